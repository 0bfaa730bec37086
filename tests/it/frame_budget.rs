//! Frames held to a time: fewer rays in the first pass, the same picture in the end, within the budget of bytes.

use progressive_iso::{
    BudgetMode, Error, Frame, FrameOptions, Infill, InfillOptions, PassReport, PixelStatus,
    RendererOptions, Residency,
};

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

#[test]
fn a_frame_that_is_held_to_a_time_ends_with_the_same_picture() {
    let (gpu, scene) = (Gpu::new(), Scene::generated("turbulence", [45, 41, 38], 8.0));
    let plain = RendererOptions { residency: Residency::Cached, ..options(SIZE) };
    let mut reference = gpu.renderer(&scene, plain);
    for residency in [Residency::Cached, Residency::Full] {
        for mode in MODES {
            let mut renderer = gpu.renderer(&scene, held(mode, residency));
            let bytes = renderer.plan().bytes();
            for azimuth in [20.0, 23.0, 80.0] {
                let expected = gpu.finish(&mut reference, &frame(&scene, azimuth, None));
                let expected_status = expected.status.as_ref().unwrap();
                renderer.set_frame(&frame(&scene, azimuth, Some(1e-3))).unwrap();
                let mut reports: Vec<PassReport> = Vec::new();
                loop {
                    let (device, queue) = (&gpu.device, &gpu.queue);
                    let report =
                        renderer.render_to_completion(device, queue, |_, _| false).unwrap();
                    assert!(report.peak_bytes <= bytes, "{mode:?} {residency:?}: {report:?}");
                    let shown = renderer.capture_blocking(device, queue).unwrap();
                    for (i, status) in shown.status.as_ref().unwrap().iter().enumerate() {
                        if *status != PixelStatus::Unfinished {
                            assert_eq!(*status, expected_status[i]);
                            let colors =
                                [&shown.color, &expected.color].map(|c| &c[4 * i..4 * i + 4]);
                            assert_eq!(colors[0], colors[1], "{mode:?} {residency:?}: pixel {i}");
                        }
                    }
                    reports.push(report);
                    if report.complete() {
                        assert_eq!(shown.color, expected.color, "{mode:?} {residency:?}");
                        break;
                    }
                }
                let first = reports.iter().find(|report| report.pass == 1).unwrap();
                let restricts = mode != BudgetMode::Fixed;
                assert_eq!(first.density < 1.0, restricts, "{mode:?} {residency:?}: {first:?}");
                assert_eq!(first.sampled_rays < first.rays, restricts, "{first:?}");
            }
        }
    }
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
    let part = |renderer: &progressive_iso::ProgressiveIsoRenderer| {
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
