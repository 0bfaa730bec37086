//! Measures both strategies side by side: `cargo run --release --example benchmark -- --set quick --out DIR`.
//!
//! Protocol: for every volume, isovalues x orbit positions with fixed seeds; every setting keeps its
//! own renderer, and the settings take turns at every view, so that all of them see the same machine.
//! Cold frames start with an empty cache and a loaded volume; warm frames repeat the view. Writes
//! `benchmark.json` (every frame, and medians over the views) and `benchmark.md`.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program")]
#![allow(unreachable_pub, reason = "the modules are private to this program")]

mod measure;
mod output;
mod sets;
#[path = "../support/mod.rs"]
mod support;

use std::path::PathBuf;

use clap::Parser;
use support::{Failure, Gpu};

/// Measures both strategies on fixed views.
#[derive(Parser)]
struct Arguments {
    /// What is measured: quick (under a minute on two cores), ci, full.
    #[arg(long, value_enum, default_value_t = sets::Set::Quick)]
    set: sets::Set,
    /// Folder for benchmark.json and benchmark.md.
    #[arg(long, default_value = "out/benchmark")]
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
        eprintln!("benchmark: {error}");
        std::process::exit(1);
    }
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    std::fs::create_dir_all(&arguments.out)?;
    let gpu = Gpu::new(arguments.adapter.as_deref())?;
    println!("adapter  {}", gpu.name());
    let mut frames = Vec::new();
    for case in sets::cases(arguments.set) {
        if arguments.volume.as_ref().is_some_and(|part| !case.name().contains(part.as_str())) {
            continue;
        }
        println!(
            "{} at {} bits per voxel, {}x{}",
            case.name(),
            case.rate,
            case.size[0],
            case.size[1]
        );
        frames.extend(measure::case(&gpu, &case)?);
    }
    output::write(&arguments.out, &gpu.name(), frames)?;
    println!("benchmark.json and benchmark.md are in {}", arguments.out.display());
    Ok(())
}
