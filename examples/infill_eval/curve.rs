//! How good the picture is after how long, with and without in-fill.

use std::path::Path;
use std::time::{Duration, Instant};

use gpu_testkit::image::psnr;
use progressive_iso::{
    BlockSortedOptions, Camera, Completeness, CompressedVolume, Frame, FrameOptions, Infill,
    InfillWeights, TraversalStrategy,
};
use serde::Serialize;

use crate::contender::{Contender, Way};
use crate::support::plot::{Axis, Lines, Scale, Series};
use crate::support::shown::{Shown, published_shading};
use crate::support::subject::{Subject, stream};
use crate::support::{Failure, Gpu, Table, write_file};

/// Finished share of the rays that is enough.
const STOP_AT: f32 = 0.85;
/// The run of median length counts.
const RUNS: usize = 3;
/// Azimuth and elevation of the camera in degrees, and its vertical field of view.
const VIEW_DEGREES: [f64; 3] = [20.0, 15.0, 40.0];
/// What an error of zero is drawn as, on a logarithmic axis.
const LEAST_RMS: f64 = 0.01;

const STRATEGIES: [(&str, TraversalStrategy); 2] = [
    ("run-ahead", TraversalStrategy::RunAhead),
    (
        "block-sorted",
        TraversalStrategy::BlockSorted(BlockSortedOptions { start_factor: 1, speculation: true }),
    ),
];

/// A frame from an empty cache.
#[derive(Clone, Debug, Serialize)]
pub struct Curve {
    pub volume: String,
    pub strategy: &'static str,
    pub method: &'static str,
    pub size: [u32; 2],
    pub points: Vec<Point>,
}

/// The picture after a pass.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Point {
    pub pass: u32,
    /// Wall time since the frame was set.
    pub ms: f64,
    /// Finished share of the rays that enter the volume.
    pub completeness: f64,
    pub stopped: bool,
    pub filled_pixels: u32,
    /// Against the finished picture; null where they are equal.
    pub psnr: Option<f64>,
}

impl Curve {
    /// When the picture was complete enough, and filled if this method fills.
    fn useful(&self) -> Option<&Point> {
        self.points.iter().find(|point| point.stopped)
    }

    fn finished_ms(&self) -> f64 {
        self.points.last().map_or(f64::NAN, |point| point.ms)
    }
}

/// All strategies and ways for one volume; `plots` go to `out`.
pub fn measure(
    gpu: &Gpu,
    subject: &Subject,
    size: [u32; 2],
    ways: &[Way],
    weights: &'static InfillWeights,
    out: &Path,
) -> Result<Vec<Curve>, Failure> {
    let (stream, isovalue) = stream(subject)?;
    let volume = CompressedVolume::try_from(&stream)?;
    let mut curves = Vec::new();
    for (strategy_name, strategy) in STRATEGIES {
        for way in ways {
            let mut contender = Contender::new(gpu, &volume, size, *way, weights, strategy)?;
            let frame = frame(&volume, size, isovalue, way.infill);
            // The first one also loads the volume and warms the driver.
            run(gpu, &mut contender, &frame)?;
            let mut runs = (0..RUNS)
                .map(|_| run(gpu, &mut contender, &frame))
                .collect::<Result<Vec<_>, _>>()?;
            let length = |run: &Vec<Point>| run.last().map_or(0.0, |point| point.ms);
            runs.sort_by(|a, b| length(a).total_cmp(&length(b)));
            curves.push(Curve {
                volume: subject.name(),
                strategy: strategy_name,
                method: way.name,
                size,
                points: runs.swap_remove(RUNS / 2),
            });
        }
        let own = &curves[curves.len() - ways.len()..];
        let name = format!("curve-{}-{strategy_name}.svg", subject.name());
        write_file(&out.join(name), chart(own).svg().as_bytes())?;
    }
    Ok(curves)
}

fn frame(volume: &CompressedVolume, size: [u32; 2], isovalue: f32, infill: Infill) -> Frame {
    let (center, radius) = volume.bounding_ball();
    let aspect = f64::from(size[0]) / f64::from(size[1]);
    let [azimuth, elevation, fov] = VIEW_DEGREES;
    let options = FrameOptions {
        shading: published_shading(),
        rounds_per_pass: 1,
        pass_ms: f32::INFINITY,
        infill,
        stop_at: Some(Completeness(STOP_AT)),
        ..Default::default()
    };
    Frame {
        camera: Camera::orbit(center, radius, azimuth, elevation, fov, aspect),
        isovalues: vec![isovalue],
        options,
    }
}

