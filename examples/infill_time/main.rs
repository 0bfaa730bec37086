//! GPU time of in-fill by stage:
//! `cargo run --release --features wgpu-profiler[,published-network] --example infill_time -- [--published W.safetensors]
//! --out DIR`.
//!
//! A view of turbulence orbits by one degree a frame, from an empty cache each, BlockSorted, one round a pass. Every pass
//! of the third frame that leaves holes is filled; `infill_time.json` has a row for each method and pass: medians over
//! the runs.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program")]
#![allow(unreachable_pub, reason = "the modules of a program")]

#[path = "../support/mod.rs"]
mod support;

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Parser;
use progressive_iso::{
    BlockSortedOptions, Camera, CompressedVolume, Frame, FrameOptions, Infill, InfillOptions,
    InfillWeights, Outputs, ProgressiveIsoRenderer, RendererOptions, Residency, TraversalStrategy,
};
use serde::Serialize;
use support::{Failure, Gpu, Origin, Table, median};

const EDGE: u32 = 192;
/// Bits per voxel.
const RATE: f64 = 8.0;
const BUDGET_BYTES: u64 = 512 << 20;
const FRAMES: u32 = 3;
/// Passes with fewer finished pixels are left out.
const LEAST_COMPLETENESS: f64 = 0.5;

/// Kernels, by the labels of their passes, as columns of the table.
const STAGES: [&str; 11] = [
    "scatter",
    "tiles",
    "push",
    "pull",
    "calibrate",
    "guess",
    "encode",
    "shrink",
    "quarters",
    "decode",
    "fill",
];

/// Measures the stages of in-fill.
#[derive(Parser)]
struct Arguments {
    /// Folder for `infill_time.json`.
    #[arg(long)]
    out: PathBuf,
    /// The published network's weights, converted by `infill/training/convert_published.py`.
    #[cfg(feature = "published-network")]
    #[arg(long)]
    published: Option<PathBuf>,
    /// Times that every frame is rendered; one more before them compiles the kernels.
    #[arg(long, default_value_t = 5)]
    runs: u32,
    /// Width and height of the pictures.
    #[arg(long, default_value = "1280x720", value_parser = support::picture_size)]
    size: [u32; 2],
    /// Part of an adapter's name.
    #[arg(long)]
    adapter: Option<String>,
}

/// A method and the completeness of the picture it filled, in pixels a million.
type Key = (&'static str, u64);

/// What one fill took.
#[derive(Default)]
struct Samples {
    holes: u32,
    /// By stage; one number for each run.
    ms: BTreeMap<String, Vec<f64>>,
}

/// Medians over the runs.
#[derive(Serialize)]
struct Row {
    method: &'static str,
    completeness_pixels: f64,
    holes: u32,
    stage_ms: BTreeMap<String, f64>,
    sum_ms: f64,
}

/// A report file.
#[derive(Serialize)]
struct File<'a> {
    #[serde(flatten)]
    origin: &'a Origin,
    size: [u32; 2],
    runs: u32,
    rows: &'a [Row],
}

/// The moving view of the volume.
struct Orbit {
    gpu: Gpu,
    renderer: ProgressiveIsoRenderer,
    isovalue: f32,
    size: [u32; 2],
    #[cfg(feature = "published-network")]
    published: Option<support::published::PublishedNetwork>,
}

impl Orbit {
    fn new(arguments: &Arguments) -> Result<Self, Failure> {
        let gpu = Gpu::new(arguments.adapter.as_deref())?;
        let dims = [EDGE; 3];
        let field = volumes::by_name("turbulence", dims)?;
        let volume = CompressedVolume::try_from(&volumes::generate(&*field, dims, RATE)?)?;
        let options = RendererOptions {
            size: arguments.size,
            budget_bytes: BUDGET_BYTES,
            infill: Some(InfillOptions {
                network: Some(InfillWeights::trained()),
                ..Default::default()
            }),
            outputs: Outputs { depth: true, normal: true, status: true },
            strategy: TraversalStrategy::BlockSorted(BlockSortedOptions::default()),
            residency: Residency::Cached,
            ..Default::default()
        };
        let renderer = ProgressiveIsoRenderer::new(&gpu.device, &gpu.queue, volume, options)?;
        #[cfg(feature = "published-network")]
        let published = match &arguments.published {
            Some(path) => Some(support::published::PublishedNetwork::new(
                &gpu,
                &renderer,
                arguments.size,
                path,
            )?),
            None => None,
        };
        Ok(Self {
            gpu,
            renderer,
            isovalue: field.suggested_isovalue() as f32,
            size: arguments.size,
            #[cfg(feature = "published-network")]
            published,
        })
    }

