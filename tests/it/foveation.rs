//! Foveated frames: the mask is the twin's, only its rays are cast, and the frame ends as any other, bit for bit.

use gpu_testkit::gpu as kit;
use gpu_testkit::property;
use progressive_iso::{
    BlockSortedOptions, BlueNoise, Capture, Error, Foveation, Frame, FrameOptions, Infill,
    InfillOptions, PassReport, PixelStatus, ProgressiveIsoRenderer, RendererOptions, Residency,
    TraversalStrategy,
};
use proptest::prelude::*;
use wavefront::cpu::sampling_mask::margin;
use wavefront::{RayOrder, SamplingParams};

use crate::invariance::same_picture;
use crate::support::{Gpu, Scene, options};

const SIZE: [u32; 2] = [150, 110];

/// Ranks by which kernel and twin may differ: `pow` of WGSL may be off by 2^-21 times the number of passes, at most 64, in
/// the exponent and by some units in the last place beside; of 1024 ranks that is 0.03.
const TOLERANCE: f32 = 0.05;

fn scene() -> Scene {
    Scene::generated("gyroid", [37, 42, 33], 8.0)
}

fn foveated() -> RendererOptions {
    RendererOptions { foveation: Some(BlueNoise::tiles()), ..options(SIZE) }
}

/// The options of every way to cast rays.
fn ways() -> [RendererOptions; 3] {
    let strategy = TraversalStrategy::BlockSorted(BlockSortedOptions::default());
    let resident = RendererOptions { residency: Residency::Full, ..foveated() };
    [foveated(), RendererOptions { strategy, ..foveated() }, resident]
}

fn frame(scene: &Scene, foveation: Option<Foveation>) -> Frame {
    let frame = scene.frame(scene.orbit(33.0, 20.0, SIZE));
    Frame { options: FrameOptions { foveation, ..frame.options }, ..frame }
}

fn pixels(size: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
    (0..size[0] * size[1]).map(move |i| [i % size[0], i / size[0]])
}

/// Whether the mask has each pixel, as the GPU has it.
fn mask(gpu: &Gpu, renderer: &ProgressiveIsoRenderer, size: [u32; 2]) -> Vec<bool> {
    let buffer = renderer.rays().unwrap().sampling_mask().unwrap();
    let words = kit::read_u32s(&gpu.device, &gpu.queue, buffer);
    let order = RayOrder::new(size);
    let set = |number: u32| words[number as usize / 32] >> (number % 32) & 1 != 0;
    let all: u32 = words.iter().map(|word| word.count_ones()).sum();
    let mask: Vec<bool> = pixels(size).map(|pixel| set(order.number(pixel))).collect();
    assert_eq!(mask.iter().filter(|&&m| m).count(), all as usize, "bits without a pixel");
    mask
}

/// Renders a frame pass by pass; `each` sees the renderer after every pass.
fn render(
    gpu: &Gpu,
    renderer: &mut ProgressiveIsoRenderer,
    frame: &Frame,
    mut each: impl FnMut(&ProgressiveIsoRenderer, &PassReport),
) -> Capture {
    renderer.set_frame(frame).unwrap();
    let see = |renderer: &ProgressiveIsoRenderer, report: &PassReport| {
        if report.pass > 0 {
            each(renderer, report);
        }
        true
    };
    let report = renderer.render_to_completion(&gpu.device, &gpu.queue, see).unwrap();
    assert!(report.complete());
    renderer.capture_blocking(&gpu.device, &gpu.queue).unwrap()
}

fn statuses(capture: &Capture) -> &[PixelStatus] {
    capture.status.as_ref().unwrap()
}

/// Number of pixels of `later` that differ from finished ones of `earlier`.
fn changed(earlier: &Capture, later: &Capture) -> usize {
    let color = |capture: &Capture, i: usize| capture.color[4 * i..4 * i + 4].to_vec();
    let depth = |capture: &Capture, i: usize| capture.depth.as_ref().unwrap()[i].to_bits();
    let finished = |&i: &usize| statuses(earlier)[i] != PixelStatus::Unfinished;
    let differs = |&i: &usize| {
        color(earlier, i) != color(later, i)
            || depth(earlier, i) != depth(later, i)
            || statuses(earlier)[i] != statuses(later)[i]
    };
    (0..statuses(earlier).len()).filter(finished).filter(differs).count()
}

