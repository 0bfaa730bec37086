//! Exclusive prefix sum of u32, any length, several levels, in place; the length may live on the
//! GPU.

use crate::indirect::{self, ARGS_BYTES, IndirectArgs, IndirectArgsBuffers};
use crate::kernel::{Binding, Kernel, KernelSource, OFFSET_ALIGNMENT, window};
use crate::memory::{Buffer, Category, Ledger};
use crate::wgsl::{self, Constant, Module};

/// WGSL: `fn scan_group(lane: u32, value: u32) -> ScanGroup` sums over the 256 invocations of a
/// workgroup (`before`: of the lanes before, `total`: of all). Takes 1 KiB of workgroup memory.
pub const GROUP_MODULE: Module =
    Module { name: "scan_group", source: include_str!("../shader/scan_group.wgsl") };

const SCAN: Module = Module { name: "scan", source: include_str!("../shader/scan.wgsl") };

const PARAMS_BYTES: u64 = 12;

/// How elements are shared out to workgroups.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Grouping {
    log_items: u32,
}

impl Grouping {
    pub(crate) const DEFAULT: Grouping = Grouping { log_items: 2 };
    /// For the sort, where a group's work on its digits costs as much as that of many pairs.
    pub(crate) const SORT: Grouping = Grouping { log_items: 3 };
    /// The smallest groups: most levels and workgroups for a given number of elements.
    #[cfg(test)]
    pub(crate) const FINEST: Grouping = Grouping { log_items: 0 };
    const LOG_LANES: u32 = 8;

    pub(crate) const fn log_group(self) -> u32 {
        Self::LOG_LANES + self.log_items
    }

    pub(crate) fn constant(self) -> (&'static str, Constant) {
        ("SCAN_ITEMS", Constant::U32(1 << self.log_items))
    }

    /// ceil(count / elements of a group).
    pub(crate) fn groups(self, count: u32) -> u32 {
        count.div_ceil(1 << self.log_group())
    }
}

/// Stage: `data[0..count]` becomes its exclusive prefix sums, modulo 2^32.
#[derive(Debug)]
pub struct Scan {
    local: Kernel,
    add: Kernel,
    args: IndirectArgs,
}

/// What a scan of up to `max_count` elements costs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScanPlan {
    pub(crate) grouping: Grouping,
    max_count: u32,
    /// The first level has ceil(count / 2^shift) elements.
    shift: u32,
    /// Most elements of each level; the last one fits a workgroup.
    levels: Vec<u32>,
}

impl ScanPlan {
    pub(crate) fn new(grouping: Grouping, max_count: u64, shift: u32) -> Self {
        let max_count = u32::try_from(max_count).unwrap_or(u32::MAX);
        let mut levels = vec![max_count.div_ceil(1 << shift)];
        let mut groups = grouping.groups(max_count.div_ceil(1 << shift));
        while groups > 1 {
            levels.push(groups);
            groups = grouping.groups(groups);
        }
        Self { grouping, max_count, shift, levels }
    }

    /// Bytes that [`ScanBuffers::new`] allocates.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let scratch: u64 = self.levels.iter().skip(1).map(|&count| 4 * u64::from(count)).sum();
        let args = match self.upper_levels() {
            0 => 0,
            sets => ARGS_BYTES * sets + IndirectArgs::BIND_BYTES,
        };
        scratch + TOTAL_BYTES + self.params_bytes() + args
    }

    /// Dispatches that one recording makes.
    #[must_use]
    pub fn dispatches(&self) -> u64 {
        self.args_dispatches() + self.sums_dispatches()
    }

    pub(crate) fn args_dispatches(&self) -> u64 {
        u64::from(self.upper_levels() > 0)
    }

    pub(crate) fn sums_dispatches(&self) -> u64 {
        1 + 2 * self.upper_levels()
    }

    /// Levels above the first, each of which costs an addition.
    fn upper_levels(&self) -> u64 {
        self.levels.len() as u64 - 1
    }

    fn params_bytes(&self) -> u64 {
        OFFSET_ALIGNMENT * self.upper_levels() + PARAMS_BYTES
    }

    /// log2 of how many elements of the input one element of this level stands for.
    fn level_shift(&self, level: usize) -> u32 {
        self.shift + self.grouping.log_group() * level as u32
    }
}

const TOTAL_BYTES: u64 = 4;

impl Scan {
    /// Elements that one workgroup scans.
    pub const ITEMS_PER_GROUP: u32 = 1 << Grouping::DEFAULT.log_group();

    /// Makes the pipelines.
    #[must_use]
    pub fn new(device: &wgpu::Device) -> Self {
        Self::with_grouping(device, Grouping::DEFAULT)
    }

    pub(crate) fn with_grouping(device: &wgpu::Device, grouping: Grouping) -> Self {
        let [local, add] = Self::grouped_sources(grouping).map(|source| source.kernel(device));
        Self { local, add, args: IndirectArgs::new(device) }
    }

