//! Loading: the compressed stream to the GPU and value ranges from it, a bounded piece per pass.

use gpu_primitives::memory::Ledger;
use gpu_primitives::upload::UploadRing;
use macrocell::{RangeScratch, Ranges};
use zfp_gpu::{BlockExtrema, ExtremaBuffers};

use crate::samples::{SampleBuffers, SamplePlan};
use crate::stages::VolumeBuffers;
use crate::{CompressedVolume, Error, ScenePlan, wgpu};

/// Largest upload chunk, and the stream's bytes per pass.
const MOST_CHUNK: u64 = 8 << 20;
const LEAST_CHUNK: u64 = 64 << 10;

/// Chunks that are staged at a time: two passes are in flight, and a chunk may be split at a page's
/// border.
const CHUNKS: u64 = 4;

/// Regions of value ranges per pass: at most 4 * 33^3 blocks are decoded, so that no driver's
/// watchdog fires.
const REGIONS_PER_PASS: u64 = 4;

/// Blocks of a region, each decoded once, in dispatches of its own.
pub(crate) const BLOCKS_PER_REGION: u64 = 33 * 33 * 33;

/// How loading is split.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct LoadPlan {
    chunk: u64,
}

impl LoadPlan {
    /// The largest useful chunks that fit `room` bytes together, or else the smallest ones.
    pub(crate) fn new(stream_bytes: u64, room: u64) -> Self {
        let affordable = (room / CHUNKS).clamp(LEAST_CHUNK, MOST_CHUNK);
        let useful = stream_bytes.next_power_of_two().max(LEAST_CHUNK);
        let rounded_down = 1 << affordable.ilog2();
        Self { chunk: useful.min(rounded_down) }
    }

    /// Most bytes that are staged at a time.
    pub(crate) fn staging_bytes(self) -> u64 {
        CHUNKS * self.chunk
    }
}

/// Pipelines of loading.
#[derive(Debug)]
pub(crate) struct LoadStages {
    ranges: Ranges,
    extrema: BlockExtrema,
}

impl LoadStages {
    pub(crate) fn new(device: &wgpu::Device, plan: &ScenePlan) -> Result<Self, Error> {
        let kept_pages = match &plan.samples {
            SamplePlan::Cached(_) => 0,
            SamplePlan::Resident(plan) => plan.page_count(),
        };
        let extrema = BlockExtrema::new(device, kept_pages)?;
        Ok(Self { ranges: Ranges::new(device), extrema })
    }
}

/// What loading needs; dropped when the GPU is done with it.
#[derive(Debug)]
pub(crate) struct Loader {
    upload: UploadRing,
    chunk: u64,
    stages: LoadStages,
    scratch: RangeScratch,
    extrema: ExtremaBuffers,
    /// Memory of the samples where all are kept.
    samples: Option<SampleBuffers>,
    next_byte: u64,
    next_region: u64,
}

impl Loader {
    pub(crate) fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        plan: &ScenePlan,
        buffers: &VolumeBuffers,
        stages: LoadStages,
    ) -> Result<Self, Error> {
        let VolumeBuffers { payload, ranges, .. } = buffers;
        let samples = match &plan.samples {
            SamplePlan::Cached(_) => None,
            SamplePlan::Resident(plan) => Some(SampleBuffers::resident(device, ledger, plan)),
        };
        let kept = samples.as_ref().and_then(SampleBuffers::kept);
        let scratch = RangeScratch::new(device, ledger, &stages.ranges, ranges);
        let extrema =
            ExtremaBuffers::new(device, ledger, &stages.extrema, payload, scratch.extrema(), kept)?;
        let chunk = plan.load.chunk;
        Ok(Self {
            upload: UploadRing::new(ledger, "progressive-iso.load.upload", chunk),
            chunk,
            stages,
            scratch,
            extrema,
            samples,
            next_byte: 0,
            next_region: 0,
        })
    }

    /// Whether everything is recorded.
    pub(crate) fn is_recorded(&self, buffers: &VolumeBuffers) -> bool {
        self.next_region == buffers.ranges.plan().region_count()
    }

    /// Whether there is something to record now.
    ///
    /// # Errors
    /// If the stream ends too early.
    pub(crate) fn can_go_on(&self, volume: &CompressedVolume) -> Result<bool, Error> {
        if self.next_byte < volume.layout().stream_bytes() {
            return volume.has_bytes(self.next_byte);
        }
        Ok(true)
    }

    /// Whether no submission uses its staging memory.
    pub(crate) fn is_idle(&self) -> bool {
        self.upload.is_idle()
    }

    /// The samples, if they were kept; frees everything else.
    pub(crate) fn into_samples(self) -> Option<SampleBuffers> {
        self.samples
    }

    /// Share of the work that is recorded, 0 to 1.
    pub(crate) fn share(&self, buffers: &VolumeBuffers) -> f32 {
        let bytes = buffers.payload.layout().stream_bytes().max(1);
        let regions = buffers.ranges.plan().region_count().max(1);
        let share = |done: u64, all: u64| done as f64 / all as f64;
        ((share(self.next_byte, bytes) + share(self.next_region, regions)) / 2.0) as f32
    }

    /// Records the next piece.
    pub(crate) fn record(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        params: &mut UploadRing,
        volume: &CompressedVolume,
        buffers: &mut VolumeBuffers,
    ) -> Result<(), Error> {
        let VolumeBuffers { payload, ranges, .. } = buffers;
        let length = volume.layout().stream_bytes();
        if self.next_byte < length {
            let piece = volume.read(self.next_byte, self.chunk);
            payload.record_upload(device, encoder, &mut self.upload, self.next_byte, &piece)?;
            self.next_byte += piece.len() as u64;
            if self.next_byte < length {
                return Ok(());
            }
        }
        let count = ranges.plan().region_count();
        for _ in 0..REGIONS_PER_PASS.min(count - self.next_region) {
            let region = ranges.plan().region(self.next_region);
            self.stages.extrema.record(
                device,
                encoder,
                params,
                &self.extrema,
                region.block_origin(),
                region.block_size(),
            )?;
            self.stages.ranges.record(device, encoder, params, ranges, &self.scratch, region);
            self.next_region += 1;
        }
        Ok(())
    }
}