/// A frame from an empty cache to its end; the clock stands still while pictures are read back.
fn run(gpu: &Gpu, contender: &mut Contender, frame: &Frame) -> Result<Vec<Point>, Failure> {
    let renderer = &mut contender.renderer;
    renderer.clear_cache();
    let (begin, mut paused) = (Instant::now(), Duration::ZERO);
    renderer.set_frame(frame)?;
    let (mut points, mut pictures, mut failure) = (Vec::new(), Vec::new(), None);
    renderer.render_to_completion(&gpu.device, &gpu.queue, |renderer, report| {
        if report.pass == 0 {
            return true;
        }
        let now = Instant::now();
        points.push(Point {
            pass: report.pass,
            ms: (now - begin - paused).as_secs_f64() * 1e3,
            completeness: report.completeness(),
            stopped: report.stopped(),
            filled_pixels: report.filled_pixels,
            psnr: None,
        });
        match renderer.capture_blocking(&gpu.device, &gpu.queue) {
            Ok(capture) => pictures.push(Shown::from(&capture)),
            Err(error) => failure = Some(error),
        }
        paused += now.elapsed();
        failure.is_none()
    })?;
    if let Some(error) = failure {
        return Err(error.into());
    }
    let finished = pictures.last().ok_or("a frame without passes")?;
    for (point, picture) in points.iter_mut().zip(&pictures) {
        let (shown, truth) = (picture.colors.as_flattened(), finished.colors.as_flattened());
        point.psnr = Some(psnr(shown, truth, 1.0)).filter(|psnr| psnr.is_finite());
    }
    Ok(points)
}

fn chart(curves: &[Curve]) -> Lines {
    let rms = |point: &Point| {
        point.psnr.map_or(LEAST_RMS, |psnr| (255.0 * 10f64.powf(-psnr / 20.0)).max(LEAST_RMS))
    };
    let places = |curve: &Curve| curve.points.iter().map(|p| [p.ms, rms(p)]).collect();
    let series: Vec<Series> = curves
        .iter()
        .map(|curve| Series { label: curve.method.into(), points: places(curve), steps: false })
        .collect();
    let all = || series.iter().flat_map(|series| &series.points);
    let title = curves.first().map_or(String::new(), |curve| {
        let [width, height] = curve.size;
        format!("{}, {}, {width}x{height}, empty cache", curve.volume, curve.strategy)
    });
    Lines {
        title,
        x_label: "ms since the frame was set".into(),
        y_label: "colour: rms error in 255ths (none: 0.01)".into(),
        x: Axis::around(Scale::Log, all().map(|p| p[0])),
        y: Axis::around(Scale::Log, all().map(|p| p[1])),
        x_ticks: Vec::new(),
        series,
    }
}

/// When pictures are useful, against the finished picture of the renderer that does not fill.
pub fn table(curves: &[Curve]) -> String {
    let title =
        format!("Time to {:.0} % of the rays, filled, from an empty cache", 100.0 * STOP_AT);
    let heads = [
        "volume",
        "strategy",
        "method",
        "complete, %",
        "PSNR",
        "ms",
        "finished frame, ms",
        "times faster",
    ];
    let mut table = Table::new(&title, &heads, 3);
    for curve in curves {
        let plain = curves.iter().find(|other| {
            let same = other.volume == curve.volume && other.strategy == curve.strategy;
            same && other.method == "unfinished"
        });
        let (Some(useful), Some(plain)) = (curve.useful(), plain) else { continue };
        table.line(&[
            curve.volume.clone(),
            curve.strategy.into(),
            curve.method.into(),
            format!("{:.1}", 100.0 * useful.completeness),
            useful.psnr.map_or("equal".into(), |psnr| format!("{psnr:.1}")),
            format!("{:.0}", useful.ms),
            format!("{:.0}", plain.finished_ms()),
            format!("{:.2}", plain.finished_ms() / useful.ms),
        ]);
    }
    table.finish()
}
