//! Stable sort of (u32 key, u32 value) pairs by the lowest bits of the keys; the length may live
//! on the GPU.
//!
//! A least-significant-digit radix sort: every pass orders the pairs by four more bits. It counts
//! digits per workgroup, scans the counts, and moves each pair to its place; no workgroup waits
//! for another.

use crate::indirect;
use crate::kernel::{Binding, Kernel, KernelSource, OFFSET_ALIGNMENT, window};
use crate::memory::{Buffer, Category, Ledger};
use crate::scan::{GROUP_MODULE, Grouping, Scan, ScanBuffers, ScanPlan, range, scratch};
use crate::wgsl::{self, Module};

const COMMON: Module = Module { name: "sort", source: include_str!("../shader/sort.wgsl") };
const ARGS: Module = Module { name: "sort_args", source: include_str!("../shader/sort_args.wgsl") };
const COUNT: Module =
    Module { name: "sort_count", source: include_str!("../shader/sort_count.wgsl") };
const SCATTER: Module =
    Module { name: "sort_scatter", source: include_str!("../shader/sort_scatter.wgsl") };

const PARAMS_BYTES: u64 = 16;

/// Arguments of the indirect dispatches, and the number of digit counts.
const ARGS_BYTES: u64 = 16;
const LENGTH_OFFSET: u64 = 12;

const DIGIT_BITS: u32 = 4;
const DIGITS: u32 = 1 << DIGIT_BITS;
const KEY_BITS: u32 = 32;

/// Stage: orders pairs by the lowest bits of their keys; equal ones keep their order.
#[derive(Debug)]
pub struct Sort {
    args: Kernel,
    count: Kernel,
    scatter: Kernel,
    scan: Scan,
}

/// What a sort of up to `max_count` pairs costs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SortPlan {
    max_count: u32,
    key_bits: u32,
    groups: u32,
    scan: ScanPlan,
}

impl SortPlan {
    fn new(grouping: Grouping, max_count: u64, key_bits: u32) -> Self {
        let max_count = u32::try_from(max_count).unwrap_or(u32::MAX);
        let groups = grouping.groups(max_count).max(1);
        // At most 2^24 groups.
        let scan = ScanPlan::new(Grouping::DEFAULT, u64::from(DIGITS * groups), 0);
        Self { max_count, key_bits: key_bits.min(KEY_BITS), groups, scan }
    }

    /// Bytes that [`SortBuffers::new`] allocates.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let other_side = 2 * self.pairs_bytes();
        other_side + self.sums_bytes() + ARGS_BYTES + self.params_bytes() + self.scan.bytes()
    }

    /// Dispatches that one recording makes.
    #[must_use]
    pub fn dispatches(&self) -> u64 {
        let per_pass = 2 + self.scan.sums_dispatches();
        1 + self.scan.args_dispatches() + u64::from(self.passes()) * per_pass
    }

    /// How often all pairs move: ceil(key bits / 4), at least once.
    #[must_use]
    pub fn passes(&self) -> u32 {
        self.key_bits.div_ceil(DIGIT_BITS).max(1)
    }

    /// Whether the sorted pairs end up in the caller's buffers: after an even number of passes.
    #[must_use]
    pub fn in_place(&self) -> bool {
        self.passes().is_multiple_of(2)
    }

    /// Bytes of all keys, or of all values.
    fn pairs_bytes(&self) -> u64 {
        4 * u64::from(self.max_count.max(1))
    }

    fn sums_bytes(&self) -> u64 {
        4 * u64::from(DIGITS * self.groups)
    }

    fn params_bytes(&self) -> u64 {
        OFFSET_ALIGNMENT * u64::from(self.passes() - 1) + PARAMS_BYTES
    }

    /// Position of a pass's digit within the keys, and its bits moved down to 0.
    fn digit(&self, pass: u32) -> [u32; 2] {
        let shift = DIGIT_BITS * pass;
        let bits = (self.key_bits - shift).min(DIGIT_BITS);
        [shift, (1 << bits) - 1]
    }
}

impl Sort {
    /// Pairs that one workgroup moves.
    pub const PAIRS_PER_GROUP: u32 = 1 << Grouping::SORT.log_group();

    /// Makes the pipelines.
    #[must_use]
    pub fn new(device: &wgpu::Device) -> Self {
        Self::with_grouping(device, Grouping::SORT)
    }

    fn with_grouping(device: &wgpu::Device, grouping: Grouping) -> Self {
        let [args, count, scatter] =
            Self::grouped_sources(grouping).map(|source| source.kernel(device));
        Self { args, count, scatter, scan: Scan::new(device) }
    }

    /// Costs of a sort of up to `max_count` pairs by the lowest `key_bits` bits of their keys.
    ///
    /// Higher bits of the keys do not matter. Above 2^32 - 1 the maximum counts as that, and above
    /// 32 the number of bits.
    #[must_use]
    pub fn plan(max_count: u64, key_bits: u32) -> SortPlan {
        SortPlan::new(Grouping::SORT, max_count, key_bits)
    }

