//! Devices that fail: a typed error, never a panic, never a wrong picture shown as finished, and the same
//! volume goes on with another renderer.

use gpu_testkit::gpu;
use progressive_iso::{
    Capture, Error, Frame, PassReport, ProgressiveIsoRenderer, RendererOptions, Residency, wgpu,
};

use crate::invariance::{minimum_budget, same_picture};
use crate::support::{Gpu, Scene, options};

const SIZE: [u32; 2] = [48, 36];

/// No call after a fault takes longer than this many others to say so.
const CALLS: usize = 8;

fn scene() -> Scene {
    Scene::generated("gyroid", [34, 29, 23], 8.0)
}

fn frame(scene: &Scene) -> Frame {
    scene.frame(scene.orbit(20.0, 10.0, SIZE))
}

/// Few slots, so that a frame takes many passes.
fn small(scene: &Scene) -> RendererOptions {
    RendererOptions { budget_bytes: minimum_budget(scene, &options(SIZE)), ..options(SIZE) }
}

fn expected(scene: &Scene) -> Capture {
    Gpu::new().render(scene, options(SIZE), &frame(scene))
}

/// Passes until `stop` or the frame is complete.
fn passes(
    gpu: &Gpu,
    renderer: &mut ProgressiveIsoRenderer,
    mut stop: impl FnMut(&PassReport) -> bool,
) {
    renderer.render_to_completion(&gpu.device, &gpu.queue, |_, report| !stop(report)).unwrap();
}

/// The error that passes come to; every report before it belongs to an unfinished frame.
fn fault(gpu: &Gpu, renderer: &mut ProgressiveIsoRenderer) -> Error {
    for _ in 0..CALLS {
        match renderer.render_pass(&gpu.device, &gpu.queue) {
            Ok(report) => assert!(!report.complete()),
            Err(error) => {
                assert!(!renderer.poll_report().complete());
                let again = renderer.render_pass(&gpu.device, &gpu.queue).unwrap_err();
                assert_eq!(again, error, "it stays");
                return error;
            }
        }
        poll(gpu);
    }
    panic!("no error in {CALLS} calls");
}

#[expect(clippy::disallowed_methods, reason = "a test is the caller that waits")]
fn poll(gpu: &Gpu) {
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
}

#[test]
fn a_lost_device_is_an_error_and_the_volume_goes_on_on_another() {
    let scene = scene();
    let expected = expected(&scene);
    let loading = |_: &PassReport| true;
    let early = |report: &PassReport| report.pass == 2;
    let never = |_: &PassReport| false;
    type Stop = fn(&PassReport) -> bool;
    let moments: [(&str, Stop); 3] =
        [("loading", loading), ("within a frame", early), ("after a frame", never)];
    for (moment, stop) in moments {
        let gpu = Gpu::new();
        let mut renderer = gpu.renderer(&scene, small(&scene));
        renderer.set_frame(&frame(&scene)).unwrap();
        passes(&gpu, &mut renderer, stop);
        gpu.device.destroy();
        renderer.set_frame(&frame(&scene)).unwrap();
        assert_eq!(fault(&gpu, &mut renderer), Error::DeviceLost, "{moment}");
        let picture = renderer.capture_blocking(&gpu.device, &gpu.queue);
        assert_eq!(picture.unwrap_err(), Error::DeviceLost, "{moment}");

        let other = Gpu::new();
        let volume = renderer.volume().clone();
        drop(renderer);
        let mut renderer =
            ProgressiveIsoRenderer::new(&other.device, &other.queue, volume, small(&scene))
                .unwrap();
        same_picture(&other.finish(&mut renderer, &frame(&scene)), &expected).unwrap();
    }
}

#[test]
fn waiting_for_a_lost_device_ends() {
    let (gpu, scene) = (Gpu::new(), scene());
    let mut renderer = gpu.renderer(&scene, small(&scene));
    renderer.set_frame(&frame(&scene)).unwrap();
    let done = renderer.render_to_completion(&gpu.device, &gpu.queue, |_, report| {
        if report.pass == 2 {
            gpu.device.destroy();
        }
        true
    });
    assert_eq!(done.unwrap_err(), Error::DeviceLost);
    assert!(!renderer.poll_report().complete());
}

#[test]
fn there_is_no_renderer_on_a_lost_device() {
    let (gpu, scene) = (Gpu::new(), scene());
    gpu.device.destroy();
    let (volume, options) = (scene.compressed(), options(SIZE));
    let found = ProgressiveIsoRenderer::new(&gpu.device, &gpu.queue, volume, options);
    assert_eq!(found.unwrap_err(), Error::DeviceLost);
}

