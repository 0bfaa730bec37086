//! Renderers that fill in different ways and do everything else alike.

use std::path::Path;
use std::time::Instant;

use progressive_iso::{
    Camera, Capture, CompressedVolume, Frame, FrameOptions, Infill, InfillOptions, InfillSources,
    InfillWeights, Outputs, PassReport, PixelStatus, ProgressiveIsoRenderer, RendererOptions,
    Residency, Shading, TraversalStrategy,
};

use crate::support::{Failure, Gpu};

const BUDGET_BYTES: u64 = 512 << 20;

/// The published renderer's colours, for which its network was trained, over a background that alpha tells from the
/// surface.
pub fn shading() -> Shading {
    Shading {
        base_color: [0.3, 0.3, 0.9],
        ambient: 0.2,
        diffuse: 0.6,
        specular: 0.1,
        shininess: 5.0,
        background: [1.0, 1.0, 1.0, 0.0],
        unfinished: [1.0, 0.0, 0.0, 0.0],
        ..Shading::default()
    }
}

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
            shading: shading(),
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

/// A picture of colours from 0 to 1 and which pixels show rather surface than background.
#[derive(Clone)]
pub struct Shown {
    pub colors: Vec<[f32; 3]>,
    /// None where colours alone are known.
    pub surface: Option<Vec<bool>>,
}

impl Shown {
    /// From red, green, blue and a word more of every pixel, f32, as the published network has them.
    pub fn from_words(words: &[u32]) -> Self {
        let color = |p: &[u32]| [p[0], p[1], p[2]].map(|v| f32::from_bits(v).clamp(0.0, 1.0));
        Self { colors: words.chunks_exact(4).map(color).collect(), surface: None }
    }
}

impl From<&Capture> for Shown {
    fn from(capture: &Capture) -> Self {
        let pixels = || capture.color.chunks_exact(4);
        let color = |p: &[u8]| [p[0], p[1], p[2]].map(|v| f32::from(v) / 255.0);
        Self {
            colors: pixels().map(color).collect(),
            surface: Some(pixels().map(|p| p[3] >= 128).collect()),
        }
    }
}

/// Which pixels are unfinished.
pub fn holes(capture: &Capture) -> Vec<bool> {
    let status = capture.status.as_deref().unwrap_or_default();
    status.iter().map(|status| *status == PixelStatus::Unfinished).collect()
}

/// Every hole as the nearest finished pixel.
pub fn nearest(shown: &Shown, holes: &[bool], size: [u32; 2]) -> Shown {
    let mut filled = shown.clone();
    let [width, height] = size.map(|s| s as i32);
    let reach = width.max(height);
    for hole in (0..holes.len()).filter(|&i| holes[i]) {
        let (x, y) = (hole as i32 % width, hole as i32 / width);
        let mut best: Option<(i32, usize)> = None;
        for radius in 1..reach {
            // Nothing farther out is nearer.
            if best.is_some_and(|(square, _)| square <= radius * radius) {
                break;
            }
            for (dx, dy) in ring(radius) {
                let (x, y) = (x + dx, y + dy);
                let inside = x >= 0 && y >= 0 && x < width && y < height;
                let pixel = (x + width * y) as usize;
                let square = dx * dx + dy * dy;
                if inside && !holes[pixel] && best.is_none_or(|(least, _)| square < least) {
                    best = Some((square, pixel));
                }
            }
        }
        if let Some((_, pixel)) = best {
            filled.colors[hole] = shown.colors[pixel];
            if let (Some(surface), Some(known)) = (&mut filled.surface, &shown.surface) {
                surface[hole] = known[pixel];
            }
        }
    }
    filled
}

/// Offsets on the edge of a square.
fn ring(radius: i32) -> impl Iterator<Item = (i32, i32)> {
    (-radius..=radius).flat_map(move |i| [(i, -radius), (i, radius), (-radius, i), (radius, i)])
}
