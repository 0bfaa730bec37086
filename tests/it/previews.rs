//! Previews: first passes of frames that are held to a time, with rays of every second or fourth pixel in both directions.

use gpu_testkit::gpu as kit;
use progressive_iso::{
    BlueNoise, BudgetMode, Camera, Capture, Foveation, Frame, FrameOptions, Infill, InfillOptions,
    InfillSources, Outputs, PassReport, PixelStatus, ProgressiveIsoRenderer, RendererOptions,
    Residency, Shading,
};
use wavefront::RayOrder;
use wavefront::cpu::upscale;

use crate::support::{Gpu, Scene, options};

/// Not a multiple of 4.
const SIZE: [u32; 2] = [150, 111];
const BACKGROUND: [f32; 4] = [0.2, 0.4, 0.6, 1.0];

fn scene() -> Scene {
    Scene::generated("turbulence", [45, 41, 38], 8.0)
}

fn renderer(gpu: &Gpu, scene: &Scene, residency: Residency) -> ProgressiveIsoRenderer {
    // Settings follow from the frame before alone, so that all of them come in turn.
    let (budget, infill) = (Some(BudgetMode::LastFrame), Some(InfillOptions::default()));
    gpu.renderer(scene, RendererOptions { budget, residency, infill, ..options(SIZE) })
}

/// Seen from so far that there is background around the volume.
fn frame(scene: &Scene, crisp_infill: bool) -> Frame {
    let frame = scene.frame(scene.orbit(20.0, 25.0, SIZE));
    let options = FrameOptions {
        target_ms: Some(1e6),
        infill: Infill::Classical,
        crisp_infill,
        pass_ms: f32::INFINITY,
        shading: Shading { background: BACKGROUND, ..frame.options.shading },
        ..frame.options
    };
    Frame { options, ..frame }
}

/// The next pass and what it shows.
fn pass(gpu: &Gpu, renderer: &mut ProgressiveIsoRenderer) -> (PassReport, Capture) {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let report = renderer.render_to_completion(device, queue, |_, report| report.pass == 0);
    (report.unwrap(), renderer.capture_blocking(device, queue).unwrap())
}

fn statuses(capture: &Capture) -> &[PixelStatus] {
    capture.status.as_ref().unwrap()
}

fn color(capture: &Capture, [x, y]: [u32; 2]) -> [f32; 4] {
    let at = 4 * (x + SIZE[0] * y) as usize;
    std::array::from_fn(|i| capture.color[at + i].into())
}

/// Number of unfinished pixels whose colours are not those between the preview's.
fn wrong_colors(capture: &Capture, step: u32, crisp: bool) -> usize {
    let last = SIZE.map(|s| (s - 1) / step);
    let is_wrong = |i: u32| {
        let pixel = [i % SIZE[0], i / SIZE[0]];
        let (place, cell) = (pixel.map(|p| p / step), pixel.map(|p| p % step));
        let corner = |i: u32| {
            let place = [place[0] + (i & 1), place[1] + (i >> 1)];
            color(capture, [0, 1].map(|a| step * place[a].min(last[a])))
        };
        let expected = upscale::color([0, 1, 2, 3].map(corner), cell, step, crisp);
        let found = color(capture, pixel);
        // The picture holds whole numbers; what is interpolated is rounded once, in fewer than 2^-10 of them.
        (0..4).any(|c| (found[c] - expected[c]).abs() > 0.5 + 1e-3)
    };
    let unfinished = |i: &u32| statuses(capture)[*i as usize] == PixelStatus::Unfinished;
    (0..SIZE[0] * SIZE[1]).filter(unfinished).filter(|i| is_wrong(*i)).count()
}

/// Whether a finished pixel of `now` is that of the finished picture.
fn is_final(now: &Capture, finished: &Capture, i: usize) -> bool {
    let depth = |capture: &Capture| capture.depth.as_ref().unwrap()[i].to_bits();
    now.color[4 * i..][..4] == finished.color[4 * i..][..4]
        && depth(now) == depth(finished)
        && statuses(now)[i] == statuses(finished)[i]
}

