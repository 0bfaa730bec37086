//! The finished picture depends on the frame alone, bit for bit: not on the budget, the split into
//! passes, the strategy, what was drawn before, or how memory is cut into pages (P5, P7, P13).

use std::sync::OnceLock;

use gpu_testkit::compare::bits_equal;
#[cfg(feature = "block-sorted")]
use progressive_iso::BlockSortedOptions;
use progressive_iso::{
    Capture, Error, Frame, PixelStatus, ProgressiveIsoRenderer, RendererOptions, ScenePlan,
    TraversalStrategy, wgpu,
};
use proptest::prelude::*;

use crate::support::{Gpu, Scene, UNFINISHED, hit_count, options};

const SIZE: [u32; 2] = [96, 72];

/// Pictures with the smallest cache, which finishes little more than one ray per round.
const SMALL: [u32; 2] = [16, 12];

/// Checks that two pictures hold the same bits.
pub(crate) fn same_picture(found: &Capture, expected: &Capture) -> Result<(), String> {
    if found.size != expected.size {
        return Err(format!("size {:?}, expected {:?}", found.size, expected.size));
    }
    let named = |what: &str, r: Result<(), gpu_testkit::compare::Mismatch>| {
        r.map_err(|mismatch| format!("{what}: {mismatch}"))
    };
    let words = |s: &Capture| s.status.iter().flatten().map(|&s| s as u32).collect::<Vec<_>>();
    let depths = |s: &Capture| s.depth.clone().unwrap_or_default();
    let normals = |s: &Capture| s.normal.iter().flatten().flatten().copied().collect::<Vec<f32>>();
    named("status", bits_equal(&words(found), &words(expected)))?;
    named("depth", bits_equal(&depths(found), &depths(expected)))?;
    named("normal", bits_equal(&normals(found), &normals(expected)))?;
    named("colour", bits_equal(&found.color, &expected.color))
}

/// The least budget, which the error names.
pub(crate) fn minimum_budget(scene: &Scene, options: &RendererOptions) -> u64 {
    let options = RendererOptions { budget_bytes: 1, ..*options };
    match ScenePlan::new(&scene.compressed(), &options, &wgpu::Limits::default()) {
        Err(Error::BudgetTooSmall { minimum, budget: 1 }) => minimum,
        other => panic!("a budget of one byte gave {other:?}"),
    }
}

fn scenes() -> &'static [Scene; 3] {
    static SCENES: OnceLock<[Scene; 3]> = OnceLock::new();
    SCENES.get_or_init(|| {
        [
            Scene::generated("gyroid", [37, 42, 33], 8.0),
            Scene::generated("turbulence", [30, 45, 26], 5.5),
            Scene::generated("rough-solid", [33, 29, 41], 6.0),
        ]
    })
}

/// A frame of a scene: where the viewer is and which surface is shown.
#[derive(Clone, Debug)]
struct Shot {
    view: u32,
    angle: f64,
    isovalue: f32,
}

impl Shot {
    fn frame(&self, scene: &Scene, size: [u32; 2]) -> Frame {
        let (sin, cos) = self.angle.to_radians().sin_cos();
        let camera = match self.view {
            0 => scene.orbit(self.angle, 25.0, size),
            1 => scene.orthographic([sin, 0.3, cos], size),
            _ => {
                let eye = [0.5, 0.45, 0.55];
                scene.looking(eye, [eye[0] + 0.3 * sin, 0.5, eye[2] + 0.3 * cos], size)
            }
        };
        let mut frame = scene.frame(camera);
        frame.isovalues[0] += self.isovalue;
        frame
    }
}

fn shots() -> impl Strategy<Value = Shot> {
    (0..3u32, 0.0..360.0, prop_oneof![Just(0.0f32), -0.05..0.05f32])
        .prop_map(|(view, angle, isovalue)| Shot { view, angle, isovalue })
}

/// What happens before the frame that is compared.
#[derive(Clone, Debug)]
enum Before {
    Passes(Shot, u32),
    Complete(Shot),
    Resize([u32; 2]),
}

fn history() -> impl Strategy<Value = Vec<Before>> {
    let one = prop_oneof![
        (shots(), 0..4u32).prop_map(|(shot, passes)| Before::Passes(shot, passes)),
        shots().prop_map(Before::Complete),
        prop_oneof![Just([50, 40]), Just([1, 1]), Just([96, 19])].prop_map(Before::Resize),
    ];
    prop::collection::vec(one, 0..4)
}

