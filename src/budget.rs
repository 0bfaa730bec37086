//! The frame-time budget: how many rays a frame's first pass casts, and how far it looks ahead, so that it takes no longer
//! than it should.
//!
//! A frame's time is predicted as its work, which a pre-pass estimates, times a cost per unit of work, which is learned
//! while frames are rendered (V. Bruder, S. Frey, T. Ertl, Real-Time Performance Prediction and Tuning for Interactive
//! Volume Raycasting, 2016).

mod krls;
mod work;

use gpu_primitives::memory::Ledger;
use gpu_primitives::readback::ReadbackRing;
use macrocell::{Grid, RangeBuffers};
use wavefront::{Foveation, FrameView};
use web_time::Instant;

use krls::Krls;
use work::{PrePass, Work};

use crate::wgpu;

/// How a frame's setting follows from [`crate::FrameOptions::target_ms`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum BudgetMode {
    /// From what a model predicts. It learns while frames are rendered; what it has not seen yet gets a safe setting.
    #[default]
    Predicted,
    /// Not at all: every frame casts all rays. Times are predicted for the reports only.
    Fixed,
    /// From what the frame before took.
    LastFrame,
    /// From what the frame's own first pass takes, which casts a quarter of the rays of the frame before; the second pass
    /// casts what fits.
    TwoPass,
}

/// Number of features.
const FEATURES: usize = 10;
/// Share of the rays that are cast at least.
const LEAST_DENSITY: f64 = 1.0 / 64.0;
/// Share of the rays of the first frame, of which nothing is known.
const FIRST_DENSITY: f64 = 1.0 / 16.0;
/// From frame to frame the step between rays shrinks by this factor at most (the publication's limit).
const MOST_STEP: f64 = 0.8;
/// What a prediction about something entirely new is multiplied by, less 1.
const CAUTION: f64 = 0.5;
/// Relative error of predictions before any was compared, the most that one counts as, and how much the newest counts.
const FIRST_SPREAD: f64 = 0.05;
const MOST_ERROR: f64 = 0.5;
const SPREAD_RATE: f64 = 0.1;
/// As many of these are kept free below a target.
const SPREADS: f64 = 1.5;
/// Part of a time that is clearly less.
const CLEARLY_LESS: f64 = 0.9;
/// Densities between the most and the least that are looked at.
const CANDIDATES: u32 = 48;
/// Unusable times in a row after which the clock counts as broken.
const MOST_UNUSABLE: u32 = 3;
/// Work of starting a pixel's ray, of filling a pixel and of decoding a coarse cell, in visits of a block.
const START_WORK: f64 = 0.1;
const FILL_WORK: f64 = 4.0;
const DECODE_WORK: f64 = 2000.0;
/// Part of what is decoded that a doubled look-ahead adds, before anything was learned.
const LOOK_AHEAD_WORK: f64 = 0.25;

/// A frame that a setting is wanted for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Request<'a> {
    pub(crate) view: &'a FrameView,
    pub(crate) size: [u32; 2],
    pub(crate) isovalue: f32,
    pub(crate) look_ahead: u32,
    /// Whether pixels without a cast ray are filled.
    pub(crate) fills: bool,
    pub(crate) target_ms: f64,
}

/// What a frame's setting was chosen by, to learn from its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Choice {
    features: [f64; FEATURES],
    /// 0 without a pre-pass.
    work: f64,
    /// Share of the rays that the frame's first pass may cast, and how far it looks ahead.
    pub(crate) density: f64,
    pub(crate) look_ahead: u32,
    pub(crate) predicted_ms: Option<f64>,
    pub(crate) target_ms: f64,
    /// CPU time of pre-pass and prediction and of learning from the frame before.
    pub(crate) cpu_ms: f64,
}

impl Choice {
    /// The sampling mask of the frame's passes; `None`: all rays at once.
    pub(crate) fn foveation(&self) -> Option<Foveation> {
        // So that the passes after the first, which cast what is left, are about as long.
        let passes = (2.0 / self.density).ceil() as u32;
        (self.density < 1.0).then_some(Foveation {
            sigma: 0.0,
            base_density: self.density as f32,
            passes: passes.clamp(1, Foveation::MOST_PASSES),
            ..Foveation::default()
        })
    }
}

