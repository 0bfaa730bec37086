//! The headless renderer for any volume: `cargo run --example render -- --help`.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program")]
#![allow(unreachable_pub, reason = "a program has no public items")]

mod arguments;
mod input;
mod problem;
#[path = "../support/mod.rs"]
mod support;

use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use arguments::{Arguments, CameraOptions, Command};
use clap::Parser;
use input::Input;
use problem::Problem;
use progressive_iso::{
    Camera, Capture, CompressedVolume, Frame, FrameOptions, Outputs, ProgressiveIsoRenderer,
    RendererOptions, Shading, wgpu,
};
use support::{Gpu, PassEntry, Report};

/// Azimuth and elevation where no camera is given.
const DEFAULT_ORBIT: [f64; 2] = [30.0, 20.0];

fn main() -> ExitCode {
    tracing_subscriber::fmt()
        .with_env_filter(tracing_subscriber::EnvFilter::from_default_env())
        .with_writer(std::io::stderr)
        .init();
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("render: {problem}");
            problem.exit_code()
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Problem> {
    if let Some(Command::Info { volume, input, scene }) = &arguments.command {
        let input = Input::read(volume, input)?;
        let (what, statistics) = (input.describe(), input.statistics());
        // Whoever reads only the first lines has what they want: a closed pipe is no failure.
        writeln!(std::io::stdout(), "{what}{statistics}").ok();
        writeln!(std::io::stdout(), "{}", input.plan(scene)?).ok();
        return Ok(());
    }
    if arguments.list_adapters {
        for adapter in support::matching_adapters(Some("")).map_err(Problem::trouble)? {
            println!("{}", support::adapter_name(&adapter.get_info()));
        }
        return Ok(());
    }
    match &arguments.volume {
        Some(volume) => render(arguments, volume),
        None => Err(Problem::input("no volume given").hint("see --help")),
    }
}

fn render(arguments: &Arguments, volume: &str) -> Result<(), Problem> {
    let files = [&arguments.color, &arguments.depth, &arguments.report];
    for path in files.into_iter().flatten() {
        check_folder(path)?;
    }
    let strategy = arguments.traversal()?;
    let input = Input::read(volume, &arguments.input)?;
    print!("{}", input.describe());
    let isovalue = arguments.iso.unwrap_or_else(|| input.suggested_isovalue());
    let origin = if arguments.iso.is_some() { "" } else { " suggested, see --iso" };
    println!("isovalue      {isovalue}{origin}");
    let volume = CompressedVolume::try_from(&input.volume)?;
    let camera = camera(&arguments.camera, &volume, arguments.scene.size)?;

    let gpu = open_device(arguments.adapter.as_deref())?;
    println!("adapter       {}", gpu.name());
    let capture = arguments.color.is_some() || arguments.depth.is_some();
    let options = RendererOptions {
        size: arguments.scene.size,
        budget_bytes: arguments.scene.budget << 20,
        outputs: Outputs { depth: arguments.depth.is_some(), ..Default::default() },
        capture,
        strategy,
        residency: arguments.scene.residency.into(),
        ..Default::default()
    };
    let begin = Instant::now();
    let mut renderer = ProgressiveIsoRenderer::new(&gpu.device, &gpu.queue, volume, options)?;
    let setup_ms = begin.elapsed().as_secs_f64() * 1e3;
    let mut options = FrameOptions {
        shading: Shading { unfinished: support::UNFINISHED, ..Default::default() },
        rounds_per_pass: arguments.rounds_per_pass,
        ..Default::default()
    };
    if let Some(blocks) = arguments.look_ahead {
        options.look_ahead = blocks;
    }
    renderer.set_frame(&Frame { camera, isovalues: vec![isovalue], options })?;
    let passes = run_passes(&gpu, &mut renderer, arguments.stop)?;
    if capture {
        let capture = renderer.capture_blocking(&gpu.device, &gpu.queue)?;
        write_pictures(arguments, &capture)?;
    }
    if let Some(path) = &arguments.report {
        Report::new(&gpu, &input.name, &renderer, isovalue, setup_ms, passes)
            .write(path)
            .map_err(Problem::trouble)?;
        println!("report        {}", path.display());
    }
    if files.iter().all(|file| file.is_none()) {
        println!("nothing written, see --color, --depth and --report");
    }
    Ok(())
}

/// Found before rendering rather than after.
fn check_folder(path: &Path) -> Result<(), Problem> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    if path.is_dir() {
        return Err(Problem::input(format!("{} is a folder", path.display())));
    }
    match folder {
        Some(folder) if !folder.is_dir() => {
            let message = format!("cannot write {}", path.display());
            Err(Problem::input(message).hint(format!("make the folder {} first", folder.display())))
        }
        _ => Ok(()),
    }
}

