//! Loading: the compressed stream to the GPU and value ranges from it, a bounded piece per pass.

use gpu_primitives::memory::Ledger;
use gpu_primitives::upload::UploadRing;
use macrocell::{MacrocellPlan, RangeBuffers, RangeScratch, Ranges};
use zfp_gpu::{BlockExtrema, ExtremaBuffers, KeptSamples, Payload};

use crate::{CompressedVolume, Error, wgpu};

/// Largest upload chunk, and the stream's bytes per pass.
const MOST_CHUNK: u64 = 8 << 20;
const LEAST_CHUNK: u64 = 64 << 10;

/// Regions of value ranges per pass: at most 4 * 33^3 blocks are decoded, so that no driver's
/// watchdog fires.
const REGIONS_PER_PASS: u64 = 4;

/// How loading is split.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct LoadPlan {
    chunk: u64,
}

impl LoadPlan {
    /// Chunks of a 64th of the budget, so that staging takes a 16th at most.
    pub(crate) fn new(stream_bytes: u64, budget_bytes: u64) -> Self {
        let affordable = (budget_bytes / 64).clamp(LEAST_CHUNK, MOST_CHUNK);
        let useful = stream_bytes.next_power_of_two().max(LEAST_CHUNK);
        let rounded_down = 1 << affordable.ilog2();
        Self { chunk: useful.min(rounded_down) }
    }

    /// The smallest chunks.
    pub(crate) fn smallest(stream_bytes: u64) -> Self {
        Self::new(stream_bytes, 0)
    }

    /// Two passes are in flight, and a chunk may be split at a page's border.
    pub(crate) fn staging_bytes(self) -> u64 {
        4 * self.chunk
    }
}

/// What loading needs; dropped when it is done.
#[derive(Debug)]
pub(crate) struct Loader {
    upload: UploadRing,
    chunk: u64,
    range_stage: Ranges,
    extrema_stage: BlockExtrema,
    scratch: RangeScratch,
    extrema: ExtremaBuffers,
    next_byte: u64,
    next_region: u64,
}

impl Loader {
    pub(crate) fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        plan: LoadPlan,
        payload: &Payload,
        ranges: &RangeBuffers,
        kept: Option<KeptSamples<'_>>,
    ) -> Result<Self, Error> {
        let kept_pages = kept.map_or(0, |kept| kept.pages.len() as u32);
        let range_stage = Ranges::new(device);
        let extrema_stage = BlockExtrema::new(device, kept_pages)?;
        let scratch = RangeScratch::new(device, ledger, &range_stage, ranges);
        let extrema =
            ExtremaBuffers::new(device, ledger, &extrema_stage, payload, scratch.extrema(), kept)?;
        Ok(Self {
            upload: UploadRing::new(ledger, "progressive-iso.load.upload", plan.chunk),
            chunk: plan.chunk,
            range_stage,
            extrema_stage,
            scratch,
            extrema,
            next_byte: 0,
            next_region: 0,
        })
    }

    /// Share of the work that is recorded, 0 to 1.
    pub(crate) fn share(&self, volume: &CompressedVolume, plan: &MacrocellPlan) -> f32 {
        let bytes = self.next_byte as f64 / volume.layout().stream_bytes().max(1) as f64;
        let regions = self.next_region as f64 / plan.region_count().max(1) as f64;
        ((bytes + regions) / 2.0) as f32
    }

    /// Records the next piece; true when everything is recorded.
    pub(crate) fn record(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        params: &mut UploadRing,
        volume: &CompressedVolume,
        payload: &mut Payload,
        ranges: &RangeBuffers,
    ) -> Result<bool, Error> {
        let length = volume.layout().stream_bytes();
        if self.next_byte < length {
            let end = (self.next_byte + self.chunk).min(length);
            let piece = &volume.bytes()[self.next_byte as usize..end as usize];
            payload.record_upload(device, encoder, &mut self.upload, self.next_byte, piece)?;
            self.next_byte = end;
            if end < length {
                return Ok(false);
            }
        }
        let count = ranges.plan().region_count();
        for _ in 0..REGIONS_PER_PASS.min(count - self.next_region) {
            let region = ranges.plan().region(self.next_region);
            self.extrema_stage.record(
                device,
                encoder,
                params,
                &self.extrema,
                region.block_origin(),
                region.block_size(),
            )?;
            self.range_stage.record(device, encoder, params, ranges, &self.scratch, region);
            self.next_region += 1;
        }
        Ok(self.next_region == count)
    }
}
