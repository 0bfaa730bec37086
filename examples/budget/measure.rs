//! The modes, frame by frame in turn.

use std::time::Instant;

use progressive_iso::{
    BudgetMode, Capture, CompressedVolume, Frame, FrameOptions, Infill, InfillOptions,
    InfillSources, ProgressiveIsoRenderer, RendererOptions,
};
use serde::Serialize;

use crate::sequence::View;
use crate::support::{Failure, Gpu, median};

const BUDGET_BYTES: u64 = 1 << 30;
/// Every so many frames what is shown is compared with the finished picture.
const COMPARED_EVERY: usize = 3;
/// Frames after which predictions count.
const LEARNING_FRAMES: usize = 20;

pub const MODES: [(&str, BudgetMode); 4] = [
    ("no adaptation", BudgetMode::Fixed),
    ("last frame", BudgetMode::LastFrame),
    ("two pass", BudgetMode::TwoPass),
    ("predicted", BudgetMode::Predicted),
];

/// One frame in one mode.
#[derive(Clone, Copy, Debug)]
pub struct Shown {
    pub ms: f64,
    /// Finished share of the rays that enter the volume; those that a preview has no rays for are not.
    quality: f64,
    /// Pixels from one ray to the next in both directions.
    step: u32,
    /// Mean squared difference to the finished picture's colours, if it was measured.
    error: Option<f64>,
    predicted_ms: Option<f64>,
    budget_ms: f64,
}

/// A mode on a recording.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub volume: String,
    pub seconds: u32,
    pub mode: &'static str,
    pub target_ms: f64,
    pub frames: usize,
    /// Mean finished share of the rays that enter the volume; those that a preview has no rays for are not.
    pub quality: f64,
    /// Of the shown pictures against the finished ones, in dB: of the mean squared error over every third frame; null without any
    /// error.
    pub psnr: Option<f64>,
    /// Frames that have rays of every second and of every fourth pixel in both directions alone.
    pub previews: [usize; 2],
    pub rmse_ms: f64,
    pub frames_above: usize,
    /// Over all frames: what each took longer than the target, 0 for those that did not.
    pub excess_ms: f64,
    /// Over the frames above and below the target.
    pub rmse_above_ms: f64,
    pub rmse_below_ms: f64,
    pub largest_above_ms: f64,
    pub largest_below_ms: f64,
    /// Median relative error of predictions after the first 20 frames; null where nothing was predicted.
    pub prediction_error: Option<f64>,
    /// Pre-pass, prediction and learning: mean and most, CPU.
    pub budget_ms: f64,
    pub most_budget_ms: f64,
}

/// What is shown, and how.
#[derive(Clone, Copy)]
pub struct Show<'a> {
    pub volume: &'a CompressedVolume,
    pub isovalue: f32,
    pub size: [u32; 2],
    pub infill: Infill,
}

impl Show<'_> {
    fn frame(&self, view: &View, target_ms: f64) -> Frame {
        let options = FrameOptions {
            target_ms: Some(target_ms as f32),
            infill: self.infill,
            pass_ms: f32::INFINITY,
            ..Default::default()
        };
        Frame {
            camera: view.camera(self.volume, self.size),
            isovalues: vec![self.isovalue * view.isovalue as f32],
            options,
        }
    }
}

fn renderer(
    gpu: &Gpu,
    show: &Show<'_>,
    mode: BudgetMode,
) -> Result<ProgressiveIsoRenderer, Failure> {
    let sources = InfillSources { neighbours: true, coarse_field: false, history: false };
    let options = RendererOptions {
        size: show.size,
        budget_bytes: BUDGET_BYTES,
        infill: Some(InfillOptions { sources, ..Default::default() }),
        budget: Some(mode),
        capture: true,
        ..Default::default()
    };
    let mut renderer =
        ProgressiveIsoRenderer::new(&gpu.device, &gpu.queue, show.volume.clone(), options)?;
    let view = crate::sequence::record(1, 0)[0];
    // Loads the volume and warms the driver.
    let empty = Show { isovalue: 1e-3, ..*show };
    for _ in 0..2 {
        renderer.set_frame(&empty.frame(&view, 1e6))?;
        renderer.render_to_completion(&gpu.device, &gpu.queue, |_, _| true)?;
    }
    Ok(renderer)
}