/// Chooses settings and learns from times.
#[derive(Debug)]
pub(crate) struct Budget {
    mode: BudgetMode,
    grid: Grid,
    /// Whether blocks are decoded on demand.
    cached: bool,
    ranges: ReadbackRing,
    pre_pass: Option<PrePass>,
    model: Krls<FEATURES>,
    /// Logarithm of the milliseconds per unit of work of the first frame that was measured.
    level: Option<f64>,
    /// Density and time of the newest frame that was measured, and the density that was chosen last.
    last: Option<(f64, f64)>,
    density: f64,
    /// Mean size of the newest predictions' relative errors.
    spread: f64,
    unusable: u32,
    learning_ms: f64,
}

impl Budget {
    pub(crate) fn new(mode: BudgetMode, ledger: &Ledger, grid: Grid, cached: bool) -> Self {
        let ranges = ReadbackRing::new(ledger, "progressive-iso.budget", range_bytes(grid), 1);
        Self {
            mode,
            grid,
            cached,
            ranges,
            pre_pass: None,
            model: Krls::default(),
            level: None,
            last: None,
            density: FIRST_DENSITY,
            spread: FIRST_SPREAD,
            unusable: 0,
            learning_ms: 0.0,
        }
    }

    /// Most bytes of GPU memory.
    pub(crate) fn bytes(grid: Grid) -> u64 {
        ReadbackRing::new(&Ledger::new(), "plan", range_bytes(grid), 1).bytes_limit()
    }

    /// The mode and whether blocks are decoded on demand.
    pub(crate) fn kind(&self) -> (BudgetMode, bool) {
        (self.mode, self.cached)
    }

    /// Records reading back the coarse cells' ranges, unless they are known or on their way.
    pub(crate) fn record_ranges(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        ranges: &RangeBuffers,
    ) {
        if self.pre_pass.is_none() && self.ranges.has_room() {
            let part = (ranges.coarse_ranges(), 0, range_bytes(self.grid));
            self.ranges.record(device, encoder, &[part], 0);
        }
    }

    /// Takes in the ranges, if the GPU has finished copying them. Lost ones are asked for again.
    pub(crate) fn collect(&mut self) {
        if let Some((_, Ok(bytes))) = self.ranges.take() {
            let pair = |b: &[u8]| {
                let value = |i: usize| f32::from_le_bytes([b[i], b[i + 1], b[i + 2], b[i + 3]]);
                [value(0), value(4)]
            };
            self.pre_pass =
                Some(PrePass::new(self.grid, bytes.chunks_exact(8).map(pair).collect()));
            // They come once, and its memory goes.
            self.ranges.set_bytes(0);
        }
    }

    /// Nothing is decoded any more.
    pub(crate) fn forget_cache(&mut self) {
        if let Some(pre_pass) = &mut self.pre_pass {
            pre_pass.forget();
        }
    }

    /// The setting of a frame.
    pub(crate) fn choose(&mut self, request: &Request<'_>) -> Choice {
        let begin = Instant::now();
        let Request { view, size, isovalue, target_ms, .. } = *request;
        let work = self.pre_pass.as_mut().map(|pre_pass| pre_pass.estimate(view, size, isovalue));
        let cached = self.cached;
        let outlook_of = |look_ahead| {
            work.map(|w| Outlook::new(&Request { look_ahead, ..*request }, &w, cached))
        };
        let mut look_ahead = request.look_ahead;
        let mut outlook = outlook_of(look_ahead);
        let density = match (self.mode, &outlook) {
            _ if self.unusable >= MOST_UNUSABLE => 1.0,
            (BudgetMode::Fixed, _) => 1.0,
            (BudgetMode::TwoPass, _) => (self.after_last(target_ms) / 4.0).max(LEAST_DENSITY),
            (BudgetMode::Predicted, Some(asked)) if self.level.is_some() => {
                let density = self.fitting(asked, target_ms);
                let is_too_long = self.cautious_ms(asked, density) > target_ms;
                if cached && look_ahead > 1 && is_too_long {
                    // What too few rays do not make room for may be what is decoded for later.
                    look_ahead = 1;
                    outlook = outlook_of(look_ahead);
                    outlook.map_or(density, |outlook| self.fitting(&outlook, target_ms))
                } else {
                    density
                }
            }
            _ => self.after_last(target_ms),
        };
        self.density = density;
        let (mut features, mut units, mut predicted_ms) = ([0.0; FEATURES], 0.0, None);
        if let Some(outlook) = &outlook {
            (features, units) = (outlook.features(density), outlook.units(density));
            predicted_ms = self.predict(outlook, density).map(|(ms, _)| ms);
        }
        let cpu_ms = begin.elapsed().as_secs_f64() * 1e3 + self.learning_ms;
        Choice { features, work: units, density, look_ahead, predicted_ms, target_ms, cpu_ms }
    }

