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
use crate::sets::{LEAST_SLOTS, Memory, Setting};
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

/// A curve that is being measured.
pub struct Candidate<'a> {
    scene: &'a Scene,
    volume: CompressedVolume,
    options: RendererOptions,
    curve: Curve,
    /// Times of runs, as many passes in each.
    times: Vec<Times>,
}

/// When a run was where.
#[derive(Clone)]
struct Times {
    setup_ms: f64,
    /// After every pass.
    pass_ms: Vec<f64>,
}

/// The picture after a pass.
struct Seen {
    report: PassReport,
    capture: Capture,
}

/// A frame from nothing to the finished picture.
struct Run {
    times: Times,
    /// Of some passes, in order; none where nobody looked.
    seen: Vec<Seen>,
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

    /// Looks at the pictures of a setting; `references`: the f64 renderer on uncompressed and on decoded
    /// samples.
    pub fn candidate<'a>(
        &mut self,
        volume: &Volume,
        scene: &'a Scene,
        stream: &ZfpVolume,
        setting: Setting,
        [truth, reference]: [&Picture; 2],
    ) -> Result<Candidate<'a>, Failure> {
        let compressed = volume.placed(stream)?;
        let limits = Gpu::open(&self.adapters)?.device.limits();
        let options = options(&compressed, scene.size, setting, &limits)?;
        let plan = ScenePlan::new(&compressed, &options, &limits)?;
        if self.warm.insert(format!("{setting:?} {}", plan.slots().div_ceil(1 << 19))) {
            self.run(&compressed, scene, &options, false)?;
        }
        let run = self.run(&compressed, scene, &options, true)?;
        let last = run.seen.last().ok_or("the frame has no picture")?;
        let finished = scene.shown(&last.capture)?;
        let curve = Curve {
            volume: volume.name.clone(),
            view: scene.position,
            strategy: setting.strategy_name(),
            rate: stream.rate(),
            size: scene.size,
            residency: setting.memory,
            budget_bytes: options.budget_bytes,
            slots: plan.slots(),
            passes: last.report.pass,
            setup_ms: run.times.setup_ms,
            arithmetic: finished.errors(reference),
            compression: reference.errors(truth),
            points: points(scene, &run, truth, &finished)?,
        };
        Ok(Candidate { scene, volume: compressed, options, curve, times: vec![run.times] })
    }

    /// Takes the times of a candidate once more.
    pub fn repeat(&self, candidate: &mut Candidate<'_>) -> Result<(), Failure> {
        let Candidate { scene, volume, options, times, .. } = candidate;
        let run = self.run(volume, scene, options, false)?;
        if run.times.pass_ms.len() == times[0].pass_ms.len() {
            times.push(run.times);
        }
        Ok(())
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
        let mut times = Times { setup_ms: clock.ms(), pass_ms: Vec::new() };
        renderer.set_frame(&scene.frame)?;
        let (mut seen, mut next, mut failure) = (Vec::new(), 1, None);
        renderer.render_to_completion(&device, &queue, |renderer, report| {
            if report.pass == 0 {
                return true;
            }
            times.pass_ms.push(clock.ms());
            if look && (report.pass >= next || report.complete()) {
                next = report.pass + 1 + report.pass.saturating_sub(EVERY_PASS) / 10;
                match clock.pause(|| renderer.capture_blocking(&device, &queue)) {
                    Ok(capture) => seen.push(Seen { report: *report, capture }),
                    Err(error) => failure = Some(error),
                }
            }
            failure.is_none()
        })?;
        match failure {
            Some(error) => Err(error.into()),
            None => Ok(Run { times, seen }),
        }
    }
}

impl Candidate<'_> {
    /// The curve with the times of the run of median length.
    pub fn finish(mut self) -> Curve {
        let length = |times: &Times| times.pass_ms.last().copied().unwrap_or_default();
        self.times.sort_by(|a, b| length(a).total_cmp(&length(b)));
        let times = &self.times[self.times.len() / 2];
        self.curve.setup_ms = times.setup_ms;
        for point in &mut self.curve.points {
            point.ms = times.pass_ms[point.pass as usize - 1];
        }
        self.curve
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

/// The pictures that were looked at.
fn points(
    scene: &Scene,
    run: &Run,
    truth: &Picture,
    finished: &Picture,
) -> Result<Vec<Point>, Failure> {
    let point = |Seen { report, capture }: &Seen| {
        let shown = scene.shown(capture)?;
        Ok(Point {
            pass: report.pass,
            ms: run.times.pass_ms[report.pass as usize - 1],
            completeness: report.completeness(),
            open_depth_voxels: report.open_depth_voxels,
            errors: shown.errors(truth),
            against_finished: shown.errors(finished),
            on_front: false,
        })
    };
    run.seen.iter().map(point).collect()
}
