//! Arguments of indirect dispatches from counts that live on the GPU.

use crate::kernel::{Binding, Kernel, KernelSource, window};
use crate::memory::{Buffer, Category, Ledger};
use crate::wgsl::{self, Module};

/// WGSL: `fn indirect_linear_group(group: vec3<u32>, groups: vec3<u32>) -> u32` numbers the
/// workgroups of a folded dispatch, `fn indirect_fold(groups: u32) -> vec3<u32>` folds.
pub const MODULE: Module =
    Module { name: "indirect", source: include_str!("../shader/indirect.wgsl") };

const ARGS: Module =
    Module { name: "indirect_args", source: include_str!("../shader/indirect_args.wgsl") };

/// Bytes of one set of arguments: three u32.
pub const ARGS_BYTES: u64 = 12;

/// Most workgroups per dimension under WebGPU's default limits.
const MAX_GROUPS: u64 = 65_535;

/// Workgroups per dimension for `groups` workgroups: (0, 1, 1) for none, otherwise the fewest rows
/// y of equal length x <= 65535, z = 1. x * y exceeds `groups` by less than y, so kernels compare
/// their linear number with the count.
///
/// Above 65535 * 65535 groups, which 32-bit indices cannot use, the result stays at that size.
#[must_use]
pub fn fold(groups: u64) -> [u32; 3] {
    crate::cpu::indirect::fold(groups)
}

pub(crate) fn fold_rows(groups: u64) -> [u32; 3] {
    let y = groups.div_ceil(MAX_GROUPS).clamp(1, MAX_GROUPS);
    let x = groups.div_ceil(y).min(MAX_GROUPS);
    [x as u32, y as u32, 1]
}

/// Stage: `args = fold(ceil(count / per_group))` from a count on the GPU.
#[derive(Debug)]
pub struct IndirectArgs {
    kernel: Kernel,
}

/// What one recording of [`IndirectArgs`] reads and writes.
#[derive(Debug)]
pub struct IndirectArgsBuffers {
    bind: wgpu::BindGroup,
    _params: Buffer,
}

impl IndirectArgs {
    /// Most sets of arguments that one recording writes.
    pub const MAX_SETS: usize = 4;

    /// Bytes that [`IndirectArgs::bind`] allocates.
    pub const BIND_BYTES: u64 = 32;

    /// Makes the pipeline.
    #[must_use]
    pub fn new(device: &wgpu::Device) -> Self {
        Self { kernel: Self::source().kernel(device) }
    }

    /// Text and bindings of the kernel.
    #[must_use]
    pub fn source() -> KernelSource {
        KernelSource {
            label: "gpu-primitives.indirect.args",
            wgsl: wgsl::compose_fixed(ARGS, &[MODULE], &[]),
            entry_point: "indirect_args",
            bindings: vec![
                Binding::Uniform { bytes: Self::BIND_BYTES },
                Binding::StorageRead { min_bytes: 4 },
                Binding::StorageReadWrite { min_bytes: 4 },
            ],
        }
    }

    /// Binds a count (one u32 at a byte offset) and the arguments (three u32 at a byte offset).
    ///
    /// The two buffers must differ: one is read and the other written by the same dispatch.
    /// `per_group` of 0 counts as 1.
    #[must_use]
    pub fn bind(
        &self,
        device: &wgpu::Device,
        ledger: &Ledger,
        count: (&wgpu::Buffer, u64),
        per_group: u32,
        args: (&wgpu::Buffer, u64),
    ) -> IndirectArgsBuffers {
        self.bind_sets(device, ledger, count, u32::MAX, &[per_group], args)
    }

    /// Like [`IndirectArgs::bind`] for several group sizes of the same count, whose arguments
    /// follow each other; sizes beyond [`IndirectArgs::MAX_SETS`] are left out. A count above
    /// `max_count` counts as `max_count`.
    #[must_use]
    pub fn bind_sets(
        &self,
        device: &wgpu::Device,
        ledger: &Ledger,
        count: (&wgpu::Buffer, u64),
        max_count: u32,
        per_group: &[u32],
        args: (&wgpu::Buffer, u64),
    ) -> IndirectArgsBuffers {
        let sets = per_group.len().min(Self::MAX_SETS);
        let (count, count_word) = window(count.0, count.1, 4);
        let (args, args_word) = window(args.0, args.1, ARGS_BYTES * sets as u64);
        let mut params = [0u32; 8];
        params[..4].copy_from_slice(&[count_word, args_word, sets as u32, max_count]);
        for (param, &size) in params[4..].iter_mut().zip(per_group) {
            *param = size.max(1);
        }
        let params = ledger.buffer_with(
            device,
            Category::Params,
            "gpu-primitives.indirect.params",
            wgpu::BufferUsages::UNIFORM,
            bytemuck::bytes_of(&params),
        );
        let bind = self.kernel.bind(
            device,
            "gpu-primitives.indirect.args",
            &[params.as_entire_binding(), count, args],
        );
        IndirectArgsBuffers { bind, _params: params }
    }

    /// Records one dispatch in a pass of its own.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, buffers: &IndirectArgsBuffers) {
        let mut pass = crate::profile::begin_pass(encoder, "gpu-primitives.indirect.args");
        self.record_in(&mut pass, buffers);
    }

    /// Records one dispatch in a pass of the caller.
    pub fn record_in(&self, pass: &mut wgpu::ComputePass<'_>, buffers: &IndirectArgsBuffers) {
        self.kernel.dispatch(pass, &buffers.bind, 1);
    }
}
