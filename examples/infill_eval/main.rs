//! In-fill against the finished picture, the published network and more passes:
//! `cargo run --release [--features published-network] --example infill_eval -- --weights infill/weights/infill.safetensors
//! [--published W.safetensors] --out DIR`.
//!
//! Sequences of frames of volumes that the network was never trained on are cut when a share of the pixels is finished.
//! `infill_eval.json` has a row for every method, volume, cut and motion: means over the frames.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program")]
#![allow(unreachable_pub, reason = "the modules of a program")]

mod contender;
mod rows;
mod sequence;
mod subject;
#[path = "../support/mod.rs"]
mod support;

use std::path::PathBuf;

use clap::{Parser, ValueEnum};
use rows::Row;
use sequence::Sequence;
use serde::Serialize;
use subject::Motion;
use support::{Failure, Gpu, Origin};

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Set {
    /// Every volume; all motions at the first cut only.
    Default,
    /// All motions at all cuts, longer sequences.
    Full,
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
    /// These volumes only.
    #[arg(long, value_delimiter = ',')]
    volumes: Vec<String>,
    /// Part of an adapter's name.
    #[arg(long)]
    adapter: Option<String>,
}

impl Set {
    fn cuts(self) -> &'static [f64] {
        &[0.85, 0.90, 0.95]
    }

    fn motions(self, cut: f64) -> Vec<Motion> {
        let orbits = [1.0, 3.0, 8.0].map(Motion::Orbit);
        match self {
            Self::Default if cut != self.cuts()[0] => vec![Motion::Orbit(3.0)],
            _ => orbits.into_iter().chain([Motion::Static, Motion::IsovalueJump]).collect(),
        }
    }

    fn frames(self) -> u32 {
        match self {
            Self::Default => 5,
            Self::Full => 16,
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
}

fn main() {
    tracing_subscriber::fmt()
        .with_env_filter(tracing_subscriber::EnvFilter::from_default_env())
        .init();
    if let Err(error) = run(&Arguments::parse()) {
        eprintln!("infill_eval: {error}");
        std::process::exit(1);
    }
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    std::fs::create_dir_all(&arguments.out)?;
    let gpu = Gpu::new(arguments.adapter.as_deref())?;
    let origin = Origin::new(gpu.name());
    println!("adapter  {}", gpu.name());
    let weights = contender::weights(&arguments.weights)?;
    let mut rows = Vec::new();
    for name in subject::NAMES {
        if !arguments.volumes.is_empty() && !arguments.volumes.iter().any(|wanted| wanted == name) {
            continue;
        }
        let subject = subject::Subject::new(name)?;
        for &cut in arguments.set.cuts() {
            let mut sequence = Sequence::new(
                &gpu,
                &subject,
                arguments.size,
                weights,
                arguments.published.as_deref(),
            )?;
            for motion in arguments.set.motions(cut) {
                let frames = arguments.set.frames();
                let measured =
                    sequence.measure(&gpu, &subject, motion, cut, frames, &arguments.out)?;
                measured.iter().for_each(|row| println!("{}", row.line()));
                rows.extend(measured);
            }
        }
        let file = File { origin: &origin, size: arguments.size, rows: &rows };
        support::write_json(&arguments.out, "infill_eval.json", &file)?;
    }
    let text = rows::tables(&rows);
    println!("\n{text}");
    support::write_file(&arguments.out.join("infill_eval.md"), text.as_bytes())
}