#[derive(Clone, Debug)]
struct Case {
    scene: usize,
    shot: Shot,
    strategy: TraversalStrategy,
    /// Share of the way from the smallest budget to one that holds every block.
    budget: f64,
    rounds_per_pass: u32,
    look_ahead: u32,
    history: Vec<Before>,
    /// Passes after which the frame is interrupted and then resumed.
    stop_after: u32,
}

#[cfg(not(feature = "block-sorted"))]
pub(crate) fn strategies() -> impl Strategy<Value = TraversalStrategy> {
    Just(TraversalStrategy::RunAhead)
}

#[cfg(feature = "block-sorted")]
pub(crate) fn strategies() -> impl Strategy<Value = TraversalStrategy> {
    let sorted = (1..9u32, any::<bool>()).prop_map(|(start_factor, speculation)| {
        TraversalStrategy::BlockSorted(BlockSortedOptions { start_factor, speculation })
    });
    prop_oneof![2 => Just(TraversalStrategy::RunAhead), 1 => sorted]
}

fn cases() -> impl Strategy<Value = Case> {
    let budget = prop_oneof![2 => Just(0.0), 1 => Just(1.0), 3 => 0.03..0.6];
    (0..3usize, shots(), strategies(), budget, 1..5u32, 1..6u32, history(), 0..9u32).prop_map(
        |(scene, shot, strategy, budget, rounds_per_pass, look_ahead, history, stop_after)| Case {
            scene,
            shot,
            strategy,
            budget,
            rounds_per_pass,
            look_ahead,
            history,
            stop_after,
        },
    )
}

/// Does what comes before; the picture has its size again afterwards.
fn play(
    gpu: &Gpu,
    renderer: &mut ProgressiveIsoRenderer,
    scene: &Scene,
    full_size: [u32; 2],
    history: &[Before],
) {
    let mut size = full_size;
    for before in history {
        match before {
            Before::Passes(shot, passes) => {
                renderer.set_frame(&shot.frame(scene, size)).unwrap();
                for _ in 0..*passes {
                    renderer.render_pass(&gpu.device, &gpu.queue).unwrap();
                }
            }
            Before::Complete(shot) => {
                gpu.finish(renderer, &shot.frame(scene, size));
            }
            Before::Resize(to) => {
                size = [0, 1].map(|a| to[a].min(full_size[a]));
                renderer.resize(&gpu.device, size).unwrap();
            }
        }
    }
    if size != full_size {
        renderer.resize(&gpu.device, full_size).unwrap();
    }
}

fn check(gpu: &Gpu, case: &Case) -> Result<(), String> {
    let scene = &scenes()[case.scene];
    let size = if case.budget == 0.0 { SMALL } else { SIZE };
    let mut frame = case.shot.frame(scene, size);
    let expected = gpu.render(scene, options(size), &frame);
    let choice = RendererOptions { strategy: case.strategy, ..options(size) };
    let least = minimum_budget(scene, &choice);
    let whole = ScenePlan::new(&scene.compressed(), &choice, &wgpu::Limits::default()).unwrap();
    let more = whole.bytes().saturating_sub(least) as f64;
    let budget_bytes = least + (case.budget * more) as u64;
    // Loading may need more than rendering with the smallest cache.
    let most_slots = (case.budget == 0.0).then_some(8);
    let mut renderer = gpu.renderer(scene, RendererOptions { budget_bytes, most_slots, ..choice });
    if most_slots.is_some_and(|most| renderer.plan().slots() > most) {
        return Err(format!("{} slots at the least budget", renderer.plan().slots()));
    }
    play(gpu, &mut renderer, scene, size, &case.history);
    frame.options.rounds_per_pass = case.rounds_per_pass;
    frame.options.pass_ms = f32::INFINITY;
    frame.options.look_ahead = case.look_ahead;
    renderer.set_frame(&frame).unwrap();
    let mut passes = 0;
    let stop = |_: &ProgressiveIsoRenderer, _: &progressive_iso::PassReport| {
        passes += 1;
        passes <= case.stop_after
    };
    renderer.render_to_completion(&gpu.device, &gpu.queue, stop).unwrap();
    let report = renderer.render_to_completion(&gpu.device, &gpu.queue, |_, _| true).unwrap();
    if !report.complete() || report.peak_bytes > budget_bytes {
        return Err(format!("budget {budget_bytes}, {report:?}"));
    }
    let found = renderer.capture_blocking(&gpu.device, &gpu.queue).unwrap();
    same_picture(&found, &expected)
}