    /// The sampling mask of a frame from its second pass on: that of its first one, or with [`BudgetMode::TwoPass`]
    /// one of as many rays as that one's time leaves room for, once it is known.
    pub(crate) fn second(&self, choice: &Choice, first: Option<Foveation>) -> Option<Foveation> {
        let two_pass = self.last.filter(|(density, _)| {
            self.mode == BudgetMode::TwoPass && density.to_bits() == choice.density.to_bits()
        });
        let (Some((density, ms)), Some(first)) = (two_pass, first) else { return first };
        let fits = (density * choice.target_ms / ms).clamp(density, 1.0);
        // The mask of the second pass has 1 - (1 - d)^2 of the rays.
        Some(Foveation { base_density: 1.0 - (1.0 - fits as f32).sqrt(), ..first })
    }

    /// Learns what a frame's first pass took.
    pub(crate) fn learn(&mut self, choice: &Choice, ms: f64) {
        if !(ms.is_finite() && ms > 0.0) {
            self.unusable += 1;
            return;
        }
        let begin = Instant::now();
        self.unusable = 0;
        self.last = Some((choice.density, ms));
        if let Some(predicted_ms) = choice.predicted_ms {
            let error = (ms / predicted_ms).ln().abs().min(MOST_ERROR);
            self.spread += SPREAD_RATE * (error - self.spread);
        }
        if choice.work > 0.0 {
            let cost = (ms / choice.work).ln();
            // What is new costs about as much as the first frame did.
            let level = *self.level.get_or_insert(cost);
            self.model.learn(&choice.features, cost - level);
        }
        self.learning_ms = begin.elapsed().as_secs_f64() * 1e3;
    }

    /// The density by what the last frame took; the safe one if there was none.
    fn after_last(&self, target_ms: f64) -> f64 {
        let Some((density, ms)) = self.last else { return FIRST_DENSITY };
        (density * target_ms / ms).min(density / MOST_STEP).clamp(LEAST_DENSITY, 1.0)
    }

    /// The largest density that is predicted to fit. Where none does, the one that is predicted to take clearly less than
    /// the frame before's, or half of that one: what is not known may be better. Fewer rays leave more pixels to fill, so
    /// time need not fall with them; from the least density on, the way is up again.
    fn fitting(&self, outlook: &Outlook, target_ms: f64) -> f64 {
        let most = (self.density / MOST_STEP).clamp(LEAST_DENSITY, 1.0);
        let (mut best, mut least_ms) = (LEAST_DENSITY, f64::INFINITY);
        for i in 0..=CANDIDATES {
            let share = f64::from(i) / f64::from(CANDIDATES);
            let density = (most * (LEAST_DENSITY / most).powf(share)).max(LEAST_DENSITY);
            let ms = self.cautious_ms(outlook, density);
            if ms <= target_ms {
                return density;
            }
            if ms < least_ms {
                (best, least_ms) = (density, ms);
            }
        }
        let at_least = self.density <= LEAST_DENSITY;
        if at_least || least_ms < CLEARLY_LESS * self.cautious_ms(outlook, self.density) {
            best
        } else {
            (0.5 * self.density).max(LEAST_DENSITY)
        }
    }