/// What is shown of a frame while a user interacts: its first pass, or two.
fn show(
    gpu: &Gpu,
    renderer: &mut ProgressiveIsoRenderer,
    frame: &Frame,
    passes: u32,
) -> Result<Shown, Failure> {
    renderer.set_frame(frame)?;
    let (mut ms, mut report) = (0.0, renderer.poll_report());
    for _ in 0..passes {
        let begin = Instant::now();
        renderer.render_pass(&gpu.device, &gpu.queue)?;
        // Nothing else may be on its way: it would take time from the next mode's frame.
        gpu.run(|_| {})?;
        report = renderer.poll_report();
        ms += report.gpu_ms.unwrap_or(begin.elapsed().as_secs_f64() * 1e3);
        if report.complete() {
            break;
        }
    }
    Ok(Shown {
        ms,
        quality: report.completeness(),
        step: report.step,
        error: None,
        predicted_ms: report.predicted_ms,
        budget_ms: report.budget_ms,
    })
}

/// Shows a recording in all modes; the frames of each, and the target.
pub fn run(
    adapter: Option<&str>,
    scene: &Show<'_>,
    views: &[View],
    target_ms: Option<f64>,
) -> Result<(Vec<Vec<Shown>>, f64), Failure> {
    // Each has a device of its own: some drivers keep a limited number of compiled shaders for each.
    let of = |(_, mode): &(_, BudgetMode)| {
        let gpu = Gpu::new(adapter)?;
        let renderer = renderer(&gpu, scene, *mode)?;
        Ok((gpu, renderer))
    };
    let mut renderers = MODES.iter().map(of).collect::<Result<Vec<_>, Failure>>()?;
    let target_ms = match target_ms {
        Some(target_ms) => target_ms,
        None => {
            // On a renderer of its own, so that all modes start with nothing decoded.
            let (gpu, mut renderer) = of(&MODES[0])?;
            let full = views
                .iter()
                .map(|view| Ok(show(&gpu, &mut renderer, &scene.frame(view, 1e6), 1)?.ms));
            0.5 * median(full.collect::<Result<Vec<_>, Failure>>()?.into_iter())
        }
    };
    let mut shown = vec![Vec::new(); MODES.len()];
    for view in views {
        let frame = scene.frame(view, target_ms);
        for (((gpu, renderer), shown), (_, mode)) in renderers.iter_mut().zip(&mut shown).zip(MODES)
        {
            let passes = if mode == BudgetMode::TwoPass { 2 } else { 1 };
            shown.push(show(gpu, renderer, &frame, passes)?);
        }
        if shown[0].len() % COMPARED_EVERY == 0 {
            compare(&renderers, &mut shown)?;
        }
    }
    Ok((shown, target_ms))
}

/// Shows a recording `runs` times; of every mode's frames the medians, and the target.
pub fn run_often(
    adapter: Option<&str>,
    scene: &Show<'_>,
    views: &[View],
    target_ms: Option<f64>,
    runs: u32,
) -> Result<(Vec<Vec<Shown>>, f64), Failure> {
    let (first, target_ms) = run(adapter, scene, views, target_ms)?;
    let mut all = vec![first];
    for _ in 1..runs {
        all.push(run(adapter, scene, views, Some(target_ms))?.0);
    }
    let of = |mode: usize, frame: usize| {
        Shown::median(&all.iter().map(|run| run[mode][frame]).collect::<Vec<_>>())
    };
    let mode = |mode: usize| (0..views.len()).map(|frame| of(mode, frame)).collect();
    Ok(((0..MODES.len()).map(mode).collect(), target_ms))
}

