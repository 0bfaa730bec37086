//! What a scene does not need costs nothing: no byte, no pipeline, no dispatch.

use gpu_primitives::kernel::dispatches_recorded;
use gpu_testkit::gpu;
use progressive_iso::{
    BlockSortedOptions, BlueNoise, BudgetMode, Category, DrawTarget, InfillOptions, Outputs,
    PassReport, ProgressiveIsoRenderer, RendererOptions, TraversalStrategy, wgpu,
};

use crate::support::{Scene, options};

/// What one renderer costs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Cost {
    compute_pipelines: isize,
    render_pipelines: isize,
    /// Bytes of pictures.
    pictures: u64,
    /// Counted by the library.
    bytes: u64,
    /// Planned by the library.
    planned: u64,
    /// Of a round in the middle of a frame.
    dispatches: u32,
}

fn counters(device: &wgpu::Device) -> [isize; 2] {
    let hal = device.get_internal_counters().hal;
    [hal.compute_pipelines.read(), hal.render_pipelines.read()]
}

/// Renders one frame on a device of its own.
fn cost(scene: &Scene, options: RendererOptions) -> Cost {
    let (device, queue) = gpu::device();
    let before = counters(&device);
    let mut renderer =
        ProgressiveIsoRenderer::new(&device, &queue, scene.compressed(), options).unwrap();
    let camera = scene.orbit(25.0, 10.0, options.size);
    renderer.set_frame(&scene.frame(camera)).unwrap();
    let mut passes: Vec<PassReport> = Vec::new();
    renderer
        .render_to_completion(&device, &queue, |_, report| {
            passes.push(*report);
            true
        })
        .unwrap();
    let after = counters(&device);
    let by_category = renderer.bytes_by_category();
    let pictures = by_category.iter().find(|(category, _)| *category == Category::Outputs);
    assert!(after[0] > before[0], "the adapter does not count pipelines");
    // Not the first pass, which starts the frame, too.
    let last = passes.last().unwrap();
    assert!(last.pass > 1, "a frame of one pass says nothing about later ones");
    Cost {
        compute_pipelines: after[0] - before[0],
        render_pipelines: after[1] - before[1],
        pictures: pictures.map_or(0, |(_, bytes)| *bytes),
        bytes: by_category.iter().map(|(_, bytes)| bytes).sum(),
        planned: renderer.plan().bytes(),
        dispatches: last.dispatches,
    }
}

fn part_bytes(scene: &Scene, options: RendererOptions, part: &str) -> (bool, u64) {
    let plan =
        progressive_iso::ScenePlan::new(&scene.compressed(), &options, &wgpu::Limits::default());
    let plan = plan.unwrap();
    let part = plan.parts().iter().find(|p| p.name == part).unwrap();
    (part.included, part.bytes)
}

#[test]
fn pictures_that_nobody_asked_for_cost_nothing() {
    let scene = Scene::generated("gyroid", [20, 21, 22], 8.0);
    let plain = options([40, 30]);
    let one = cost(&scene, RendererOptions { outputs: Outputs::default(), ..plain });
    let all = Outputs { depth: true, normal: true, status: true };
    let four = cost(&scene, RendererOptions { outputs: all, ..plain });
    assert_eq!(one.pictures, 40 * 30 * 4);
    assert_eq!(four.pictures, 40 * 30 * (4 + 4 + 8 + 4));
    assert_eq!(one.compute_pipelines, four.compute_pipelines);
    assert_eq!(one.dispatches, four.dispatches);
}

#[test]
fn drawing_is_left_out_without_a_target() {
    let scene = Scene::generated("gyroid", [20, 21, 22], 8.0);
    let plain = RendererOptions {
        outputs: Outputs { depth: true, ..Outputs::default() },
        ..options([40, 30])
    };
    let target = RendererOptions { draw_target: Some(DrawTarget::default()), ..plain };
    assert_eq!(part_bytes(&scene, plain, "draw"), (false, 0));
    assert!(part_bytes(&scene, target, "draw").0);
    let (without, with) = (cost(&scene, plain), cost(&scene, target));
    assert_eq!((without.render_pipelines, with.render_pipelines), (0, 1));
    assert_eq!(without.dispatches, with.dispatches);
}

#[test]
fn the_other_strategy_is_left_out() {
    let scene = Scene::generated("gyroid", [20, 21, 22], 8.0);
    let run_ahead = options([40, 30]);
    let strategy = TraversalStrategy::BlockSorted(BlockSortedOptions::default());
    let block_sorted = RendererOptions { strategy, ..run_ahead };
    assert_eq!(part_bytes(&scene, run_ahead, "block pairs"), (false, 0));
    let (included, bytes) = part_bytes(&scene, block_sorted, "block pairs");
    assert!(included && bytes > 0);
    let (ours, published) = (cost(&scene, run_ahead), cost(&scene, block_sorted));
    // One kernel against eight of its own and those of scan, compaction and arguments.
    assert!(ours.compute_pipelines + 7 <= published.compute_pipelines, "{ours:?} {published:?}");
    assert!(ours.dispatches + 7 <= published.dispatches, "{ours:?} {published:?}");
}

