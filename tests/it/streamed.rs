//! Streams that arrive while they are uploaded, and options that change on a loaded volume.

use progressive_iso::{
    BlockSortedOptions, CompressedVolume, Error, Outputs, ProgressiveIsoRenderer, RendererOptions,
    Residency, StreamFeed, TraversalStrategy, wgpu,
};

use crate::invariance::same_picture;
use crate::support::{ALL_OUTPUTS, Gpu, Scene, options};

const SIZE: [u32; 2] = [64, 48];

fn scene() -> Scene {
    Scene::generated("gyroid", [60, 57, 58], 8.0)
}

/// The volume of a scene, and the end at which its stream arrives.
fn streamed(scene: &Scene) -> (CompressedVolume, StreamFeed) {
    let volume = &scene.volume;
    CompressedVolume::streamed(volume.dims, volume.bits_per_block, volume.first_bit).unwrap()
}

/// Submits what can be submitted; true while anything can.
fn step(gpu: &Gpu, renderer: &mut ProgressiveIsoRenderer) -> Result<bool, Error> {
    let report = renderer.render_pass(&gpu.device, &gpu.queue)?;
    #[expect(clippy::disallowed_methods, reason = "the test owns the loop")]
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    Ok(report.submitted)
}

#[test]
fn a_stream_in_pieces_makes_the_same_picture() {
    let (gpu, scene) = (Gpu::new(), scene());
    let frame = scene.frame(scene.orbit(15.0, 20.0, SIZE));
    for residency in [Residency::Cached, Residency::Full] {
        let options = RendererOptions { residency, ..options(SIZE) };
        let expected = gpu.render(&scene, options, &frame);
        for piece in [1001, 4096, 1 << 20] {
            let (volume, feed) = streamed(&scene);
            let mut renderer =
                ProgressiveIsoRenderer::new(&gpu.device, &gpu.queue, volume, options).unwrap();
            renderer.set_frame(&frame).unwrap();
            let mut loaded = 0.0;
            for bytes in scene.volume.bytes.chunks(piece) {
                // Nothing is there to record, and the wait is no fault.
                assert!(!step(&gpu, &mut renderer).unwrap());
                feed.push(bytes);
                assert_eq!(feed.waiting_bytes(), bytes.len() as u64);
                while step(&gpu, &mut renderer).unwrap() {}
                assert_eq!(feed.waiting_bytes(), 0, "bytes are let go");
                let report = renderer.poll_report();
                assert!(report.loaded > loaded, "pieces of {piece} bytes");
                loaded = report.loaded;
            }
            drop(feed);
            same_picture(&gpu.finish(&mut renderer, &frame), &expected).unwrap();
            assert!(renderer.poll_report().peak_bytes <= renderer.plan().bytes());
        }
    }
}

#[test]
fn a_stream_that_ends_early_is_an_error() {
    let (gpu, scene) = (Gpu::new(), scene());
    let (volume, feed) = streamed(&scene);
    let options = options(SIZE);
    let mut renderer =
        ProgressiveIsoRenderer::new(&gpu.device, &gpu.queue, volume, options).unwrap();
    renderer.set_frame(&scene.frame(scene.orbit(0.0, 0.0, SIZE))).unwrap();
    feed.push(&scene.volume.bytes[..1000]);
    drop(feed);
    assert!(step(&gpu, &mut renderer).unwrap());
    for _ in 0..2 {
        let found = step(&gpu, &mut renderer);
        assert!(matches!(found, Err(Error::ShortStream { found: 1000, .. })), "{found:?}");
    }
}