proptest! {
    #![proptest_config(gpu_testkit::property(10))]

    #[test]
    fn the_picture_depends_on_the_frame_alone(case in cases()) {
        let problem = check(&Gpu::new(), &case).err();
        prop_assert_eq!(problem, None);
    }
}

#[test]
fn one_different_bit_makes_another_picture() {
    let gpu = Gpu::new();
    let scene = &scenes()[0];
    let frame = scene.frame(scene.orbit(10.0, 20.0, [24, 16]));
    let expected = gpu.render(scene, options([24, 16]), &frame);
    same_picture(&expected, &expected).unwrap();
    let changes: [&dyn Fn(&mut Capture); 5] = [
        &|p| p.color[77] ^= 1,
        &|p| p.depth.as_mut().unwrap()[3] = 0.0,
        &|p| p.normal.as_mut().unwrap()[200][1] += 0.001,
        &|p| p.status.as_mut().unwrap()[0] = PixelStatus::Unfinished,
        &|p| p.size = [16, 24],
    ];
    for (n, change) in changes.iter().enumerate() {
        let mut bad = expected.clone();
        change(&mut bad);
        assert!(same_picture(&bad, &expected).is_err(), "change {n}");
    }
}

/// Payload, slots and everything else cut into pieces of at most 320 KiB.
#[test]
fn pages_do_not_show() {
    let scene = Scene::generated("gyroid", [60, 57, 58], 32.0);
    let frame = scene.frame(scene.orbit(40.0, 15.0, SIZE));
    let whole = Gpu::new();
    let expected = whole.render(&scene, options(SIZE), &frame);
    assert!(hit_count(&expected) > 1000);
    for (limit, pages) in [(320 << 10, 3), (512 << 10, 2)] {
        let limits = wgpu::Limits {
            max_storage_buffer_binding_size: limit,
            max_buffer_size: 8 << 20,
            ..wgpu::Limits::default()
        };
        let gpu = Gpu::with_limits(limits);
        let mut renderer = gpu.renderer(&scene, options(SIZE));
        let held = renderer.plan().slots() * 256;
        assert_eq!(held.div_ceil(limit), pages, "{}", renderer.plan().explain());
        let found = gpu.finish(&mut renderer, &frame);
        same_picture(&found, &expected).unwrap();
    }
}

/// P6 and P7 with the smallest cache: every pass finishes a ray or decodes a block; a pixel that is
/// final never changes; the others show nothing yet.
#[test]
fn partial_pictures_are_prefixes_and_every_pass_makes_progress() {
    let size = [20, 15];
    let gpu = Gpu::new();
    for (scene, shot) in [
        (&scenes()[0], Shot { view: 0, angle: 200.0, isovalue: 0.0 }),
        (&scenes()[1], Shot { view: 1, angle: 80.0, isovalue: 0.01 }),
    ] {
        let frame = shot.frame(scene, size);
        let expected = gpu.render(scene, options(size), &frame);
        let smallest = RendererOptions { most_slots: Some(8), ..options(size) };
        let budget_bytes = minimum_budget(scene, &smallest);
        let mut renderer = gpu.renderer(scene, RendererOptions { budget_bytes, ..smallest });
        assert_eq!(renderer.plan().slots(), 8);
        renderer.set_frame(&frame).unwrap();
        let mut last = (u32::MAX, 0, 0.0);
        let mut passes = 0;
        renderer
            .render_to_completion(&gpu.device, &gpu.queue, |renderer, report| {
                if report.pass == 0 {
                    return true;
                }
                let (active, decoded, completeness) = last;
                assert!(
                    report.active_rays < active || report.blocks_decoded > decoded,
                    "no progress: {report:?}"
                );
                assert!(report.completeness() >= completeness, "{report:?}");
                last = (report.active_rays, report.blocks_decoded, report.completeness());
                passes += 1;
                let picture = renderer.capture_blocking(&gpu.device, &gpu.queue).unwrap();
                let unfinished = check_prefix(&picture, &expected).unwrap();
                assert_eq!(unfinished, report.active_rays, "{report:?}");
                true
            })
            .unwrap();
        assert!(passes > 15 && last.0 == 0 && last.2 == 1.0, "{passes} passes, {last:?}");
    }
}

