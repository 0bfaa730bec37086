//! Value ranges at load: from block extrema to two bytes per block.

use bytemuck::{Pod, Zeroable};
use gpu_primitives::kernel::{Binding, Kernel, KernelSource};
use gpu_primitives::memory::{Buffer, Category, Ledger};
use gpu_primitives::upload::UploadRing;
use gpu_primitives::wgsl::{Module, compose_fixed};
use gpu_primitives::{indirect, wgpu};

use crate::plan::{CODE_BYTES, MacrocellPlan, Region};
use crate::wgsl::QUANTISE;

const RANGES: Module = Module { name: "ranges", source: include_str!("../shader/ranges.wgsl") };

/// Uniform of `shader/ranges.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct RangesParams {
    blocks: [u32; 3],
    page_first: u32,
    coarse: [u32; 3],
    page_count: u32,
    region_origin: [u32; 3],
    region_groups: u32,
    region_blocks: [u32; 3],
    pad0: u32,
    region_coarse: [u32; 3],
    pad1: u32,
    cells: [u32; 3],
    pad2: u32,
}

/// The stage that builds value ranges.
#[derive(Debug)]
pub struct Ranges {
    kernel: Kernel,
}

/// Value ranges of one volume.
#[derive(Debug)]
pub struct RangeBuffers {
    plan: MacrocellPlan,
    coarse_ranges: Buffer,
    code_pages: Vec<Buffer>,
}

/// What building the ranges needs for the time of loading; drop it afterwards.
#[derive(Debug)]
pub struct RangeScratch {
    extrema: Buffer,
    params: Buffer,
    binds: Vec<wgpu::BindGroup>,
}

impl RangeBuffers {
    /// Allocates the ranges of a volume.
    pub fn new(device: &wgpu::Device, ledger: &Ledger, plan: &MacrocellPlan) -> Self {
        let storage = |label: &str, size: u64| {
            let usage = wgpu::BufferUsages::STORAGE
                | wgpu::BufferUsages::COPY_SRC
                | wgpu::BufferUsages::COPY_DST;
            let label = Some(label);
            let desc = wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false };
            ledger.buffer(device, Category::Ranges, &desc)
        };
        Self {
            plan: plan.clone(),
            coarse_ranges: storage("macrocell.ranges.coarse", plan.grid().coarse_count() * 8),
            code_pages: plan
                .pages()
                .map(|(_, count)| storage("macrocell.ranges.codes", count * CODE_BYTES))
                .collect(),
        }
    }

    /// (low, high) as two f32 per coarse cell; low > high where it has no dual cell.
    pub fn coarse_ranges(&self) -> &wgpu::Buffer {
        &self.coarse_ranges
    }

    /// 64 codes of 16 bits per coarse cell: low code in the lower byte, high code in the upper one.
    pub fn code_pages(&self) -> &[Buffer] {
        &self.code_pages
    }

    /// The plan these buffers were made from.
    pub fn plan(&self) -> &MacrocellPlan {
        &self.plan
    }
}

impl RangeScratch {
    /// Allocates the extrema of one region.
    pub fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        stage: &Ranges,
        buffers: &RangeBuffers,
    ) -> Self {
        let buffer = |label, size, usage| {
            let label = Some(label);
            let desc = wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false };
            ledger.buffer(device, Category::Scratch, &desc)
        };
        let extrema = buffer(
            "macrocell.ranges.extrema",
            buffers.plan.scratch_bytes(),
            wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        );
        let params = buffer(
            "macrocell.ranges.params",
            Self::PARAMS_BYTES,
            wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        );
        let binds = buffers
            .code_pages
            .iter()
            .map(|page| {
                let resources = [
                    params.as_entire_binding(),
                    extrema.as_entire_binding(),
                    buffers.coarse_ranges.as_entire_binding(),
                    page.as_entire_binding(),
                ];
                stage.kernel.bind(device, "macrocell.ranges", &resources)
            })
            .collect();
        Self { extrema, params, binds }
    }

    /// Bytes of the uniform.
    pub const PARAMS_BYTES: u64 = size_of::<RangesParams>() as u64;

    /// Where the extrema of a region belong: 8 pairs (min, max) of f32 per block, x fastest over
    /// [`Region::block_size`].
    pub fn extrema(&self) -> &wgpu::Buffer {
        &self.extrema
    }
}

impl Ranges {
    /// Makes the pipeline.
    pub fn new(device: &wgpu::Device) -> Self {
        Self { kernel: Self::source().kernel(device) }
    }

    /// Text and bindings of the kernel.
    pub fn source() -> KernelSource {
        KernelSource {
            label: "macrocell.ranges",
            wgsl: compose_fixed(RANGES, &[QUANTISE, indirect::MODULE], &[]),
            entry_point: "main",
            bindings: vec![
                Binding::Uniform { bytes: RangeScratch::PARAMS_BYTES },
                Binding::StorageRead { min_bytes: 64 },
                Binding::StorageReadWrite { min_bytes: 8 },
                Binding::StorageReadWrite { min_bytes: CODE_BYTES },
            ],
        }
    }

    /// Records building the ranges of `region`, whose extrema are in `scratch` by then.
    pub fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        upload: &mut UploadRing,
        buffers: &RangeBuffers,
        scratch: &RangeScratch,
        region: Region,
    ) {
        let grid = buffers.plan.grid();
        let groups: u64 = region.coarse_size.iter().map(|&c| u64::from(c)).product();
        let first = grid.coarse_index(region.coarse_origin);
        let last = grid.coarse_index(std::array::from_fn(|a| {
            region.coarse_origin[a] + region.coarse_size[a] - 1
        }));
        for (bind, (page_first, page_count)) in scratch.binds.iter().zip(buffers.plan.pages()) {
            if last < page_first || first >= page_first + page_count {
                continue;
            }
            let params = RangesParams {
                blocks: grid.blocks(),
                page_first: page_first as u32,
                coarse: grid.coarse(),
                page_count: page_count as u32,
                region_origin: region.block_origin(),
                region_groups: groups as u32,
                region_blocks: region.block_size(),
                pad0: 0,
                region_coarse: region.coarse_size,
                pad1: 0,
                cells: grid.dims().map(|d| d - 1),
                pad2: 0,
            };
            upload.write(device, encoder, &scratch.params, 0, bytemuck::bytes_of(&params));
            let mut pass = gpu_primitives::profile::begin_pass(encoder, "macrocell.ranges");
            self.kernel.dispatch(&mut pass, bind, groups);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gpu_testkit::layout::{check_struct, struct_size};

    #[test]
    fn uniforms_lie_where_the_host_writes_them() {
        let text = Ranges::source().wgsl.source;
        let params = members!(RangesParams: blocks, page_first, coarse, page_count, region_origin, region_groups, region_blocks, pad0,
            region_coarse, pad1, cells, pad2);
        check_struct(&text, "RangesParams", &params).unwrap();
        assert_eq!(struct_size(&text, "RangesParams").unwrap() as usize, size_of::<RangesParams>());
    }
}
