//! The published network on the pictures of a renderer that does not fill.

use std::path::Path;
use std::time::Instant;

use gpu_primitives::memory::Ledger;
use infill::published::{
    Published, PublishedBuffers, PublishedOptions, PublishedPicture, PublishedPlan,
    PublishedWeights,
};
use progressive_iso::{ProgressiveIsoRenderer, wgpu};

use crate::contender::{Shown, milliseconds};
use crate::support::{Failure, Gpu, read_words};

/// The network on one picture.
pub struct PublishedNetwork {
    stage: Published,
    buffers: PublishedBuffers,
    pub bytes: u64,
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
        let ledger = Ledger::new();
        let buffers = PublishedBuffers::new(&gpu.device, &ledger, &stage, &plan, &weights, picture);
        Ok(Self { stage, buffers, bytes: ledger.total() })
    }

    /// Fills the picture as it is now: what it shows, and the wall time.
    pub fn fill(&self, gpu: &Gpu) -> Result<(Shown, f64), Failure> {
        let start = Instant::now();
        self.submit(gpu, |encoder| self.stage.record(encoder, &self.buffers))?;
        let ms = milliseconds(start);
        let words = read_words(gpu, self.buffers.output())?;
        let color = |p: &[u32]| [p[0], p[1], p[2]].map(|v| f32::from_bits(v).clamp(0.0, 1.0));
        Ok((Shown { colors: words.chunks_exact(4).map(color).collect(), surface: None }, ms))
    }

    pub fn clear(&self, gpu: &Gpu) -> Result<(), Failure> {
        self.submit(gpu, |encoder| self.buffers.record_clear_state(encoder))
    }

    fn submit(&self, gpu: &Gpu, record: impl Fn(&mut wgpu::CommandEncoder)) -> Result<(), Failure> {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        record(&mut encoder);
        #[expect(clippy::disallowed_methods, reason = "the program owns the queue")]
        gpu.queue.submit([encoder.finish()]);
        #[expect(clippy::disallowed_methods, reason = "the program may block")]
        gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(())
    }
}
