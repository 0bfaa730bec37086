//! In-fill against the finished picture, the published network and more passes:
//! `cargo run --release [--features published-network] --example infill_eval -- --weights infill/weights/infill.safetensors
//! [--published W.safetensors] --out DIR`.
//!
//! Sequences of frames of volumes that the network was never trained on are cut when a share of the pixels is finished.
//! `infill_eval.json` has a row for every method, volume, cut and motion: means over the frames. Its curves tell how good
//! the picture of a larger volume is after how long, from an empty cache.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program")]
#![allow(unreachable_pub, reason = "the modules of a program")]

mod contender;
mod curve;
mod rows;
mod sequence;
mod subject;
#[path = "../support/mod.rs"]
mod support;

use std::path::PathBuf;

use clap::{Parser, ValueEnum};
use curve::Curve;
use progressive_iso::InfillWeights;
use rows::Row;
use sequence::Sequence;
use serde::Serialize;
use subject::Motion;
use support::subject::{BRAIN, cube, turbulence};
use support::{Failure, Gpu, Origin};

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Set {
    /// Every volume; all motions at the first cut only.
    Default,
    /// All motions at all cuts, longer sequences.
    Full,
    /// A tiny volume, for the test of the program.
    Test,
}

/// Measures in-fill on volumes that were never trained on.
#[derive(Parser)]
struct Arguments {
    /// Folder for `infill_eval.json`, `infill_eval.md` and pictures.
    #[arg(long)]
    out: PathBuf,
    /// The network's weights.
    #[arg(long)]
    weights: PathBuf,
    /// The published network's weights, converted by `infill/training/convert_published.py`.
    #[arg(long)]
    published: Option<PathBuf>,
    #[arg(long, value_enum, default_value = "default")]
    set: Set,
    /// Width and height of the pictures.
    #[arg(long, default_value = "640x360", value_parser = support::picture_size)]
    size: [u32; 2],
    /// These volumes only, such as `tubes`, `turbulence-256`.
    #[arg(long, value_delimiter = ',')]
    volumes: Vec<String>,
    /// Part of an adapter's name.
    #[arg(long)]
    adapter: Option<String>,
}

impl Arguments {
    fn wants(&self, volume: &str) -> bool {
        self.volumes.is_empty() || self.volumes.iter().any(|wanted| wanted == volume)
    }
}

impl Set {
    fn cuts(self) -> &'static [f64] {
        match self {
            Self::Test => &[0.85],
            _ => &[0.85, 0.90, 0.95],
        }
    }

    fn motions(self, cut: f64) -> Vec<Motion> {
        let orbits = [1.0, 3.0, 8.0].map(Motion::Orbit);
        match self {
            Self::Default if cut != self.cuts()[0] => vec![Motion::Orbit(3.0)],
            Self::Test => vec![Motion::Orbit(1.0), Motion::IsovalueJump],
            _ => orbits.into_iter().chain([Motion::Static, Motion::IsovalueJump]).collect(),
        }
    }

    fn frames(self) -> u32 {
        match self {
            Self::Default => 3,
            Self::Full => 16,
            Self::Test => 2,
        }
    }

    fn views(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::Test => &[("turbulence", 0.5)],
            _ => &subject::VIEWS,
        }
    }

    /// Voxels on each axis of the generated volumes.
    fn edge(self) -> u32 {
        match self {
            Self::Test => 48,
            _ => subject::EDGE,
        }
    }

    /// Volumes whose pictures are timed from an empty cache, and the size of those pictures.
    fn curves(self) -> (Vec<support::subject::Subject>, [u32; 2]) {
        match self {
            Self::Test => (vec![turbulence(48)], [96, 64]),
            _ => {
                let (shells, solid) = (cube("shells", 256, 2.0), cube("rough-solid", 256, 4.0));
                (vec![BRAIN, turbulence(256), shells, solid], [1280, 720])
            }
        }
    }
}

/// A report file.
#[derive(Serialize)]
struct File<'a> {
    #[serde(flatten)]
    origin: &'a Origin,
    size: [u32; 2],
    rows: &'a [Row],
    curves: &'a [Curve],
}

fn main() {
    support::main("infill_eval", || run(&Arguments::parse()));
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    std::fs::create_dir_all(&arguments.out)?;
    let gpu = Gpu::new(arguments.adapter.as_deref())?;
    let origin = Origin::new(gpu.name());
    println!("adapter  {}", gpu.name());
    let weights = contender::weights(&arguments.weights)?;
    let (mut rows, mut curves) = (Vec::new(), Vec::new());
    let save = |rows: &[Row], curves: &[Curve]| {
        let file = File { origin: &origin, size: arguments.size, rows, curves };
        support::write_json(&arguments.out, "infill_eval.json", &file)
    };
    for view in arguments.set.views().iter().filter(|view| arguments.wants(view.0)) {
        let subject = subject::Subject::new(*view, arguments.set.edge())?;
        rows.extend(measure(arguments, &gpu, &subject, weights)?);
        save(&rows, &curves)?;
    }
    let (subjects, size) = arguments.set.curves();
    for subject in subjects.iter().filter(|subject| arguments.wants(&subject.name())) {
        let (out, ways) = (&arguments.out, &contender::CURVE_WAYS);
        curves.extend(curve::measure(&gpu, subject, size, ways, weights, out)?);
        save(&rows, &curves)?;
    }
    let text = rows::tables(&rows) + &curve::table(&curves);
    println!("\n{text}");
    support::write_file(&arguments.out.join("infill_eval.md"), text.as_bytes())
}

/// All cuts and motions of a volume.
fn measure(
    arguments: &Arguments,
    gpu: &Gpu,
    subject: &subject::Subject,
    weights: &'static InfillWeights,
) -> Result<Vec<Row>, Failure> {
    let (set, published) = (arguments.set, arguments.published.as_deref());
    let mut sequence = Sequence::new(gpu, subject, arguments.size, weights, published)?;
    let mut rows = Vec::new();
    for &cut in set.cuts() {
        for motion in set.motions(cut) {
            let out = &arguments.out;
            let measured = sequence.measure(gpu, subject, motion, cut, set.frames(), out)?;
            measured.iter().for_each(|row| println!("{}", row.line()));
            rows.extend(measured);
        }
    }
    Ok(rows)
}
