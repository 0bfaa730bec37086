//! Frames for training the in-fill network: `cargo run --release --example infill_dataset -- --out DIR`.
//!
//! Every sequence shows one generated volume. Its frames are cut at the first pass that finishes a share of the
//! pixels, or with `--sampling sparse` after the first pass of a foveated frame; each becomes an EXR picture of half floats with what the filler knows at the cut and what the finished
//! frame shows. `dataset.json` lists them. The channels are described in `docs/infill.md`.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program")]
#![allow(unreachable_pub, reason = "the modules of a program")]

mod picture;
#[path = "../stability/suite/random.rs"]
#[allow(dead_code, reason = "shared with the example `stability`")]
mod random;
mod sampling;
mod sequence;
mod shapes;
#[path = "../support/mod.rs"]
mod support;

use std::path::PathBuf;

use clap::Parser;
use random::Random;
use sampling::Sampling;
use sequence::{Sequence, Subject};
use support::{Failure, Gpu};

/// Kinds of volumes, in turn.
const KINDS: [&str; 9] = [
    "turbulence",
    "mixing-layer",
    "blobs",
    "shells",
    "sheets",
    "tubes",
    "gyroid",
    "rough-solid",
    "labels",
];

/// Writes frames for training the in-fill network.
#[derive(Parser)]
struct Arguments {
    /// Folder for the pictures and `dataset.json`.
    #[arg(long)]
    out: PathBuf,
    /// Number of sequences, each of a volume of its own.
    #[arg(long, default_value_t = 36)]
    sequences: u32,
    /// Frames of a sequence.
    #[arg(long, default_value_t = 6)]
    frames: u32,
    /// Width and height of the pictures.
    #[arg(long, default_value = "384x288", value_parser = support::picture_size)]
    size: [u32; 2],
    /// Where pictures get their holes from.
    #[arg(long, value_enum, default_value = "cut")]
    sampling: Sampling,
    /// Everything random follows from it.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Kinds of volumes, in turn; besides these there are `rods` and `brain-part`.
    #[arg(long, value_delimiter = ',', default_values_t = KINDS.map(String::from))]
    kinds: Vec<String>,
    /// Part of an adapter's name.
    #[arg(long)]
    adapter: Option<String>,
}

fn main() {
    support::main("infill_dataset", || run(&Arguments::parse()));
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    std::fs::create_dir_all(&arguments.out)?;
    let gpu = Gpu::new(arguments.adapter.as_deref())?;
    let mut entries = Vec::new();
    for number in 0..arguments.sequences {
        // A sequence depends on the seed and its number alone, so that it can be made again.
        let mut random =
            Random::new(arguments.seed.wrapping_mul(1 << 32).wrapping_add(number.into()));
        let kind = &arguments.kinds[number as usize % arguments.kinds.len()];
        let subject = Subject::random(kind, &mut random);
        let frames = (number, arguments.frames, arguments.size);
        let sequence = Sequence::new(&gpu, subject, frames, arguments.sampling, random)?;
        let made = sequence.write(&gpu, &arguments.out)?;
        println!("{number:4} {kind:<14} {} frames", made.len());
        entries.extend(made);
        support::write_json(&arguments.out, "dataset.json", &entries)?;
    }
    Ok(())
}
