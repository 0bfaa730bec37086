//! Frames held to a time, in all modes: `cargo run --release --example budget -- --set ci --out DIR`.
//!
//! Recorded interaction is shown frame by frame in every mode in turn. `budget.json` has a row for each volume,
//! recording and mode; the plots have the time of every frame.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program")]
#![allow(unreachable_pub, reason = "the modules of a program")]

mod measure;
#[path = "../stability/suite/random.rs"]
#[allow(dead_code, reason = "shared with the example `stability`")]
mod random;
mod sequence;
#[path = "../support/mod.rs"]
mod support;

use std::path::PathBuf;

use clap::{Parser, ValueEnum};
use measure::{MODES, Row, Show, Shown};
use progressive_iso::{CompressedVolume, Infill, wgpu};
use serde::Serialize;
use support::plot::{Axis, Lines, Scale, Series};
use support::subject::{BRAIN, Subject, cube, turbulence};
use support::{Failure, Gpu, Origin, Table};

/// Milliseconds that a frame should take on a GPU: 30 frames a second.
const GPU_TARGET_MS: f64 = 33.3;
/// Seed of the recordings.
const SEED: u64 = 12;

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Set {
    /// Three volumes, 10 seconds of interaction.
    Brief,
    /// The benchmark's volumes, 10 and 30 seconds.
    Ci,
    /// A tiny volume, for the test of the program.
    Test,
}

/// Measures how well frames keep to a time.
#[derive(Parser)]
struct Arguments {
    /// Folder for `budget.json`, `budget.md` and plots.
    #[arg(long)]
    out: PathBuf,
    #[arg(long, value_enum, default_value = "brief")]
    set: Set,
    /// Milliseconds that a frame should take; without, 33.3 on a GPU and half the median full frame's on a software
    /// adapter.
    #[arg(long)]
    target_ms: Option<f64>,
    /// Leaves the pixels without a ray as they are.
    #[arg(long)]
    no_infill: bool,
    /// Shows every recording so often, by renderers of their own each time: a frame's time is the median of its times, so that
    /// what other processes take from one of them does not count.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// Only volumes whose name contains this.
    #[arg(long)]
    volume: Option<String>,
    /// Part of an adapter's name.
    #[arg(long)]
    adapter: Option<String>,
}

impl Set {
    fn subjects(self) -> Vec<Subject> {
        let (shells, solid) = (cube("shells", 256, 2.0), cube("rough-solid", 256, 4.0));
        match self {
            Self::Brief => vec![BRAIN, turbulence(256), shells],
            Self::Ci => vec![
                BRAIN,
                cube("shells", 128, 2.0),
                shells,
                turbulence(128),
                turbulence(256),
                turbulence(512),
                cube("rough-solid", 128, 4.0),
                solid,
            ],
            Self::Test => vec![turbulence(48)],
        }
    }

    fn seconds(self) -> &'static [u32] {
        match self {
            Self::Brief => &[10],
            Self::Ci => &[10, 30],
            Self::Test => &[5],
        }
    }

    fn size(self) -> [u32; 2] {
        if self == Self::Test { [96, 64] } else { [1280, 720] }
    }
}

/// A report file.
#[derive(Serialize)]
struct File<'a> {
    #[serde(flatten)]
    origin: &'a Origin,
    size: [u32; 2],
    seed: u64,
    rows: &'a [Row],
}

