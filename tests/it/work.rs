//! Work of a dispatch: never more than the bound, whatever the view.

use std::time::Instant;

use progressive_iso::{Camera, FrameOptions, PassReport, RendererOptions, Residency};

use crate::suite::random::Random;
use crate::support::{Gpu, Scene, aspect, options};

/// As many rays as are walked at a time.
const SIZE: [u32; 2] = [1920, 1088];

/// White noise, and an isovalue above all but 1 % of it.
fn noise(dims: [u32; 3]) -> Scene {
    let mut random = Random::new(1);
    let samples: Vec<f32> =
        (0..dims.iter().product()).map(|_: u32| random.between(0.0, 1.0) as f32).collect();
    let mut scene = Scene::generated("gyroid", dims, 8.0);
    scene.volume = volume_io::encode(&samples, dims, 8.0).unwrap();
    let mut sorted = scene.volume.decode();
    sorted.sort_by(f32::total_cmp);
    scene.isovalue = sorted[sorted.len() - sorted.len() / 100];
    scene
}

/// Rays between the hits of dense noise: just below its largest samples most blocks are active and few
/// have a surface.
#[test]
fn work_stays_within_the_bound_in_dense_noise() {
    let gpu = Gpu::new();
    let scene = noise([96; 3]);
    for residency in [Residency::Full, Residency::Cached] {
        let options =
            RendererOptions { residency, size: SIZE, budget_bytes: 512 << 20, ..options(SIZE) };
        let mut renderer = gpu.renderer(&scene, options);
        // So near that every ray enters.
        let (center, radius) = scene.compressed().bounding_ball();
        let camera = Camera::orbit(center, 0.3 * radius, 33.0, 21.0, 40.0, aspect(SIZE));
        let mut frame = scene.frame(camera);
        frame.options = FrameOptions { rounds_per_pass: 1, ..frame.options };
        let bound = renderer.plan().work().blocks_decoded;
        // Cold, then with everything at hand and the bound that the first frame's times led to.
        let mut cut_walks = 0;
        for _ in 0..2 {
            renderer.set_frame(&frame).unwrap();
            let (mut decoded, mut worst_ms, mut last) = (0, 0.0f64, Instant::now());
            let mut check = |report: &PassReport| {
                worst_ms = worst_ms.max(1e3 * last.elapsed().as_secs_f64());
                last = Instant::now();
                assert!(report.most_cells <= report.cells_bound, "{report:?}");
                assert!(u64::from(report.blocks_decoded - decoded) <= bound, "{report:?}");
                decoded = report.blocks_decoded;
                true
            };
            let (device, queue) = (&gpu.device, &gpu.queue);
            let report =
                renderer.render_to_completion(device, queue, |_, report| check(report)).unwrap();
            assert!(report.complete() && report.most_cells > report.entered_rays, "{report:?}");
            cut_walks += report.cut_walks;
            println!(
                "{residency:?}: {} rounds, worst step {worst_ms:.0} ms, at most {} of {} cells, {} cut",
                report.rounds, report.most_cells, report.cells_bound, report.cut_walks
            );
        }
        assert!(cut_walks > 0, "the bound is never reached");
    }
}