    fn frame(&self, number: u32, infill: Infill) -> Frame {
        let (center, radius) = self.renderer.volume().bounding_ball();
        let aspect = f64::from(self.size[0]) / f64::from(self.size[1]);
        let camera =
            Camera::orbit(center, 0.83 * radius, 30.0 + f64::from(number), 20.0, 50.0, aspect);
        let options = FrameOptions {
            rounds_per_pass: 1,
            pass_ms: f32::INFINITY,
            infill,
            ..Default::default()
        };
        Frame { camera, isovalues: vec![self.isovalue], options }
    }

    /// Renders the frames with a filler, and adds what the stages of the last one took.
    fn measure(
        &mut self,
        (method, infill): (&'static str, Infill),
        samples: &mut BTreeMap<Key, Samples>,
    ) -> Result<(), Failure> {
        for number in 0..FRAMES {
            let frame = self.frame(number, infill);
            self.renderer.clear_cache();
            self.renderer.set_frame(&frame)?;
            let mut scatter_ms = 0.0;
            let mut described = None;
            let (device, queue) = (&self.gpu.device, &self.gpu.queue);
            self.renderer.render_to_completion(device, queue, |renderer, report| {
                if number + 1 < FRAMES || described == Some(report.pass) {
                    return true;
                }
                described = Some(report.pass);
                let share = report.completeness_pixels();
                let key = (method, (share * 1e6) as u64);
                let mut ms: BTreeMap<_, _> = renderer
                    .stage_times()
                    .iter()
                    .filter_map(|stage| Some((stage.label.strip_prefix("infill.")?, stage.ms)))
                    .collect();
                // The previous frame's hits are placed once a frame, in its first pass.
                scatter_ms += ms.remove("scatter").unwrap_or(0.0);
                if report.pass > 0 && share >= LEAST_COMPLETENESS {
                    let own = samples.entry(key).or_default();
                    own.holes = report.filled_pixels;
                    for (stage, ms) in ms.into_iter().chain([("scatter", scatter_ms)]) {
                        own.ms.entry(stage.to_owned()).or_default().push(ms);
                    }
                }
                true
            })?;
        }
        Ok(())
    }

    /// Wall time of the published network on the picture as it is: its time does not depend on the holes.
    #[cfg(feature = "published-network")]
    fn measure_published(&self, samples: &mut BTreeMap<Key, Samples>) -> Result<(), Failure> {
        if let Some(published) = &self.published {
            published.clear(&self.gpu)?;
            let ms = published.fill(&self.gpu)?;
            let own = samples.entry(("published-network", 1_000_000)).or_default();
            own.ms.entry("fill".to_owned()).or_default().push(ms);
        }
        Ok(())
    }
}

impl Row {
    fn new((method, millionths): Key, samples: &Samples) -> Self {
        let stage_ms: BTreeMap<_, _> = samples
            .ms
            .iter()
            .map(|(stage, ms)| (stage.clone(), median(ms.iter().copied())))
            .collect();
        let sum_ms = stage_ms.values().sum();
        let completeness_pixels = millionths as f64 * 1e-6;
        Self { method, completeness_pixels, holes: samples.holes, stage_ms, sum_ms }
    }

    fn cells(&self) -> Vec<String> {
        let stage =
            |name: &&str| self.stage_ms.get(*name).map_or(String::new(), |ms| format!("{ms:.1}"));
        let mut cells = vec![
            self.method.to_owned(),
            format!("{:.1} %", 100.0 * self.completeness_pixels),
            self.holes.to_string(),
        ];
        cells.extend(STAGES.iter().map(stage));
        cells.push(format!("{:.1}", self.sum_ms));
        cells
    }
}

fn main() {
    support::main("infill_time", || run(&Arguments::parse()));
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    std::fs::create_dir_all(&arguments.out)?;
    let mut orbit = Orbit::new(arguments)?;
    let origin = Origin::new(orbit.gpu.name());
    println!("adapter  {}", orbit.gpu.name());
    let mut samples = BTreeMap::new();
    for run in 0..=arguments.runs {
        for method in [("classical", Infill::Classical), ("network", Infill::Network)] {
            orbit.measure(method, &mut samples)?;
        }
        #[cfg(feature = "published-network")]
        orbit.measure_published(&mut samples)?;
        if run == 0 {
            samples.clear();
        }
    }
    let rows: Vec<Row> = samples.iter().map(|(key, samples)| Row::new(*key, samples)).collect();
    let mut heads = vec!["method", "finished pixels", "holes"];
    heads.extend(STAGES);
    heads.push("sum");
    let mut table = Table::new("In-fill, GPU milliseconds", &heads, 1);
    rows.iter().for_each(|row| table.line(&row.cells()));
    println!("\n{}", table.finish());
    let file = File { origin: &origin, size: arguments.size, runs: arguments.runs, rows: &rows };
    support::write_json(&arguments.out, "infill_time.json", &file)
}