/// The kernels' workgroups have up to 256 invocations in a row.
#[test]
fn a_shader_that_the_device_refuses_is_an_error() {
    let limits = wgpu::Limits { max_compute_workgroup_size_x: 128, ..wgpu::Limits::default() };
    let (gpu, scene) = (Gpu::with_limits(limits), scene());
    for residency in [Residency::Cached, Residency::Full] {
        let options = RendererOptions { residency, ..options(SIZE) };
        let volume = scene.compressed();
        let found = ProgressiveIsoRenderer::new(&gpu.device, &gpu.queue, volume, options);
        let found = found.unwrap_err();
        assert!(matches!(found, Error::ShaderRefused { .. }), "{found:?}");
        assert!(found.to_string().contains("256"), "{found}");
    }
}

/// What a driver does that takes all commands and runs none: counters come back as zeros, which would
/// read as a finished picture.
#[test]
fn passes_that_do_not_run_are_an_error() {
    let (device, queue) = gpu::noop_device(wgpu::Limits::default());
    let (gpu, scene) = (Gpu { device, queue }, scene());
    for residency in [Residency::Cached, Residency::Full] {
        let mut renderer = gpu.renderer(&scene, RendererOptions { residency, ..options(SIZE) });
        renderer.set_frame(&frame(&scene)).unwrap();
        assert_eq!(fault(&gpu, &mut renderer), Error::NotRun);
        let mut renderer = gpu.renderer(&scene, RendererOptions { residency, ..options(SIZE) });
        renderer.set_frame(&frame(&scene)).unwrap();
        let done = renderer.render_to_completion(&gpu.device, &gpu.queue, |_, _| true);
        assert_eq!(done.unwrap_err(), Error::NotRun);
    }
}

#[test]
fn a_pass_that_the_device_refuses_is_an_error() {
    let (gpu, scene) = (Gpu::new(), scene());
    for by_encoder in [false, true] {
        let mut renderer = gpu.renderer(&scene, small(&scene));
        renderer.set_frame(&frame(&scene)).unwrap();
        passes(&gpu, &mut renderer, |report| report.pass == 2);
        renderer.textures().color().destroy();
        if by_encoder {
            let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            assert!(renderer.encode_pass(&gpu.device, &mut encoder).unwrap().submitted);
            gpu::submit_and_wait(&gpu.device, &gpu.queue, encoder);
            let caught = pollster::block_on(scope.pop());
            assert!(caught.is_some(), "what the caller submits, the caller is told");
            assert_eq!(fault(&gpu, &mut renderer), Error::NotRun);
        } else {
            let found = fault(&gpu, &mut renderer);
            assert!(matches!(found, Error::Refused { .. }), "{found:?}");
        }
    }
}

/// A refused submission maps staging buffers that nothing was copied to.
#[test]
fn a_capture_that_does_not_run_gives_no_picture() {
    let (gpu, scene) = (Gpu::new(), scene());
    let mut renderer = gpu.renderer(&scene, options(SIZE));
    gpu.finish(&mut renderer, &frame(&scene));
    let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut pending = renderer.capture(&gpu.device, &mut encoder).unwrap();
    renderer.textures().color().destroy();
    gpu::submit_and_wait(&gpu.device, &gpu.queue, encoder);
    assert!(pollster::block_on(scope.pop()).is_some());
    assert!(pending.try_take().is_none());
    assert!(pending.is_lost());
    let found = renderer.capture_blocking(&gpu.device, &gpu.queue).unwrap_err();
    assert!(matches!(found, Error::Refused { .. }), "{found:?}");
}

