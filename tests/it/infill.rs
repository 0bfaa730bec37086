//! In-fill: holes get the colours that the twin gives them, finished pixels keep their bits, and passes go on.

use bytemuck::Zeroable as _;
use gpu_testkit::gpu as kit;
use infill::cpu::field::CoarseField;
use infill::cpu::fill::{Filled, Finished, Scene as Twin};
use infill::cpu::reproject::{self, EMPTY, OldHit};
use infill::{Sources, Weights};
use macrocell::Grid;
use progressive_iso::{
    BlockSortedOptions, BlueNoise, Camera, Capture, Completeness, Error, Frame, FrameOptions,
    FrameView, Infill, InfillOptions, InfillWhen, PassReport, PixelStatus, ProgressiveIsoRenderer,
    RendererOptions, Residency, TraversalStrategy,
};
use wavefront::cpu::frame::{FrameRay, RayStates};
use wavefront::cpu::shading;
use wavefront::{FrameParams, LookAhead, ShadingParams};

use crate::suite::random::Random;
use crate::support::{self, Gpu, Scene, options};

pub(crate) const SIZE: [u32; 2] = [151, 109];

pub(crate) fn with_infill(infill: InfillOptions) -> RendererOptions {
    RendererOptions { infill: Some(infill), ..options(SIZE) }
}

pub(crate) fn frame_with(scene: &Scene, azimuth: f64, infill: Infill) -> Frame {
    let frame = scene.frame(scene.orbit(azimuth, 25.0, SIZE));
    let options = FrameOptions { infill, look_ahead: 1, ..frame.options };
    Frame { options, ..frame }
}

/// Renders passes of one frame until `share` of the pixels is finished.
pub(crate) fn render_until(
    gpu: &Gpu,
    renderer: &mut ProgressiveIsoRenderer,
    frame: &Frame,
    share: f64,
) -> PassReport {
    renderer.set_frame(frame).unwrap();
    renderer
        .render_to_completion(&gpu.device, &gpu.queue, |_, report| {
            report.pass == 0 || report.completeness_pixels() < share
        })
        .unwrap()
}

pub(crate) fn capture(gpu: &Gpu, renderer: &ProgressiveIsoRenderer) -> Capture {
    renderer.capture_blocking(&gpu.device, &gpu.queue).unwrap()
}

fn pixels() -> impl Iterator<Item = [u32; 2]> {
    (0..SIZE[0] * SIZE[1]).map(|i| [i % SIZE[0], i / SIZE[0]])
}

/// What the twin needs of a frame.
pub(crate) struct View {
    pub(crate) params: FrameParams,
    shading: ShadingParams,
    view: FrameView,
    grid: Grid,
    isovalue: f32,
}

impl View {
    pub(crate) fn new(scene: &Scene, frame: &Frame) -> Self {
        let dims = scene.volume.dims;
        let view = FrameView::new(&frame.camera, SIZE, scene.world_from_index, dims).unwrap();
        let shading = ShadingParams::new(&frame.options.shading, scene.world_from_index);
        Self::of(view, shading, Grid::new(dims), frame.isovalues[0])
    }

    fn of(view: FrameView, shading: ShadingParams, grid: Grid, isovalue: f32) -> Self {
        let lru = lru_cache_gpu::LruParams::zeroed();
        let params = view.params(grid, lru, isovalue, LookAhead::NONE);
        Self { params, shading, view, grid, isovalue }
    }

    /// That of the picture at half the resolution.
    pub(crate) fn halved(&self) -> Self {
        Self::of(self.view.reduced(2), self.shading, self.grid, self.isovalue)
    }

    pub(crate) fn pixels(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let [width, height] = self.params.size();
        (0..width * height).map(move |i| [i % width, i / width])
    }

    pub(crate) fn finished(capture: &Capture) -> Vec<Option<Finished>> {
        let (status, depth) = (capture.status.as_ref().unwrap(), capture.depth.as_ref().unwrap());
        let normal = capture.normal.as_ref().unwrap();
        (0..status.len())
            .map(|i| match status[i] {
                PixelStatus::Background => Some(Finished::Background),
                PixelStatus::Hit => Some(Finished::Hit { depth: depth[i], normal: normal[i] }),
                PixelStatus::Unfinished => None,
            })
            .collect()
    }

