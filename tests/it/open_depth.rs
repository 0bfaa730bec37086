//! `PassReport::open_depth_voxels`: the first hits of unfinished rays lie where the report says.

use gpu_testkit::bounds::{RayErrors, Sight};
use progressive_iso::{
    Capture, Frame, FrameView, PassReport, PixelStatus, RendererOptions, TraversalStrategy,
};
use proptest::prelude::*;

use crate::invariance::{minimum_budget, strategies};
use crate::support::{Gpu, Scene, options};

const SIZE: [u32; 2] = [64, 48];

/// A partial picture, what the passes up to it reported, and the finished one.
struct Interrupted {
    reports: Vec<PassReport>,
    partial: Capture,
    finished: Capture,
}

fn interrupt(
    gpu: &Gpu,
    scene: &Scene,
    frame: &Frame,
    options: RendererOptions,
    passes: u32,
) -> Interrupted {
    let mut renderer = gpu.renderer(scene, options);
    renderer.set_frame(frame).unwrap();
    let mut reports = Vec::new();
    let mut take = |report: &PassReport, last: u32| {
        reports.extend((report.pass > 0).then_some(*report));
        report.pass < last
    };
    renderer.render_to_completion(&gpu.device, &gpu.queue, |_, r| take(r, passes)).unwrap();
    let partial = renderer.capture_blocking(&gpu.device, &gpu.queue).unwrap();
    // A frame that is complete already has the same last report once more.
    renderer.render_to_completion(&gpu.device, &gpu.queue, |_, r| take(r, u32::MAX)).unwrap();
    let finished = renderer.capture_blocking(&gpu.device, &gpu.queue).unwrap();
    let until = reports.partition_point(|report| report.pass <= passes);
    let last = *reports.last().unwrap();
    assert!(last.complete() && last.open_depth_voxels == 0.0, "{last:?}");
    let never_grows = reports.windows(2).all(|r| r[1].open_depth_voxels <= r[0].open_depth_voxels);
    assert!(never_grows, "{reports:?}");
    reports.truncate(until);
    Interrupted { reports, partial, finished }
}

/// A ray's way through the volume: least and greatest parameters at which the GPU may find its begin
/// and its end, by the error of its position on the axis of the plane there.
struct Way {
    begin: f64,
    end: [f64; 2],
}

impl Way {
    fn new(Sight { ray, error, .. }: &Sight, dims: [u32; 3]) -> Self {
        let mut way = Self { begin: 0.0, end: [f64::INFINITY; 2] };
        for axis in (0..3).filter(|&axis| ray.direction[axis] != 0.0) {
            let planes = [0.0, f64::from(dims[axis]) - 1.0];
            let mut t = planes.map(|p| (p - ray.origin[axis]) / ray.direction[axis]);
            t.sort_by(f64::total_cmp);
            let off = |t: f64| error.position(t.abs())[axis] / ray.direction[axis].abs();
            way.begin = way.begin.max(t[0] - off(t[0]));
            way.end = [way.end[0].min(t[1] - off(t[1])), way.end[1].min(t[1] + off(t[1]))];
        }
        way
    }
}

/// Whether the first hits of all unfinished rays lie in the last `open` voxels before the rays leave the
/// volume, and none of the unfinished rays is so much shorter than `open` that nothing of it can be.
fn check(scene: &Scene, frame: &Frame, shot: &Interrupted, open: f64) -> Result<usize, String> {
    let (dims, size) = (scene.volume.dims, shot.partial.size);
    let view = FrameView::new(&frame.camera, size, scene.world_from_index, dims).unwrap();
    let errors = RayErrors::new(size, view.start_depth(), |pixel| view.ray(pixel));
    let (mut hits, mut longest): (usize, f64) = (0, 0.0);
    for (i, status) in shot.partial.status.iter().flatten().enumerate() {
        if *status != PixelStatus::Unfinished {
            continue;
        }
        let pixel = [i as u32 % size[0], i as u32 / size[0]];
        let sight = errors.sight(pixel, view.ray(pixel));
        let way = Way::new(&sight, dims);
        longest = longest.max(way.end[1] - way.begin);
        let depth = shot.finished.depth.as_ref().unwrap()[i];
        if depth.is_finite() {
            hits += 1;
            let t = sight.parameter(depth);
            let before_end = way.end[0] - t - sight.parameter_error(t);
            if before_end > open {
                return Err(format!(
                    "pixel {pixel:?}: a hit {before_end} voxels before the end, {open} claimed"
                ));
            }
        }
    }
    if open > longest * (1.0 + 1e-6) {
        return Err(format!("{open} claimed, but no unfinished ray is longer than {longest}"));
    }
    Ok(hits)
}

#[derive(Clone, Debug)]
struct Case {
    name: &'static str,
    angles: [f64; 2],
    inside: bool,
    strategy: TraversalStrategy,
    /// Whether the budget is the smallest.
    tight: bool,
    look_ahead: u32,
    passes: u32,
}

fn cases() -> impl Strategy<Value = Case> {
    let name = prop_oneof![Just("gyroid"), Just("turbulence"), Just("rough-solid")];
    let angles = [0.0..360.0, -80.0..80.0];
    (name, angles, any::<bool>(), strategies(), any::<bool>(), 1..4u32, 1..6u32).prop_map(
        |(name, angles, inside, strategy, tight, look_ahead, passes)| Case {
            name,
            angles,
            inside,
            strategy,
            tight,
            look_ahead,
            passes,
        },
    )
}

fn check_case(gpu: &Gpu, case: &Case) -> Result<usize, String> {
    let scene = Scene::generated(case.name, [33, 42, 37], 6.0);
    let camera = if case.inside {
        let [sin, cos] = [case.angles[0].to_radians().sin(), case.angles[0].to_radians().cos()];
        scene.looking([0.5, 0.45, 0.55], [0.5 + 0.3 * sin, 0.5, 0.55 + 0.3 * cos], SIZE)
    } else {
        scene.orbit(case.angles[0], case.angles[1], SIZE)
    };
    let mut frame = scene.frame(camera);
    frame.options.look_ahead = case.look_ahead;
    let mut options = RendererOptions { strategy: case.strategy, ..options(SIZE) };
    if case.tight {
        options.budget_bytes = minimum_budget(&scene, &options);
    }
    let shot = interrupt(gpu, &scene, &frame, options, case.passes);
    let open = f64::from(shot.reports.last().map_or(0.0, |report| report.open_depth_voxels));
    check(&scene, &frame, &shot, open)
}

proptest! {
    #![proptest_config(gpu_testkit::property(12))]

    #[test]
    fn unfinished_rays_hit_where_the_report_says(case in cases()) {
        let problem = check_case(&Gpu::new(), &case).err();
        prop_assert_eq!(problem, None);
    }
}

#[test]
fn another_claim_would_be_wrong() {
    let gpu = Gpu::new();
    let scene = Scene::generated("gyroid", [33, 42, 37], 6.0);
    let mut frame = scene.frame(scene.orbit(20.0, 15.0, SIZE));
    frame.options.look_ahead = 1;
    let shot = interrupt(&gpu, &scene, &frame, options(SIZE), 1);
    let open = f64::from(shot.reports[0].open_depth_voxels);
    let hits = check(&scene, &frame, &shot, open).unwrap();
    assert!(hits > 500, "{hits} hits are open");
    check(&scene, &frame, &shot, 0.8 * open).unwrap_err();
    check(&scene, &frame, &shot, 1.3 * open).unwrap_err();
}