fn finished_pixels(capture: &Capture) -> impl Iterator<Item = usize> {
    let finished = |i: &usize| statuses(capture)[*i] != PixelStatus::Unfinished;
    (0..statuses(capture).len()).filter(finished)
}

/// Pixels of a preview whose rays the picture's sampling mask does not have: those that it has not finished wait.
fn missing_in_mask(gpu: &Gpu, renderer: &ProgressiveIsoRenderer, step: u32) -> usize {
    let mask = renderer.rays().unwrap().sampling_mask().unwrap();
    let words = kit::read_u32s(&gpu.device, &gpu.queue, mask);
    let order = RayOrder::new(SIZE);
    let numbers = (0..SIZE[0] * SIZE[1])
        .map(|i| [i % SIZE[0], i / SIZE[0]])
        .filter(|pixel| pixel.iter().all(|p| p % step == 0))
        .map(|pixel| order.number(pixel));
    numbers.filter(|n| words[*n as usize / 32] >> (n % 32) & 1 == 0).count()
}

fn check_report(report: &PassReport, shown: &Capture) {
    assert_eq!(report.exact_pixels() as usize, finished_pixels(shown).count(), "{report:?}");
    let is_preview = report.step > 1;
    assert!(!(is_preview && report.complete()) && report.sampled_rays <= report.rays);
    assert_eq!(is_preview, report.open_depth_voxels > 60.0 && report.step > 1, "{report:?}");
    let share = f64::from(report.step).powi(-2);
    assert!(!is_preview || report.completeness() <= share + 1e-6, "{report:?}");
}

/// Every setting from a 16th of the rays up, as the share of rays grows by a quarter from frame to frame.
fn every_setting(residency: Residency, crisp: bool) {
    let (gpu, scene) = (Gpu::new(), scene());
    let (frame, mut renderer) = (frame(&scene, crisp), renderer(&gpu, &scene, residency));
    let mut plain = gpu.renderer(&scene, RendererOptions { residency, ..options(SIZE) });
    let whole = FrameOptions { target_ms: None, infill: Infill::Off, ..frame.options };
    let expected = gpu.finish(&mut plain, &Frame { options: whole, ..frame.clone() });
    let mut steps = Vec::new();
    for number in 0..20 {
        renderer.set_frame(&frame).unwrap();
        let (first, shown) = pass(&gpu, &mut renderer);
        steps.push(first.step);
        check_report(&first, &shown);
        assert!(finished_pixels(&shown).all(|i| is_final(&shown, &expected, i)), "{number}");
        if first.step > 1 {
            let lattice = |i: usize| [i as u32 % SIZE[0], i as u32 / SIZE[0]];
            let on_lattice = |i| lattice(i).iter().all(|p| p % first.step == 0);
            assert!(finished_pixels(&shown).all(on_lattice), "frame {number}");
            assert_eq!(wrong_colors(&shown, first.step, crisp), 0, "frame {number}");
            // The comparison sees a shade of one pixel between others.
            let mut wrong = shown.clone();
            let at = (0..statuses(&shown).len()).rev().find(|&i| !on_lattice(i)).unwrap();
            wrong.color[4 * at] ^= 2;
            assert_eq!(wrong_colors(&wrong, first.step, crisp), 1, "frame {number}");
        }
        if first.complete() {
            break;
        }
        let (second, later) = pass(&gpu, &mut renderer);
        assert_eq!((second.pass, second.step), (2, 1), "{second:?}");
        check_report(&second, &later);
        if first.step > 1 {
            assert_eq!(missing_in_mask(&gpu, &renderer, first.step), 0, "frame {number}");
        }
        assert!(finished_pixels(&later).all(|i| is_final(&later, &expected, i)), "{number}");
        assert!(second.exact_pixels() > first.exact_pixels(), "frame {number}");
        for i in 0..statuses(&later).len() {
            let [before, now] = [&shown, &later].map(|c| &c.color[4 * i..][..4]);
            let waits = statuses(&later)[i] == PixelStatus::Unfinished;
            assert!(!waits || before == now, "frame {number}, pixel {i} changed unfinished");
        }
        let (device, queue) = (&gpu.device, &gpu.queue);
        let last = renderer.render_to_completion(device, queue, |_, _| true).unwrap();
        let end = renderer.capture_blocking(device, queue).unwrap();
        assert!(last.complete() && (last.hits, last.active_rays) == (hits(&expected), 0));
        assert_eq!((&end.color, &end.depth), (&expected.color, &expected.depth), "{number}");
    }
    let count = |step| steps.iter().filter(|s| **s == step).count();
    assert!(count(4) > 0 && count(2) > 2 && count(1) > 2, "{steps:?}");
}

