//! Renderers that fill in different ways and do everything else alike.

use std::path::Path;
use std::time::Instant;

use progressive_iso::{
    Camera, Capture, CompressedVolume, Frame, FrameOptions, Infill, InfillOptions, InfillSources,
    InfillWeights, Outputs, PassReport, ProgressiveIsoRenderer, RendererOptions, Residency,
    TraversalStrategy,
};

use crate::support::shown::published_shading;
use crate::support::{Failure, Gpu};

const BUDGET_BYTES: u64 = 512 << 20;

/// Weights for the life of the program.
pub fn weights(path: &Path) -> Result<&'static InfillWeights, Failure> {
    let bytes = std::fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(Box::leak(Box::new(InfillWeights::from_safetensors(&bytes)?)))
}

/// A way to fill.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    pub name: &'static str,
    pub infill: Infill,
    pub sources: InfillSources,
}

const NOTHING: InfillSources =
    InfillSources { neighbours: false, coarse_field: false, history: false };
const EVERYTHING: InfillSources =
    InfillSources { neighbours: true, coarse_field: true, history: true };

/// The first leaves unfinished pixels as they are.
pub const WAYS: [Way; 6] = [
    Way { name: "unfinished", infill: Infill::Off, sources: NOTHING },
    Way {
        name: "push-pull",
        infill: Infill::Classical,
        sources: InfillSources { neighbours: true, ..NOTHING },
    },
    Way {
        name: "coarse",
        infill: Infill::Classical,
        sources: InfillSources { coarse_field: true, ..NOTHING },
    },
    Way { name: "classical", infill: Infill::Classical, sources: EVERYTHING },
    Way { name: "network", infill: Infill::Network, sources: EVERYTHING },
    Way {
        name: "network-no-history",
        infill: Infill::Network,
        sources: InfillSources { history: false, ..EVERYTHING },
    },
];

/// Those whose pictures are timed.
pub const CURVE_WAYS: [Way; 3] = [WAYS[0], WAYS[3], WAYS[4]];

/// A renderer with its way to fill.
pub struct Contender {
    pub way: Way,
    pub renderer: ProgressiveIsoRenderer,
}

/// A frame at its cut.
pub struct Cut {
    pub capture: Capture,
    /// Wall time of the last pass, filling included.
    pub last_pass_ms: f64,
    pub report: PassReport,
}

impl Contender {
    pub fn new(
        gpu: &Gpu,
        volume: &CompressedVolume,
        size: [u32; 2],
        way: Way,
        weights: &'static InfillWeights,
        strategy: TraversalStrategy,
    ) -> Result<Self, Failure> {
        let network = (way.infill == Infill::Network).then_some(weights);
        let options = RendererOptions {
            size,
            budget_bytes: BUDGET_BYTES,
            outputs: Outputs { depth: true, normal: true, status: true },
            infill: (way.infill != Infill::Off).then_some(InfillOptions {
                sources: way.sources,
                network,
                ..Default::default()
            }),
            capture: true,
            strategy,
            residency: Residency::Cached,
            ..Default::default()
        };
        let renderer =
            ProgressiveIsoRenderer::new(&gpu.device, &gpu.queue, volume.clone(), options)?;
        Ok(Self { way, renderer })
    }

    /// Renders until `share` of the pixels are finished, from an empty cache.
    pub fn cut(
        &mut self,
        gpu: &Gpu,
        camera: Camera,
        isovalue: f32,
        share: f64,
    ) -> Result<Cut, Failure> {
        let options = FrameOptions {
            shading: published_shading(),
            rounds_per_pass: 1,
            pass_ms: f32::INFINITY,
            infill: self.way.infill,
            ..Default::default()
        };
        self.renderer.clear_cache();
        self.renderer.set_frame(&Frame { camera, isovalues: vec![isovalue], options })?;
        let (mut start, mut last_pass_ms) = (Instant::now(), 0.0);
        let report = self.renderer.render_to_completion(&gpu.device, &gpu.queue, |_, report| {
            last_pass_ms = milliseconds(start);
            start = Instant::now();
            report.pass == 0 || report.completeness_pixels() < share
        })?;
        Ok(Cut { capture: self.capture(gpu)?, last_pass_ms, report })
    }

    pub fn capture(&self, gpu: &Gpu) -> Result<Capture, Failure> {
        Ok(self.renderer.capture_blocking(&gpu.device, &gpu.queue)?)
    }

    /// Goes on for as many passes as `milliseconds` hold.
    pub fn go_on(&mut self, gpu: &Gpu, budget_ms: f64) -> Result<Capture, Failure> {
        let (mut capture, mut spent) = (self.capture(gpu)?, 0.0);
        loop {
            let start = Instant::now();
            let report =
                self.renderer.render_to_completion(&gpu.device, &gpu.queue, |_, _| false)?;
            spent += milliseconds(start);
            if spent > budget_ms {
                return Ok(capture);
            }
            capture = self.capture(gpu)?;
            if report.complete() {
                return Ok(capture);
            }
        }
    }

    pub fn finish(&mut self, gpu: &Gpu) -> Result<Capture, Failure> {
        self.renderer.render_to_completion(&gpu.device, &gpu.queue, |_, _| true)?;
        self.capture(gpu)
    }
}

pub fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
