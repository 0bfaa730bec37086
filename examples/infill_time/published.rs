//! The published network on a renderer's picture.

use std::path::Path;
use std::time::Instant;

use gpu_primitives::memory::Ledger;
use infill::published::{
    Published, PublishedBuffers, PublishedOptions, PublishedPicture, PublishedPlan,
    PublishedWeights,
};
use progressive_iso::{ProgressiveIsoRenderer, wgpu};

use crate::support::{Failure, Gpu};

pub struct PublishedNetwork {
    stage: Published,
    buffers: PublishedBuffers,
}

impl PublishedNetwork {
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
        let buffers =
            PublishedBuffers::new(&gpu.device, &Ledger::new(), &stage, &plan, &weights, picture);
        Ok(Self { stage, buffers })
    }

    /// Fills the picture from an empty state: wall milliseconds.
    pub fn fill(&self, gpu: &Gpu) -> Result<f64, Failure> {
        submit(gpu, |encoder| self.buffers.record_clear_state(encoder))?;
        let start = Instant::now();
        submit(gpu, |encoder| self.stage.record(encoder, &self.buffers))?;
        Ok(start.elapsed().as_secs_f64() * 1e3)
    }
}

fn submit(gpu: &Gpu, record: impl Fn(&mut wgpu::CommandEncoder)) -> Result<(), Failure> {
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    record(&mut encoder);
    #[expect(clippy::disallowed_methods, reason = "the program owns the queue")]
    gpu.queue.submit([encoder.finish()]);
    #[expect(clippy::disallowed_methods, reason = "the program may block")]
    gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
    Ok(())
}