#[test]
fn foveated_frames_end_exactly_and_never_change_a_finished_pixel() {
    let (gpu, scene) = (Gpu::new(), scene());
    let expected = gpu.render(&scene, options(SIZE), &frame(&scene, None));
    for options in ways() {
        let mut renderer = gpu.renderer(&scene, options);
        for passes in [1, 5, 64] {
            let foveation =
                Foveation { gaze: [0.3, 0.6], base_density: 0.05, passes, ..Foveation::default() };
            let frame = frame(&scene, Some(foveation));
            let mut last: Option<Capture> = None;
            let mut seen = 0;
            let end = render(&gpu, &mut renderer, &frame, |renderer, report| {
                seen += 1;
                // Every pass takes memory of lavapipe, which keeps what is read back.
                if seen % 4 == 1 {
                    let now = renderer.capture_blocking(&gpu.device, &gpu.queue).unwrap();
                    let unfinished =
                        statuses(&now).iter().filter(|&&s| s == PixelStatus::Unfinished).count();
                    assert_eq!(unfinished, report.active_rays as usize);
                    assert_eq!(last.as_ref().map_or(0, |last| changed(last, &now)), 0);
                    last = Some(now);
                }
            });
            same_picture(&end, &expected).unwrap();
            let last = last.unwrap();
            assert_eq!(changed(&last, &end), 0);
            let mut wrong = end.clone();
            wrong.color[4 * (SIZE[0] * SIZE[1] / 2) as usize] ^= 1;
            assert_eq!(changed(&end, &wrong), 1, "the comparison sees nothing");
        }
    }
}

#[test]
fn only_the_rays_of_the_mask_are_cast() {
    let (gpu, scene) = (Gpu::new(), scene());
    let foveation = Foveation { gaze: [0.4, 0.5], ..Foveation::default() };
    for options in ways() {
        let mut renderer = gpu.renderer(&scene, options);
        let mut view = frame(&scene, Some(foveation));
        view.options.rounds_per_pass = 50;
        view.options.pass_ms = f32::INFINITY;
        let mut reports: Vec<PassReport> = Vec::new();
        render(&gpu, &mut renderer, &view, |renderer, report| {
            reports.push(*report);
            if report.pass > 3 {
                return;
            }
            let mask = mask(&gpu, renderer, SIZE);
            assert_eq!(mask.iter().filter(|&&m| m).count(), report.sampled_rays as usize);
            let now = renderer.capture_blocking(&gpu.device, &gpu.queue).unwrap();
            let (mut hits_outside, mut unfinished_inside, mut unfinished_outside) = (0, 0, 0);
            for (&status, &masked) in statuses(&now).iter().zip(&mask) {
                hits_outside += u32::from(status == PixelStatus::Hit && !masked);
                unfinished_inside += u32::from(status == PixelStatus::Unfinished && masked);
                unfinished_outside += u32::from(status == PixelStatus::Unfinished && !masked);
            }
            assert_eq!((hits_outside, unfinished_inside), (0, 0), "pass {}", report.pass);
            assert!(unfinished_outside > 0 && report.hits > 0);
        });
        // Where the whole volume is resident, one round finishes the rays of a pass; the others find none.
        if options.residency == Residency::Full {
            assert!(reports.iter().all(|report| report.rounds == report.pass), "{reports:?}");
        }
        let first = reports[0];
        assert_eq!(first.pass, 1);
        let mean = foveation.mean_density(SIZE) * f64::from(SIZE[0] * SIZE[1]);
        assert!((f64::from(first.sampled_rays) / mean - 1.0).abs() < 0.05);
        assert_eq!(reports.last().unwrap().active_rays, 0);
        assert!(reports.iter().all(|report| report.open_depth_voxels >= 0.0));
        let open: Vec<f32> = reports.iter().map(|report| report.open_depth_voxels).collect();
        assert!(open.windows(2).all(|pair| pair[1] <= pair[0]), "{open:?}");
    }
}

