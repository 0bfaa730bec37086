//! Wrong input gives a typed error that says what was expected, and changes nothing.

use std::sync::Arc;

use progressive_iso::{
    Camera, CompressedVolume, Error, Frame, ProgressiveIsoRenderer, RendererOptions, ScenePlan,
    wgpu,
};

use crate::invariance::same_picture;
use crate::support::{Gpu, Scene, options};

const SIZE: [u32; 2] = [32, 24];

fn scene() -> Scene {
    Scene::generated("gyroid", [14, 11, 9], 8.0)
}

#[test]
fn frames_that_cannot_be_shown_are_refused_and_the_last_one_stays() {
    let gpu = Gpu::new();
    let scene = scene();
    let mut renderer = gpu.renderer(&scene, options(SIZE));
    let good = scene.frame(scene.orbit(20.0, 10.0, SIZE));
    let expected = gpu.finish(&mut renderer, &good);

    let with_isovalues =
        |isovalues: &[f32]| Frame { isovalues: isovalues.to_vec(), ..good.clone() };
    let camera = |change: &dyn Fn(&mut Camera)| {
        let mut frame = good.clone();
        change(&mut frame.camera);
        frame
    };
    let error = |renderer: &mut ProgressiveIsoRenderer, frame: &Frame| {
        renderer.set_frame(frame).unwrap_err()
    };
    for (count, isovalues) in [(0, &[][..]), (2, &[0.0, 0.1])] {
        let found = error(&mut renderer, &with_isovalues(isovalues));
        assert_eq!(found, Error::IsovalueCount { found: count });
    }
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -2.2e37] {
        let found = error(&mut renderer, &with_isovalues(&[bad]));
        assert!(matches!(found, Error::Isovalue { .. }), "{bad}: {found}");
    }
    let flat = camera(&|c| c.view_from_world[0] = [0.0; 4]);
    let squashed = camera(&|c| c.clip_from_view[1] = [0.0; 4]);
    let undefined = camera(&|c| c.view_from_world[3][1] = f64::NAN);
    let infinite = camera(&|c| c.clip_from_view[2][2] = f64::INFINITY);
    let sheared = camera(&|c| c.clip_from_view[0][3] = 0.5);
    for (frame, word) in [
        (flat, "cannot be inverted"),
        (squashed, "cannot be inverted"),
        (undefined, "view_from_world"),
        (infinite, "clip_from_view"),
        (sheared, "last row"),
    ] {
        let found = error(&mut renderer, &frame);
        assert!(matches!(found, Error::Wavefront(_)), "{found:?}");
        assert!(found.to_string().contains(word), "{found}");
    }
    let found = renderer.capture_blocking(&gpu.device, &gpu.queue).unwrap();
    same_picture(&found, &expected).unwrap();
    assert!(renderer.poll_report().complete(), "a refused frame does not count");
}

#[test]
fn a_placement_that_cannot_be_inverted_is_refused() {
    let gpu = Gpu::new();
    let good = scene();
    for world_from_index in
        [CompressedVolume::placed([1.0, 0.0, 1.0], [0.0; 3]), [[f64::NAN; 4]; 4]]
    {
        let scene = scene().placed(world_from_index);
        let mut renderer = gpu.renderer(&scene, options(SIZE));
        let frame = scene.frame(good.orbit(0.0, 0.0, SIZE));
        let found = renderer.set_frame(&frame).unwrap_err();
        assert!(matches!(found, Error::Wavefront(_)), "{found}");
    }
}

#[test]
fn impossible_pictures_are_refused() {
    let volume = scene().compressed();
    let limits = wgpu::Limits::default();
    for size in [[0, 10], [10, 0], [8193, 1], [1, 8193], [8000, 8000], [u32::MAX, u32::MAX]] {
        let found = ScenePlan::new(&volume, &options(size), &limits).unwrap_err();
        assert!(matches!(found, Error::Wavefront(_)), "{size:?}: {found}");
        assert!(found.to_string().contains("pixels"), "{found}");
    }
    let budget_bytes = 0;
    let found =
        ScenePlan::new(&volume, &RendererOptions { budget_bytes, ..options(SIZE) }, &limits);
    assert!(matches!(found, Err(Error::BudgetTooSmall { budget: 0, .. })));
}

#[test]
fn devices_below_the_default_limits_are_refused() {
    let volume = scene().compressed();
    let changes: [fn(&mut wgpu::Limits); 5] = [
        |l| l.max_storage_buffers_per_shader_stage = 7,
        |l| l.max_storage_textures_per_shader_stage = 3,
        |l| l.max_compute_invocations_per_workgroup = 128,
        |l| l.max_compute_workgroups_per_dimension = 60_000,
        |l| l.max_compute_workgroup_storage_size = 8 << 10,
    ];
    for change in changes {
        let mut limits = wgpu::Limits::default();
        change(&mut limits);
        let found = ScenePlan::new(&volume, &options(SIZE), &limits).unwrap_err();
        assert!(matches!(found, Error::UnsupportedDevice { .. }), "{found}");
    }
}

#[test]
fn streams_that_do_not_fit_are_refused() {
    let good = scene().volume;
    let bytes = |n: usize| Arc::new(good.bytes[..n].to_vec());
    let new = |dims, bits, first_bit, n| CompressedVolume::new(dims, bits, first_bit, bytes(n));
    let needed = good.dims.map(|n| u64::from(n.div_ceil(4))).iter().product::<u64>() * 64;
    assert!(new(good.dims, 512, 0, needed as usize).is_ok());
    let short = new(good.dims, 512, 0, needed as usize - 1).unwrap_err();
    assert_eq!(
        short,
        Error::ShortStream {
            dims: good.dims,
            bits_per_block: 512,
            expected: needed,
            found: needed - 1
        }
    );
    assert!(matches!(new(good.dims, 512, 8, needed as usize), Err(Error::ShortStream { .. })));
    assert!(matches!(new([0, 4, 4], 512, 0, 64), Err(Error::Stream(_))));
    assert!(matches!(new([4, 4, 4], 8, 0, 64), Err(Error::Stream(_))));
    let huge = [u32::MAX, u32::MAX, u32::MAX];
    assert!(matches!(
        new(huge, 512, u64::MAX, 64),
        Err(Error::Stream(_) | Error::ShortStream { .. })
    ));
}

#[test]
fn what_was_not_planned_is_refused() {
    let gpu = Gpu::new();
    let scene = scene();
    let mut renderer = gpu.renderer(&scene, RendererOptions { capture: false, ..options(SIZE) });
    let early = renderer.render_pass(&gpu.device, &gpu.queue);
    assert_eq!(early.unwrap_err(), Error::NoFrame);
    let early = renderer.render_to_completion(&gpu.device, &gpu.queue, |_, _| true);
    assert_eq!(early.unwrap_err(), Error::NoFrame);
    let picture = renderer.capture_blocking(&gpu.device, &gpu.queue);
    assert_eq!(picture.unwrap_err(), Error::CaptureNotPlanned);
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: renderer.color_view(),
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations::default(),
        })],
        ..wgpu::RenderPassDescriptor::default()
    });
    assert_eq!(renderer.draw(&mut pass), Err(Error::DrawNotPlanned));
    drop(pass);
}
