//! Active masks for the current isovalue.

use bytemuck::{Pod, Zeroable};
use gpu_primitives::kernel::{Binding, Kernel, KernelSource};
use gpu_primitives::memory::{Buffer, Category, Ledger};
use gpu_primitives::wgsl::{Module, compose_fixed};
use gpu_primitives::{indirect, upload::UploadRing, wgpu};

use crate::Grid;
use crate::plan::CODE_BYTES;
use crate::ranges::RangeBuffers;
use crate::wgsl::QUANTISE;

const ACTIVATE: Module =
    Module { name: "activate", source: include_str!("../shader/activate.wgsl") };
const THIRD_LEVEL: Module =
    Module { name: "third_level", source: include_str!("../shader/third_level.wgsl") };

const ACTIVE_BOX: Module =
    Module { name: "active_box", source: include_str!("../shader/active_box.wgsl") };

/// Uniform of `shader/activate.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct ActivateParams {
    page_first: u32,
    page_count: u32,
    isovalue: f32,
    pad0: u32,
}

/// Uniform of `shader/third_level.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct ThirdLevelParams {
    coarse: [u32; 3],
    coarse_count: u32,
    third: [u32; 3],
    third_count: u32,
}

/// Uniform of `shader/active_box.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct ActiveBoxParams {
    cells: [u32; 3],
    first: u32,
    last_cell: [i32; 3],
    child_shift: u32,
    active_box: u32,
    has_third_level: u32,
    pad0: u32,
    pad1: u32,
}

impl ActiveBoxParams {
    fn new(grid: Grid) -> Self {
        let third = grid.has_third_level();
        Self {
            cells: if third { grid.third() } else { grid.coarse() },
            first: if third { grid.coarse_count() as u32 } else { 0 },
            last_cell: grid.last_cell(),
            child_shift: if third { 2 } else { 0 },
            active_box: grid.mask_count() as u32,
            has_third_level: third.into(),
            pad0: 0,
            pad1: 0,
        }
    }
}

/// The stage that turns value ranges into active masks.
#[derive(Debug)]
pub struct Activate {
    activate: Kernel,
    third_level: Option<Kernel>,
    active_box: Kernel,
}

/// Active masks of one volume.
#[derive(Debug)]
pub struct Masks {
    masks: Buffer,
    pages: Vec<(Buffer, wgpu::BindGroup)>,
    third_level: Option<(Buffer, wgpu::BindGroup)>,
    active_box: (Buffer, wgpu::BindGroup),
}

impl Masks {
    /// Allocates the masks; `ranges` are what they are computed from.
    pub fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        stage: &Activate,
        ranges: &RangeBuffers,
    ) -> Self {
        let plan = ranges.plan();
        let masks = ledger.buffer(
            device,
            Category::Masks,
            &wgpu::BufferDescriptor {
                label: Some("macrocell.masks"),
                size: plan.mask_bytes(),
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            },
        );
        let params = |bytes: &[u8]| {
            let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
            ledger.buffer_with(device, Category::Params, "macrocell.activate.params", usage, bytes)
        };
        let pages = ranges
            .code_pages()
            .iter()
            .map(|page| {
                let params = params(&[0; size_of::<ActivateParams>()]);
                let resources = [
                    params.as_entire_binding(),
                    ranges.coarse_ranges().as_entire_binding(),
                    page.as_entire_binding(),
                    masks.as_entire_binding(),
                ];
                let bind = stage.activate.bind(device, "macrocell.activate", &resources);
                (params, bind)
            })
            .collect();
        let grid = plan.grid();
        if grid.has_third_level() && stage.third_level.is_none() {
            tracing::error!(dims = ?grid.dims(), "the stage was made without a third level");
        }
        let kernel = stage.third_level.as_ref().filter(|_| grid.has_third_level());
        let third_level = kernel.map(|kernel| {
            let params = params(bytemuck::bytes_of(&ThirdLevelParams {
                coarse: grid.coarse(),
                coarse_count: grid.coarse_count() as u32,
                third: grid.third(),
                third_count: grid.third_count() as u32,
            }));
            let resources = [params.as_entire_binding(), masks.as_entire_binding()];
            let bind = kernel.bind(device, "macrocell.third_level", &resources);
            (params, bind)
        });
        let params = params(bytemuck::bytes_of(&ActiveBoxParams::new(grid)));
        let resources = [params.as_entire_binding(), masks.as_entire_binding()];
        let bind = stage.active_box.bind(device, "macrocell.active_box", &resources);
        Self { masks, pages, third_level, active_box: (params, bind) }
    }

    /// The masks: two u32 per coarse cell, then two per third-level cell where there are any, then eight of
    /// the box of all active blocks: its first block, whether there is a third level, its last dual cell, 0.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.masks
    }

    /// Bytes of uniforms beside [`crate::MacrocellPlan::mask_bytes`].
    pub fn params_bytes(plan: &crate::MacrocellPlan) -> u64 {
        let third = if plan.grid().has_third_level() { size_of::<ThirdLevelParams>() } else { 0 };
        let others = third + size_of::<ActiveBoxParams>();
        plan.pages().count() as u64 * size_of::<ActivateParams>() as u64 + others as u64
    }
}