#[test]
fn one_renderer_loads_a_stream() {
    let (gpu, scene) = (Gpu::new(), scene());
    let (volume, feed) = streamed(&scene);
    feed.push(&*scene.volume.bytes);
    let new = |volume| {
        ProgressiveIsoRenderer::new(&gpu.device, &gpu.queue, volume, options(SIZE)).unwrap()
    };
    let frame = scene.frame(scene.orbit(0.0, 0.0, SIZE));
    let mut first = new(volume.clone());
    gpu.finish(&mut first, &frame);
    let mut second = new(volume);
    second.set_frame(&frame).unwrap();
    assert!(matches!(step(&gpu, &mut second), Err(Error::StreamTaken)));
}

#[test]
fn options_change_on_a_loaded_volume() {
    let (gpu, scene) = (Gpu::new(), scene());
    let (volume, feed) = streamed(&scene);
    feed.push(&*scene.volume.bytes);
    let auto = RendererOptions { residency: Residency::Auto, ..options(SIZE) };
    let mut renderer = ProgressiveIsoRenderer::new(&gpu.device, &gpu.queue, volume, auto).unwrap();
    let frame = scene.frame(scene.orbit(15.0, 20.0, SIZE));
    let expected = gpu.finish(&mut renderer, &frame);
    assert_eq!(renderer.plan().residency(), Residency::Full);
    let sorted = TraversalStrategy::BlockSorted(BlockSortedOptions::default());
    let small = Some(40);
    let changes = [
        RendererOptions { budget_bytes: auto.budget_bytes / 2, ..auto },
        RendererOptions { strategy: sorted, ..auto },
        RendererOptions { strategy: sorted, most_slots: small, ..auto },
        RendererOptions { most_slots: small, ..auto },
        RendererOptions { size: [32, 24], ..auto },
        auto,
    ];
    let residencies = [Residency::Full].into_iter().chain([Residency::Cached; 5]);
    for (options, residency) in changes.into_iter().zip(residencies) {
        renderer.set_options(&gpu.device, options).unwrap();
        assert_eq!(renderer.plan().residency(), residency, "{options:?}");
        let frame = scene.frame(scene.orbit(15.0, 20.0, options.size));
        let found = gpu.finish(&mut renderer, &frame);
        let fresh = gpu.render(&scene, options, &frame);
        same_picture(&found, &fresh).unwrap();
        let report = renderer.poll_report();
        assert!(report.bytes <= renderer.plan().rendering_bytes(), "{options:?}");
        assert!(report.peak_bytes <= auto.budget_bytes);
    }
    same_picture(&gpu.finish(&mut renderer, &frame), &expected).unwrap();
}

#[test]
fn pictures_come_and_go_with_the_options() {
    let (gpu, scene) = (Gpu::new(), scene());
    let options = options(SIZE);
    let frame = scene.frame(scene.orbit(15.0, 20.0, SIZE));
    let mut renderer = gpu.renderer(&scene, options);
    let expected = gpu.finish(&mut renderer, &frame);
    for outputs in [Outputs::default(), Outputs { depth: true, ..Outputs::default() }, ALL_OUTPUTS]
    {
        renderer.set_options(&gpu.device, RendererOptions { outputs, ..options }).unwrap();
        let found = gpu.finish(&mut renderer, &frame);
        assert_eq!(found.color, expected.color);
        assert_eq!(found.depth.is_some(), outputs.depth);
        assert_eq!(found.status.is_some(), outputs.status);
    }
    same_picture(&gpu.finish(&mut renderer, &frame), &expected).unwrap();
}

#[test]
fn refused_options_change_nothing() {
    let (gpu, scene) = (Gpu::new(), scene());
    let frame = scene.frame(scene.orbit(15.0, 20.0, SIZE));
    let options = options(SIZE);
    let mut renderer = gpu.renderer(&scene, options);
    let expected = gpu.finish(&mut renderer, &frame);
    let tight = RendererOptions { budget_bytes: 1000, ..options };
    let refused = renderer.set_options(&gpu.device, tight);
    assert!(matches!(refused, Err(Error::BudgetTooSmall { .. })), "{refused:?}");
    same_picture(&gpu.finish(&mut renderer, &frame), &expected).unwrap();
}
