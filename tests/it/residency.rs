//! A volume that is resident as a whole makes the same pictures, in one pass, and needs no cache.

use progressive_iso::{
    BlockSortedOptions, Camera, Capture, Category, Error, Outputs, PassReport, PixelStatus,
    ProgressiveIsoRenderer, RendererOptions, Residency, ScenePlan, TraversalStrategy, wgpu,
};

use crate::invariance::same_picture;
use crate::support::{Gpu, Scene, hit_count, options};

const SIZE: [u32; 2] = [64, 48];

fn with(residency: Residency) -> RendererOptions {
    RendererOptions { residency, ..options(SIZE) }
}

fn plan(scene: &Scene, options: &RendererOptions) -> Result<ScenePlan, Error> {
    ScenePlan::new(&scene.compressed(), options, &wgpu::Limits::default())
}

/// The least budget with which the whole volume can be resident.
fn minimum_full(scene: &Scene, options: &RendererOptions) -> u64 {
    let tight = RendererOptions { budget_bytes: 1, residency: Residency::Full, ..*options };
    match plan(scene, &tight) {
        Err(Error::BudgetTooSmall { minimum, .. }) => minimum,
        other => panic!("{other:?}"),
    }
}

fn bytes_of(renderer: &ProgressiveIsoRenderer, category: Category) -> u64 {
    let all = renderer.bytes_by_category();
    all.iter().find(|(c, _)| *c == category).map_or(0, |&(_, bytes)| bytes)
}

#[test]
fn both_residencies_make_the_same_picture() {
    let gpu = Gpu::new();
    // The last two have no active block, so no ray is ever active.
    for (name, dims, rate, rounds) in [
        ("gyroid", [37, 26, 31], 9.0, 1),
        ("turbulence", [70, 65, 33], 4.0, 1),
        ("rough-solid", [40, 41, 43], 6.0, 1),
        ("sphere", [2, 3, 2], 16.0, 0),
        ("plane", [5, 1, 4], 16.0, 0),
    ] {
        let scene = Scene::generated(name, dims, rate);
        for azimuth in [15.0, 200.0] {
            let frame = scene.frame(scene.orbit(azimuth, 25.0, SIZE));
            let cached = gpu.render(&scene, with(Residency::Cached), &frame);
            let mut renderer = gpu.renderer(&scene, with(Residency::Full));
            let full = gpu.finish(&mut renderer, &frame);
            same_picture(&full, &cached).unwrap();
            let report = renderer.poll_report();
            assert_eq!((report.blocks_decoded, report.blocks_requested), (0, 0), "{name}");
            // Again, when nothing is left to load: one round.
            let again = gpu.finish(&mut renderer, &frame);
            same_picture(&again, &cached).unwrap();
            let report = renderer.poll_report();
            assert_eq!((report.pass, report.rounds), (1, rounds), "{name}");
        }
    }
}

/// Nothing that belongs to one isovalue is left for the next.
#[test]
fn a_resident_volume_shows_every_isovalue() {
    let gpu = Gpu::new();
    let mut scene = Scene::generated("gyroid", [37, 26, 31], 9.0);
    let mut renderer = gpu.renderer(&scene, with(Residency::Full));
    let mut hits = Vec::new();
    for isovalue in [0.0, 0.4, -0.3, 0.0] {
        scene.isovalue = isovalue;
        let frame = scene.frame(scene.orbit(40.0, 10.0, SIZE));
        let found = gpu.finish(&mut renderer, &frame);
        let expected: Capture = gpu.render(&scene, with(Residency::Cached), &frame);
        same_picture(&found, &expected).unwrap();
        hits.push(hit_count(&found));
    }
    assert!(hits[0] == hits[3] && hits[0] != hits[1] && hits[1] > 100, "{hits:?}");
}

#[test]
fn the_plan_chooses_by_strategy_and_budget() {
    let scene = Scene::generated("gyroid", [60, 57, 58], 8.0);
    let auto = options(SIZE);
    let auto = RendererOptions { residency: Residency::Auto, ..auto };
    assert_eq!(plan(&scene, &auto).unwrap().residency(), Residency::Full);
    let strategy = TraversalStrategy::BlockSorted(BlockSortedOptions::default());
    let sorted = RendererOptions { strategy, ..auto };
    assert_eq!(plan(&scene, &sorted).unwrap().residency(), Residency::Cached);
    let refused = plan(&scene, &RendererOptions { residency: Residency::Full, ..sorted });
    assert!(matches!(refused, Err(Error::Wavefront(_))), "{refused:?}");

    let forced = |budget_bytes| {
        plan(&scene, &RendererOptions { budget_bytes, residency: Residency::Full, ..auto })
    };
    let minimum = minimum_full(&scene, &auto);
    assert_eq!(forced(minimum).unwrap().bytes(), minimum);
    assert!(forced(minimum - 1).is_err());
    let chosen =
        |budget_bytes| plan(&scene, &RendererOptions { budget_bytes, ..auto }).unwrap().residency();
    assert_eq!(chosen(minimum), Residency::Full);
    assert_eq!(chosen(minimum - 1), Residency::Cached);
}