impl Activate {
    /// Makes the pipelines; the third level's only when one of the volumes has one
    /// ([`crate::Grid::has_third_level`]): without it such a volume would look empty.
    pub fn new(device: &wgpu::Device, third_level: bool) -> Self {
        Self {
            activate: Self::source().kernel(device),
            third_level: third_level.then(|| Self::third_level_source().kernel(device)),
            active_box: Self::active_box_source().kernel(device),
        }
    }

    /// Text and bindings of the coarse level's kernel.
    pub fn source() -> KernelSource {
        KernelSource {
            label: "macrocell.activate",
            wgsl: compose_fixed(ACTIVATE, &[QUANTISE, indirect::MODULE], &[]),
            entry_point: "main",
            bindings: vec![
                Binding::Uniform { bytes: size_of::<ActivateParams>() as u64 },
                Binding::StorageRead { min_bytes: 8 },
                Binding::StorageRead { min_bytes: CODE_BYTES },
                Binding::StorageReadWrite { min_bytes: 8 },
            ],
        }
    }

    /// Text and bindings of the third level's kernel.
    pub fn third_level_source() -> KernelSource {
        KernelSource {
            label: "macrocell.third_level",
            wgsl: compose_fixed(THIRD_LEVEL, &[indirect::MODULE], &[]),
            entry_point: "main",
            bindings: vec![
                Binding::Uniform { bytes: size_of::<ThirdLevelParams>() as u64 },
                Binding::StorageReadWrite { min_bytes: 8 },
            ],
        }
    }

    /// Text and bindings of the kernel that finds the box of all active blocks.
    pub fn active_box_source() -> KernelSource {
        KernelSource {
            label: "macrocell.active_box",
            wgsl: compose_fixed(ACTIVE_BOX, &[], &[]),
            entry_point: "main",
            bindings: vec![
                Binding::Uniform { bytes: size_of::<ActiveBoxParams>() as u64 },
                Binding::StorageReadWrite { min_bytes: 8 },
            ],
        }
    }

    /// Records computing the masks for `isovalue` (finite).
    pub fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        upload: &mut UploadRing,
        ranges: &RangeBuffers,
        masks: &Masks,
        isovalue: f32,
    ) {
        let plan = ranges.plan();
        for ((params, _), (page_first, page_count)) in masks.pages.iter().zip(plan.pages()) {
            let (page_first, page_count) = (page_first as u32, page_count as u32);
            let value = ActivateParams { page_first, page_count, isovalue, pad0: 0 };
            upload.write(device, encoder, params, 0, bytemuck::bytes_of(&value));
        }
        let mut pass = gpu_primitives::profile::begin_pass(encoder, "macrocell.activate");
        for ((_, bind), (_, page_count)) in masks.pages.iter().zip(plan.pages()) {
            self.activate.dispatch(&mut pass, bind, page_count);
        }
        if let (Some(kernel), Some((_, bind))) = (&self.third_level, &masks.third_level) {
            kernel.dispatch(&mut pass, bind, plan.grid().third_count().div_ceil(64));
        }
        self.active_box.dispatch(&mut pass, &masks.active_box.1, 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gpu_testkit::layout::{check_struct, struct_size};

    #[test]
    fn uniforms_lie_where_the_host_writes_them() {
        let text = Activate::source().wgsl.source;
        let params = members!(ActivateParams: page_first, page_count, isovalue, pad0);
        check_struct(&text, "ActivateParams", &params).unwrap();
        assert_eq!(
            struct_size(&text, "ActivateParams").unwrap() as usize,
            size_of::<ActivateParams>()
        );
        let text = Activate::third_level_source().wgsl.source;
        let params = members!(ThirdLevelParams: coarse, coarse_count, third, third_count);
        check_struct(&text, "ThirdLevelParams", &params).unwrap();
        let bytes = struct_size(&text, "ThirdLevelParams").unwrap();
        assert_eq!(bytes as usize, size_of::<ThirdLevelParams>());
        let text = Activate::active_box_source().wgsl.source;
        let params = members!(
            ActiveBoxParams: cells, first, last_cell, child_shift, active_box, has_third_level, pad0, pad1
        );
        check_struct(&text, "ActiveBoxParams", &params).unwrap();
        let bytes = struct_size(&text, "ActiveBoxParams").unwrap();
        assert_eq!(bytes as usize, size_of::<ActiveBoxParams>());
    }
}
