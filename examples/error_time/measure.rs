//! Renders the curves and takes the times.

use std::collections::HashSet;
use std::time::{Duration, Instant};

use gpu_testkit::picture::Picture;
use progressive_iso::{
    Capture, CompressedVolume, Error, Outputs, PassReport, ProgressiveIsoRenderer, RendererOptions,
    Residency, ScenePlan, wgpu,
};
use volume_io::ZfpVolume;

use crate::curve::{Curve, Point};
use crate::sets::{Case, LEAST_SLOTS, Memory, Setting};
use crate::support::{Failure, Gpu, matching_adapters};
use crate::volume::{Scene, Volume};

/// More than any cache and any volume here needs.
const AMPLE_BYTES: u64 = 2 << 30;

/// Steps in which the smallest budget is looked for: 60 slots.
const BUDGET_STEP_BYTES: u64 = 16 << 10;

/// Every pass up to this one has its picture looked at; of later ones, every one that is a tenth later
/// than the last one looked at.
const EVERY_PASS: u32 = 12;

/// Makes devices and renderers.
pub struct Bench {
    adapters: Vec<wgpu::Adapter>,
    /// Settings whose shaders the driver has compiled before.
    warm: HashSet<String>,
}

/// A pass of a run.
struct Seen {
    report: PassReport,
    ms: f64,
    /// Where it is looked at.
    capture: Option<Capture>,
}

/// A frame from nothing to the finished picture.
struct Run {
    setup_ms: f64,
    passes: Vec<Seen>,
}

/// A clock that does not run while pictures are read back.
struct Clock {
    begin: Instant,
    paused: Duration,
}

impl Clock {
    fn start() -> Self {
        Self { begin: Instant::now(), paused: Duration::ZERO }
    }

    fn ms(&self) -> f64 {
        (self.begin.elapsed() - self.paused).as_secs_f64() * 1e3
    }

    fn pause<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let begin = Instant::now();
        let result = work();
        self.paused += begin.elapsed();
        result
    }
}

impl Bench {
    pub fn new(adapter: Option<&str>) -> Result<Self, Failure> {
        Ok(Self { adapters: matching_adapters(adapter)?, warm: HashSet::new() })
    }

    /// Name of the adapter.
    pub fn adapter(&self) -> Result<String, Failure> {
        Ok(Gpu::open(&self.adapters)?.name())
    }

    /// Measures a setting; `references`: the f64 renderer on uncompressed and on decoded samples.
    pub fn curve(
        &mut self,
        case: &Case,
        volume: &Volume,
        scene: &Scene,
        stream: &ZfpVolume,
        setting: Setting,
        [truth, reference]: [&Picture; 2],
    ) -> Result<Curve, Failure> {
        let compressed = volume.placed(stream)?;
        let limits = Gpu::open(&self.adapters)?.device.limits();
        let options = options(&compressed, scene.size, setting, &limits)?;
        let plan = ScenePlan::new(&compressed, &options, &limits)?;
        if self.warm.insert(format!("{setting:?} {}", plan.slots().div_ceil(1 << 19))) {
            self.run(&compressed, scene, &options, false)?;
        }
        let looked_at = self.run(&compressed, scene, &options, true)?;
        let mut runs = vec![looked_at];
        for _ in 1..case.runs {
            runs.push(self.run(&compressed, scene, &options, false)?);
        }
        let (setup_ms, times) = median_run(&runs);
        let points = points(scene, &runs[0], &times, truth)?;
        let finished = finished(scene, &runs[0])?;
        Ok(Curve {
            volume: case.subject.name(),
            view: scene.position,
            strategy: setting.strategy_name(),
            rate: stream.rate(),
            size: scene.size,
            residency: setting.memory,
            budget_bytes: options.budget_bytes,
            slots: plan.slots(),
            passes: runs[0].passes.len() as u32,
            setup_ms,
            arithmetic: finished.errors(reference),
            compression: reference.errors(truth),
            points,
        })
    }

