//! What `tools/vtk_baseline.py` measures of VTK, measured here: from the data in memory to the first
//! finished picture in memory, and the memory that it takes. The data is the compressed stream.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::time::Instant;

use progressive_iso::{ProgressiveIsoRenderer, RendererOptions};
use serde::Serialize;
use volume_io::ReadOptions;

use crate::cpu_volume::CpuVolume;
use crate::library::{self, Wanted, with_residency};
use crate::scene::{FIELD_OF_VIEW_DEGREES, Scene, View};
use crate::sets::{MIDDLE, default_look_ahead};
use crate::support::subject::{Subject, cube, stream, turbulence};
use crate::support::{
    Failure, Gpu, Origin, reset_resident_peak, resident_bytes, write_file, write_json,
};

/// Repetitions, each with a new renderer.
const REPEATS: usize = 5;

fn subject() -> Subject {
    turbulence(256)
}

fn view(isovalue: f32) -> View {
    View { isovalue, position: [20.0, 15.0], size: MIDDLE }
}

/// The view, for other programs.
#[derive(Serialize)]
struct Export {
    dims: [u32; 3],
    isovalue: f32,
    size: [u32; 2],
    eye: [f64; 3],
    target: [f64; 3],
    up: [f64; 3],
    vertical_fov_degrees: f64,
}

/// Writes the decoded samples to `path`, the stream and the view beside it.
pub fn export(path: &Path) -> Result<(), Failure> {
    let (zfp, isovalue) = stream(&subject())?;
    let decoded = CpuVolume::decode(&zfp)?;
    let bytes: Vec<u8> = decoded.samples().iter().flat_map(|v| v.to_le_bytes()).collect();
    write_file(path, &bytes)?;
    volume_io::write_zfp(
        &zfp,
        std::io::BufWriter::new(std::fs::File::create(path.with_extension("zfp"))?),
    )?;
    let scene = Scene::of_stream(subject(), &zfp, isovalue)?;
    let world =
        glam::DMat4::from_cols_array_2d(&scene.camera(&view(isovalue)).view_from_world).inverse();
    let export = Export {
        dims: zfp.dims,
        isovalue,
        size: MIDDLE,
        eye: world.w_axis.truncate().to_array(),
        target: scene.volume.bounding_ball().0,
        up: world.y_axis.truncate().to_array(),
        vertical_fov_degrees: FIELD_OF_VIEW_DEGREES,
    };
    write_file(&path.with_extension("json"), serde_json::to_string_pretty(&export)?.as_bytes())
}

/// One way from the stream to the picture, in milliseconds and bytes.
#[derive(Clone, Copy, Debug, Serialize)]
struct Run {
    residency: Wanted,
    /// Planning, pipelines and allocation.
    pipelines_ms: f64,
    /// From the renderer to the picture in memory: loading, drawing, reading back.
    picture_ms: f64,
    load_ms: f64,
    draw_ms: f64,
    read_back_ms: f64,
    /// Most resident memory above that after the warm-up, with and without the stream.
    growth_bytes: Option<u64>,
    growth_without_input_bytes: Option<u64>,
    /// GPU memory that the library asked for, the most at any time.
    peak_bytes: u64,
    hits: u32,
}

#[derive(Serialize)]
struct File<'a> {
    #[serde(flatten)]
    origin: &'a Origin,
    volume: String,
    size: [u32; 2],
    compressed_bytes: usize,
    after_warm_up_bytes: Option<u64>,
    runs: Vec<Run>,
}