    /// Costs of a scan of up to `max_count` elements; above 2^32 - 1 it counts as that.
    #[must_use]
    pub fn plan(max_count: u64) -> ScanPlan {
        ScanPlan::new(Grouping::DEFAULT, max_count, 0)
    }

    /// Texts and bindings of the kernels.
    #[must_use]
    pub fn sources() -> [KernelSource; 2] {
        Self::grouped_sources(Grouping::DEFAULT)
    }

    fn grouped_sources(grouping: Grouping) -> [KernelSource; 2] {
        let library = [indirect::MODULE, GROUP_MODULE];
        let add = ("SCAN_ADD", Constant::Bool(true));
        let bindings = |sums| {
            vec![
                Binding::Uniform { bytes: PARAMS_BYTES },
                Binding::StorageRead { min_bytes: 4 },
                Binding::StorageReadWrite { min_bytes: 4 },
                sums,
            ]
        };
        [
            KernelSource {
                label: "gpu-primitives.scan.local",
                wgsl: wgsl::compose_fixed(SCAN, &library, &[grouping.constant()]),
                entry_point: "scan_local",
                bindings: bindings(Binding::StorageReadWrite { min_bytes: 4 }),
            },
            KernelSource {
                label: "gpu-primitives.scan.add",
                wgsl: wgsl::compose_fixed(SCAN, &library, &[grouping.constant(), add]),
                entry_point: "scan_add",
                bindings: bindings(Binding::StorageRead { min_bytes: 4 }),
            },
        ]
    }

    /// Records the scan in a pass of its own.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, buffers: &ScanBuffers) {
        let mut pass = crate::profile::begin_pass(encoder, "gpu-primitives.scan");
        self.record_in(&mut pass, buffers);
    }

    /// Records the scan in a pass of the caller.
    pub fn record_in(&self, pass: &mut wgpu::ComputePass<'_>, buffers: &ScanBuffers) {
        self.record_args_in(pass, buffers);
        self.record_sums_in(pass, buffers);
    }

    /// The part of [`Scan::record_in`] that depends on the count alone.
    pub(crate) fn record_args_in(&self, pass: &mut wgpu::ComputePass<'_>, buffers: &ScanBuffers) {
        if let Some(args) = &buffers.args {
            self.args.record_in(pass, &args.bind);
        }
    }

    /// The rest of [`Scan::record_in`], for as many times as the count stays the same.
    pub(crate) fn record_sums_in(&self, pass: &mut wgpu::ComputePass<'_>, buffers: &ScanBuffers) {
        for (level, bind) in (0u64..).zip(&buffers.local) {
            match &buffers.args {
                Some(args) if level < buffers.add.len() as u64 => {
                    self.local.dispatch_indirect(pass, bind, &args.buffer, ARGS_BYTES * level);
                }
                _ => self.local.dispatch(pass, bind, 1),
            }
        }
        if let Some(args) = &buffers.args {
            for (level, bind) in buffers.add.iter().enumerate().rev() {
                let level = level as u64;
                self.add.dispatch_indirect(pass, bind, &args.buffer, ARGS_BYTES * level);
            }
        }
    }
}

/// What one scan reads and writes.
#[derive(Debug)]
pub struct ScanBuffers {
    /// One per level, the data first.
    local: Vec<wgpu::BindGroup>,
    /// One per level but the last.
    add: Vec<wgpu::BindGroup>,
    args: Option<Args>,
    total: Buffer,
    _scratch: Vec<Buffer>,
    _params: Buffer,
}

#[derive(Debug)]
struct Args {
    buffer: Buffer,
    bind: IndirectArgsBuffers,
}

impl ScanBuffers {
    /// Scratch memory and bind groups for `data` (storage; at least 4 * `max_count` bytes, and
    /// never less than 4) and its length, one u32 at byte `count_offset` of `count` (storage).
    ///
    /// A length above the plan's counts as the plan's. `count` and `data` are different buffers,
    /// since the same dispatch reads one and writes the other.
    #[must_use]
    pub fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        scan: &Scan,
        plan: &ScanPlan,
        data: &wgpu::Buffer,
        count: &wgpu::Buffer,
        count_offset: u64,
    ) -> Self {
        let storage = |bytes, label| {
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
            scratch(device, ledger, bytes, usage, label)
        };
        let total = storage(TOTAL_BYTES, "gpu-primitives.scan.total");
        let upper: Vec<Buffer> = plan.levels[1..]
            .iter()
            .map(|&count| storage(4 * u64::from(count), "gpu-primitives.scan.level"))
            .collect();
        let (count_range, count_word) = window(count, count_offset, 4);
        let params = level_params(device, ledger, plan, count_word);

        // Level by level: its data, and the sums of its groups, which are the next level's data.
        let level_data = |level: usize| match level.checked_sub(1) {
            None => range(data, 4 * u64::from(plan.levels[0].max(1))),
            Some(upper_level) => upper.get(upper_level).unwrap_or(&total).as_entire_binding(),
        };
        let bind = |kernel: &Kernel, label: &str, level: usize| {
            let params = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: &params,
                offset: OFFSET_ALIGNMENT * level as u64,
                size: wgpu::BufferSize::new(PARAMS_BYTES),
            });
            let resources = [params, count_range.clone(), level_data(level), level_data(level + 1)];
            kernel.bind(device, label, &resources)
        };
        let local = (0..=upper.len())
            .map(|level| bind(&scan.local, "gpu-primitives.scan.local", level))
            .collect();
        let add = (0..upper.len())
            .map(|level| bind(&scan.add, "gpu-primitives.scan.add", level))
            .collect();
        let args = (!upper.is_empty())
            .then(|| Args::new(device, ledger, &scan.args, plan, (count, count_offset)));
        Self { local, add, args, total, _scratch: upper, _params: params }
    }

    /// Sum of all elements, modulo 2^32: one u32 (usages `STORAGE` and `COPY_SRC`).
    #[must_use]
    pub fn total(&self) -> &wgpu::Buffer {
        &self.total
    }
}

