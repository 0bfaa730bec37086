//! How wrong is the picture after so many milliseconds?
//! `cargo run --release --example error_time -- [--volume PART | --set ci] --out DIR`
//!
//! For every volume, view and setting, the picture after every pass is compared with the finished
//! picture and with an f64 renderer on the CPU that has the uncompressed samples. Writes
//! `error_time.json`, `error_time.md` and plots; `docs/accuracy.md` explains them.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program")]
#![allow(unreachable_pub, reason = "the modules are private to this program")]

mod best;
mod curve;
mod figures;
mod measure;
mod output;
mod reference;
mod sets;
#[path = "../support/mod.rs"]
mod support;
mod tables;
mod volume;

use std::path::PathBuf;

use clap::Parser;
use curve::Curve;
use measure::Bench;
use sets::{Case, Set};
use support::{Failure, Origin};
use volume::Volume;

/// Measures the error of the shown picture against the time.
#[derive(Parser)]
struct Arguments {
    /// What is measured.
    #[arg(long, value_enum, default_value_t = Set::Brief)]
    set: Set,
    /// Folder for everything that is written.
    #[arg(long, default_value = "out/error_time")]
    out: PathBuf,
    /// Part of an adapter's name; see the example `render --list-adapters`.
    #[arg(long)]
    adapter: Option<String>,
    /// Only volumes whose name contains this.
    #[arg(long)]
    volume: Option<String>,
}

fn main() {
    if let Err(error) = run(&Arguments::parse()) {
        eprintln!("error_time: {error}");
        std::process::exit(1);
    }
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    let wanted = |case: &Case| {
        arguments.volume.as_ref().is_none_or(|part| case.subject.name().contains(part.as_str()))
    };
    let cases: Vec<Case> = sets::cases(arguments.set).into_iter().filter(wanted).collect();
    if cases.is_empty() {
        return Err("no volume of the set has such a name".into());
    }
    std::fs::create_dir_all(&arguments.out)?;
    let mut bench = Bench::new(arguments.adapter.as_deref())?;
    let origin = Origin::new(bench.adapter()?);
    println!("adapter  {}", origin.adapter);
    let mut curves = Vec::new();
    for case in &cases {
        println!("{}", case.subject.name());
        measure_case(&mut bench, case, &mut curves)?;
    }
    best::mark_fronts(&mut curves);
    output::write(&arguments.out, &origin, &curves)?;
    println!("error_time.json, error_time.md and plots are in {}", arguments.out.display());
    Ok(())
}

/// All curves of a volume. Pictures are looked at once; then all settings take turns, so that they see
/// the same machine.
fn measure_case(bench: &mut Bench, case: &Case, curves: &mut Vec<Curve>) -> Result<(), Failure> {
    let volume = Volume::new(&case.subject)?;
    let scenes: Vec<_> =
        case.views.iter().map(|view| volume.scene(view)).collect::<Result<_, _>>()?;
    let truths: Vec<_> =
        scenes.iter().map(|scene| scene.reference(&volume, &volume.samples)).collect();
    let mut candidates = Vec::new();
    for &rate in case.rates {
        let stream = volume.compressed(rate)?;
        let decoded = stream.decode();
        for (scene, truth) in scenes.iter().zip(&truths) {
            let reference = scene.reference(&volume, &decoded);
            for &setting in scene.settings {
                let references = [truth, &reference];
                candidates.push(bench.candidate(&volume, scene, &stream, setting, references)?);
            }
        }
    }
    for _ in 1..case.runs {
        for candidate in &mut candidates {
            bench.repeat(candidate)?;
        }
    }
    for candidate in candidates {
        let curve = candidate.finish();
        println!("  {}", curve.line());
        curves.push(curve);
    }
    Ok(())
}