    /// More than most times that are predicted like this: about one in nine of those that scatter as the newest did
    /// lies above.
    fn cautious_ms(&self, outlook: &Outlook, density: f64) -> f64 {
        let spread = (SPREADS * self.spread).exp();
        self.predict(outlook, density)
            .map_or(f64::INFINITY, |(ms, novelty)| ms * (1.0 + CAUTION * novelty) * spread)
    }

    /// Milliseconds, and how new this is.
    fn predict(&self, outlook: &Outlook, density: f64) -> Option<(f64, f64)> {
        let level = self.level?;
        let (cost, novelty) = self.model.predict(&outlook.features(density));
        Some((outlook.units(density) * (level + cost).exp(), novelty))
    }
}

/// What is known of a frame before its density is chosen.
#[derive(Clone, Copy, Debug)]
struct Outlook {
    /// In visits of a block: for every frame, more if all rays are cast, or if all pixels are filled instead, and for
    /// all blocks that such a frame decodes.
    started: f64,
    cast: f64,
    filled: f64,
    decoded: f64,
    look_ahead: u32,
    /// With a density of 1.
    features: [f64; FEATURES],
}

impl Outlook {
    fn new(request: &Request<'_>, work: &Work, cached: bool) -> Self {
        let Request { view, size, look_ahead, fills, .. } = *request;
        let middle = size.map(|s| s / 2);
        let (_, direction, _) = view.ray(middle);
        let (_, beside, _) = view.ray([middle[0] + 1, middle[1]]);
        let apart = glam::DVec3::from(direction).distance(beside.into());
        let voxels_per_pixel = (apart * work.distance_voxels).max(1e-3);
        let rays = size.map(f64::from).iter().product::<f64>();
        let fresh = if cached { work.fresh } else { 0.0 };
        Self {
            started: rays * START_WORK,
            cast: rays * work.entered * (1.0 + work.visited),
            filled: if fills { rays * work.entered * FILL_WORK } else { 0.0 },
            decoded: fresh * work.in_sight * DECODE_WORK,
            look_ahead,
            features: [
                0.0,
                (1.0 + work.visited).ln(),
                work.entered,
                0.5 * (1.0 + work.depth_voxels).ln(),
                2.0 * fresh,
                0.3 * f64::from(look_ahead.max(1)).ln(),
                0.3 * voxels_per_pixel.ln(),
                0.5 * rays.ln(),
                0.4 * direction[0],
                0.4 * direction[1],
            ],
        }
    }

    /// Work in visits of a block.
    fn units(&self, density: f64) -> f64 {
        let rays = self.started + density * self.cast + (1.0 - density) * self.filled;
        let ahead = 1.0 + LOOK_AHEAD_WORK * f64::from(self.look_ahead.max(1)).log2();
        rays + self.decoded * ahead * density.sqrt()
    }

    fn features(&self, density: f64) -> [f64; FEATURES] {
        let mut features = self.features;
        features[0] = 0.7 * density.ln();
        features
    }
}

/// Bytes of all coarse cells' ranges.
fn range_bytes(grid: Grid) -> u64 {
    8 * grid.coarse_count()
}