#[test]
fn full_residency_leaves_the_cache_out() {
    let gpu = Gpu::new();
    let scene = Scene::generated("gyroid", [60, 57, 58], 8.0);
    let blocks = 15 * 15 * 15;
    let mut renderer = gpu.renderer(&scene, with(Residency::Full));
    let frame = scene.frame(scene.orbit(15.0, 20.0, SIZE));
    gpu.finish(&mut renderer, &frame);
    gpu.finish(&mut renderer, &frame);
    assert_eq!(bytes_of(&renderer, Category::Slots), 256 * blocks);
    assert_eq!(bytes_of(&renderer, Category::Directory), 0);
    let included = |name: &str| {
        renderer.plan().parts().iter().find(|part| part.name == name).unwrap().included
    };
    assert!(included("resident volume") && !included("cache"));
    assert!(renderer.poll_report().peak_bytes <= renderer.plan().bytes());
    let full = renderer.poll_report().dispatches;
    let mut cached = gpu.renderer(&scene, with(Residency::Cached));
    gpu.finish(&mut cached, &frame);
    gpu.finish(&mut cached, &frame);
    // Neither service nor decode.
    assert!(full + 5 <= cached.poll_report().dispatches, "{full}");
}

#[test]
fn a_picture_that_no_longer_fits_beside_the_volume_moves_it_into_a_cache() {
    let gpu = Gpu::new();
    let scene = Scene::generated("gyroid", [60, 57, 58], 8.0);
    let auto = RendererOptions { residency: Residency::Auto, ..options(SIZE) };
    let budget_bytes = minimum_full(&scene, &auto) + 10_000;
    let mut renderer = gpu.renderer(&scene, RendererOptions { budget_bytes, ..auto });
    assert_eq!(renderer.plan().residency(), Residency::Full);
    let frame = scene.frame(scene.orbit(15.0, 20.0, SIZE));
    let expected = gpu.finish(&mut renderer, &frame);
    for size in [[120, 90], SIZE] {
        renderer.resize(&gpu.device, size).unwrap();
        // What was loaded for a cache stays in one.
        assert_eq!(renderer.plan().residency(), Residency::Cached, "{size:?}");
        let frame = scene.frame(scene.orbit(15.0, 20.0, size));
        let found = gpu.finish(&mut renderer, &frame);
        let cached = RendererOptions { residency: Residency::Cached, ..options(size) };
        same_picture(&found, &gpu.render(&scene, cached, &frame)).unwrap();
        assert!(renderer.poll_report().peak_bytes <= budget_bytes);
    }
    let found = gpu.finish(&mut renderer, &frame);
    same_picture(&found, &expected).unwrap();
}

/// The list of active rays holds 2^21: the others wait for the next round, and none is forgotten.
#[test]
fn pictures_of_more_rays_than_the_list_holds_are_finished() {
    let gpu = Gpu::new();
    let size = [2100, 1000];
    let scene = Scene::generated("gyroid", [12, 13, 11], 9.0);
    let outputs = Outputs { status: true, ..Outputs::default() };
    let options = RendererOptions { size, outputs, ..with(Residency::Full) };
    let mut renderer = gpu.renderer(&scene, options);
    // From inside, so that every ray enters the volume.
    let mut frame = scene.frame(scene.orbit(30.0, 20.0, size));
    let centre = [5.5, 6.0, 5.0];
    let aspect = f64::from(size[0]) / f64::from(size[1]);
    let up = [0.0, 1.0, 0.0];
    frame.camera = Camera::perspective(centre, [9.0, 6.5, 5.5], up, 60.0, aspect, 1e-3, 1e3);
    gpu.finish(&mut renderer, &frame);
    // Nothing is known of the rays that the first round has no room for.
    frame.options.rounds_per_pass = 1;
    renderer.set_frame(&frame).unwrap();
    let first = |_: &ProgressiveIsoRenderer, _: &PassReport| false;
    let report = renderer.render_to_completion(&gpu.device, &gpu.queue, first).unwrap();
    assert_eq!((report.pass, report.active_rays), (1, size[0] * size[1] - (1 << 21)));
    let diagonal = (11.0f32 * 11.0 + 12.0 * 12.0 + 10.0 * 10.0).sqrt();
    assert!((report.open_depth_voxels / diagonal - 1.0).abs() < 1e-6, "{report:?}");
    let picture = gpu.finish(&mut renderer, &frame);
    let report = renderer.poll_report();
    assert_eq!(report.open_depth_voxels, 0.0);
    assert_eq!(report.entered_rays, size[0] * size[1]);
    assert_eq!(report.rounds, 2, "one for the list's rays, one for the rest");
    let status = picture.status.unwrap();
    let of = |wanted| status.iter().filter(|&&s| s == wanted).count() as u32;
    assert_eq!(of(PixelStatus::Unfinished), 0);
    assert!(of(PixelStatus::Hit) == report.hits && report.hits > 1_000_000, "{report:?}");
    // With a cache the rays of the second list are known before anything is requested for them.
    let options = RendererOptions { size, outputs, ..with(Residency::Cached) };
    let mut renderer = gpu.renderer(&scene, options);
    let cached = gpu.finish(&mut renderer, &frame);
    let report = renderer.poll_report();
    assert_eq!(cached.color, picture.color);
    // Requests for rays that have not started, if they took their states for places, decode 18.
    assert!(report.blocks_decoded <= 12, "{report:?}");
}
