//! Numerical stability, case by case: `cargo run --release --example stability -- --out DIR`.
//!
//! Every case is a volume from a formula, drawn by the GPU and compared with a reference in f64 and with
//! the CPU twin; then 10,000 frames on one renderer. Writes `stability.json` and `stability.md`;
//! `docs/testing.md` explains the columns, `docs/numerics.md` derives the bounds. With `--mass N`
//! instead: N rays from within closed surfaces, all of which must hit.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program")]
#![allow(unreachable_pub, reason = "the modules are private to this program")]

mod output;
mod suite;
#[path = "../support/mod.rs"]
mod support;

use std::path::PathBuf;
use std::time::Instant;

use clap::Parser;
use suite::views::Effort;
use suite::{cases, long_run, mass, measure, refusals};
use support::{Failure, Gpu, Origin};

/// Measures numerical stability.
#[derive(Parser)]
struct Arguments {
    /// Folder for everything that is written.
    #[arg(long, default_value = "out/stability")]
    out: PathBuf,
    /// Part of an adapter's name; see the example `render --list-adapters`.
    #[arg(long)]
    adapter: Option<String>,
    /// Only cases whose group or name contains this; "long run" is one of them.
    #[arg(long)]
    case: Option<String>,
    /// Frames of the long run; 0 leaves it out.
    #[arg(long, default_value_t = 10_000)]
    frames: u32,
    /// Smaller pictures, as in the test suite.
    #[arg(long)]
    reduced: bool,
    /// Measure nothing else: send at least so many rays from within closed surfaces.
    #[arg(long, value_name = "RAYS")]
    mass: Option<f64>,
    /// Seed of the long run and of the mass of rays.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

fn main() {
    match run(&Arguments::parse()) {
        Ok(true) => {}
        Ok(false) => {
            eprintln!("stability: a case failed");
            std::process::exit(2);
        }
        Err(error) => {
            eprintln!("stability: {error}");
            std::process::exit(1);
        }
    }
}

/// Whether all is well.
fn run(arguments: &Arguments) -> Result<bool, Failure> {
    std::fs::create_dir_all(&arguments.out)?;
    let gpu = Gpu::new(arguments.adapter.as_deref())?;
    let origin = Origin::new(gpu.name());
    println!("adapter  {}", origin.adapter);
    let start = Instant::now();
    if let Some(rays) = arguments.mass {
        let report = mass::run(&gpu.device, &gpu.queue, rays as u64, arguments.seed)?;
        output::write_mass(&arguments.out, &origin, &report, start.elapsed().as_secs_f64())?;
        return Ok(report.ok());
    }
    let effort = if arguments.reduced { Effort::Reduced } else { Effort::Full };
    let wanted = |text: &str| arguments.case.as_ref().is_none_or(|part| text.contains(&**part));
    let mut rows = Vec::new();
    for case in cases::all(effort) {
        if wanted(case.group) || wanted(&case.name) {
            let row = measure::measure(&gpu.device, &gpu.queue, &case, effort);
            println!("{}", output::line(&row));
            rows.push(row);
        }
    }
    if wanted("refused") {
        rows.push(refusals::measure(&gpu.device, &gpu.queue));
    }
    let long_run = match arguments.frames {
        0 => None,
        _ if !wanted("long run") => None,
        frames => Some(long_run::run(&gpu.device, &gpu.queue, frames, arguments.seed)?),
    };
    output::write(&arguments.out, &origin, &rows, long_run.as_ref(), start.elapsed().as_secs_f64())
}
