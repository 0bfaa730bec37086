//! Measures both strategies side by side: `cargo run --release --example benchmark -- --set quick --out DIR`.
//!
//! Protocol: for every volume, isovalues x orbit positions with fixed seeds; every setting keeps its
//! own renderer, and the settings take turns at every view, so that all of them see the same machine.
//! Cold frames start with an empty cache and a loaded volume, warm frames repeat the view, moved
//! frames follow it on a short orbit. Writes `benchmark.json` (every frame, and medians over the
//! views; `docs/benchmark.md` explains the keys), `benchmark.md` and plots.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program")]
#![allow(unreachable_pub, reason = "the modules are private to this program")]

mod cpu_renderer;
mod cpu_volume;
mod cpu_walk;
mod figures;
mod frame;
mod library;
mod measure;
mod needed;
mod output;
mod rows;
mod scaling;
mod scene;
mod sets;
mod summary;
#[path = "../support/mod.rs"]
mod support;
mod tables;
mod vtk;

use std::path::PathBuf;

use clap::Parser;
use measure::Results;
use scene::Scene;
use support::{Failure, Gpu, Origin};

/// Measures both strategies on fixed views.
#[derive(Parser)]
struct Arguments {
    /// What is measured.
    #[arg(long, value_enum, default_value_t = sets::Set::Quick)]
    set: sets::Set,
    /// Folder for everything that is written.
    #[arg(long, default_value = "out/benchmark")]
    out: PathBuf,
    /// Part of an adapter's name; see the example `render --list-adapters`.
    #[arg(long)]
    adapter: Option<String>,
    /// Only volumes whose name contains this.
    #[arg(long)]
    volume: Option<String>,
    /// Only settings whose name contains this, or one of these; not with the sets scaling and vtk.
    #[arg(long)]
    setting: Vec<String>,
    /// Measure nothing: write the volume of the set vtk, decoded, to this file as raw 32-bit floats,
    /// and beside it its stream (.zfp) and a view of it (.json).
    #[arg(long, value_name = "FILE")]
    export_raw: Option<PathBuf>,
}

impl Arguments {
    fn wants(&self, name: &str) -> bool {
        self.volume.as_ref().is_none_or(|part| name.contains(part.as_str()))
    }

    fn settings(&self, case: &sets::Case) -> Vec<sets::Setting> {
        let mut settings = sets::settings(self.set, case);
        if !self.setting.is_empty() {
            settings.retain(|s| self.setting.iter().any(|part| s.label.contains(part.as_str())));
        }
        settings
    }
}

fn main() {
    if let Err(error) = run(&Arguments::parse()) {
        eprintln!("benchmark: {error}");
        std::process::exit(1);
    }
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    if let Some(path) = &arguments.export_raw {
        return vtk::export(path);
    }
    std::fs::create_dir_all(&arguments.out)?;
    let gpu = Gpu::new(arguments.adapter.as_deref())?;
    let origin = Origin::new(gpu.name());
    println!("adapter  {}", origin.adapter);
    let results = match arguments.set {
        sets::Set::Vtk => return vtk::measure(&gpu, &origin, &arguments.out),
        sets::Set::Scaling => scaling::measure(&gpu, |name| arguments.wants(name))?,
        _ => strategies(arguments, &gpu)?,
    };
    output::write(&arguments.out, &origin, &results)?;
    println!("benchmark.json, benchmark.md and plots are in {}", arguments.out.display());
    Ok(())
}

/// All cases of a set.
fn strategies(arguments: &Arguments, gpu: &Gpu) -> Result<Results, Failure> {
    let mut results = Results::default();
    let mut last: Option<Scene> = None;
    for case in sets::cases(arguments.set) {
        let name = case.subject.name();
        if !arguments.wants(&name) {
            continue;
        }
        let [width, height] = case.size;
        println!("{name} at {} bits per voxel, {width}x{height}", case.subject.rate);
        // A volume of the case before goes before the next one is made.
        last = last.filter(|scene| scene.subject == case.subject);
        let mut scene = match last.take() {
            Some(scene) => scene,
            None => Scene::new(case.subject, true)?,
        };
        measure::case(gpu, arguments.settings(&case), &case, &mut scene, &mut results)?;
        last = Some(scene);
    }
    Ok(results)
}
