//! The published in-fill network on a renderer's pictures.

use std::path::Path;
use std::time::Instant;

use gpu_primitives::memory::Ledger;
use infill::published::{
    Published, PublishedBuffers, PublishedOptions, PublishedPicture, PublishedPlan,
    PublishedWeights,
};
use progressive_iso::{ProgressiveIsoRenderer, wgpu};

use super::shown::Shown;
use super::{Failure, Gpu, read_words};

/// The network on one picture, which has to have its status.
pub struct PublishedNetwork {
    stage: Published,
    buffers: PublishedBuffers,
    pub bytes: u64,
}

impl PublishedNetwork {
    /// `weights`: a file that `infill/training/convert_published.py` made.
    pub fn new(
        gpu: &Gpu,
        renderer: &ProgressiveIsoRenderer,
        size: [u32; 2],
        weights: &Path,
    ) -> Result<Self, Failure> {
        let bytes = std::fs::read(weights).map_err(|e| format!("{}: {e}", weights.display()))?;
        let weights = PublishedWeights::from_safetensors(&bytes)?;
        let plan = PublishedPlan::new(size, &gpu.device.limits())?;
        let stage = Published::new(&gpu.device, PublishedOptions::default());
        let status = renderer.textures().status().ok_or("a picture without status")?;
        let status = status.create_view(&wgpu::TextureViewDescriptor::default());
        let picture = PublishedPicture { color: renderer.color_view(), status: &status };
        let ledger = Ledger::new();
        let buffers = PublishedBuffers::new(&gpu.device, &ledger, &stage, &plan, &weights, picture);
        Ok(Self { stage, buffers, bytes: ledger.total() })
    }

    /// Forgets the pictures filled so far.
    pub fn clear(&self, gpu: &Gpu) -> Result<(), Failure> {
        gpu.run(|encoder| self.buffers.record_clear_state(encoder))
    }

    /// Fills the picture as it is now, `anew` without the pictures filled so far: what it shows, and wall milliseconds.
    pub fn picture(&self, gpu: &Gpu, anew: bool) -> Result<(Shown, f64), Failure> {
        if anew {
            self.clear(gpu)?;
        }
        let ms = self.fill(gpu)?;
        Ok((Shown::from_words(&read_words(gpu, self.buffers.output())?), ms))
    }

    /// Fills the picture as it is now: wall milliseconds.
    pub fn fill(&self, gpu: &Gpu) -> Result<f64, Failure> {
        let start = Instant::now();
        gpu.run(|encoder| self.stage.record(encoder, &self.buffers))?;
        Ok(start.elapsed().as_secs_f64() * 1e3)
    }
}