/// Number of unfinished pixels; all others must be as in the finished picture.
fn check_prefix(picture: &Capture, finished: &Capture) -> Result<u32, String> {
    let status = picture.status.as_ref().unwrap();
    let mut seen = finished.clone();
    let mut unfinished = 0;
    for (i, _) in status.iter().enumerate().filter(|(_, s)| **s == PixelStatus::Unfinished) {
        unfinished += 1;
        seen.status.as_mut().unwrap()[i] = PixelStatus::Unfinished;
        seen.depth.as_mut().unwrap()[i] = f32::INFINITY;
        seen.normal.as_mut().unwrap()[i] = [0.0; 3];
        seen.color[4 * i..][..4].copy_from_slice(&UNFINISHED);
    }
    same_picture(picture, &seen).map(|()| unfinished)
}

#[test]
fn a_changed_final_pixel_is_no_prefix() {
    let gpu = Gpu::new();
    let scene = &scenes()[0];
    let size = [20, 15];
    let finished = gpu.render(scene, options(size), &scene.frame(scene.orbit(5.0, 5.0, size)));
    let mut partial = finished.clone();
    partial.status.as_mut().unwrap()[200] = PixelStatus::Unfinished;
    assert!(check_prefix(&partial, &finished).is_err(), "the pixel keeps its colour");
    partial.depth.as_mut().unwrap()[200] = f32::INFINITY;
    partial.normal.as_mut().unwrap()[200] = [0.0; 3];
    partial.color[800..804].copy_from_slice(&UNFINISHED);
    assert_eq!(check_prefix(&partial, &finished), Ok(1));
    partial.color[0] ^= 1;
    assert!(check_prefix(&partial, &finished).is_err());
}

/// P13: zfp codes a block scaled by a power of two with the same bits but its exponent.
#[test]
fn scaling_by_powers_of_two_changes_nothing() {
    let gpu = Gpu::new();
    let dims = [31, 22, 27];
    let field = volumes::by_name("gyroid", dims).unwrap();
    let samples = volumes::samples(&*field, dims);
    let picture = |k: i32| {
        let factor = 2f32.powi(k);
        let scaled: Vec<f32> = samples.iter().map(|v| v * factor).collect();
        let mut scene = Scene::generated("gyroid", dims, 7.0);
        scene.volume = volume_io::encode(&scaled, dims, 7.0).unwrap();
        scene.isovalue = 0.3 * factor;
        gpu.render(&scene, options(SIZE), &scene.frame(scene.orbit(70.0, -20.0, SIZE)))
    };
    let expected = picture(0);
    assert!(hit_count(&expected) > 1000);
    for k in [-60, -7, 1, 40, 100] {
        same_picture(&picture(k), &expected).unwrap_or_else(|problem| panic!("2^{k}: {problem}"));
    }
}

/// Several passes in one encoder that the caller submits.
#[test]
fn the_callers_own_submissions_make_the_same_picture() {
    let gpu = Gpu::new();
    let scene = Scene::generated("turbulence", [35, 33, 30], 8.0);
    let options = options([48, 36]);
    let frame = scene.frame(scene.orbit(40.0, -20.0, options.size));
    let expected = gpu.render(&scene, options, &frame);
    let mut renderer =
        ProgressiveIsoRenderer::new(&gpu.device, &gpu.queue, scene.compressed(), options).unwrap();
    renderer.set_frame(&frame).unwrap();
    while !renderer.poll_report().complete() {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut passes = 0;
        while renderer.encode_pass(&gpu.device, &mut encoder).unwrap().submitted {
            passes += 1;
        }
        assert!(passes > 0, "neither complete nor another pass");
        gpu_testkit::gpu::submit_and_wait(&gpu.device, &gpu.queue, encoder);
    }
    let found = renderer.capture_blocking(&gpu.device, &gpu.queue).unwrap();
    same_picture(&found, &expected).unwrap();
}