    /// Keys of the hits of an older picture.
    pub(crate) fn history(&self, old: &View, known: &[Option<Finished>]) -> Vec<u32> {
        let rows = self.view.pixel_from_index();
        let [width, height] = self.params.size();
        let mut keys = vec![EMPTY; (width * height) as usize];
        for (pixel, finished) in old.pixels().zip(known) {
            let &Some(Finished::Hit { depth, normal }) = finished else { continue };
            let ray = FrameRay::new(&old.params, pixel);
            let t = ray.t(&old.params, depth);
            let position = [0, 1, 2].map(|a| ray.ray.origin[a] + t * ray.ray.direction[a]);
            let hit = OldHit { position, normal };
            if let Some(([x, y], key)) =
                reproject::key(&self.params, &self.grid, &rows, &self.shading, &hit)
            {
                let least = &mut keys[(x + self.params.size()[0] * y) as usize];
                *least = key.min(*least);
            }
        }
        keys
    }

    /// What the twin shows in the holes of a picture.
    pub(crate) fn fill(
        &self,
        scene: &Scene,
        known: &[Option<Finished>],
        states: &[u32],
        history: Option<&[u32]>,
        sources: Sources,
        weights: &Weights,
    ) -> Vec<Option<Filled>> {
        let ranges = macrocell::cpu::ranges::build(&self.grid, &scene.volume.decode());
        let field = CoarseField::new(&self.grid, &ranges);
        let states = RayStates::new(&self.params, states);
        let t_low: Vec<f32> = self
            .pixels()
            .zip(known)
            .map(|(pixel, known)| if known.is_none() { states.t_low(pixel) } else { 0.0 })
            .collect();
        let twin = Twin {
            frame: &self.params,
            shading: &self.shading,
            grid: self.grid,
            field: Some(&field),
            pixels: known,
            t_low: &t_low,
            history,
            sources,
        };
        twin.fill(weights).pixels
    }

    /// The colour of a filled pixel in bytes, not rounded.
    pub(crate) fn color(&self, pixel: [u32; 2], filled: &Filled, background: [f32; 4]) -> [f32; 3] {
        let direction = FrameRay::new(&self.params, pixel).ray.direction;
        let to_viewer = shading::to_viewer(&self.shading, direction);
        let color = shading::shade(&self.shading, filled.normal, to_viewer);
        [0, 1, 2].map(|a| {
            let mixed = background[a] * (1.0 - filled.coverage) + color[a] * filled.coverage;
            255.0 * mixed.clamp(0.0, 1.0)
        })
    }
}

/// Holes whose colours differ from the twin's by more than `most` bytes, and all holes.
fn differences(
    view: &View,
    capture: &Capture,
    twin: &[Option<Filled>],
    frame: &Frame,
    most: f32,
) -> (usize, usize) {
    let background = frame.options.shading.background;
    let (mut wrong, mut holes) = (0, 0);
    for (i, pixel) in pixels().enumerate() {
        if capture.status.as_ref().unwrap()[i] != PixelStatus::Unfinished {
            continue;
        }
        holes += 1;
        let found = &capture.color[4 * i..4 * i + 3];
        let expected = match &twin[i] {
            Some(filled) => view.color(pixel, filled, background),
            None => [0, 1, 2].map(|a| f32::from(support::UNFINISHED[a])),
        };
        let off = |a: usize| (f32::from(found[a]) - expected[a]).abs() > most;
        wrong += usize::from((0..3).any(off));
    }
    (wrong, holes)
}

/// Every set of sources, by bits.
fn sources(bits: u32) -> Sources {
    Sources { neighbours: bits & 1 != 0, coarse_field: bits & 2 != 0, history: bits & 4 != 0 }
}

/// What is compared: two frames, the second cut; the twin gets the same pictures.
#[derive(Clone, Copy)]
struct Case {
    sources: Sources,
    infill: Infill,
    weights: Option<&'static Weights>,
    /// Distance of the camera in radii of the volume.
    distance: f64,
}

impl Case {
    fn frame(&self, scene: &Scene, azimuth: f64) -> Frame {
        let (center, radius) = scene.compressed().bounding_ball();
        let distance = radius * self.distance;
        let aspect = support::aspect(SIZE);
        let camera = Camera::orbit(center, distance, azimuth, 25.0, 40.0, aspect);
        Frame { camera, ..frame_with(scene, azimuth, self.infill) }
    }

