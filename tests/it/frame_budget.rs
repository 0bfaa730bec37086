//! Frames held to a time: fewer rays in the first pass, the same picture in the end, within the budget of bytes.

use progressive_iso::{
    BudgetMode, Capture, Error, Frame, FrameOptions, Infill, InfillOptions, PassReport,
    PixelStatus, ProgressiveIsoRenderer, RendererOptions, Residency,
};

use proptest::prelude::*;

use crate::support::{Gpu, Scene, options};

const SIZE: [u32; 2] = [150, 110];
const MODES: [BudgetMode; 4] =
    [BudgetMode::Predicted, BudgetMode::Fixed, BudgetMode::LastFrame, BudgetMode::TwoPass];

fn held(mode: BudgetMode, residency: Residency) -> RendererOptions {
    let infill = Some(InfillOptions::default());
    RendererOptions { budget: Some(mode), residency, infill, ..options(SIZE) }
}

fn frame(scene: &Scene, azimuth: f64, target_ms: Option<f32>) -> Frame {
    let frame = scene.frame(scene.orbit(azimuth, 25.0, SIZE));
    let infill = if target_ms.is_some() { Infill::Classical } else { Infill::Off };
    let options = FrameOptions { target_ms, infill, rounds_per_pass: 2, ..frame.options };
    Frame { options, ..frame }
}

/// What a renderer is asked for, frame by frame.
#[derive(Clone, Debug)]
struct Case {
    mode: BudgetMode,
    residency: Residency,
    /// Azimuth in degrees and milliseconds.
    frames: Vec<(f64, f32)>,
}

fn cases() -> impl Strategy<Value = Case> {
    let mode = prop::sample::select(MODES.to_vec());
    let residency = prop::sample::select(vec![Residency::Cached, Residency::Full]);
    let target_ms = (-3.0_f32..3.0).prop_map(|power| 10.0_f32.powf(power));
    let frames = prop::collection::vec((0.0..90.0, target_ms), 1..4);
    (mode, residency, frames).prop_map(|(mode, residency, frames)| Case { mode, residency, frames })
}

