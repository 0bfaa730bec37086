//! Order-preserving stream compaction: `out = [values[i] | flags[i] != 0]`, with the counts in and
//! out on the GPU.

use crate::indirect::{self, ARGS_BYTES, IndirectArgs, IndirectArgsBuffers};
use crate::kernel::{Binding, Kernel, KernelSource, window};
use crate::memory::{Buffer, Category, Ledger};
use crate::scan::{GROUP_MODULE, Grouping, Scan, ScanBuffers, ScanPlan, range, scratch};
use crate::wgsl::{self, Constant, Module};

const COMPACT: Module = Module { name: "compact", source: include_str!("../shader/compact.wgsl") };

const PARAMS_BYTES: u64 = 8;

/// Stage: keeps the values whose flag is not 0, in order.
#[derive(Debug)]
pub struct Compact {
    count: Kernel,
    scatter: Kernel,
    args: IndirectArgs,
    scan: Scan,
}

/// What a compaction of up to `max_count` elements costs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CompactPlan {
    max_count: u32,
    groups: u32,
    scan: ScanPlan,
}

impl CompactPlan {
    fn new(grouping: Grouping, max_count: u64) -> Self {
        let max_count = u32::try_from(max_count).unwrap_or(u32::MAX);
        let scan = ScanPlan::new(grouping, u64::from(max_count), grouping.log_group());
        Self { max_count, groups: grouping.groups(max_count).max(1), scan }
    }

    /// Bytes that [`CompactBuffers::new`] allocates.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let own = 4 * u64::from(self.groups) + PARAMS_BYTES + ARGS_BYTES + IndirectArgs::BIND_BYTES;
        own + self.scan.bytes()
    }

    /// Dispatches that one recording makes, besides a copy of 4 bytes.
    #[must_use]
    pub fn dispatches(&self) -> u64 {
        3 + self.scan.dispatches()
    }
}

impl Compact {
    /// Makes the pipelines.
    #[must_use]
    pub fn new(device: &wgpu::Device) -> Self {
        Self::with_grouping(device, Grouping::DEFAULT)
    }

    fn with_grouping(device: &wgpu::Device, grouping: Grouping) -> Self {
        let [count, scatter] = Self::grouped_sources(grouping).map(|source| source.kernel(device));
        let scan = Scan::with_grouping(device, grouping);
        Self { count, scatter, args: IndirectArgs::new(device), scan }
    }

    /// Costs of a compaction of up to `max_count` elements; above 2^32 - 1 it counts as that.
    #[must_use]
    pub fn plan(max_count: u64) -> CompactPlan {
        CompactPlan::new(Grouping::DEFAULT, max_count)
    }

    /// Texts and bindings of the kernels (those of [`Scan`] not included).
    #[must_use]
    pub fn sources() -> [KernelSource; 2] {
        Self::grouped_sources(Grouping::DEFAULT)
    }

    fn grouped_sources(grouping: Grouping) -> [KernelSource; 2] {
        let library = [indirect::MODULE, GROUP_MODULE];
        let items = grouping.constant();
        let scatter = ("COMPACT_SCATTER", Constant::Bool(true));
        let read = Binding::StorageRead { min_bytes: 4 };
        let write = Binding::StorageReadWrite { min_bytes: 4 };
        let params = Binding::Uniform { bytes: PARAMS_BYTES };
        [
            KernelSource {
                label: "gpu-primitives.compact.count",
                wgsl: wgsl::compose_fixed(COMPACT, &library, &[items]),
                entry_point: "compact_count",
                bindings: vec![params, read, read, write],
            },
            KernelSource {
                label: "gpu-primitives.compact.scatter",
                wgsl: wgsl::compose_fixed(COMPACT, &library, &[items, scatter]),
                entry_point: "compact_scatter",
                bindings: vec![params, read, read, read, read, write],
            },
        ]
    }

    /// Records the compaction: one compute pass and one copy.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, buffers: &CompactBuffers) {
        let mut pass = crate::profile::begin_pass(encoder, "gpu-primitives.compact");
        self.args.record_in(&mut pass, &buffers.args_bind);
        self.count.dispatch_indirect(&mut pass, &buffers.count, &buffers.args, 0);
        self.scan.record_in(&mut pass, &buffers.scan);
        self.scatter.dispatch_indirect(&mut pass, &buffers.scatter, &buffers.args, 0);
        drop(pass);
        // A copy, so that the count in and the count out may lie in the same buffer.
        let (target, offset) = &buffers.count_out;
        encoder.copy_buffer_to_buffer(buffers.scan.total(), 0, target, *offset, 4);
    }
}

/// What one compaction reads and writes.
#[derive(Debug)]
pub struct CompactBuffers {
    args: Buffer,
    args_bind: IndirectArgsBuffers,
    count: wgpu::BindGroup,
    scan: ScanBuffers,
    scatter: wgpu::BindGroup,
    count_out: (wgpu::Buffer, u64),
    _sums: Buffer,
    _params: Buffer,
}