    /// Holes whose colours are not the twin's, and all holes.
    fn against_the_twin(&self) -> (usize, usize) {
        let gpu = Gpu::new();
        let scene = Scene::generated("turbulence", [70, 66, 61], 8.0);
        let Self { sources, weights, .. } = *self;
        let options =
            with_infill(InfillOptions { sources, network: weights, ..Default::default() });
        let mut renderer = gpu.renderer(&scene, options);
        let (first, second) = (self.frame(&scene, 20.0), self.frame(&scene, 24.0));
        render_until(&gpu, &mut renderer, &first, 0.6);
        let old = capture(&gpu, &renderer);
        renderer.clear_cache();
        let report = render_until(&gpu, &mut renderer, &second, 0.5);
        let cut = capture(&gpu, &renderer);
        let states = kit::read_u32s(&gpu.device, &gpu.queue, renderer.rays().unwrap().rays());
        let (before, view) = (View::new(&scene, &first), View::new(&scene, &second));
        let keys = view.history(&before, &View::finished(&old));
        let zero = Weights::zero();
        let weights = weights.unwrap_or(&zero);
        let known = View::finished(&cut);
        let twin = view.fill(&scene, &known, &states, Some(&keys), sources, weights);
        let filled = twin.iter().flatten().count();
        assert_eq!(report.filled_pixels as usize, filled, "{sources:?}");
        assert_eq!(report.exact_pixels() + report.active_rays, SIZE[0] * SIZE[1]);
        differences(&view, &cut, &twin, &second, 4.0)
    }
}

#[test]
fn holes_get_the_twins_colours_with_every_set_of_sources() {
    for bits in 0..8 {
        let case = Case {
            sources: sources(bits),
            infill: Infill::Classical,
            weights: None,
            distance: 0.8,
        };
        let (wrong, holes) = case.against_the_twin();
        println!("sources {bits}: {wrong} of {holes} holes differ");
        assert!(holes > 500, "{holes}");
        // Rays whose crossing hangs on a rounding, and words whose last bit does.
        assert!(wrong * 500 <= holes, "{wrong} of {holes}");
    }
}

/// Weights of about the size that training gives.
pub(crate) fn random_weights(seed: u64) -> &'static Weights {
    let mut random = Random::new(seed);
    Box::leak(Box::new(Weights::from_fn(|_| random.between(-0.25, 0.25) as f32)))
}

#[test]
fn the_network_is_the_twins() {
    // From far away most tiles are far from any hole.
    for (seed, distance) in [(1, 0.8), (2, 0.8), (3, 3.0), (4, 5.0)] {
        let case = Case {
            sources: Sources::default(),
            infill: Infill::Network,
            weights: Some(random_weights(seed)),
            distance,
        };
        let (wrong, holes) = case.against_the_twin();
        println!("seed {seed}: {wrong} of {holes} holes differ");
        assert!(holes > 20 && wrong * 500 <= holes, "seed {seed}: {wrong} of {holes}");
    }
}

#[test]
fn the_comparison_notices_another_network() {
    let gpu = Gpu::new();
    let scene = Scene::generated("turbulence", [70, 66, 61], 8.0);
    let infill = InfillOptions { network: Some(random_weights(1)), ..Default::default() };
    let mut renderer = gpu.renderer(&scene, with_infill(infill));
    let frame = frame_with(&scene, 20.0, Infill::Network);
    render_until(&gpu, &mut renderer, &frame, 0.5);
    let cut = capture(&gpu, &renderer);
    let states = kit::read_u32s(&gpu.device, &gpu.queue, renderer.rays().unwrap().rays());
    let view = View::new(&scene, &frame);
    let wrong = |seed| {
        let weights = random_weights(seed);
        let known = View::finished(&cut);
        let twin = view.fill(&scene, &known, &states, None, Sources::default(), weights);
        differences(&view, &cut, &twin, &frame, 4.0).0
    };
    assert_eq!(wrong(1), 0);
    assert!(wrong(2) > 100);
}

#[test]
fn other_weights_show() {
    let gpu = Gpu::new();
    let scene = Scene::generated("turbulence", [70, 66, 61], 8.0);
    let picture = |weights| {
        let infill = InfillOptions { network: Some(weights), ..Default::default() };
        let mut renderer = gpu.renderer(&scene, with_infill(infill));
        render_until(&gpu, &mut renderer, &frame_with(&scene, 20.0, Infill::Network), 0.5);
        capture(&gpu, &renderer).color
    };
    assert_ne!(picture(random_weights(1)), picture(random_weights(2)));
}

