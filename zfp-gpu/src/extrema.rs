//! Stage: least and greatest samples of blocks, for value ranges at load.

use gpu_primitives::indirect;
use gpu_primitives::kernel::{Binding, Kernel, KernelSource};
use gpu_primitives::memory::{Buffer, Category, Ledger};
use gpu_primitives::upload::UploadRing;
use gpu_primitives::wgsl::{Constant, Module, compose_fixed};

use crate::decode::{MAX_CACHE_PAGES, SLOT_BYTES};
use crate::plan::PAGE_PARAM_BYTES;
use crate::{Error, Payload, StreamLayout, wgsl};

const EXTREMA: Module = Module { name: "extrema", source: include_str!("../shader/extrema.wgsl") };

/// Stage: extrema of the blocks of a region, in eight classes of samples.
///
/// 16 f32 per block: (min, max) of class `c` at `16e + 2c`, with `e = x + size_x * (y + size_y * z)`
/// within the region. Class 0 holds all samples; bit 0 of `c` keeps only samples with local x = 0,
/// bit 1 those with y = 0, bit 2 those with z = 0, so that a cell's neighbours on the plus side can
/// contribute just the face, edge or corner that the cell shares with them. Only samples inside the
/// volume count. Blocks outside the volume are left untouched.
///
/// It may keep the samples, too: block b in slot b of slots laid out as [`crate::Decode`] does.
#[derive(Debug)]
pub struct BlockExtrema {
    kernel: Kernel,
    slot_pages: u32,
}

/// Where a [`BlockExtrema`] stage keeps samples.
#[derive(Clone, Copy, Debug)]
pub struct KeptSamples<'a> {
    /// Pages with a slot for every block of the volume, as many as the stage was made for.
    pub pages: &'a [Buffer],
    /// Slots of every page but the last, which may be shorter.
    pub slots_per_page: u32,
}

/// What a [`BlockExtrema`] stage reads and writes: a bind group per payload page.
#[derive(Debug)]
pub struct ExtremaBuffers {
    binds: Vec<wgpu::BindGroup>,
    params: Buffer,
    layout: StreamLayout,
    /// First block and number of blocks of every payload page.
    pages: Vec<(u64, u64)>,
    output_bytes: u64,
    slots_per_page: u32,
}

impl BlockExtrema {
    /// Bytes per block of a region.
    pub const BYTES_PER_BLOCK: u64 = 64;

    /// Blocks per workgroup.
    const BLOCKS_PER_GROUP: u32 = 32;

    /// Makes the pipeline. With `slot_pages` of 1 to 4 it keeps the samples, with 0 it does not.
    ///
    /// # Errors
    /// [`Error::CachePages`] for any other number of pages.
    pub fn new(device: &wgpu::Device, slot_pages: u32) -> Result<Self, Error> {
        Ok(Self { kernel: Self::source(slot_pages)?.kernel(device), slot_pages })
    }

    /// Text and bindings of the kernel.
    ///
    /// # Errors
    /// As [`BlockExtrema::new`].
    pub fn source(slot_pages: u32) -> Result<KernelSource, Error> {
        if slot_pages > MAX_CACHE_PAGES {
            let expected = format!("0 to {MAX_CACHE_PAGES}");
            return Err(Error::CachePages { expected, found: slot_pages as usize });
        }
        let mut constants = vec![("KEEP_SAMPLES", Constant::Bool(slot_pages > 0))];
        constants.extend(wgsl::slot_page_constants(slot_pages));
        let library = [indirect::MODULE, wgsl::BLOCK, wgsl::GROUP, wgsl::STORE];
        let mut bindings = vec![
            Binding::Uniform { bytes: PAGE_PARAM_BYTES },
            Binding::Uniform { bytes: ExtremaBuffers::BYTES },
            Binding::StorageRead { min_bytes: 4 },
            Binding::StorageReadWrite { min_bytes: 8 },
        ];
        bindings.extend((0..slot_pages).map(|_| Binding::StorageReadWrite { min_bytes: 16 }));
        Ok(KernelSource {
            label: "zfp-gpu.extrema",
            wgsl: compose_fixed(EXTREMA, &library, &constants),
            entry_point: "block_extrema",
            bindings,
        })
    }

    /// Records the extrema of the region of blocks `region_origin ..+ region_size`, one dispatch
    /// per payload page that the region may touch. The region may reach outside the volume.
    ///
    /// # Errors
    /// [`Error::BufferTooSmall`] when the output does not hold the region; nothing is recorded.
    pub fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        upload: &mut UploadRing,
        buffers: &ExtremaBuffers,
        region_origin: [u32; 3],
        region_size: [u32; 3],
    ) -> Result<(), Error> {
        let count = region_size.map(u128::from).iter().product::<u128>();
        let expected = count.saturating_mul(u128::from(Self::BYTES_PER_BLOCK));
        if expected > u128::from(buffers.output_bytes) {
            return Err(Error::BufferTooSmall {
                what: "the output of the extrema",
                expected: u64::try_from(expected).unwrap_or(u64::MAX),
                found: buffers.output_bytes,
            });
        }
        // Fits: a binding holds fewer than 2^32 bytes times 64.
        let count = count as u32;
        let Some((first, last)) = blocks_touched(&buffers.layout, region_origin, region_size)
        else {
            return Ok(());
        };
        let ([ox, oy, oz], [sx, sy, sz]) = (region_origin, region_size);
        let [nx, ny, nz] = buffers.layout.dims;
        let params = [ox, oy, oz, 0, sx, sy, sz, count, nx, ny, nz, buffers.slots_per_page];
        upload.write(device, encoder, &buffers.params, 0, bytemuck::bytes_of(&params));
        let mut pass = gpu_primitives::profile::begin_pass(encoder, "zfp-gpu.extrema");
        for (bind, &(page_first, page_blocks)) in buffers.binds.iter().zip(&buffers.pages) {
            if first < page_first + page_blocks && page_first <= last {
                let groups = u64::from(count.div_ceil(Self::BLOCKS_PER_GROUP));
                self.kernel.dispatch(&mut pass, bind, groups);
            }
        }
        Ok(())
    }
}