fn main() {
    support::main("budget", || run(&Arguments::parse()));
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    std::fs::create_dir_all(&arguments.out)?;
    let adapter = arguments.adapter.as_deref();
    let gpu = Gpu::new(adapter)?;
    let name = gpu.name();
    println!("adapter  {name}");
    let is_software = gpu.info.device_type == wgpu::DeviceType::Cpu;
    let target_ms = arguments.target_ms.or((!is_software).then_some(GPU_TARGET_MS));
    let (origin, size) = (Origin::new(name), arguments.set.size());
    let wanted = arguments.volume.as_deref().unwrap_or_default();
    let mut rows: Vec<Row> = Vec::new();
    for subject in arguments.set.subjects().iter().filter(|s| s.name().contains(wanted)) {
        let (stream, isovalue) = support::subject::stream(subject)?;
        let volume = CompressedVolume::try_from(&stream)?;
        let infill = if arguments.no_infill { Infill::Off } else { Infill::Classical };
        let show = Show { volume: &volume, isovalue, size, infill };
        for &seconds in arguments.set.seconds() {
            let views = sequence::record(seconds, SEED);
            let (shown, target_ms) =
                measure::run_often(adapter, &show, &views, target_ms, arguments.runs)?;
            let name = format!("{}-{seconds}s", subject.name());
            let chart = chart(&name, &shown, target_ms);
            let path = arguments.out.join(format!("budget-{name}.svg"));
            support::write_file(&path, chart.svg().as_bytes())?;
            let row = |(shown, (mode, _)): (&Vec<Shown>, (&'static str, _))| {
                Row::new(subject.name(), seconds, mode, shown, target_ms)
            };
            rows.extend(shown.iter().zip(MODES).map(row));
        }
        let file = File { origin: &origin, size, seed: SEED, rows: &rows };
        support::write_json(&arguments.out, "budget.json", &file)?;
    }
    let text = table(&rows) + &summary(&rows);
    println!("\n{text}");
    support::write_file(&arguments.out.join("budget.md"), text.as_bytes())
}

/// The time of every frame.
fn chart(name: &str, shown: &[Vec<Shown>], target_ms: f64) -> Lines {
    let line = |(shown, (mode, _)): (&Vec<Shown>, (&str, _))| Series {
        label: mode.into(),
        points: shown.iter().enumerate().map(|(i, shown)| [i as f64, shown.ms]).collect(),
        steps: false,
    };
    let mut series: Vec<Series> = shown.iter().zip(MODES).map(line).collect();
    let frames = shown.iter().map(Vec::len).max().unwrap_or(1) as f64;
    let points = vec![[0.0, target_ms], [frames - 1.0, target_ms]];
    series.push(Series { label: "target".into(), points, steps: false });
    let times = series.iter().flat_map(|series| &series.points).map(|point| point[1]);
    Lines {
        title: format!("{name}: times of frames"),
        x_label: "frame".into(),
        y_label: "ms".into(),
        y: Axis::around(Scale::Linear, times),
        x: Axis::linear([0.0, frames]),
        x_ticks: Vec::new(),
        series,
    }
}

fn table(rows: &[Row]) -> String {
    let heads = [
        "volume",
        "mode",
        "s",
        "target",
        "quality",
        "PSNR",
        "previews",
        "frames above",
        "excess",
        "RMSE above",
        "RMSE below",
        "RMSE",
        "largest above",
        "largest below",
        "prediction error",
        "budget, CPU",
        "most",
    ];
    let mut table = Table::new("Frames held to a time, milliseconds", &heads, 2);
    for row in rows {
        let ms = |ms: f64| format!("{ms:.1}");
        table.line(&[
            row.volume.clone(),
            row.mode.into(),
            row.seconds.to_string(),
            ms(row.target_ms),
            format!("{:.2}", row.quality),
            row.psnr.map_or("-".into(), |psnr| format!("{psnr:.1}")),
            format!("{} + {}", row.previews[0], row.previews[1]),
            row.frames_above.to_string(),
            ms(row.excess_ms),
            ms(row.rmse_above_ms),
            ms(row.rmse_below_ms),
            ms(row.rmse_ms),
            ms(row.largest_above_ms),
            ms(row.largest_below_ms),
            row.prediction_error.map_or("-".into(), |error| format!("{:.0} %", 100.0 * error)),
            format!("{:.2}", row.budget_ms),
            format!("{:.2}", row.most_budget_ms),
        ]);
    }
    table.finish()
}

/// Mean of a mode's PSNR less last-frame adaptation's.
fn psnr_more(rows: &[Row], mode: &str) -> Option<f64> {
    let of = |mode: &str| -> Option<Vec<f64>> {
        rows.iter().filter(|row| row.mode == mode).map(|row| row.psnr).collect()
    };
    let (own, last) = (of(mode)?, of("last frame")?);
    Some(own.iter().zip(&last).map(|(own, last)| own - last).sum::<f64>() / own.len().max(1) as f64)
}

/// Every mode against last-frame adaptation, means over volumes and recordings.
fn summary(rows: &[Row]) -> String {
    let heads = [
        "mode",
        "RMSE above",
        "excess over all frames",
        "frames above",
        "largest above",
        "quality",
        "PSNR, dB more",
        "prediction error",
    ];
    let mut table = Table::new("Against the last frame's time", &heads, 1);
    let mean = |mode: &str, value: fn(&Row) -> f64| {
        let own: Vec<f64> = rows.iter().filter(|row| row.mode == mode).map(value).collect();
        own.iter().sum::<f64>() / own.len().max(1) as f64
    };
    for (mode, _) in MODES {
        // Shares of the target, so that every volume counts the same.
        let share = |value: fn(&Row) -> f64| {
            format!("{:.2}", mean(mode, value) / mean("last frame", value))
        };
        table.line(&[
            mode.into(),
            share(|row| row.rmse_above_ms / row.target_ms),
            share(|row| row.excess_ms / row.target_ms),
            share(|row| row.frames_above as f64 / row.frames as f64),
            share(|row| row.largest_above_ms / row.target_ms),
            share(|row| row.quality),
            psnr_more(rows, mode).map_or("-".into(), |more| format!("{more:+.1}")),
            format!("{:.0} %", 100.0 * mean(mode, |row| row.prediction_error.unwrap_or(f64::NAN))),
        ]);
    }
    table.finish()
}