/// In the fovea, where tau is 1 to half a rank, the first pass finishes every pixel exactly.
#[test]
fn the_fovea_is_exact_at_once() {
    let (gpu, scene) = (Gpu::new(), scene());
    let foveation = Foveation { gaze: [0.5, 0.5], sigma: 5.0, ..Foveation::default() };
    let expected = gpu.render(&scene, options(SIZE), &frame(&scene, None));
    for options in ways() {
        let mut renderer = gpu.renderer(&scene, options);
        let mut view = frame(&scene, Some(foveation));
        view.options.rounds_per_pass = 50;
        view.options.pass_ms = f32::INFINITY;
        let mut first = None;
        render(&gpu, &mut renderer, &view, |renderer, report| {
            if report.pass == 1 {
                first = Some(renderer.capture_blocking(&gpu.device, &gpu.queue).unwrap());
            }
        });
        let first = first.unwrap();
        assert_eq!(changed(&first, &expected), 0);
        let params = SamplingParams::new(&foveation, SIZE, 0, 0);
        let full = |pixel| 1.0 - wavefront::cpu::sampling_mask::not_drawn(&params, pixel);
        let fovea = pixels(SIZE)
            .zip(statuses(&first))
            .filter(|&(pixel, _)| full(pixel) >= 1.0 - 0.4 / 1024.0);
        let (mut count, mut unfinished) = (0, 0);
        for (_, &status) in fovea {
            count += 1;
            unfinished += u32::from(status == PixelStatus::Unfinished);
        }
        assert!(count > 50 && unfinished == 0, "{unfinished} of {count}");
    }
}

#[derive(Clone, Debug)]
struct Case {
    size: [u32; 2],
    foveation: Foveation,
    /// Frames set before.
    before: u32,
    passes: u32,
}

fn cases() -> impl Strategy<Value = Case> {
    let foveation = (
        [-0.2..1.2f32, -0.2..1.2f32],
        prop_oneof![Just(0.0), 0.001..0.1f32],
        prop_oneof![Just(0.0), 0.003..0.3f32, Just(1.0)],
        prop_oneof![1..65u32, Just(64)],
    )
        .prop_map(|(gaze, sigma, base_density, passes)| Foveation {
            gaze,
            sigma,
            base_density,
            passes,
        });
    let size = prop_oneof![[1..200u32, 1..120u32], Just([1, 1]), Just([64, 64])];
    (size, foveation, 0..5u32, 1..9u32).prop_map(|(size, foveation, before, passes)| Case {
        size,
        foveation,
        before,
        passes,
    })
}

proptest! {
    #![proptest_config(property(12))]

    /// Bits of the mask after some passes of any frame are those of the twin in any of them.
    #[test]
    fn the_mask_is_the_twins(case in cases()) {
        let (gpu, scene) = (Gpu::new(), scene());
        let Case { size, foveation, before, passes } = case;
        let options = RendererOptions { size, ..foveated() };
        let mut renderer = gpu.renderer(&scene, options);
        let mut view = scene.frame(scene.orbit(33.0, 20.0, size));
        view.options.foveation = Some(foveation);
        (0..before).for_each(|_| renderer.set_frame(&view).unwrap());
        renderer.set_frame(&view).unwrap();
        let report = renderer
            .render_to_completion(&gpu.device, &gpu.queue, |_, report| report.pass < passes)
            .unwrap();
        let found = mask(&gpu, &renderer, size);
        let margins = |pixel| (0..report.pass.min(foveation.passes)).map(move |pass| {
            let params = SamplingParams::new(&foveation, size, report.frame, pass);
            margin(BlueNoise::tiles(), &params, pixel)
        });
        let mut unclear = 0;
        for (pixel, found) in pixels(size).zip(found) {
            let most = margins(pixel).fold(f32::NEG_INFINITY, f32::max);
            if most.abs() > TOLERANCE {
                prop_assert_eq!(found, most > 0.0, "{:?} {}", pixel, most);
            } else {
                unclear += 1;
            }
        }
        prop_assert!(unclear * 50 <= size[0] * size[1] + 500, "{} unclear", unclear);
    }
}

