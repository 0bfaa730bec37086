//! Foveated frames: how good they look after one pass, and how much sooner they are there.
//! `cargo run --release [--features published-network] --example foveation -- [--set full] [--published W.safetensors]
//! --out DIR`.
//!
//! Writes `foveation.json`, `foveation.md`, `foveation-speed.svg` and pictures; `docs/interaction.md` explains them.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program")]
#![allow(unreachable_pub, reason = "the modules are private to this program")]

mod filler;
mod measures;
mod quality;
mod rest;
mod sets;
mod speed;
#[path = "../support/mod.rs"]
mod support;
mod tables;
mod view;

use std::path::{Path, PathBuf};

use clap::{Parser, ValueEnum};
use quality::Quality;
use rest::Rest;
use serde::{Deserialize, Serialize};
use sets::Set;
use speed::Speed;
use support::{Failure, Gpu, Origin};
use view::Volume;

/// One of the parts of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Part {
    /// Measures of filled pictures.
    Quality,
    /// The picture while the gaze rests.
    Rest,
    /// Times.
    Speed,
}

/// Measures foveated frames.
#[derive(Parser)]
struct Arguments {
    /// Folder for everything that is written.
    #[arg(long)]
    out: PathBuf,
    /// What is measured.
    #[arg(long, value_enum, default_value = "brief")]
    set: Set,
    /// These parts only.
    #[arg(long, value_enum, value_delimiter = ',')]
    parts: Vec<Part>,
    /// Only volumes whose name contains this.
    #[arg(long)]
    volume: Option<String>,
    /// Quality of these methods only.
    #[arg(long, value_delimiter = ',')]
    methods: Vec<String>,
    /// Files that earlier runs wrote: their rows are part of the tables, before those of this run.
    #[arg(long, value_delimiter = ',')]
    add: Vec<PathBuf>,
    /// Measures nothing, for `--add` alone.
    #[arg(long)]
    nothing: bool,
    /// The published network's weights, converted by `infill/training/convert_published.py`.
    #[arg(long)]
    published: Option<PathBuf>,
    /// Writes the pictures of all frames, for measures of films.
    #[arg(long)]
    films: bool,
    /// Part of an adapter's name.
    #[arg(long)]
    adapter: Option<String>,
}

impl Arguments {
    fn wants_method(&self, name: &str) -> bool {
        self.methods.is_empty() || self.methods.iter().any(|method| method == name)
    }

    fn wants(&self, part: Part) -> bool {
        !self.nothing && (self.parts.is_empty() || self.parts.contains(&part))
    }
}

/// What was measured.
#[derive(Default, Serialize, Deserialize)]
struct Rows {
    quality: Vec<Quality>,
    rest: Vec<Rest>,
    speed: Vec<Speed>,
}

impl Rows {
    /// All rows of some report files.
    fn read(files: &[PathBuf]) -> Result<Self, Failure> {
        let mut rows = Self::default();
        for file in files {
            let text = std::fs::read_to_string(file)
                .map_err(|error| format!("{}: {error}", file.display()))?;
            let read: Self = serde_json::from_str(&text)?;
            rows.quality.extend(read.quality);
            rows.rest.extend(read.rest);
            rows.speed.extend(read.speed);
        }
        Ok(rows)
    }
}

/// A report file.
#[derive(Serialize)]
struct File<'a> {
    #[serde(flatten)]
    origin: &'a Origin,
    sigma: f32,
    #[serde(flatten)]
    rows: &'a Rows,
}

fn main() {
    support::main("foveation", || run(&Arguments::parse()));
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    std::fs::create_dir_all(&arguments.out)?;
    let gpu = Gpu::new(arguments.adapter.as_deref())?;
    let origin = Origin::new(gpu.name());
    println!("adapter  {}", gpu.name());
    let mut rows = Rows::read(&arguments.add)?;
    let plan = arguments.set.plan();
    let wanted = |name: &str| arguments.volume.as_ref().is_none_or(|part| name.contains(&**part));
    let subjects = plan.subjects.iter().filter(|_| !arguments.nothing);
    for subject in subjects.filter(|subject| wanted(&subject.name())) {
        measure(&gpu, &Volume::new(subject)?, arguments, &mut rows)?;
        write_rows(&arguments.out, &origin, &rows)?;
    }
    write_rows(&arguments.out, &origin, &rows)?;
    let text = tables::all(&origin, &rows.quality, &rows.rest, &rows.speed);
    println!("\n{text}");
    support::write_file(&arguments.out.join("foveation.md"), text.as_bytes())?;
    if rows.speed.is_empty() {
        return Ok(());
    }
    let plot = tables::speed_plot(&rows.speed).svg();
    support::write_file(&arguments.out.join("foveation-speed.svg"), plot.as_bytes())
}

fn measure(
    gpu: &Gpu,
    volume: &Volume,
    arguments: &Arguments,
    rows: &mut Rows,
) -> Result<(), Failure> {
    let plan = arguments.set.plan();
    if arguments.wants(Part::Quality) {
        quality::measure(gpu, volume, plan, arguments, &mut rows.quality)?;
    }
    if arguments.wants(Part::Rest) {
        rest::measure(gpu, volume, plan, &mut rows.rest)?;
    }
    if arguments.wants(Part::Speed) {
        speed::measure(arguments.adapter.as_deref(), volume, plan, &mut rows.speed)?;
    }
    Ok(())
}

fn write_rows(folder: &Path, origin: &Origin, rows: &Rows) -> Result<(), Failure> {
    support::write_json(folder, "foveation.json", &File { origin, sigma: sets::SIGMA, rows })
}