/// Numbers from 0 to 1 that look random, the same in every run.
#[cfg(test)]
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use wavefront::Camera;

    const SIZE: [u32; 2] = [640, 360];
    const GRID: [u32; 3] = [200, 200, 200];

    fn budget(mode: BudgetMode) -> Budget {
        let grid = Grid::new(GRID);
        let mut budget = Budget::new(mode, &Ledger::new(), grid, false);
        // Active for isovalues from 0 to 1: a cell in three.
        let active = |i: u64| if i.is_multiple_of(3) { [0.0, 1.0] } else { [2.0, 3.0] };
        let ranges = (0..grid.coarse_count()).map(active).collect();
        budget.pre_pass = Some(PrePass::new(grid, ranges));
        budget
    }

    fn view(azimuth: f64, distance: f64) -> FrameView {
        let unit = [1.0, 0.0, 0.0, 0.0];
        let world = [unit, [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
        let camera = Camera::orbit([100.0; 3], 170.0 * distance, azimuth, 20.0, 50.0, 16.0 / 9.0);
        FrameView::new(&camera, SIZE, world, GRID).unwrap_or_else(|e| panic!("{e}"))
    }

    /// Shows `frames` frames of a moving camera to a renderer whose times are `cost` of density and
    /// frame number, and returns densities and times.
    fn show(
        budget: &mut Budget,
        frames: u32,
        target_ms: f64,
        fills: bool,
        cost: impl Fn(f64, u32) -> f64,
    ) -> Vec<(f64, f64)> {
        let frame = |number: u32| {
            let distance = 0.8 + 0.3 * (f64::from(number) * 0.1).sin();
            let view = view(3.0 * f64::from(number), distance);
            let request =
                Request { view: &view, size: SIZE, isovalue: 0.5, look_ahead: 2, fills, target_ms };
            let choice = budget.choose(&request);
            let ms = cost(choice.density, number);
            budget.learn(&choice, ms);
            (choice.density, ms)
        };
        (0..frames).map(frame).collect()
    }

    #[test]
    fn times_come_near_the_target_from_below() {
        let cost = |density: f64, _| 4.0 + 90.0 * density;
        let shown = show(&mut budget(BudgetMode::Predicted), 120, 30.0, false, cost);
        for (i, (density, ms)) in shown.iter().enumerate().skip(20) {
            assert!((22.0..31.0).contains(ms), "frame {i}: {ms} ms with a density of {density}");
        }
    }

    #[test]
    fn a_frame_that_decodes_too_much_does_not_look_ahead() {
        let mut budget = budget(BudgetMode::Predicted);
        budget.cached = true;
        // Decoding what is new takes a millisecond for every step of looking ahead; the rest nothing of note.
        let mut look = |azimuth: f64, target_ms: f64| {
            let view = view(azimuth, 1.0);
            let request = Request {
                view: &view,
                size: SIZE,
                isovalue: 0.5,
                look_ahead: 4,
                fills: false,
                target_ms,
            };
            let choice = budget.choose(&request);
            budget.learn(&choice, 10.0 + f64::from(choice.look_ahead));
            choice.look_ahead
        };
        assert_eq!(look(0.0, 1e-3), 4, "nothing is known yet");
        assert_eq!(look(1.0, 1e6), 4);
        assert_eq!(look(2.0, 1e-3), 1);
        assert_eq!(look(3.0, 1e6), 4);
    }

    #[test]
    fn a_density_rises_by_a_quarter_at_most() {
        for mode in [BudgetMode::Predicted, BudgetMode::LastFrame] {
            let shown = show(&mut budget(mode), 60, 1e6, false, |density, _| 100.0 * density);
            for pair in shown.windows(2) {
                assert!(pair[1].0 <= pair[0].0 / MOST_STEP * (1.0 + 1e-9), "{mode:?}: {pair:?}");
            }
            assert_eq!(shown[59].0.to_bits(), 1.0_f64.to_bits(), "{mode:?}: all rays fit");
        }
    }

    #[test]
    fn what_does_not_fit_gets_the_least_density() {
        for mode in [BudgetMode::Predicted, BudgetMode::LastFrame] {
            let shown = show(&mut budget(mode), 30, 1e-3, false, |density, _| 100.0 * density);
            assert!((shown[29].0 - LEAST_DENSITY).abs() < 1e-3, "{mode:?}: {:?}", shown[29]);
        }
    }

    #[test]
    fn what_takes_as_long_with_fewer_rays_is_tried_with_fewer_all_the_same() {
        // As where filling takes as long as casting: rises again from the least density, too.
        let mut budget = budget(BudgetMode::Predicted);
        show(&mut budget, 40, 200.0, true, |density, _| 110.0 - 10.0 * density);
        let shown = show(&mut budget, 20, 50.0, true, |density, _| 110.0 - 10.0 * density);
        let least = shown.iter().map(|shown| shown.0).fold(1.0, f64::min);
        assert!(least <= LEAST_DENSITY * 1.01, "{shown:?}");
    }

    #[test]
    fn an_unusable_clock_ends_adaptation_and_a_usable_one_resumes_it() {
        for broken in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let mut budget = budget(BudgetMode::Predicted);
            let cost = |density: f64, number| {
                if (10..20).contains(&number) { broken } else { 100.0 * density }
            };
            let shown = show(&mut budget, 40, 20.0, false, cost);
            assert!(shown[9].0 < 0.5, "{shown:?}");
            for (density, _) in &shown[13..20] {
                assert_eq!(density.to_bits(), 1.0_f64.to_bits(), "{broken}: {shown:?}");
            }
            assert!(shown[39].0 < 0.5, "{broken}: {shown:?}");
        }
    }

    proptest! {
        #[test]
        fn whatever_frames_take_a_density_is_one_and_rises_slowly(
            mode in prop::sample::select(vec![BudgetMode::Predicted, BudgetMode::LastFrame]),
            target_ms in 0.1..300.0,
            fixed_ms in 0.01..100.0,
            all_rays_ms in 0.0..1e3,
            fills in any::<bool>(),
            seed in any::<u64>(),
        ) {
            let scatter = std::cell::RefCell::new(noise(seed));
            // Every tenth frame or so takes ten times as long.
            let cost = |density: f64, _| {
                let factor = if scatter.borrow_mut()() > 0.9 { 10.0 } else { 1.0 };
                (fixed_ms + all_rays_ms * density) * factor
            };
            let shown = show(&mut budget(mode), 60, target_ms, fills, cost);
            prop_assert!(shown.iter().all(|(density, _)| (LEAST_DENSITY..=1.0).contains(density)), "{shown:?}");
            for pair in shown.windows(2) {
                prop_assert!(pair[1].0 <= pair[0].0 / MOST_STEP * (1.0 + 1e-9), "{pair:?}");
            }
        }

        #[test]
        fn a_target_within_reach_is_kept(
            target_ms in 1.0..300.0,
            fixed_share in 0.02..0.6,
            density in 0.04..0.9,
        ) {
            let fixed_ms = fixed_share * target_ms;
            let cost = |chosen: f64, _| fixed_ms + (target_ms - fixed_ms) * chosen / density;
            let shown = show(&mut budget(BudgetMode::Predicted), 80, target_ms, false, cost);
            for (i, (chosen, ms)) in shown.iter().enumerate().skip(40) {
                prop_assert!(*ms <= 1.1 * target_ms, "frame {i}: {ms} of {target_ms} ms, density {chosen}");
                prop_assert!(*ms >= 0.6 * target_ms, "frame {i}: {ms} of {target_ms} ms, density {chosen}");
            }
        }

        #[test]
        fn a_clock_that_stays_unusable_ends_adaptation(
            mode in prop::sample::select(vec![BudgetMode::Predicted, BudgetMode::LastFrame, BudgetMode::TwoPass]),
            broken in prop::sample::select(vec![0.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY]),
            from in 0_u32..20,
        ) {
            let cost = |density: f64, number| if number >= from { broken } else { 100.0 * density };
            let shown = show(&mut budget(mode), from + 8, 20.0, false, cost);
            for (density, _) in &shown[from as usize + MOST_UNUSABLE as usize..] {
                prop_assert_eq!(density.to_bits(), 1.0_f64.to_bits(), "{:?}", shown);
            }
        }
    }

    #[test]
    fn a_second_pass_casts_what_the_first_one_leaves_time_for() {
        let mut budget = budget(BudgetMode::TwoPass);
        let view = view(0.0, 1.0);
        let request = Request {
            view: &view,
            size: SIZE,
            isovalue: 0.5,
            look_ahead: 2,
            fills: false,
            target_ms: 20.0,
        };
        let choice = budget.choose(&request);
        let first = choice.foveation();
        assert_eq!(budget.second(&choice, first), first, "nothing is known of it yet");
        budget.learn(&choice, 5.0);
        let second = budget.second(&choice, first).map(|f| f64::from(f.base_density));
        let expected = 1.0 - (1.0 - 4.0 * choice.density).sqrt();
        assert!(second.is_some_and(|d| (d - expected).abs() < 1e-6), "{second:?}: {expected}");
    }
}