/// What the picture shows where no ray was cast: the colour of unfinished pixels, or a guess.
#[test]
fn in_fill_fills_what_was_not_cast() {
    let (gpu, scene) = (Gpu::new(), scene());
    let options = RendererOptions { infill: Some(InfillOptions::default()), ..foveated() };
    let mut renderer = gpu.renderer(&scene, options);
    let mut view = frame(&scene, Some(Foveation { base_density: 0.1, ..Foveation::default() }));
    view.options.infill = Infill::Classical;
    let mut passes = 0;
    let end = render(&gpu, &mut renderer, &view, |_, report| {
        passes += 1;
        assert_eq!(report.filled_pixels, report.active_rays);
    });
    assert!(passes > 1);
    same_picture(&end, &gpu.render(&scene, crate::support::options(SIZE), &frame(&scene, None)))
        .unwrap();
}

#[test]
fn rays_that_were_not_cast_leave_their_whole_way_open() {
    let (gpu, scene) = (Gpu::new(), scene());
    let cells = scene.volume.dims.map(|n| (n - 1) as f32);
    let diagonal = cells.iter().map(|n| n * n).sum::<f32>().sqrt();
    for size in [[1, 1], [40, 30]] {
        for options in ways().map(|options| RendererOptions { size, ..options }) {
            let mut renderer = gpu.renderer(&scene, options);
            // Nothing is cast before the last pass.
            let foveation =
                Foveation { sigma: 0.0, base_density: 0.0, passes: 3, ..Foveation::default() };
            let mut waiting = 0;
            render(&gpu, &mut renderer, &frame(&scene, Some(foveation)), |_, report| {
                if report.pass < foveation.passes {
                    waiting += 1;
                    assert!(report.active_rays > 0 && report.sampled_rays == 0, "{report:?}");
                    let open = report.open_depth_voxels;
                    assert!((open - diagonal).abs() < 1e-3 * diagonal, "{open} of {diagonal}");
                }
                assert!(!report.complete() || report.open_depth_voxels == 0.0, "{report:?}");
            });
            assert!(waiting > 0);
        }
    }
}

#[test]
fn foveation_must_be_planned_and_in_range() {
    let (gpu, scene) = (Gpu::new(), scene());
    let view = |foveation| frame(&scene, Some(foveation));
    let mut plain = gpu.renderer(&scene, options(SIZE));
    let refused = plain.set_frame(&view(Foveation::default()));
    assert_eq!(refused, Err(Error::FoveationNotPlanned));
    let mut renderer = gpu.renderer(&scene, foveated());
    renderer.set_frame(&view(Foveation::default())).unwrap();
    let good = Foveation::default();
    for bad in [
        Foveation { gaze: [f32::NAN, 0.5], ..good },
        Foveation { sigma: -0.01, ..good },
        Foveation { sigma: f32::INFINITY, ..good },
        Foveation { base_density: 1.01, ..good },
        Foveation { base_density: f32::NAN, ..good },
        Foveation { passes: 0, ..good },
        Foveation { passes: 65, ..good },
    ] {
        let error = renderer.set_frame(&view(bad)).unwrap_err();
        assert!(error.to_string().contains("base density"), "{error}");
    }
    // It cannot be taken away from a frame that has it.
    let taken = renderer.set_options(&gpu.device, options(SIZE));
    assert_eq!(taken, Err(Error::FoveationNotPlanned));
}

/// Foveation comes and goes with the options.
#[test]
fn options_may_add_and_remove_foveation() {
    let (gpu, scene) = (Gpu::new(), scene());
    let expected = gpu.render(&scene, options(SIZE), &frame(&scene, None));
    let mut renderer = gpu.renderer(&scene, options(SIZE));
    let with = Some(Foveation { passes: 3, ..Foveation::default() });
    for (options, foveation) in [(options(SIZE), None), (foveated(), with), (options(SIZE), None)] {
        renderer.set_frame(&frame(&scene, None)).unwrap();
        renderer.set_options(&gpu.device, options).unwrap();
        let end = render(&gpu, &mut renderer, &frame(&scene, foveation), |_, _| ());
        same_picture(&end, &expected).unwrap();
        assert!(renderer.poll_report().bytes <= renderer.plan().bytes());
    }
}
