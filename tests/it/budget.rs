//! Memory: never more than planned, never more than allowed, nothing for what is left out.

use progressive_iso::{
    Category, DrawTarget, Error, Outputs, PassReport, ProgressiveIsoRenderer, RendererOptions,
    ScenePlan, StreamLayout, When, wgpu,
};

use volume_io::ZfpVolume;

use crate::invariance::{minimum_budget, same_picture};
use crate::support::{Gpu, Scene, options};

fn plan(scene: &Scene, options: &RendererOptions) -> Result<ScenePlan, Error> {
    ScenePlan::new(&scene.compressed(), options, &wgpu::Limits::default())
}

#[test]
fn what_is_allocated_stays_within_the_plan_and_the_plan_within_the_budget() {
    let gpu = Gpu::new();
    for (dims, rate, size) in [
        ([1, 1, 1], 8.0, [1, 1]),
        ([5, 3, 2], 8.0, [7, 300]),
        ([4, 4, 4], 0.2, [64, 64]),
        ([70, 33, 41], 3.7, [333, 57]),
        ([100, 90, 110], 16.0, [160, 120]),
    ] {
        let scene = Scene::generated("gyroid", dims, rate);
        let base = RendererOptions { draw_target: Some(DrawTarget::default()), ..options(size) };
        let least = minimum_budget(&scene, &base);
        for budget_bytes in [least, least + 1, least + 12_345, 2 * least, 64 << 20] {
            let options = RendererOptions { budget_bytes, ..base };
            let plan = plan(&scene, &options).unwrap();
            assert!(plan.bytes() <= budget_bytes, "{dims:?}: {}", plan.explain());
            let sum = |when| {
                let there =
                    plan.parts().iter().filter(|p| p.when == when || p.when == When::Always);
                there.map(|p| p.bytes).sum::<u64>()
            };
            assert_eq!(plan.bytes(), sum(When::Loading).max(sum(When::Rendering)));
            if budget_bytes == least && scene.volume.voxel_count() > 100_000 {
                continue; // thousands of passes
            }
            let mut renderer = gpu.renderer(&scene, options);
            let frame = scene.frame(scene.orbit(10.0, 10.0, size));
            if budget_bytes >= 2 * least {
                gpu.finish(&mut renderer, &frame);
                gpu.finish(&mut renderer, &scene.frame(scene.orbit(50.0, 10.0, size)));
            } else {
                renderer.set_frame(&frame).unwrap();
                let few = |report: PassReport| report.pass < 4 && !report.complete();
                while few(renderer.poll_report()) {
                    renderer.render_pass(&gpu.device, &gpu.queue).unwrap();
                    renderer.capture_blocking(&gpu.device, &gpu.queue).unwrap();
                }
            }
            let report = renderer.poll_report();
            assert!(
                report.peak_bytes <= renderer.plan().bytes(),
                "{dims:?}, {budget_bytes}: peak {}, {:?}, {}",
                report.peak_bytes,
                renderer.bytes_by_category(),
                renderer.plan().explain()
            );
            let sum: u64 = renderer.bytes_by_category().iter().map(|&(_, bytes)| bytes).sum();
            assert_eq!(sum, report.bytes);
        }
    }
}

#[test]
fn plans_need_no_stream() {
    let scene = Scene::generated("gyroid", [21, 13, 9], 8.0);
    let (options, limits) = (options([64, 48]), wgpu::Limits::default());
    let ZfpVolume { dims, bits_per_block, first_bit, .. } = scene.volume;
    let layout = StreamLayout::new(dims, bits_per_block, first_bit).unwrap();
    assert_eq!(ScenePlan::for_layout(&layout, &options, &limits), plan(&scene, &options));
}