impl Args {
    fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        stage: &IndirectArgs,
        plan: &ScanPlan,
        count: (&wgpu::Buffer, u64),
    ) -> Self {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDIRECT;
        let bytes = ARGS_BYTES * plan.upper_levels();
        let buffer = scratch(device, ledger, bytes, usage, "gpu-primitives.scan.args");
        // A group of a level below the last stands for fewer elements than there are.
        let per_group: Vec<u32> =
            (1..plan.levels.len()).map(|level| 1 << plan.level_shift(level)).collect();
        let bind = stage.bind_sets(device, ledger, count, plan.max_count, &per_group, (&buffer, 0));
        Self { buffer, bind }
    }
}

fn level_params(
    device: &wgpu::Device,
    ledger: &Ledger,
    plan: &ScanPlan,
    count_word: u32,
) -> Buffer {
    let mut bytes = Vec::new();
    for level in 0..plan.levels.len() {
        bytes.resize(OFFSET_ALIGNMENT as usize * level, 0);
        let params = [count_word, plan.max_count, plan.level_shift(level)];
        bytes.extend_from_slice(bytemuck::bytes_of(&params));
    }
    let label = "gpu-primitives.scan.params";
    ledger.buffer_with(device, Category::Params, label, wgpu::BufferUsages::UNIFORM, &bytes)
}

pub(crate) fn scratch(
    device: &wgpu::Device,
    ledger: &Ledger,
    size: u64,
    usage: wgpu::BufferUsages,
    label: &str,
) -> Buffer {
    let desc =
        wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
    ledger.buffer(device, Category::Scratch, &desc)
}

/// The first `bytes` bytes of a buffer.
pub(crate) fn range(buffer: &wgpu::Buffer, bytes: u64) -> wgpu::BindingResource<'_> {
    wgpu::BindingResource::Buffer(wgpu::BufferBinding {
        buffer,
        offset: 0,
        size: wgpu::BufferSize::new(bytes),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use gpu_testkit::gpu;

    // 65537 groups of 256: the dispatch folds, and there are four levels.
    #[test]
    fn more_groups_than_one_dimension_takes() {
        const COUNT: u32 = 65_536 * 256 + 1;
        let (device, queue) = gpu::device();
        let mut expected: Vec<u32> = (0..COUNT).map(|i| i.wrapping_mul(2_654_435_761)).collect();
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let data = gpu::buffer_with(&device, bytemuck::cast_slice(&expected), usage);
        let count = gpu::buffer_with(&device, bytemuck::bytes_of(&COUNT), usage);

        let ledger = Ledger::new();
        let scan = Scan::with_grouping(&device, Grouping::FINEST);
        let plan = ScanPlan::new(Grouping::FINEST, u64::from(COUNT), 0);
        assert_eq!(plan.levels, [COUNT, 65_537, 257, 2]);
        let buffers = ScanBuffers::new(&device, &ledger, &scan, &plan, &data, &count, 0);
        assert_eq!(ledger.total(), plan.bytes());
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        scan.record(&mut encoder, &buffers);
        gpu::submit_and_wait(&device, &queue, encoder);

        let total = crate::cpu::scan::exclusive_scan(&mut expected);
        assert_eq!(gpu::read_u32s(&device, &queue, buffers.total()), [total]);
        let found = gpu::read_u32s(&device, &queue, &data);
        let differing = found.iter().zip(&expected).position(|(found, expected)| found != expected);
        assert_eq!(differing, None, "first differing element");
    }

    #[test]
    fn levels_end_with_one_group() {
        let levels = |count| ScanPlan::new(Grouping::DEFAULT, count, 0).levels;
        assert_eq!(levels(0), [0]);
        assert_eq!(levels(1024), [1024]);
        assert_eq!(levels(1025), [1025, 2]);
        assert_eq!(levels(1 << 20), [1 << 20, 1024]);
        assert_eq!(levels((1 << 20) + 1), [(1 << 20) + 1, 1025, 2]);
        assert_eq!(levels(u64::MAX), [u32::MAX, 1 << 22, 1 << 12, 4]);
        assert_eq!(ScanPlan::new(Grouping::DEFAULT, 1025, 10).levels, [2]);
    }
}
