//! Renders what the page's tests compare with, through the same session: `reference FOLDER [RUNS]`.
//!
//! Writes the colour, depth and status of every scene of `tests/scenes.json`, the times of its passes, and a
//! large file for the test of the page's memory.

#![allow(clippy::print_stderr, reason = "a command-line program")]
#![allow(clippy::disallowed_methods, reason = "the program owns the device")]

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use progressive_iso::{Capture, Outputs, PixelStatus, RendererOptions, wgpu};
use serde_json::{Value, json};
use volume_io::{FixedRateHeader, Geometry};
use web::link::Link;
use web::session::{Session, Settings};

const SCENES: &str = include_str!("../tests/scenes.json");
/// Budgets in MiB that the measurements are made with: all resident, and a cache.
const BUDGETS: [u64; 2] = [256, 32];

type Failure = Box<dyn std::error::Error>;

struct Gpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (folder, runs) = match arguments.as_slice() {
        [folder] => (folder, Ok(1)),
        [folder, runs] => (folder, runs.parse()),
        _ => (&String::new(), "".parse()),
    };
    let Ok(runs) = runs else {
        eprintln!("usage: reference FOLDER [RUNS]");
        return ExitCode::from(2);
    };
    match run(Path::new(&folder), runs) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("reference: {failure}");
            ExitCode::FAILURE
        }
    }
}

fn run(folder: &Path, runs: usize) -> Result<(), Failure> {
    let (device, queue) = gpu_testkit::gpu::device();
    let gpu = Gpu { device, queue };
    let scenes: Value = serde_json::from_str(SCENES)?;
    let size = [0, 1].map(|axis| scenes["size"][axis].as_u64().unwrap_or(1) as u32);
    let mut measured = Vec::new();
    for budget in BUDGETS.into_iter().flat_map(|budget| std::iter::repeat_n(budget, runs)) {
        measured.push(render(&gpu, folder, &scenes["scenes"], size, budget)?);
    }
    std::fs::write(folder.join("measured.json"), json!(measured).to_string())?;
    std::fs::write(folder.join("large.zfp"), large_file()?)?;
    Ok(())
}

/// Renders the scenes and writes their pictures, which no budget changes.
fn render(
    gpu: &Gpu,
    folder: &Path,
    scenes: &Value,
    size: [u32; 2],
    budget: u64,
) -> Result<Value, Failure> {
    let outputs = Outputs { status: true, depth: true, ..Outputs::default() };
    let budget_bytes = budget << 20;
    let options =
        RendererOptions { size, outputs, capture: true, budget_bytes, ..Default::default() };
    let settings = Settings { renderer: options, ..Settings::default() };
    let volume = volumes::brain();
    let header = FixedRateHeader::parse(&volume.bytes).ok_or("the bundled file has no header")?;
    let began = Instant::now();
    let geometry = Geometry::default();
    let mut session = Session::new(&gpu.device, &gpu.queue, header, geometry, settings)?;
    session.push(&volume.bytes)?;
    session.finish()?;
    let mut first_ms = None;
    let mut rows = Vec::new();
    for scene in scenes.as_array().into_iter().flatten() {
        let text = |key: &str| scene[key].as_str().unwrap_or_default();
        let link = Link::parse(text("link"));
        if let Some(isovalue) = link.isovalue {
            session.set_isovalue(isovalue);
        }
        if let Some(view) = link.view {
            session.set_view(view);
        }
        loop {
            let step = session.advance(&gpu.device, &gpu.queue)?;
            if step.is_new {
                first_ms.get_or_insert_with(|| 1e3 * began.elapsed().as_secs_f64());
            }
            if step.rests {
                break;
            }
            gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
        }
        let passes: Vec<_> = session.passes().iter().map(|p| [p.ms, p.completeness]).collect();
        rows.push(json!({ "name": text("name"), "passes": passes }));
        let capture = session.renderer().capture_blocking(&gpu.device, &gpu.queue)?;
        write(folder, text("name"), capture)?;
    }
    let peak_bytes = session.report().peak_bytes;
    Ok(json!({ "budget": budget, "first_ms": first_ms, "peak_bytes": peak_bytes, "scenes": rows }))
}

fn write(folder: &Path, name: &str, capture: Capture) -> Result<(), Failure> {
    let depth: Vec<u8> =
        capture.depth.ok_or("no depth")?.iter().flat_map(|depth| depth.to_le_bytes()).collect();
    let number = |status: &PixelStatus| *status as u8;
    let status: Vec<u8> = capture.status.ok_or("no status")?.iter().map(number).collect();
    for (kind, bytes) in [("color", capture.color), ("depth", depth), ("status", status)] {
        std::fs::write(folder.join(format!("{name}.{kind}")), bytes)?;
    }
    Ok(())
}

/// 64 MiB, all zeros but a corner: a file that would show in the page's memory.
fn large_file() -> Result<Vec<u8>, Failure> {
    let mut file = Vec::new();
    let mut encoder = volume_io::StreamEncoder::new([256, 256, 512], 16.0, &mut file)?;
    encoder.push(&[1.0; 64])?;
    for _ in 1..encoder.block_count() {
        encoder.push(&[0.0; 64])?;
    }
    encoder.finish()?;
    Ok(file)
}