/// Not only for small volumes: staging, which grows with the budget, must not move the minimum.
#[test]
fn the_minimum_that_the_error_names_is_enough_and_one_byte_less_is_not() {
    let brain = Scene {
        volume: volumes::brain(),
        world_from_index: progressive_iso::CompressedVolume::placed([1.0; 3], [0.0; 3]),
        isovalue: 0.0,
    };
    for (scene, size) in [
        (Scene::generated("gyroid", [21, 13, 9], 8.0), [64, 48]),
        (Scene::generated("plane", [130, 120, 128], 32.0), [640, 480]),
        (Scene::generated("plane", [200, 200, 200], 16.0), [1280, 720]),
        (brain, [960, 720]),
    ] {
        let dims = scene.volume.dims;
        let least = minimum_budget(&scene, &options(size));
        let with = |budget_bytes| {
            plan(&scene, &RendererOptions { budget_bytes, ..options(size) })
                .map(|plan| (plan.bytes() <= budget_bytes, plan.slots()))
        };
        assert!(matches!(with(least), Ok((true, 8..))), "{dims:?}");
        assert_eq!(
            with(least - 1),
            Err(Error::BudgetTooSmall { minimum: least, budget: least - 1 }),
            "{dims:?}"
        );
        // More bytes never give fewer slots than the minimum, nor exceed the budget.
        for budget in [least + 1000, 2 * least, 3 * least, 10 * least] {
            let (fits, slots) = with(budget).unwrap();
            assert!(fits && slots >= 8, "{dims:?}, {budget}");
        }
    }
}

fn bytes_of(renderer: &ProgressiveIsoRenderer, category: Category) -> u64 {
    let all = renderer.bytes_by_category();
    all.iter().find(|(c, _)| *c == category).map_or(0, |&(_, bytes)| bytes)
}

#[test]
fn parts_left_out_cost_nothing() {
    let gpu = Gpu::new();
    let scene = Scene::generated("gyroid", [20, 20, 20], 8.0);
    let bare = RendererOptions { outputs: Outputs::default(), capture: false, ..options([50, 40]) };
    let renderer = gpu.renderer(&scene, bare);
    for part in renderer.plan().parts() {
        assert!(part.included || part.bytes == 0, "{part:?}");
    }
    let included =
        |name: &str| renderer.plan().parts().iter().any(|part| part.name == name && part.included);
    for name in ["draw", "capture", "third level"] {
        assert!(!included(name), "{name}");
    }
    // Colour alone: four bytes a pixel.
    assert_eq!(bytes_of(&renderer, Category::Outputs), 4 * 50 * 40);
    for (outputs, bytes) in [
        (Outputs { depth: true, ..Outputs::default() }, 8),
        (Outputs { normal: true, ..Outputs::default() }, 12),
        (Outputs { status: true, ..Outputs::default() }, 8),
    ] {
        let renderer = gpu.renderer(&scene, RendererOptions { outputs, ..bare });
        assert_eq!(bytes_of(&renderer, Category::Outputs), bytes * 50 * 40);
        let depth = renderer.textures().depth().is_some();
        assert_eq!(depth, outputs.depth);
        assert_eq!(renderer.textures().normal().is_some(), outputs.normal);
        assert_eq!(renderer.textures().status().is_some(), outputs.status);
    }
    // A draw target needs depth.
    let draw_target = Some(DrawTarget::default());
    let renderer = gpu.renderer(&scene, RendererOptions { draw_target, ..bare });
    assert_eq!(bytes_of(&renderer, Category::Outputs), 8 * 50 * 40);
}

#[test]
fn changing_sizes_leaves_nothing_behind() {
    let gpu = Gpu::new();
    let scene = Scene::generated("gyroid", [40, 41, 43], 8.0);
    let size = [80, 60];
    let budget_bytes = minimum_budget(&scene, &options([120, 90])) + (256 << 10);
    let options = RendererOptions { budget_bytes, ..options(size) };
    let mut renderer = gpu.renderer(&scene, options);
    let frame = scene.frame(scene.orbit(10.0, 10.0, size));
    let expected = gpu.finish(&mut renderer, &frame);
    let bytes = renderer.poll_report().bytes;
    for other in [[120, 90], [3, 5], [90, 90]] {
        renderer.resize(&gpu.device, other).unwrap();
        assert!(renderer.poll_report().peak_bytes <= budget_bytes);
        renderer.resize(&gpu.device, size).unwrap();
    }
    let found = gpu.finish(&mut renderer, &frame);
    same_picture(&found, &expected).unwrap();
    assert_eq!(renderer.poll_report().bytes, bytes);
    let too_large = renderer.resize(&gpu.device, [4000, 4000]);
    assert!(matches!(too_large, Err(Error::BudgetTooSmall { .. })), "{too_large:?}");
    let found = gpu.finish(&mut renderer, &frame);
    same_picture(&found, &expected).unwrap();
}
