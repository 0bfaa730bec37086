//! In-fill at half the picture's resolution, and of pictures whose size changes.

use gpu_testkit::gpu as kit;
use infill::cpu::fill::Finished;
use infill::cpu::reduced;
use infill::{Sources, Weights};
use progressive_iso::{
    BlueNoise, Capture, Foveation, Infill, InfillOptions, PixelStatus, ProgressiveIsoRenderer,
    RendererOptions, Residency,
};

use crate::infill::{SIZE, View, capture, frame_with, random_weights, render_until, with_infill};
use crate::support::{Gpu, Scene};

/// Of each of the reduced picture's pixels the first finished one, and its index.
fn halved(view: &View, shown: &Capture) -> Vec<Option<(Finished, usize)>> {
    let known = View::finished(shown);
    let index = |pixel: [u32; 2]| (pixel[0] + SIZE[0] * pixel[1]) as usize;
    let finished = |place| {
        let indices = reduced::pixels(place, SIZE).map(index);
        indices.filter_map(|i| Some((known[i]?, i))).next()
    };
    view.pixels().map(finished).collect()
}

/// The hits of a picture that history takes: of 2x2 pixels the first one.
fn first_hits(view: &View, shown: &Capture) -> Vec<Option<Finished>> {
    let mut hits = View::finished(shown);
    for place in view.halved().pixels() {
        let mut found = false;
        for [x, y] in reduced::pixels(place, SIZE) {
            let own = &mut hits[(x + SIZE[0] * y) as usize];
            let is_hit = matches!(own, Some(Finished::Hit { .. }));
            *own = own.filter(|_| is_hit && !found);
            found |= is_hit;
        }
    }
    hits
}

/// Holes whose colours differ from the twin's by more than 4 in 255, and all holes.
fn against_the_twin(sources: Sources, weights: Option<&'static Weights>) -> (usize, usize) {
    let (gpu, scene) = (Gpu::new(), Scene::generated("turbulence", [70, 66, 61], 8.0));
    let infill = if weights.is_some() { Infill::Network } else { Infill::Classical };
    let options =
        InfillOptions { sources, network: weights, half_resolution: true, ..Default::default() };
    let mut renderer = gpu.renderer(&scene, with_infill(options));
    let (first, second) = [20.0, 24.0].map(|azimuth| frame_with(&scene, azimuth, infill)).into();
    // Nothing may stay of an earlier one, whatever it showed.
    let mut earlier = frame_with(&scene, 60.0, infill);
    earlier.isovalues[0] *= 0.8;
    render_until(&gpu, &mut renderer, &earlier, 1.0);
    renderer.clear_cache();
    render_until(&gpu, &mut renderer, &first, 0.6);
    let old = capture(&gpu, &renderer);
    renderer.clear_cache();
    let report = render_until(&gpu, &mut renderer, &second, 0.5);
    assert_eq!(report.filled_pixels, report.active_rays);
    let shown = capture(&gpu, &renderer);
    let words = kit::read_u32s(&gpu.device, &gpu.queue, renderer.rays().unwrap().rays());

    let (before, full) = (View::new(&scene, &first), View::new(&scene, &second));
    let view = full.halved();
    let only = |found: &[Option<(Finished, usize)>]| -> Vec<Option<Finished>> {
        found.iter().map(|found| found.map(|(finished, _)| finished)).collect()
    };
    let keys = view.history(&before, &first_hits(&before, &old));
    let found = halved(&view, &shown);
    let states = reduced::rays(&full.params, &words).unwrap();
    let zero = Weights::zero();
    let twin =
        view.fill(&scene, &only(&found), &states, Some(&keys), sources, weights.unwrap_or(&zero));
    let background = second.options.shading.background;
    let byte = |i: usize| [0, 1, 2].map(|c| f32::from(shown.color[4 * i + c]));
    let small: Vec<[f32; 3]> = (view.pixels().zip(found.iter().zip(&twin)))
        .map(|(place, (found, filled))| match (found, filled) {
            (Some((_, i)), _) => byte(*i),
            (None, Some(filled)) => view.color(place, filled, background).map(f32::round),
            (None, None) => {
                second.options.shading.unfinished.map(|c| 255.0 * c)[..3].try_into().unwrap()
            }
        })
        .collect();
    let [width, height] = view.params.size().map(i64::from);
    let at =
        |[x, y]: [i64; 2]| small[(x.clamp(0, width - 1) + width * y.clamp(0, height - 1)) as usize];
    let (mut wrong, mut holes) = (0, 0);
    for (i, pixel) in full.pixels().enumerate() {
        if shown.status.as_ref().unwrap()[i] == PixelStatus::Unfinished {
            let expected = reduced::color(at, pixel, false);
            holes += 1;
            wrong += usize::from((0..3).any(|c| (byte(i)[c] - expected[c]).abs() > 4.0));
        }
    }
    (wrong, holes)
}

#[test]
fn holes_get_the_twins_colours_at_half_resolution() {
    let all = Sources::default();
    for sources in [
        all,
        Sources { neighbours: false, ..all },
        Sources { history: false, ..all },
        Sources { coarse_field: false, ..all },
    ] {
        let (wrong, holes) = against_the_twin(sources, None);
        println!("{sources:?}: {wrong} of {holes} holes differ");
        // Rays whose crossing hangs on a rounding, each of which up to 16 pixels show.
        assert!(holes > 500 && wrong * 60 <= holes, "{sources:?}: {wrong} of {holes}");
    }
}

#[test]
fn the_network_is_the_twins_at_half_resolution() {
    let (wrong, holes) = against_the_twin(Sources::default(), Some(random_weights(5)));
    println!("{wrong} of {holes} holes differ");
    assert!(holes > 500 && wrong * 60 <= holes, "{wrong} of {holes}");
}

#[test]
fn resized_pictures_are_filled_as_those_of_that_size() {
    resized_pictures(false);
    resized_pictures(true);
}

fn resized_pictures(half_resolution: bool) {
    let gpu = Gpu::new();
    let scene = Scene::generated("turbulence", [70, 66, 61], 8.0);
    let foveation = Some(BlueNoise::tiles());
    let of = |size| {
        let sources = Sources { history: false, ..Sources::default() };
        let options = with_infill(InfillOptions { sources, half_resolution, ..Default::default() });
        let residency = Residency::Full;
        gpu.renderer(&scene, RendererOptions { size, foveation, residency, ..options })
    };
    let mut frame = frame_with(&scene, 20.0, Infill::Classical);
    frame.options.foveation = Some(Foveation::default());
    let shown = |renderer: &mut ProgressiveIsoRenderer| {
        renderer.set_frame(&frame).unwrap();
        let (device, queue) = (&gpu.device, &gpu.queue);
        renderer.render_to_completion(device, queue, |_, report| report.pass == 0).unwrap();
        capture(&gpu, renderer).color
    };
    // The third frame, whose mask another one does not have; changing the size starts a frame.
    let mut unchanged = of(SIZE);
    let expected = [(); 3].map(|()| shown(&mut unchanged))[2].clone();
    for other in [[1, 1], [SIZE[0] / 2, SIZE[1] / 2], [2 * SIZE[0], SIZE[1] + 7]] {
        let mut resized = of(other);
        assert!(shown(&mut resized) != expected);
        resized.resize(&gpu.device, SIZE).unwrap();
        assert!(shown(&mut resized) == expected, "{other:?}");
    }
}