#[test]
fn a_network_of_zeros_is_the_classical_filler() {
    let gpu = Gpu::new();
    let scene = Scene::generated("turbulence", [70, 66, 61], 8.0);
    let zero: &'static Weights = Box::leak(Box::new(Weights::zero()));
    let infill = InfillOptions { network: Some(zero), ..Default::default() };
    let pictures = [Infill::Classical, Infill::Network].map(|method| {
        let mut renderer = gpu.renderer(&scene, with_infill(infill));
        render_until(&gpu, &mut renderer, &frame_with(&scene, 20.0, method), 0.5);
        capture(&gpu, &renderer)
    });
    assert!(pictures[0].status.as_ref().unwrap().contains(&PixelStatus::Unfinished));
    assert!(pictures[0].color == pictures[1].color);
}

#[test]
fn finished_pixels_keep_their_bits_in_every_pass() {
    let gpu = Gpu::new();
    let scene = Scene::generated("gyroid", [60, 64, 60], 8.0);
    let weights = random_weights(7);
    let infill = InfillOptions { network: Some(weights), ..Default::default() };
    let mut filled = gpu.renderer(&scene, with_infill(infill));
    let mut plain = gpu.renderer(&scene, options(SIZE));
    let passes = |renderer: &mut ProgressiveIsoRenderer, infill| {
        let mut pictures = Vec::new();
        renderer.set_frame(&frame_with(&scene, 20.0, infill)).unwrap();
        renderer
            .render_to_completion(&gpu.device, &gpu.queue, |renderer, report| {
                if report.pass > 0 {
                    pictures.push(capture(&gpu, renderer));
                }
                true
            })
            .unwrap();
        pictures
    };
    let (with, without) = (passes(&mut filled, Infill::Network), passes(&mut plain, Infill::Off));
    assert_eq!(with.len(), without.len());
    for (with, without) in with.iter().zip(&without) {
        assert_eq!(with.status, without.status);
        assert_eq!(with.depth, without.depth);
        for (i, status) in with.status.as_ref().unwrap().iter().enumerate() {
            let same = with.color[4 * i..4 * i + 4] == without.color[4 * i..4 * i + 4];
            assert!(same || *status == PixelStatus::Unfinished, "pixel {i}");
        }
    }
    assert!(with.last().unwrap().color == without.last().unwrap().color);
}

#[test]
fn pixels_are_filled_from_the_completeness_that_is_enough() {
    let gpu = Gpu::new();
    let scene = Scene::generated("turbulence", [70, 66, 61], 8.0);
    let mut renderer = gpu.renderer(&scene, with_infill(InfillOptions::default()));
    let mut frame = frame_with(&scene, 20.0, Infill::Classical);
    frame.options.stop_at = Some(Completeness(0.7));
    renderer.set_frame(&frame).unwrap();
    let (mut stopped, mut going) = (0, 0);
    let last = renderer
        .render_to_completion(&gpu.device, &gpu.queue, |renderer, report| {
            if report.pass > 0 {
                assert_eq!(report.stopped(), report.completeness() >= 0.7);
                let expected = if report.stopped() { report.active_rays } else { 0 };
                assert_eq!(report.filled_pixels, expected);
                if !report.stopped() {
                    let shown = renderer.capture_blocking(&gpu.device, &gpu.queue).unwrap();
                    for (i, status) in shown.status.as_ref().unwrap().iter().enumerate() {
                        let is_unfinished = *status == PixelStatus::Unfinished;
                        let color = &shown.color[4 * i..4 * i + 4];
                        assert!(!is_unfinished || *color == support::UNFINISHED, "pixel {i}");
                    }
                }
                *(if report.stopped() { &mut stopped } else { &mut going }) += 1;
            }
            true
        })
        .unwrap();
    assert!(stopped > 1 && going > 0, "{stopped} {going}");
    assert!(last.complete() && last.filled_pixels == 0);
}

#[test]
fn what_was_not_planned_is_refused() {
    let gpu = Gpu::new();
    let scene = Scene::generated("gyroid", [20, 20, 20], 8.0);
    let mut without = gpu.renderer(&scene, options(SIZE));
    let refused = |renderer: &mut ProgressiveIsoRenderer, infill| {
        renderer.set_frame(&frame_with(&scene, 0.0, infill)) == Err(Error::InfillNotPlanned)
    };
    assert!(refused(&mut without, Infill::Classical));
    let mut classical = gpu.renderer(&scene, with_infill(InfillOptions::default()));
    assert!(refused(&mut classical, Infill::Network));
    assert!(!refused(&mut classical, Infill::Classical));
}

