//! The bundled brain scan, appearing pass by pass: `cargo run --example quickstart -- [--out DIR]`.
//!
//! Writes a picture after every pass, `final.png` and `report.json`.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program")]

mod support;

use std::path::PathBuf;
use std::time::Instant;

use clap::Parser;
use progressive_iso::{
    Camera, CompressedVolume, Frame, FrameOptions, ProgressiveIsoRenderer, RendererOptions,
    Residency, Shading,
};
use support::{Failure, Gpu, PassEntry, Report};

/// Renders the bundled brain scan progressively.
#[derive(Parser)]
struct Arguments {
    /// Folder for the pictures and the report.
    #[arg(long, default_value = "out/quickstart")]
    out: PathBuf,
    /// Part of an adapter's name; see the example `render --list-adapters`.
    #[arg(long)]
    adapter: Option<String>,
    /// GPU memory in MiB, everything included.
    #[arg(long, default_value_t = 64)]
    budget: u64,
}

fn main() {
    tracing_subscriber::fmt()
        .with_env_filter(tracing_subscriber::EnvFilter::from_default_env())
        .init();
    if let Err(error) = run(&Arguments::parse()) {
        eprintln!("quickstart: {error}");
        std::process::exit(1);
    }
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    std::fs::create_dir_all(&arguments.out)?;
    let gpu = Gpu::new(arguments.adapter.as_deref())?;
    println!("adapter  {}", gpu.name());

    let begin = Instant::now();
    let volume = CompressedVolume::try_from(&volumes::brain())?;
    let (center, radius) = volume.bounding_ball();
    let options = RendererOptions {
        size: [960, 720],
        budget_bytes: arguments.budget << 20,
        capture: true,
        // As for a volume larger than memory, and in small steps, so that there are passes to look at.
        residency: Residency::Cached,
        ..Default::default()
    };
    let mut renderer = ProgressiveIsoRenderer::new(&gpu.device, &gpu.queue, volume, options)?;
    let setup_ms = begin.elapsed().as_secs_f64() * 1e3;
    println!("\n{}", renderer.plan().explain());

    // The scan's z axis points to the crown of the head: look from the front left, a little from above.
    let (azimuth, elevation) = (30.0_f64.to_radians(), 15.0_f64.to_radians());
    let distance = radius * 2.0;
    let away = [-azimuth.sin() * elevation.cos(), azimuth.cos() * elevation.cos(), elevation.sin()];
    let eye = [0, 1, 2].map(|a| center[a] + distance * away[a]);
    let camera = Camera::perspective(
        eye,
        center,
        [0.0, 0.0, 1.0],
        38.0,
        960.0 / 720.0,
        0.1 * distance,
        4.0 * distance,
    );
    let isovalue = volumes::BRAIN_ISOVALUE;
    renderer.set_frame(&Frame {
        camera,
        isovalues: vec![isovalue],
        options: FrameOptions {
            shading: Shading { unfinished: support::UNFINISHED, ..Default::default() },
            rounds_per_pass: 1,
            look_ahead: 1,
            ..Default::default()
        },
    })?;

    println!("{}", PassEntry::HEAD);
    let mut passes: Vec<PassEntry> = Vec::new();
    let mut failure: Result<(), Failure> = Ok(());
    let begin = Instant::now();
    renderer.render_to_completion(&gpu.device, &gpu.queue, |renderer, report| {
        if report.pass == 0 {
            return true;
        }
        let entry = PassEntry::new(report, begin.elapsed().as_secs_f64() * 1e3);
        println!("{}", entry.line());
        let path = arguments.out.join(format!("pass_{:03}.png", entry.pass));
        failure = renderer
            .capture_blocking(&gpu.device, &gpu.queue)
            .map_err(Failure::from)
            .and_then(|capture| support::write_png(&path, &capture));
        passes.push(entry);
        failure.is_ok()
    })?;
    failure?;
    support::write_png(
        &arguments.out.join("final.png"),
        &renderer.capture_blocking(&gpu.device, &gpu.queue)?,
    )?;

    let peak = passes.last().map_or(0, |p| p.peak_bytes);
    println!(
        "\n{} passes, {:.1} MB at most, set-up {setup_ms:.0} ms",
        passes.len(),
        peak as f64 / 1e6
    );
    Report::new(&gpu, "brain", &renderer, isovalue, setup_ms, passes)
        .write(&arguments.out.join("report.json"))?;
    println!("pictures and report.json are in {}", arguments.out.display());
    Ok(())
}