    /// Renders the frame with a renderer of its own, on a device of its own.
    fn run(
        &self,
        volume: &CompressedVolume,
        scene: &Scene,
        options: &RendererOptions,
        look: bool,
    ) -> Result<Run, Failure> {
        let Gpu { device, queue, .. } = Gpu::open(&self.adapters)?;
        let mut clock = Clock::start();
        let mut renderer = ProgressiveIsoRenderer::new(&device, &queue, volume.clone(), *options)?;
        let setup_ms = clock.ms();
        renderer.set_frame(&scene.frame)?;
        let (mut passes, mut next, mut failure) = (Vec::new(), 1, None);
        renderer.render_to_completion(&device, &queue, |renderer, report| {
            if report.pass == 0 {
                return true;
            }
            let ms = clock.ms();
            let mut capture = None;
            if look && (report.pass >= next || report.complete()) {
                next = report.pass + 1 + report.pass.saturating_sub(EVERY_PASS) / 10;
                match clock.pause(|| renderer.capture_blocking(&device, &queue)) {
                    Ok(picture) => capture = Some(picture),
                    Err(error) => failure = Some(error),
                }
            }
            passes.push(Seen { report: *report, ms, capture });
            failure.is_none()
        })?;
        match failure {
            Some(error) => Err(error.into()),
            None => Ok(Run { setup_ms, passes }),
        }
    }
}

/// The options of a setting's renderer.
fn options(
    volume: &CompressedVolume,
    size: [u32; 2],
    setting: Setting,
    limits: &wgpu::Limits,
) -> Result<RendererOptions, Failure> {
    let residency = match setting.memory {
        Memory::Full => Residency::Full,
        Memory::Cached | Memory::Smallest => Residency::Cached,
    };
    let options = RendererOptions {
        size,
        budget_bytes: AMPLE_BYTES,
        outputs: Outputs { depth: true, normal: true, status: true },
        capture: true,
        strategy: setting.strategy,
        residency,
        ..Default::default()
    };
    match setting.memory {
        Memory::Smallest => smallest(volume, options, limits),
        _ => Ok(options),
    }
}

/// The options with the smallest budget.
fn smallest(
    volume: &CompressedVolume,
    options: RendererOptions,
    limits: &wgpu::Limits,
) -> Result<RendererOptions, Failure> {
    let mut smallest = RendererOptions { budget_bytes: 0, ..options };
    loop {
        match ScenePlan::new(volume, &smallest, limits) {
            Err(Error::BudgetTooSmall { minimum, .. }) => smallest.budget_bytes = minimum,
            Err(error) => return Err(error.into()),
            Ok(plan) if plan.slots() < LEAST_SLOTS.min(volume.layout().block_count()) => {
                smallest.budget_bytes += BUDGET_STEP_BYTES;
            }
            Ok(_) => return Ok(smallest),
        }
    }
}

/// Set-up and times of the passes of the run of median length among those with as many passes as the
/// first one.
fn median_run(runs: &[Run]) -> (f64, Vec<f64>) {
    let mut same: Vec<&Run> =
        runs.iter().filter(|run| run.passes.len() == runs[0].passes.len()).collect();
    let length = |run: &Run| run.passes.last().map_or(0.0, |seen| seen.ms);
    same.sort_by(|a, b| length(a).total_cmp(&length(b)));
    let run = same[same.len() / 2];
    (run.setup_ms, run.passes.iter().map(|seen| seen.ms).collect())
}

fn finished(scene: &Scene, run: &Run) -> Result<Picture, Failure> {
    let capture = run.passes.last().and_then(|seen| seen.capture.as_ref());
    scene.shown(capture.ok_or("the frame has no finished picture")?)
}

/// The passes whose pictures were looked at.
fn points(scene: &Scene, run: &Run, times: &[f64], truth: &Picture) -> Result<Vec<Point>, Failure> {
    let finished = finished(scene, run)?;
    let mut points = Vec::new();
    for (seen, &ms) in run.passes.iter().zip(times) {
        let Some(capture) = &seen.capture else { continue };
        let shown = scene.shown(capture)?;
        points.push(Point {
            pass: seen.report.pass,
            ms,
            completeness: seen.report.completeness(),
            open_depth_voxels: seen.report.open_depth_voxels,
            errors: shown.errors(truth),
            against_finished: shown.errors(&finished),
            on_front: false,
        });
    }
    Ok(points)
}