#[test]
fn crisp_pixels_are_surface_or_background() {
    let gpu = Gpu::new();
    let scene = Scene::generated("turbulence", [70, 66, 61], 8.0);
    let mut renderer = gpu.renderer(&scene, with_infill(InfillOptions::default()));
    let mut frame = frame_with(&scene, 20.0, Infill::Classical);
    // A surface of one colour whatever its normal.
    frame.options.shading.ambient = 1.0;
    frame.options.shading.diffuse = 0.0;
    frame.options.shading.specular = 0.0;
    frame.options.shading.base_color = [1.0, 0.0, 0.0];
    let mut colors = [false, true].map(|crisp| {
        frame.options.crisp_infill = crisp;
        render_until(&gpu, &mut renderer, &frame, 0.5);
        let mut colors =
            capture(&gpu, &renderer).color.chunks_exact(4).map(<[u8]>::to_vec).collect::<Vec<_>>();
        colors.sort();
        colors.dedup();
        colors
    });
    assert!(colors[0].len() > 2);
    colors[1].retain(|c| *c != support::UNFINISHED);
    assert_eq!(colors[1], [support::BACKGROUND.to_vec(), vec![255, 0, 0, 255]]);
}

#[test]
fn memory_stays_within_the_plan_and_is_nothing_when_off() {
    let gpu = Gpu::new();
    let scene = Scene::generated("turbulence", [70, 66, 61], 8.0);
    let plain = options(SIZE);
    let part = |options| {
        let plan =
            progressive_iso::ScenePlan::new(&scene.compressed(), &options, &gpu.device.limits());
        plan.unwrap().parts().iter().find(|part| part.name == "infill").unwrap().bytes
    };
    assert_eq!(part(plain), 0);
    let bytes = |options| {
        let mut renderer = gpu.renderer(&scene, options);
        let frame = Frame {
            options: FrameOptions { infill: Infill::Off, ..Default::default() },
            ..frame_with(&scene, 20.0, Infill::Off)
        };
        let report = render_until(&gpu, &mut renderer, &frame, 2.0);
        assert!(report.peak_bytes <= renderer.plan().bytes());
        report.bytes
    };
    let weights = random_weights(3);
    let with = with_infill(InfillOptions { network: Some(weights), ..Default::default() });
    // The counter of filled pixels is read back for two passes in flight.
    let more = bytes(RendererOptions { most_slots: Some(600), ..with })
        - bytes(RendererOptions { most_slots: Some(600), ..plain });
    let slack = 64;
    assert!(more >= part(with) && more <= part(with) + slack, "{more} {}", part(with));
}

#[test]
fn infill_comes_and_goes_with_the_options() {
    let (gpu, scene) = (Gpu::new(), Scene::generated("turbulence", [45, 41, 38], 8.0));
    // With a cache and pairs, a pass has most to read back.
    let cached = |options| RendererOptions {
        strategy: TraversalStrategy::BlockSorted(BlockSortedOptions::default()),
        residency: Residency::Cached,
        ..options
    };
    let (without, with) = (cached(options(SIZE)), cached(with_infill(InfillOptions::default())));
    let [off, filled] = [Infill::Off, Infill::Classical].map(|i| frame_with(&scene, 20.0, i));
    let mut renderer = gpu.renderer(&scene, without);
    let expected = gpu.finish(&mut renderer, &off);
    for _ in 0..2 {
        renderer.set_options(&gpu.device, with).unwrap();
        renderer.clear_cache();
        let report = render_until(&gpu, &mut renderer, &filled, 0.2);
        assert!(report.filled_pixels > 500 && !report.complete(), "{report:?}");
        let (plan, bytes) = (renderer.plan().clone(), renderer.poll_report().bytes);
        let refused = renderer.set_options(&gpu.device, without);
        assert!(matches!(refused, Err(Error::InfillNotPlanned)), "the frame needs it: {refused:?}");
        let kept = renderer.poll_report();
        assert_eq!((renderer.plan(), kept.bytes), (&plan, bytes), "nothing changes");
        assert_eq!(
            (kept.frame, kept.newest_frame),
            (report.frame, report.frame),
            "the frame goes on"
        );
        assert_eq!(gpu.finish(&mut renderer, &off).color, expected.color);
        renderer.set_options(&gpu.device, without).unwrap();
        assert!(matches!(renderer.set_frame(&filled), Err(Error::InfillNotPlanned)));
        assert_eq!(gpu.finish(&mut renderer, &off).color, expected.color);
        let report = renderer.poll_report();
        assert_eq!(report.filled_pixels, 0);
        assert!(report.bytes <= renderer.plan().rendering_bytes(), "{report:?}");
    }
}