fn hits(capture: &Capture) -> u32 {
    statuses(capture).iter().filter(|s| **s == PixelStatus::Hit).count() as u32
}

#[test]
fn previews_of_a_resident_volume_show_final_pixels_and_colours_between_them() {
    every_setting(Residency::Full, false);
}

#[test]
fn previews_of_a_cached_volume_may_be_crisp() {
    every_setting(Residency::Cached, true);
}

/// Without the status nothing is written where the volume is not; what is there must not differ.
#[test]
fn previews_are_the_same_whatever_pictures_are_asked_for() {
    let (gpu, scene) = (Gpu::new(), scene());
    let mut frame = frame(&scene, false);
    // Far away and beside the middle, so that most of the picture is background.
    let (center, radius) = scene.compressed().bounding_ball();
    let aside = [center[0] + 1.1 * radius, center[1] - 0.7 * radius, center[2]];
    frame.camera = Camera::orbit(aside, 5.0 * radius, 20.0, 25.0, 40.0, 150.0 / 111.0);
    let mut renderers = [true, false].map(|status| {
        let (budget, infill) = (Some(BudgetMode::LastFrame), Some(InfillOptions::default()));
        let outputs = Outputs { depth: true, normal: true, status };
        let residency = Residency::Full;
        gpu.renderer(
            &scene,
            RendererOptions { budget, infill, outputs, residency, ..options(SIZE) },
        )
    });
    let mut steps = Vec::new();
    for number in 0..20 {
        let shown = renderers.each_mut().map(|renderer| {
            renderer.set_frame(&frame).unwrap();
            let (first, picture) = pass(&gpu, renderer);
            let (_, later) = pass(&gpu, renderer);
            (first.step, [picture, later].map(|p| (p.color, p.depth, p.normal)))
        });
        assert!(shown[0] == shown[1], "frame {number}: pictures differ");
        steps.push(shown[0].0);
    }
    assert!([1, 2, 4].iter().all(|step| steps.contains(step)), "{steps:?}");
}

/// What history has of the picture goes with what a preview writes over it.
#[test]
fn a_preview_leaves_no_history_in_the_picture() {
    let (gpu, scene) = (Gpu::new(), scene());
    let sources = InfillSources { neighbours: false, coarse_field: false, history: true };
    let options = RendererOptions {
        infill: Some(InfillOptions { sources, ..Default::default() }),
        budget: Some(BudgetMode::LastFrame),
        foveation: Some(BlueNoise::tiles()),
        residency: Residency::Full,
        ..options(SIZE)
    };
    let held = frame(&scene, false);
    let plain = FrameOptions { target_ms: None, ..held.options };
    let gaze = FrameOptions { foveation: Some(Foveation::default()), ..plain };
    let filled = |frames: &[FrameOptions]| {
        let mut renderer = gpu.renderer(&scene, options);
        let reports = frames.iter().map(|options| {
            renderer.set_frame(&Frame { options: *options, ..held.clone() }).unwrap();
            pass(&gpu, &mut renderer).0
        });
        let reports: Vec<PassReport> = reports.collect();
        let last = reports.last().unwrap();
        (reports.iter().map(|report| report.step).collect::<Vec<_>>(), last.filled_pixels)
    };
    let (_, followed) = filled(&[plain, gaze]);
    assert!(followed > 100, "{followed} pixels filled from the frame before");
    let (steps, filled) = filled(&[plain, held.options, gaze]);
    assert_eq!((steps, filled), (vec![1, 4, 1], 0));
}