/// Pass `dropped` of every frame is recorded and never submitted: as the last of the passes in flight, or
/// with one behind it.
#[test]
fn a_dropped_encoder_starts_the_frame_again() {
    let (gpu, scene) = (Gpu::new(), scene());
    let expected = expected(&scene);
    for (dropped, behind) in [(1, false), (1, true), (2, false), (2, true)] {
        let mut renderer = gpu.renderer(&scene, small(&scene));
        renderer.set_frame(&frame(&scene)).unwrap();
        while renderer.poll_report().loaded < 1.0 {
            renderer.render_pass(&gpu.device, &gpu.queue).unwrap();
            poll(&gpu);
        }
        // The pass that found the volume loaded was one of the frame's: begin another one, for which no block
        // is active, so that its masks are of no use to the next.
        let mut again = frame(&scene);
        again.isovalues[0] = 1e6;
        gpu.finish(&mut renderer, &again);
        renderer.set_frame(&frame(&scene)).unwrap();
        for _ in 1..dropped {
            renderer.render_pass(&gpu.device, &gpu.queue).unwrap();
            poll(&gpu);
        }
        let encoder = || gpu.device.create_command_encoder(&Default::default());
        let (mut first, mut second) = (encoder(), encoder());
        assert!(renderer.encode_pass(&gpu.device, &mut first).unwrap().submitted);
        if behind {
            assert!(renderer.encode_pass(&gpu.device, &mut second).unwrap().submitted);
            gpu::submit_and_wait(&gpu.device, &gpu.queue, second);
        }
        drop(first);
        let before = renderer.poll_report();
        assert!(!before.complete());
        let report = renderer.render_to_completion(&gpu.device, &gpu.queue, |_, _| true).unwrap();
        assert!(report.complete());
        let found = renderer.capture_blocking(&gpu.device, &gpu.queue).unwrap();
        same_picture(&found, &expected).unwrap();
    }
}

#[test]
fn a_dropped_encoder_that_loads_is_an_error() {
    let (gpu, scene) = (Gpu::new(), scene());
    let mut renderer = gpu.renderer(&scene, options(SIZE));
    renderer.set_frame(&frame(&scene)).unwrap();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    assert!(renderer.encode_pass(&gpu.device, &mut encoder).unwrap().submitted);
    drop(encoder);
    assert_eq!(fault(&gpu, &mut renderer), Error::LoadDropped);
}

/// Set for the child of the test below.
const LITTLE_MEMORY: &str = "PROGRESSIVE_ISO_TEST_LITTLE_MEMORY";

/// Buffers of the noop device lie in the process's memory: a process that may have no more than 450 MiB gets no
/// page of 512 MiB, and says so as a driver would. In a process of its own, because the limit holds for all.
#[cfg(target_os = "linux")]
#[test]
fn want_of_memory_is_an_error() {
    if std::env::var_os(LITTLE_MEMORY).is_some() {
        return without_memory();
    }
    let test = std::env::current_exe().unwrap();
    let arguments = ["--exact", "faults::want_of_memory_is_an_error", "--nocapture"];
    let output = std::process::Command::new("sh")
        .args(["-c", "ulimit -v 460800 && exec \"$0\" \"$@\""])
        .arg(test)
        .args(arguments)
        .env(LITTLE_MEMORY, "1")
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    println!("{text}\n{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success() && text.contains("1 passed"));
    assert!(text.contains("with all samples: the device is out of memory"));
    assert!(text.contains("with a cache: the device is out of memory"));
}

#[cfg(target_os = "linux")]
fn without_memory() {
    let limits = wgpu::Limits {
        max_buffer_size: (2 << 30) - 4,
        max_storage_buffer_binding_size: (2 << 30) - 4,
        ..wgpu::Limits::default()
    };
    let (device, queue) = gpu::noop_device(limits);
    // 6.3 million blocks of 16 bits: 12 MiB of stream, 1.5 GiB of samples.
    let volume = || {
        let bytes = std::sync::Arc::new(vec![0u8; 12 << 20]);
        progressive_iso::CompressedVolume::new([1024, 1024, 384], 16, 0, bytes).unwrap()
    };
    let options = |residency| RendererOptions {
        residency,
        budget_bytes: 8 << 30,
        size: SIZE,
        ..RendererOptions::default()
    };
    let full = options(Residency::Full);
    let found = ProgressiveIsoRenderer::new(&device, &queue, volume(), full).unwrap_err();
    assert!(matches!(found, Error::OutOfMemory { .. }), "{found:?}");
    println!("with all samples: {found}");
    // The cache is made when the volume is loaded.
    let cached = options(Residency::Cached);
    let mut renderer = ProgressiveIsoRenderer::new(&device, &queue, volume(), cached).unwrap();
    let (center, radius) = renderer.volume().bounding_ball();
    let camera = progressive_iso::Camera::orbit(center, radius, 0.0, 0.0, 40.0, 1.0);
    renderer.set_frame(&crate::support::frame(camera, 0.5)).unwrap();
    let found = renderer.render_to_completion(&device, &queue, |_, _| true).unwrap_err();
    assert!(matches!(found, Error::OutOfMemory { .. }), "{found:?}");
    assert!(!renderer.poll_report().complete());
    println!("with a cache: {found}");
}