/// Measures this library the same way and writes `vtk.json`.
pub fn measure(gpu: &Gpu, origin: &Origin, folder: &Path) -> Result<(), Failure> {
    let raw = folder.join("turbulence-256.raw");
    export_elsewhere(&raw)?;
    warm_up(gpu)?;
    let after_warm_up = resident_bytes().map(|[now, _]| now);
    let stream: Arc<[u8]> = std::fs::read(raw.with_extension("zfp"))?.into();
    let zfp = volume_io::read_bytes("turbulence-256.zfp", stream, &ReadOptions::default())?;
    let isovalue = volumes::by_name("turbulence", subject().dims)?.suggested_isovalue() as f32;
    let scene = Scene::of_stream(subject(), &zfp, isovalue)?;
    let mut runs = Vec::new();
    for _ in 0..REPEATS {
        for residency in [Wanted::Cached, Wanted::Full] {
            runs.extend(run(gpu, &scene, residency, after_warm_up)?);
        }
    }
    for run in &runs {
        println!("{}", serde_json::to_string(run)?);
    }
    let file = File {
        origin,
        volume: subject().name(),
        size: MIDDLE,
        compressed_bytes: zfp.bytes.len(),
        after_warm_up_bytes: after_warm_up,
        runs,
    };
    write_json(folder, "vtk.json", &file)
}

/// Has another process write the volume's files, so that making them leaves no memory here.
fn export_elsewhere(raw: &PathBuf) -> Result<(), Failure> {
    if raw.with_extension("zfp").exists() {
        return Ok(());
    }
    let status = Command::new(std::env::current_exe()?).arg("--export-raw").arg(raw).status()?;
    if status.success() { Ok(()) } else { Err("the volume could not be exported".into()) }
}

/// A small scene of another kind: pipelines of the driver, thread pools, allocators.
fn warm_up(gpu: &Gpu) -> Result<(), Failure> {
    let subject = cube("gyroid", 48, 8.0);
    let (zfp, isovalue) = stream(&subject)?;
    let scene = Scene::of_stream(subject, &zfp, isovalue)?;
    for residency in [Wanted::Cached, Wanted::Full] {
        let view = View { size: [160, 120], ..view(isovalue) };
        picture(gpu, &scene, &view, residency)?;
    }
    Ok(())
}

/// A run after the first one finds memory that it needs already resident, so that only the first of
/// each kind tells how much memory it takes; the times of all count.
fn run(
    gpu: &Gpu,
    scene: &Scene,
    residency: Wanted,
    after_warm_up: Option<u64>,
) -> Result<Option<Run>, Failure> {
    let with_input = resident_bytes().map(|[now, _]| now);
    reset_resident_peak();
    let Some(mut run) = picture(gpu, scene, &view(scene.isovalue), residency)? else {
        return Ok(None);
    };
    let most = resident_bytes().map(|[_, most]| most);
    let above = |base: Option<u64>| Some(most?.saturating_sub(base?));
    run.growth_bytes = above(after_warm_up);
    run.growth_without_input_bytes = above(with_input);
    Ok(Some(run))
}

/// From the stream to the picture; `None` where the plan comes to another residency.
fn picture(
    gpu: &Gpu,
    scene: &Scene,
    view: &View,
    residency: Wanted,
) -> Result<Option<Run>, Failure> {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let options = RendererOptions { size: view.size, capture: true, ..Default::default() };
    let begin = Instant::now();
    let mut renderer = ProgressiveIsoRenderer::new(
        device,
        queue,
        scene.volume.clone(),
        with_residency(options, residency),
    )?;
    if library::residency(renderer.plan()) != residency {
        return Ok(None);
    }
    let pipelines_ms = begin.elapsed().as_secs_f64() * 1e3;
    let begin = Instant::now();
    let elapsed = || begin.elapsed().as_secs_f64() * 1e3;
    renderer.set_frame(&scene.frame(view, default_look_ahead(), 1))?;
    renderer.render_to_completion(device, queue, |_, report| report.pass == 0)?;
    let load_ms = elapsed();
    let report = renderer.render_to_completion(device, queue, |_, _| true)?;
    let draw_ms = elapsed() - load_ms;
    let capture = renderer.capture_blocking(device, queue)?;
    let picture_ms = elapsed();
    if capture.size != view.size {
        return Err("the picture has another size".into());
    }
    Ok(Some(Run {
        residency,
        pipelines_ms,
        picture_ms,
        load_ms,
        draw_ms,
        read_back_ms: picture_ms - load_ms - draw_ms,
        growth_bytes: None,
        growth_without_input_bytes: None,
        peak_bytes: report.peak_bytes,
        hits: report.hits,
    }))
}
