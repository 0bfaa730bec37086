//! An application's own render loop around the renderer: `cargo run --example custom_loop`.
//!
//! The application owns device, queue, camera and targets; the isosurface is drawn into its render
//! pass and occludes its mesh, and the other way round. Headless by default, with a picture every
//! few frames; `cargo run --example custom_loop --features window -- --window` opens a window.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program")]
#![allow(clippy::disallowed_methods, reason = "an application submits, writes and polls itself")]
#![allow(unreachable_pub, reason = "a program has no public items")]

mod headless;
mod mesh;
mod scene;
#[path = "../support/mod.rs"]
mod support;
#[cfg(feature = "window")]
mod window;

use std::path::PathBuf;

use clap::Parser;
use support::Failure;

/// Shows a mesh and an isosurface that occlude each other, from a camera that orbits and rests.
#[derive(Parser)]
struct Arguments {
    /// Folder for the pictures.
    #[arg(long, default_value = "out/custom_loop")]
    out: PathBuf,
    /// Frames to render; the camera rests in the last third of every 48. A window stays open
    /// without this.
    #[arg(long)]
    frames: Option<u32>,
    /// Frames from one picture file to the next.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Part of an adapter's name; see the example `render --list-adapters`.
    #[arg(long)]
    adapter: Option<String>,
    /// The renderer's GPU memory in MiB, everything included.
    #[arg(long, default_value_t = 96)]
    budget: u64,
    /// Open a window instead.
    #[cfg(feature = "window")]
    #[arg(long)]
    window: bool,
}

/// Where the camera is in a frame: moving for 32 frames, then at rest for 16.
fn orbit_degrees(frame: u32) -> f64 {
    let (turn, step) = (frame / 48, (frame % 48).min(31));
    30.0 + 1.5 * f64::from(turn * 31 + step)
}

fn main() {
    support::main("custom_loop", || run(&Arguments::parse()));
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    #[cfg(feature = "window")]
    if arguments.window {
        return window::run(arguments);
    }
    headless::run(arguments)
}