    /// Texts and bindings of the kernels (those of [`Scan`] not included).
    #[must_use]
    pub fn sources() -> [KernelSource; 3] {
        Self::grouped_sources(Grouping::SORT)
    }

    fn grouped_sources(grouping: Grouping) -> [KernelSource; 3] {
        let library = [indirect::MODULE, GROUP_MODULE, COMMON];
        let compose = |module| wgsl::compose_fixed(module, &library, &[grouping.constant()]);
        let read = Binding::StorageRead { min_bytes: 4 };
        let write = Binding::StorageReadWrite { min_bytes: 4 };
        let params = Binding::Uniform { bytes: PARAMS_BYTES };
        [
            KernelSource {
                label: "gpu-primitives.sort.args",
                wgsl: compose(ARGS),
                entry_point: "sort_args",
                bindings: vec![params, read, write],
            },
            KernelSource {
                label: "gpu-primitives.sort.count",
                wgsl: compose(COUNT),
                entry_point: "sort_count",
                bindings: vec![params, read, read, write],
            },
            KernelSource {
                label: "gpu-primitives.sort.scatter",
                wgsl: compose(SCATTER),
                entry_point: "sort_scatter",
                bindings: vec![params, read, read, read, read, write, write],
            },
        ]
    }

    /// Records the sort in a pass of its own.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, buffers: &SortBuffers) {
        let mut pass = crate::profile::begin_pass(encoder, "gpu-primitives.sort");
        self.record_in(&mut pass, buffers);
    }

    /// Records the sort in a pass of the caller.
    pub fn record_in(&self, pass: &mut wgpu::ComputePass<'_>, buffers: &SortBuffers) {
        self.args.dispatch(pass, &buffers.args_bind, 1);
        self.scan.record_args_in(pass, &buffers.scan);
        for step in &buffers.steps {
            self.count.dispatch_indirect(pass, &step.count, &buffers.args, 0);
            self.scan.record_sums_in(pass, &buffers.scan);
            self.scatter.dispatch_indirect(pass, &step.scatter, &buffers.args, 0);
        }
    }
}

/// What one sort reads and writes.
#[derive(Debug)]
pub struct SortBuffers {
    args: Buffer,
    args_bind: wgpu::BindGroup,
    steps: Vec<Step>,
    scan: ScanBuffers,
    keys: wgpu::Buffer,
    values: wgpu::Buffer,
    _other_side: [Buffer; 2],
    _sums: Buffer,
    _params: Buffer,
}

/// One movement of all pairs.
#[derive(Debug)]
struct Step {
    count: wgpu::BindGroup,
    scatter: wgpu::BindGroup,
}

impl SortBuffers {
    /// Scratch memory, among it as much as the pairs take, and bind groups.
    ///
    /// `keys` and `values` are storage buffers of at least 4 * `max_count` bytes, and never less
    /// than 4. `count` is one u32 at a byte offset (usage `STORAGE`); above the plan's count it
    /// counts as the plan's. The three are different buffers.
    ///
    /// The pairs move back and forth between these buffers and as many scratch ones:
    /// [`SortBuffers::keys`] and [`SortBuffers::values`] are where they end up. Elements of `keys`
    /// and `values` from the count on are left as they are.
    #[must_use]
    pub fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        sort: &Sort,
        plan: &SortPlan,
        keys: &wgpu::Buffer,
        values: &wgpu::Buffer,
        count: (&wgpu::Buffer, u64),
    ) -> Self {
        let storage = wgpu::BufferUsages::STORAGE;
        let readable = storage | wgpu::BufferUsages::COPY_SRC;
        let side = |label| scratch(device, ledger, plan.pairs_bytes(), readable, label);
        let other_side = [side("gpu-primitives.sort.keys"), side("gpu-primitives.sort.values")];
        let sums = scratch(device, ledger, plan.sums_bytes(), storage, "gpu-primitives.sort.sums");
        let args_usage = storage | wgpu::BufferUsages::INDIRECT;
        let args = scratch(device, ledger, ARGS_BYTES, args_usage, "gpu-primitives.sort.args");
        let (count_range, count_word) = window(count.0, count.1, 4);
        let params = pass_params(device, ledger, plan, count_word);
        let args_bind = sort.args.bind(
            device,
            "gpu-primitives.sort.args",
            &[pass_range(&params, 0), count_range.clone(), args.as_entire_binding()],
        );

        let here: [&wgpu::Buffer; 2] = [keys, values];
        let there = [&*other_side[0], &*other_side[1]];
        let bytes = plan.pairs_bytes();
        let step = |pass: u32| {
            let (from, to) = if pass.is_multiple_of(2) { (here, there) } else { (there, here) };
            let params = pass_range(&params, pass);
            let count = sort.count.bind(
                device,
                "gpu-primitives.sort.count",
                &[
                    params.clone(),
                    count_range.clone(),
                    range(from[0], bytes),
                    sums.as_entire_binding(),
                ],
            );
            let scatter = sort.scatter.bind(
                device,
                "gpu-primitives.sort.scatter",
                &[
                    params,
                    count_range.clone(),
                    range(from[0], bytes),
                    range(from[1], bytes),
                    sums.as_entire_binding(),
                    range(to[0], bytes),
                    range(to[1], bytes),
                ],
            );
            Step { count, scatter }
        };
        let steps = (0..plan.passes()).map(step).collect();
        let scan =
            ScanBuffers::new(device, ledger, &sort.scan, &plan.scan, &sums, &args, LENGTH_OFFSET);
        let [keys, values] = if plan.in_place() { here } else { there }.map(wgpu::Buffer::clone);
        Self {
            args,
            args_bind,
            steps,
            scan,
            keys,
            values,
            _other_side: other_side,
            _sums: sums,
            _params: params,
        }
    }

    /// The sorted keys: the buffer given to [`SortBuffers::new`] where [`SortPlan::in_place`],
    /// otherwise scratch memory that lives as long as this (usages `STORAGE` and `COPY_SRC`).
    #[must_use]
    pub fn keys(&self) -> &wgpu::Buffer {
        &self.keys
    }

    /// The values in the order of their keys, on the same side as [`SortBuffers::keys`].
    #[must_use]
    pub fn values(&self) -> &wgpu::Buffer {
        &self.values
    }
}