fn open_device(wanted: Option<&str>) -> Result<Gpu, Problem> {
    let adapters = support::matching_adapters(wanted).map_err(|error| match wanted {
        Some(_) => Problem::input(error).hint("see --list-adapters"),
        None => Problem::trouble(error),
    })?;
    let gpu = Gpu::open(&adapters).map_err(Problem::trouble)?;
    // Without a handler wgpu panics, for example when the device's memory is full.
    gpu.device.on_uncaptured_error(Arc::new(|error: wgpu::Error| {
        eprintln!("render: the device failed: {error}");
        std::process::exit(1);
    }));
    Ok(gpu)
}

fn camera(
    options: &CameraOptions,
    volume: &CompressedVolume,
    [width, height]: [u32; 2],
) -> Result<Camera, Problem> {
    let (center, radius) = volume.bounding_ball();
    let aspect = f64::from(width) / f64::from(height);
    let Some(eye) = options.eye else {
        let [azimuth, elevation] = options.orbit.unwrap_or(DEFAULT_ORBIT);
        let mut camera = Camera::orbit(center, radius, azimuth, elevation, options.fov, aspect);
        if let Some(height) = options.ortho {
            // The projection alone differs: depths are those from the perspective's eye.
            let (up, far) = ([0.0, 1.0, 0.0], 1e3 * radius);
            let parallel =
                Camera::orthographic([0.0; 3], [0.0, 0.0, -1.0], up, height, aspect, 0.0, far);
            camera.clip_from_view = parallel.clip_from_view;
        }
        return Ok(camera);
    };
    let target = options.target.unwrap_or(center);
    let up = options.up.unwrap_or([0.0, 1.0, 0.0]);
    let distance = |to: [f64; 3]| (0..3).map(|a| (eye[a] - to[a]).powi(2)).sum::<f64>().sqrt();
    if distance(target) == 0.0 {
        return Err(Problem::input(format!("--eye and --target are both {eye:?}")));
    }
    if up == [0.0; 3] {
        return Err(Problem::input("--up has no direction"));
    }
    // Nothing is cut off: rays start at the near distance and end with the volume.
    let far = 2.0 * (distance(center) + radius).max(f64::MIN_POSITIVE);
    let near = 1e-7 * far;
    Ok(match options.ortho {
        Some(height) => Camera::orthographic(eye, target, up, height, aspect, 0.0, far),
        None => Camera::perspective(eye, target, up, options.fov, aspect, near, far),
    })
}

fn run_passes(
    gpu: &Gpu,
    renderer: &mut ProgressiveIsoRenderer,
    stop: f64,
) -> Result<Vec<PassEntry>, Problem> {
    println!("\n{}", PassEntry::HEAD);
    let mut passes: Vec<PassEntry> = Vec::new();
    let begin = Instant::now();
    renderer.render_to_completion(&gpu.device, &gpu.queue, |_, report| {
        if report.pass == 0 {
            return true;
        }
        let entry = PassEntry::new(report, begin.elapsed().as_secs_f64() * 1e3);
        println!("{}", entry.line());
        let go_on = entry.completeness < stop;
        passes.push(entry);
        go_on
    })?;
    if let Some(last) = passes.last() {
        let (count, peak) = (passes.len(), last.peak_bytes);
        let percent = last.completeness * 100.0;
        println!(
            "\n{count} passes, {percent:.2}% complete, {} surface pixels, {peak} bytes at most",
            last.hits
        );
        if last.hits == 0 && last.active_rays == 0 {
            println!("no surface in the picture: `render info` shows the range of the values");
        }
    }
    Ok(passes)
}

fn write_pictures(arguments: &Arguments, capture: &Capture) -> Result<(), Problem> {
    if let Some(path) = &arguments.color {
        support::write_png(path, capture).map_err(Problem::trouble)?;
        println!("color         {}", path.display());
    }
    if let Some(path) = &arguments.depth {
        support::write_depth_exr(path, capture).map_err(Problem::trouble)?;
        println!("depth         {}", path.display());
    }
    Ok(())
}