/// Renders a frame to its end; the reports of its passes.
fn check_frame(
    gpu: &Gpu,
    renderer: &mut ProgressiveIsoRenderer,
    frame: &Frame,
    expected: &Capture,
) -> Result<Vec<PassReport>, TestCaseError> {
    let expected_status = expected.status.as_ref().unwrap();
    let bytes = renderer.plan().bytes();
    renderer.set_frame(frame).unwrap();
    let mut reports: Vec<PassReport> = Vec::new();
    loop {
        let (device, queue) = (&gpu.device, &gpu.queue);
        let report = renderer.render_to_completion(device, queue, |_, _| false).unwrap();
        prop_assert!(report.peak_bytes <= bytes, "{report:?}");
        let shown = renderer.capture_blocking(device, queue).unwrap();
        for (i, status) in shown.status.as_ref().unwrap().iter().enumerate() {
            if *status != PixelStatus::Unfinished {
                prop_assert_eq!(*status, expected_status[i], "pixel {}", i);
                let colors = [&shown.color, &expected.color].map(|c| &c[4 * i..4 * i + 4]);
                prop_assert_eq!(colors[0], colors[1], "pixel {}", i);
            }
        }
        reports.push(report);
        if report.complete() {
            prop_assert_eq!(&shown.color, &expected.color);
            return Ok(reports);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn frames_that_are_held_to_a_time_end_with_the_same_picture_within_the_budget(case in cases()) {
        let (gpu, scene) = (Gpu::new(), Scene::generated("turbulence", [45, 41, 38], 8.0));
        let plain = RendererOptions { residency: Residency::Cached, ..options(SIZE) };
        let mut reference = gpu.renderer(&scene, plain);
        let mut renderer = gpu.renderer(&scene, held(case.mode, case.residency));
        for (azimuth, target_ms) in case.frames {
            let expected = gpu.finish(&mut reference, &frame(&scene, azimuth, None));
            check_frame(&gpu, &mut renderer, &frame(&scene, azimuth, Some(target_ms)), &expected)?;
        }
    }
}

#[test]
fn a_frame_that_is_held_to_a_time_ends_with_the_same_picture() {
    let (gpu, scene) = (Gpu::new(), Scene::generated("turbulence", [45, 41, 38], 8.0));
    let plain = RendererOptions { residency: Residency::Cached, ..options(SIZE) };
    let mut reference = gpu.renderer(&scene, plain);
    let azimuths = [20.0, 23.0, 80.0];
    let expected = azimuths.map(|a| gpu.finish(&mut reference, &frame(&scene, a, None)));
    for residency in [Residency::Cached, Residency::Full] {
        for mode in MODES {
            let mut renderer = gpu.renderer(&scene, held(mode, residency));
            for (azimuth, expected) in azimuths.into_iter().zip(&expected) {
                let wanted = frame(&scene, azimuth, Some(1e-3));
                let reports = check_frame(&gpu, &mut renderer, &wanted, expected).unwrap();
                let first = reports.iter().find(|report| report.pass == 1).unwrap();
                let restricts = mode != BudgetMode::Fixed;
                assert_eq!(first.density < 1.0, restricts, "{mode:?} {residency:?}: {first:?}");
                assert_eq!(first.sampled_rays < first.rays, restricts, "{first:?}");
            }
        }
    }
}

#[test]
fn only_the_first_pass_of_a_frame_looks_ahead_less() {
    let (gpu, scene) = (Gpu::new(), Scene::generated("turbulence", [45, 41, 38], 8.0));
    let mut renderer = gpu.renderer(&scene, held(BudgetMode::Predicted, Residency::Cached));
    for number in 0..4 {
        // No density makes room for what a cold cache has to decode.
        renderer.clear_cache();
        let azimuth = 20.0 + 5.0 * f64::from(number);
        renderer.set_frame(&frame(&scene, azimuth, Some(1e-3))).unwrap();
        let mut passes = Vec::new();
        let (device, queue) = (&gpu.device, &gpu.queue);
        let last = renderer.render_to_completion(device, queue, |_, report| {
            passes.extend((report.pass > 0).then_some((report.pass, report.look_ahead)));
            true
        });
        assert!(last.unwrap().complete());
        let asked = FrameOptions::default().look_ahead;
        // The first frames are what is learned from.
        let first = if number > 1 { 1 } else { asked };
        let expected = |pass: u32| if pass == 1 { first } else { asked };
        assert!(passes.len() > 1, "frame {number}: {passes:?}");
        for (pass, look_ahead) in &passes {
            assert_eq!(*look_ahead, expected(*pass), "frame {number}: {passes:?}");
        }
    }
}

#[test]
fn passes_after_the_first_decode_ahead_again() {
    let (gpu, scene) = (Gpu::new(), Scene::generated("turbulence", [45, 41, 38], 8.0));
    let decoded = |look_ahead: u32| {
        let mut renderer = gpu.renderer(&scene, held(BudgetMode::Predicted, Residency::Cached));
        let frames = (0..4).map(|number| {
            // As above; the first frames are what is learned from.
            renderer.clear_cache();
            let mut frame = frame(&scene, 20.0 + 5.0 * f64::from(number), Some(1e-3));
            frame.options.look_ahead = look_ahead;
            renderer.set_frame(&frame).unwrap();
            let (device, queue) = (&gpu.device, &gpu.queue);
            renderer.render_to_completion(device, queue, |_, _| true).unwrap().blocks_decoded
        });
        frames.skip(2).sum::<u32>()
    };
    let (ahead, not) = (decoded(8), decoded(1));
    assert!(ahead > not + not / 20, "{ahead} blocks decoded, {not} without looking ahead");
}

#[test]
fn times_are_predicted_once_something_was_measured() {
    let (gpu, scene) = (Gpu::new(), Scene::generated("turbulence", [45, 41, 38], 8.0));
    let mut renderer = gpu.renderer(&scene, held(BudgetMode::Predicted, Residency::Full));
    let mut last = PassReport::default();
    for number in 0..8 {
        let azimuth = 20.0 + 2.0 * f64::from(number);
        renderer.set_frame(&frame(&scene, azimuth, Some(1e6))).unwrap();
        let (device, queue) = (&gpu.device, &gpu.queue);
        last = renderer.render_to_completion(device, queue, |_, report| report.pass == 0).unwrap();
        assert_eq!(last.predicted_ms.is_some(), number > 1, "frame {number}: {last:?}");
    }
    assert!(last.predicted_ms.is_some_and(|ms| ms.is_finite() && ms > 0.0), "{last:?}");
    assert!(last.density > 0.1 && last.budget_ms > 0.0, "{last:?}");
}

#[test]
fn a_target_that_was_not_planned_or_is_no_time_is_refused() {
    let (gpu, scene) = (Gpu::new(), Scene::generated("turbulence", [45, 41, 38], 8.0));
    let mut plain = gpu.renderer(&scene, options(SIZE));
    let part = |renderer: &ProgressiveIsoRenderer| {
        let parts = renderer.plan().parts();
        parts.iter().find(|part| part.name == "frame budget").unwrap().clone()
    };
    assert!(!part(&plain).included);
    let wanted = Frame {
        options: FrameOptions { target_ms: Some(20.0), ..FrameOptions::default() },
        ..frame(&scene, 0.0, None)
    };
    assert!(matches!(plain.set_frame(&wanted), Err(Error::BudgetNotPlanned)));
    let mut renderer = gpu.renderer(&scene, held(BudgetMode::Predicted, Residency::Cached));
    assert!(part(&renderer).included && part(&renderer).bytes > 0);
    for target in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let mut wrong = wanted.clone();
        wrong.options.target_ms = Some(target);
        let refused = renderer.set_frame(&wrong);
        assert!(matches!(refused, Err(Error::Target { .. })), "{target}: {refused:?}");
    }
    renderer.set_frame(&wanted).unwrap();
}