fn pass_params(device: &wgpu::Device, ledger: &Ledger, plan: &SortPlan, count_word: u32) -> Buffer {
    let mut bytes = Vec::new();
    for pass in 0..plan.passes() {
        bytes.resize(OFFSET_ALIGNMENT as usize * pass as usize, 0);
        let [shift, mask] = plan.digit(pass);
        bytes.extend_from_slice(bytemuck::bytes_of(&[count_word, plan.max_count, shift, mask]));
    }
    let label = "gpu-primitives.sort.params";
    ledger.buffer_with(device, Category::Params, label, wgpu::BufferUsages::UNIFORM, &bytes)
}

fn pass_range(params: &wgpu::Buffer, pass: u32) -> wgpu::BindingResource<'_> {
    wgpu::BindingResource::Buffer(wgpu::BufferBinding {
        buffer: params,
        offset: OFFSET_ALIGNMENT * u64::from(pass),
        size: wgpu::BufferSize::new(PARAMS_BYTES),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use gpu_testkit::gpu;

    // 65537 groups of 256, so the dispatches fold; the counts of digits take three levels.
    #[test]
    #[ignore = "takes minutes on SwiftShader; cargo test -p gpu-primitives -- --ignored"]
    fn more_groups_than_one_dimension_takes() {
        const COUNT: u32 = 65_536 * 256 + 1;
        let (device, queue) = gpu::device();
        let keys: Vec<u32> = (0..COUNT).map(|i| i.wrapping_mul(2_654_435_761) >> 28).collect();
        let values: Vec<u32> = (0..COUNT).map(|i| i ^ 0x5555_5555).collect();
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let buffer = |words: &[u32]| gpu::buffer_with(&device, bytemuck::cast_slice(words), usage);
        let (key_buffer, value_buffer) = (buffer(&keys), buffer(&values));
        let count = buffer(&[COUNT]);

        let ledger = Ledger::new();
        let sort = Sort::with_grouping(&device, Grouping::FINEST);
        let plan = SortPlan::new(Grouping::FINEST, u64::from(COUNT), 4);
        assert_eq!((plan.passes(), plan.groups), (1, 65_537));
        let buffers = SortBuffers::new(
            &device,
            &ledger,
            &sort,
            &plan,
            &key_buffer,
            &value_buffer,
            (&count, 0),
        );
        assert_eq!(ledger.total(), plan.bytes());
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        sort.record(&mut encoder, &buffers);
        gpu::submit_and_wait(&device, &queue, encoder);

        let (expected_keys, expected_values) = crate::cpu::sort::sort(&keys, &values, 4);
        for (found, expected) in
            [(buffers.keys(), expected_keys), (buffers.values(), expected_values)]
        {
            let found = gpu::read_u32s(&device, &queue, found);
            let differing = found.iter().zip(&expected).position(|(a, b)| a != b);
            assert_eq!(differing, None, "first differing element");
            assert_eq!(found.len(), expected.len());
        }
    }

    #[test]
    fn digits_cover_the_key_bits() {
        let digits = |bits| {
            let plan = SortPlan::new(Grouping::SORT, 1, bits);
            (0..plan.passes()).map(|pass| plan.digit(pass)).collect::<Vec<_>>()
        };
        assert_eq!(digits(0), [[0, 0]]);
        assert_eq!(digits(1), [[0, 1]]);
        assert_eq!(digits(4), [[0, 15]]);
        assert_eq!(digits(6), [[0, 15], [4, 3]]);
        assert_eq!(digits(32), [0, 4, 8, 12, 16, 20, 24, 28].map(|shift| [shift, 15]));
        assert_eq!(digits(33), digits(32));
    }
}