impl Shown {
    /// Of the same frame in several runs; as it is if there is one.
    fn median(runs: &[Self]) -> Self {
        let of = |value: fn(&Self) -> f64| median(runs.iter().map(value));
        let ms = of(|shown| shown.ms);
        let ratios = || runs.iter().filter_map(|shown| Some(shown.predicted_ms? / shown.ms));
        let errors = || runs.iter().filter_map(|shown| shown.error);
        Self {
            ms,
            quality: of(|shown| shown.quality),
            step: runs[0].step,
            error: (errors().count() > 0).then(|| median(errors())),
            // As far from the time as predictions are in the median.
            predicted_ms: (ratios().count() > 0).then(|| ms * median(ratios())),
            budget_ms: of(|shown| shown.budget_ms),
        }
    }
}

/// Compares what is shown with the finished picture, which the first mode shows.
fn compare(
    renderers: &[(Gpu, ProgressiveIsoRenderer)],
    shown: &mut [Vec<Shown>],
) -> Result<(), Failure> {
    let mut finished: Option<Capture> = None;
    for ((gpu, renderer), shown) in renderers.iter().zip(shown) {
        let picture = renderer.capture_blocking(&gpu.device, &gpu.queue)?;
        let error = mean_squared_error(finished.as_ref().unwrap_or(&picture), &picture);
        if let Some(newest) = shown.last_mut() {
            newest.error = Some(error);
        }
        finished.get_or_insert(picture);
    }
    Ok(())
}

/// Of the colours without alpha, 0 to 255.
fn mean_squared_error(a: &Capture, b: &Capture) -> f64 {
    let pixels = a.color.chunks_exact(4).zip(b.color.chunks_exact(4));
    let squares =
        pixels.flat_map(|(a, b)| (0..3).map(|i| (f64::from(a[i]) - f64::from(b[i])).powi(2)));
    squares.sum::<f64>() / (3 * a.color.len() / 4).max(1) as f64
}

impl Row {
    pub fn new(
        volume: String,
        seconds: u32,
        mode: &'static str,
        shown: &[Shown],
        target_ms: f64,
    ) -> Self {
        let errors = || shown.iter().map(|shown| shown.ms - target_ms);
        let rms = |errors: Vec<f64>| {
            let count = errors.len().max(1) as f64;
            (errors.iter().fold(0.0, |sum, error| sum + error * error) / count).sqrt()
        };
        let mean = |value: fn(&Shown) -> f64| {
            shown.iter().map(value).sum::<f64>() / shown.len().max(1) as f64
        };
        let predictions: Vec<f64> = shown
            .iter()
            .skip(LEARNING_FRAMES)
            .filter_map(|shown| Some((shown.predicted_ms? - shown.ms).abs() / shown.ms))
            .collect();
        Self {
            volume,
            seconds,
            mode,
            target_ms,
            frames: shown.len(),
            quality: mean(|shown| shown.quality),
            psnr: {
                let errors: Vec<f64> = shown.iter().filter_map(|shown| shown.error).collect();
                let error = errors.iter().sum::<f64>() / errors.len().max(1) as f64;
                (error > 0.0).then(|| 10.0 * (255.0 * 255.0 / error).log10())
            },
            previews: [2, 4].map(|step| shown.iter().filter(|shown| shown.step == step).count()),
            rmse_ms: rms(errors().collect()),
            frames_above: errors().filter(|e| *e > 0.0).count(),
            excess_ms: rms(errors().map(|e| e.max(0.0)).collect()),
            rmse_above_ms: rms(errors().filter(|e| *e > 0.0).collect()),
            rmse_below_ms: rms(errors().filter(|e| *e <= 0.0).collect()),
            largest_above_ms: errors().fold(0.0, f64::max),
            largest_below_ms: errors().fold(0.0, f64::min).abs(),
            prediction_error: (!predictions.is_empty()).then(|| median(predictions.into_iter())),
            budget_ms: mean(|shown| shown.budget_ms),
            most_budget_ms: shown.iter().map(|shown| shown.budget_ms).fold(0.0, f64::max),
        }
    }
}