#[test]
fn infill_is_left_out_where_every_ray_ends_in_the_first_pass() {
    let (gpu, scene) = (Gpu::new(), Scene::generated("turbulence", [45, 41, 38], 8.0));
    let full = |infill| RendererOptions { residency: Residency::Full, infill, ..options(SIZE) };
    let usual = InfillOptions { network: Some(Weights::trained()), ..Default::default() };
    let frame = frame_with(&scene, 20.0, Infill::Network);
    let part = |renderer: &ProgressiveIsoRenderer| {
        let parts = renderer.plan().parts();
        let part = parts.iter().find(|part| part.name == "infill").unwrap();
        (part.included, part.why.clone(), part.bytes)
    };

    let mut without = gpu.renderer(&scene, full(None));
    let plain = frame_with(&scene, 20.0, Infill::Off);
    let expected = gpu.finish(&mut without, &plain);
    let mut renderer = gpu.renderer(&scene, full(Some(usual)));
    let left_out = "every block is resident: nothing to fill";
    assert_eq!(part(&renderer), (false, left_out.into(), 0));
    assert_eq!(renderer.plan().bytes(), without.plan().bytes(), "it costs no byte");
    assert_eq!(gpu.finish(&mut renderer, &frame).color, expected.color);
    let (report, plain) = (renderer.poll_report(), without.poll_report());
    assert_eq!((report.bytes, report.dispatches), (plain.bytes, plain.dispatches));

    // It comes with a cache, with foveated frames and where it is asked for all the same, and goes again.
    let asked = InfillOptions { when: InfillWhen::Always, ..usual };
    let foveated = RendererOptions { foveation: Some(BlueNoise::tiles()), ..full(Some(usual)) };
    for with in [full(Some(asked)), foveated] {
        renderer.set_options(&gpu.device, with).unwrap();
        assert!(part(&renderer).0 && renderer.plan().bytes() > without.plan().bytes());
        assert_eq!(gpu.finish(&mut renderer, &frame).color, expected.color);
        let bytes = renderer.poll_report().bytes;
        assert!(bytes >= plain.bytes + part(&renderer).2, "it has its memory: {bytes}");
        renderer.set_options(&gpu.device, full(Some(usual))).unwrap();
        assert!(!part(&renderer).0);
        assert_eq!(gpu.finish(&mut renderer, &frame).color, expected.color);
    }
    let cached = RendererOptions { residency: Residency::Cached, ..full(Some(usual)) };
    renderer.set_options(&gpu.device, cached).unwrap();
    assert!(part(&renderer).0);
    let report = render_until(&gpu, &mut renderer, &frame, 0.1);
    assert!(!report.complete() && report.filled_pixels > 100, "{report:?}");
}

/// The finished picture, the rounds that it took and the blocks that were decoded.
fn finished(
    gpu: &Gpu,
    scene: &Scene,
    strategy: TraversalStrategy,
    slots: u64,
    guided: bool,
) -> (Capture, [u32; 2]) {
    let infill = Some(InfillOptions { guided: true, ..Default::default() });
    let chosen = RendererOptions { strategy, most_slots: Some(slots), infill, ..options(SIZE) };
    let mut renderer = gpu.renderer(scene, chosen);
    let mut frame = frame_with(scene, 20.0, Infill::Classical);
    frame.options.guided = guided;
    let report = render_until(gpu, &mut renderer, &frame, 2.0);
    (capture(gpu, &renderer), [report.rounds, report.blocks_decoded])
}

#[test]
fn guided_requests_change_no_bit_of_the_finished_picture() {
    let gpu = Gpu::new();
    let block_sorted = TraversalStrategy::BlockSorted(BlockSortedOptions::default());
    for name in ["turbulence", "sheets"] {
        let scene = Scene::generated(name, [70, 66, 61], 8.0);
        // BlockSorted takes hundreds of rounds with few slots, minutes on a slow driver.
        let run_ahead = TraversalStrategy::RunAhead;
        for (strategy, slots) in [(run_ahead, 300), (run_ahead, 6000), (block_sorted, 6000)] {
            let [plain, guided] =
                [false, true].map(|guided| finished(&gpu, &scene, strategy, slots, guided));
            println!(
                "{name}, {strategy:?}, {slots} slots: rounds and blocks {:?}, guided {:?}",
                plain.1, guided.1
            );
            assert!(plain.0 == guided.0);
            // The guide does ask for more, unless the slots are too few for that.
            assert!(slots < 1000 || plain.1 != guided.1);
        }
    }
}