impl ExtremaBuffers {
    /// Bytes that [`ExtremaBuffers::new`] allocates.
    pub const BYTES: u64 = 48;

    /// Binds a payload and the output, a storage buffer of [`BlockExtrema::BYTES_PER_BLOCK`] bytes
    /// for every block of the largest region. `kept` is for a stage that keeps samples.
    ///
    /// # Errors
    /// [`Error::BufferTooSmall`] when the output does not hold one block or the slots do not hold
    /// every block, [`Error::CachePages`] when there are not as many pages as the stage writes.
    pub fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        stage: &BlockExtrema,
        payload: &Payload,
        output: &wgpu::Buffer,
        kept: Option<KeptSamples<'_>>,
    ) -> Result<Self, Error> {
        check_kept(stage, payload.layout(), kept)?;
        if output.size() < BlockExtrema::BYTES_PER_BLOCK {
            return Err(Error::BufferTooSmall {
                what: "the output of the extrema",
                expected: BlockExtrema::BYTES_PER_BLOCK,
                found: output.size(),
            });
        }
        let params = ledger.buffer(
            device,
            Category::Params,
            &wgpu::BufferDescriptor {
                label: Some("zfp-gpu.extrema.params"),
                size: Self::BYTES,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            },
        );
        let bind = |page: &crate::payload::Page| {
            let mut resources = vec![
                page.params.as_entire_binding(),
                params.as_entire_binding(),
                page.words.as_entire_binding(),
                output.as_entire_binding(),
            ];
            let slots = kept.iter().flat_map(|kept| kept.pages);
            resources.extend(slots.map(|page| page.as_entire_binding()));
            stage.kernel.bind(device, "zfp-gpu.extrema", &resources)
        };
        let blocks = |page: &crate::PayloadPage| (page.first_block.into(), page.blocks.into());
        Ok(Self {
            binds: payload.pages().iter().map(bind).collect(),
            params,
            layout: *payload.layout(),
            pages: payload.payload_plan().pages().iter().map(blocks).collect(),
            output_bytes: output.size(),
            slots_per_page: kept.map_or(1, |kept| kept.slots_per_page),
        })
    }
}

fn check_kept(
    stage: &BlockExtrema,
    layout: &StreamLayout,
    kept: Option<KeptSamples<'_>>,
) -> Result<(), Error> {
    let found = kept.map_or(0, |kept| kept.pages.len());
    if found != stage.slot_pages as usize {
        return Err(Error::CachePages { expected: stage.slot_pages.to_string(), found });
    }
    let Some(kept) = kept else { return Ok(()) };
    let per_page = u64::from(kept.slots_per_page);
    let blocks: u64 = layout.blocks().iter().map(|&b| u64::from(b)).product();
    for (page, buffer) in (0u64..).zip(kept.pages) {
        let slots = blocks.saturating_sub(page * per_page).min(per_page);
        if buffer.size() < slots * SLOT_BYTES {
            let (expected, found) = (slots * SLOT_BYTES, buffer.size());
            return Err(Error::BufferTooSmall { what: "a page of kept samples", expected, found });
        }
    }
    if per_page * (kept.pages.len() as u64) < blocks {
        let (expected, found) = (blocks * SLOT_BYTES, per_page * found as u64 * SLOT_BYTES);
        return Err(Error::BufferTooSmall { what: "the pages of kept samples", expected, found });
    }
    Ok(())
}

/// Least and greatest index of the volume's blocks inside a region; `None` if there are none.
fn blocks_touched(layout: &StreamLayout, origin: [u32; 3], size: [u32; 3]) -> Option<(u64, u64)> {
    let blocks = layout.blocks();
    if (0..3).any(|axis| size[axis] == 0 || origin[axis] >= blocks[axis]) {
        return None;
    }
    let end = |axis: usize| blocks[axis].min(origin[axis].saturating_add(size[axis])) - 1;
    let index = |p: [u32; 3]| {
        let ([x, y, z], [bx, by, _]) = (p.map(u64::from), blocks.map(u64::from));
        x + bx * (y + by * z)
    };
    Some((index(origin), index([end(0), end(1), end(2)])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_touch_the_blocks_inside_the_volume() {
        let layout = StreamLayout::new([40, 20, 12], 64, 0).unwrap();
        assert_eq!(blocks_touched(&layout, [0; 3], [10, 5, 3]), Some((0, 149)));
        assert_eq!(blocks_touched(&layout, [2, 1, 1], [1, 1, 1]), Some((62, 62)));
        assert_eq!(blocks_touched(&layout, [9, 4, 2], [u32::MAX; 3]), Some((149, 149)));
        assert_eq!(blocks_touched(&layout, [10, 0, 0], [1; 3]), None);
        assert_eq!(blocks_touched(&layout, [0; 3], [1, 0, 1]), None);
    }
}