impl CompactBuffers {
    /// Scratch memory and bind groups.
    ///
    /// `flags`, `values` and `out` are storage buffers of at least 4 * `max_count` bytes, and never
    /// less than 4; elements of `out` from the count on are left as they are. `count_in` is one u32
    /// at a byte offset (usage `STORAGE`); above the plan's count it counts as the plan's.
    /// `count_out` is one u32 at a byte offset (usage `COPY_DST`) and may be the same place.
    /// `out` differs from all buffers that are read.
    #[must_use]
    pub fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        compact: &Compact,
        plan: &CompactPlan,
        flags: &wgpu::Buffer,
        values: &wgpu::Buffer,
        count_in: (&wgpu::Buffer, u64),
        out: &wgpu::Buffer,
        count_out: (&wgpu::Buffer, u64),
    ) -> Self {
        let (count_range, count_word) = window(count_in.0, count_in.1, 4);
        let params = ledger.buffer_with(
            device,
            Category::Params,
            "gpu-primitives.compact.params",
            wgpu::BufferUsages::UNIFORM,
            bytemuck::bytes_of(&[count_word, plan.max_count]),
        );
        let storage = wgpu::BufferUsages::STORAGE;
        let sums_bytes = 4 * u64::from(plan.groups);
        let sums = scratch(device, ledger, sums_bytes, storage, "gpu-primitives.compact.sums");
        let args_usage = storage | wgpu::BufferUsages::INDIRECT;
        let args = scratch(device, ledger, ARGS_BYTES, args_usage, "gpu-primitives.compact.args");
        let args_bind = compact.args.bind_sets(
            device,
            ledger,
            count_in,
            plan.max_count,
            &[1 << plan.scan.grouping.log_group()],
            (&args, 0),
        );
        let bytes = 4 * u64::from(plan.max_count.max(1));
        let count = compact.count.bind(
            device,
            "gpu-primitives.compact.count",
            &[
                params.as_entire_binding(),
                count_range.clone(),
                range(flags, bytes),
                sums.as_entire_binding(),
            ],
        );
        let scatter = compact.scatter.bind(
            device,
            "gpu-primitives.compact.scatter",
            &[
                params.as_entire_binding(),
                count_range,
                range(flags, bytes),
                sums.as_entire_binding(),
                range(values, bytes),
                range(out, bytes),
            ],
        );
        let scan = ScanBuffers::new(
            device,
            ledger,
            &compact.scan,
            &plan.scan,
            &sums,
            count_in.0,
            count_in.1,
        );
        Self {
            args,
            args_bind,
            count,
            scan,
            scatter,
            count_out: (count_out.0.clone(), count_out.1),
            _sums: sums,
            _params: params,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gpu_testkit::gpu;

    // 65537 groups of 256, so the dispatches fold; every value out of place would show.
    #[test]
    fn more_groups_than_one_dimension_takes() {
        const COUNT: u32 = 65_536 * 256 + 1;
        const SENTINEL: u32 = 0xDEAD_BEEF;
        let (device, queue) = gpu::device();
        let values: Vec<u32> = (0..COUNT).map(|i| i ^ 0x5555_5555).collect();
        let flags: Vec<u32> = (0..COUNT).map(|i| i.wrapping_mul(2_654_435_761) >> 31).collect();
        let expected = crate::cpu::compact::compact(&flags, &values);
        let storage = wgpu::BufferUsages::STORAGE;
        let flags = gpu::buffer_with(&device, bytemuck::cast_slice(&flags), storage);
        let values = gpu::buffer_with(&device, bytemuck::cast_slice(&values), storage);
        let out = gpu::sentinel_buffer(&device, 4 * u64::from(COUNT), SENTINEL);
        let usage = storage | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        let count = gpu::buffer_with(&device, bytemuck::bytes_of(&COUNT), usage);

        let ledger = Ledger::new();
        let compact = Compact::with_grouping(&device, Grouping::FINEST);
        let plan = CompactPlan::new(Grouping::FINEST, u64::from(COUNT));
        let (place, out_place) = ((&count, 0), &out);
        let buffers = CompactBuffers::new(
            &device, &ledger, &compact, &plan, &flags, &values, place, out_place, place,
        );
        assert_eq!(ledger.total(), plan.bytes());
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        compact.record(&mut encoder, &buffers);
        gpu::submit_and_wait(&device, &queue, encoder);

        let kept = expected.len();
        assert_eq!(gpu::read_u32s(&device, &queue, &count), [kept as u32]);
        let found = gpu::read_u32s(&device, &queue, &out);
        let differing = found.iter().zip(&expected).position(|(found, expected)| found != expected);
        assert_eq!(differing, None, "first differing element");
        assert!(found[kept..].iter().all(|&word| word == SENTINEL));
    }
}