#[test]
fn foveation_is_left_out_unless_asked_for() {
    let scene = Scene::generated("gyroid", [20, 21, 22], 8.0);
    let without = options([40, 30]);
    let with = RendererOptions { foveation: Some(BlueNoise::tiles()), ..without };
    assert_eq!(part_bytes(&scene, without, "foveation"), (false, 0));
    let bytes = part_bytes(&scene, with, "foveation").1;
    // The tiles, a bit for each of 64x32 rays, a uniform and arguments.
    assert_eq!(bytes, 128 * 1024 + 64 * 32 / 8 + 40 + 16);
    let slots = Some(100);
    let [without, with] =
        [without, with].map(|o| cost(&scene, RendererOptions { most_slots: slots, ..o }));
    assert_eq!(without.compute_pipelines + 1, with.compute_pipelines);
    assert_eq!(without.bytes + bytes, with.bytes);
    // A frame without it pays nothing for the plan.
    assert_eq!(without.dispatches, with.dispatches);
}

#[test]
fn previews_are_left_out_unless_a_frame_budget_has_them() {
    let scene = Scene::generated("gyroid", [20, 21, 22], 8.0);
    let infill = Some(InfillOptions::default());
    let of = |budget, infill| RendererOptions {
        budget: Some(budget),
        infill,
        most_slots: Some(100),
        ..options([40, 30])
    };
    let without = of(BudgetMode::Fixed, infill);
    for none in [of(BudgetMode::TwoPass, infill), of(BudgetMode::Predicted, None)] {
        assert_eq!(part_bytes(&scene, none, "previews"), (false, 0));
    }
    assert_eq!(part_bytes(&scene, without, "previews"), (false, 0));
    let with = of(BudgetMode::Predicted, infill);
    let bytes = part_bytes(&scene, with, "previews").1;
    assert!(bytes > 0);
    let [without, with] = [without, with].map(|options| cost(&scene, options));
    assert_eq!(without.compute_pipelines + 2, with.compute_pipelines);
    assert_eq!(without.bytes + bytes, with.bytes);
    // A frame without one pays nothing for the plan.
    assert_eq!(without.dispatches, with.dispatches);
}

#[test]
fn the_third_level_is_left_out_of_small_volumes() {
    let small = Scene::generated("sphere", [33, 33, 33], 2.0);
    let large = Scene::generated("sphere", [129, 129, 129], 2.0);
    assert_eq!(part_bytes(&small, options([40, 30]), "third level"), (false, 0));
    assert!(part_bytes(&large, options([40, 30]), "third level").0);
    let (small, large) = (cost(&small, options([40, 30])), cost(&large, options([40, 30])));
    assert_eq!(small.compute_pipelines + 1, large.compute_pipelines);
    assert_eq!(small.dispatches, large.dispatches);
}

#[test]
fn capture_is_left_out_unless_asked_for() {
    let scene = Scene::generated("gyroid", [20, 21, 22], 8.0);
    let without = RendererOptions { capture: false, ..options([40, 30]) };
    let with = RendererOptions { capture: true, ..without };
    assert_eq!(part_bytes(&scene, without, "capture"), (false, 0));
    assert!(part_bytes(&scene, with, "capture").1 > 0);
    let (without, with) = (cost(&scene, without), cost(&scene, with));
    assert!(without.bytes <= without.planned && with.bytes <= with.planned);
    assert_eq!(without.compute_pipelines, with.compute_pipelines);
}

#[test]
fn a_finished_frame_records_nothing_more() {
    let scene = Scene::generated("gyroid", [20, 21, 22], 8.0);
    let (device, queue) = gpu::device();
    let options = options([40, 30]);
    let mut renderer =
        ProgressiveIsoRenderer::new(&device, &queue, scene.compressed(), options).unwrap();
    let frame = scene.frame(scene.orbit(25.0, 10.0, options.size));
    renderer.set_frame(&frame).unwrap();
    renderer.render_to_completion(&device, &queue, |_, _| true).unwrap();
    let before = dispatches_recorded();
    let report = renderer.render_pass(&device, &queue).unwrap();
    assert!(report.complete() && !report.submitted);
    assert_eq!(dispatches_recorded(), before);
    renderer.set_frame(&frame).unwrap();
    let report = renderer.render_pass(&device, &queue).unwrap();
    assert!(report.submitted && !report.complete());
    assert!(dispatches_recorded() > before);
}
