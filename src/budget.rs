//! The frame-time budget: how many rays a frame's first pass casts, whether it is a preview, and how far it looks ahead, so
//! that it takes no longer than it should.
//!
//! A frame's time is predicted as its work, which a pre-pass estimates, times a cost per unit of work, which is learned
//! while frames are rendered (V. Bruder, S. Frey, T. Ertl, Real-Time Performance Prediction and Tuning for Interactive
//! Volume Raycasting, 2016).

mod errors;
mod krls;
mod outlook;
mod setting;
mod work;

use gpu_primitives::memory::Ledger;
use gpu_primitives::readback::ReadbackRing;
use macrocell::{Grid, RangeBuffers};
use wavefront::{Foveation, FrameView};
use web_time::Instant;

use errors::Errors;
use krls::Krls;
use outlook::{Features, KINDS, LIKENESS, Outlook};
use work::PrePass;

pub(crate) use setting::{STEPS, Sampling, Setting, step_index};

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

impl BudgetMode {
    /// Whether its first passes may be previews. The second pass of [`BudgetMode::TwoPass`] has to go on from the first.
    pub(crate) fn has_previews(self) -> bool {
        matches!(self, Self::Predicted | Self::LastFrame)
    }
}

/// Share of the picture's rays that is cast at least.
const LEAST_SHARE: f64 = 1.0 / 64.0;
/// That of the first frame, of which nothing is known.
const FIRST_SHARE: f64 = 1.0 / 16.0;
/// From frame to frame the step between rays shrinks by this factor at most (the publication's limit).
const MOST_STEP: f64 = 0.8;
/// What a prediction about something entirely new is multiplied by, less 1.
const CAUTION: f64 = 0.5;
/// Part of a target below which the frame before leaves room for a trial, and frames from one that took too long to the next.
const ROOM: f64 = 0.85;
const LEAST_WAIT: u32 = 4;
const MOST_WAIT: u32 = 64;
/// How new something is at least that was not tried before.
const NEW: f64 = 0.1;
/// As many typical errors of predictions are kept free below a target.
const SPREADS: f64 = 1.0;
/// Part of a time that is clearly less.
const CLEARLY_LESS: f64 = 0.9;
/// Shares between the most and the least that are looked at.
const CANDIDATES: u32 = 48;
/// Unusable times in a row after which the clock counts as broken.
const MOST_UNUSABLE: u32 = 3;
/// A frame that a setting is wanted for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Request<'a> {
    pub(crate) view: &'a FrameView,
    pub(crate) size: [u32; 2],
    /// Pixels from one ray to the next in both directions that the first pass may have, ascending from 1.
    pub(crate) steps: &'a [u32],
    pub(crate) isovalue: f32,
    pub(crate) look_ahead: u32,
    /// Whether pixels without a cast ray are filled.
    pub(crate) fills: bool,
    pub(crate) target_ms: f64,
}

/// What a frame's setting was chosen by, to learn from its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Choice {
    /// Those without a pre-pass are not learned from, as their work is 0.
    features: Features,
    work: f64,
    pub(crate) setting: Setting,
    /// The share that was asked for: about that of the setting; and whether to find out what it takes.
    asked: f64,
    is_trial: bool,
    /// How far it looks ahead.
    pub(crate) look_ahead: u32,
    pub(crate) predicted_ms: Option<f64>,
    pub(crate) target_ms: f64,
    /// CPU time of pre-pass and prediction and of learning from the frame before.
    pub(crate) cpu_ms: f64,
}

/// A share that is asked for: whether it is predicted to fit, and whether to find out what it takes.
#[derive(Clone, Copy, Debug)]
struct Fitting {
    asked: f64,
    fits: bool,
    is_trial: bool,
}

/// A frame whose time is known: the share that was asked for, what it took, and its work.
#[derive(Clone, Copy, Debug)]
struct Measured {
    asked: f64,
    ms: f64,
    work: f64,
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
    model: Krls<LIKENESS, KINDS>,
    /// Logarithm of the milliseconds per unit of work of the first frame that was measured.
    level: Option<f64>,
    /// The newest frame that was measured, and the share that was asked for last.
    last: Option<Measured>,
    asked: f64,
    /// Frames until the next trial, and how many there were between the newest ones.
    trial_in: u32,
    trial_wait: u32,
    /// First and last steps that a frame with a usable time had.
    steps_seen: Vec<[u32; 2]>,
    errors: Errors,
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
            asked: FIRST_SHARE,
            trial_in: 0,
            trial_wait: 0,
            steps_seen: Vec::new(),
            errors: Errors::default(),
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
            work.map(|work| Outlook::new(&Request { look_ahead, ..*request }, &work, cached))
        };
        let mut look_ahead = request.look_ahead;
        let mut outlook = outlook_of(look_ahead);
        let mut is_trial = false;
        let asked = match (self.mode, &outlook) {
            _ if self.unusable >= MOST_UNUSABLE => 1.0,
            (BudgetMode::Fixed, _) => 1.0,
            (BudgetMode::TwoPass, _) => (self.after_last(target_ms) / 4.0).max(LEAST_SHARE),
            (BudgetMode::Predicted, Some(known)) if self.level.is_some() => {
                let mut found = self.fitting(known, request);
                if cached && look_ahead > 1 && !found.fits {
                    // What too few rays do not make room for may be what is decoded for later.
                    look_ahead = 1;
                    outlook = outlook_of(look_ahead);
                    found = outlook.map_or(found, |outlook| self.fitting(&outlook, request));
                }
                is_trial = found.is_trial;
                if is_trial {
                    // Until its time is known.
                    self.trial_in = LEAST_WAIT;
                }
                found.asked
            }
            _ => self.after_last(target_ms),
        };
        let setting = Setting::new(asked, request.steps);
        self.asked = asked;
        let mut features = Features { local: [0.0; LIKENESS], linear: [0.0; KINDS] };
        let (mut units, mut predicted_ms) = (0.0, None);
        if let Some(outlook) = &outlook {
            (features, units) = (outlook.features(&setting), outlook.units(&setting));
            predicted_ms = self.predict(outlook, &setting).map(|(ms, _)| ms);
        }
        let cpu_ms = begin.elapsed().as_secs_f64() * 1e3 + self.learning_ms;
        Choice {
            features,
            work: units,
            setting,
            asked,
            is_trial,
            look_ahead,
            predicted_ms,
            target_ms,
            cpu_ms,
        }
    }

    /// Which rays a frame casts from its second pass on: more of those of its first one; after a preview that one's and as
    /// large a share of the others; or with [`BudgetMode::TwoPass`] as many as the first one's time leaves room for, once
    /// it is known.
    pub(crate) fn second(&self, choice: &Choice) -> Option<Sampling> {
        let Setting { last, share, .. } = choice.setting;
        if last > 1 {
            return Some(Sampling { lattice: last, ..Sampling::even(share)? });
        }
        let sampling = choice.setting.newest_sampling();
        let two_pass = self.last.filter(|last| {
            self.mode == BudgetMode::TwoPass && last.asked.to_bits() == choice.asked.to_bits()
        });
        let (Some(Measured { asked, ms, .. }), Some(first)) = (two_pass, sampling) else {
            return sampling;
        };
        let fits = (asked * choice.target_ms / ms).clamp(asked, 1.0);
        // The mask of the second pass has 1 - (1 - d)^2 of the rays.
        let base_density = 1.0 - (1.0 - fits as f32).sqrt();
        Some(Sampling { foveation: Foveation { base_density, ..first.foveation }, ..first })
    }

    /// Learns what a frame's first pass took.
    pub(crate) fn learn(&mut self, choice: &Choice, ms: f64) {
        if !(ms.is_finite() && ms > 0.0) {
            self.unusable += 1;
            return;
        }
        self.unusable = 0;
        let Setting { first, last, .. } = choice.setting;
        if !self.steps_seen.contains(&[first, last]) {
            self.steps_seen.push([first, last]);
            let is_quick = choice.predicted_ms.is_some_and(|predicted| ms <= predicted);
            if first > 1 && !(self.mode == BudgetMode::Predicted && is_quick) {
                // Drivers finish compiling kernels when they first run, so it may take less from now on.
                return;
            }
        }
        let begin = Instant::now();
        self.last = Some(Measured { asked: choice.asked, ms, work: choice.work });
        self.end_frame(choice.is_trial, ms > choice.target_ms);
        let cost = (ms / choice.work).ln();
        if cost.is_finite() {
            let level = *self.level.get_or_insert(cost);
            let (known, novelty) = self.model.predict(&choice.features);
            let expected = known + self.errors.drift();
            let error = self.errors.take(cost - level - expected, novelty);
            self.model.learn(&choice.features, expected + error);
        }
        self.learning_ms = begin.elapsed().as_secs_f64() * 1e3;
    }

    /// Takes in whether a frame took too long. A trial that did makes the next one wait twice as long.
    fn end_frame(&mut self, is_trial: bool, is_too_long: bool) {
        self.trial_in = self.trial_in.saturating_sub(1);
        if is_trial {
            let longer = (2 * self.trial_wait).clamp(LEAST_WAIT, MOST_WAIT);
            self.trial_wait = if is_too_long { longer } else { 0 };
            self.trial_in = self.trial_wait;
        }
    }

    /// The share by what the last frame took; the safe one if there was none.
    fn after_last(&self, target_ms: f64) -> f64 {
        let Some(Measured { asked, ms, .. }) = self.last else { return FIRST_SHARE };
        (asked * target_ms / ms).min(asked / MOST_STEP).clamp(LEAST_SHARE, 1.0)
    }

    /// The largest share that is predicted to fit, and whether there is one. Where none does, the one that is predicted to
    /// take clearly less than the frame before's, or half of that one: what is not known may be better. Fewer rays leave
    /// more pixels to fill, so time need not fall with them; from the least share on, the way is up again.
    fn fitting(&self, outlook: &Outlook, request: &Request<'_>) -> Fitting {
        let target_ms = request.target_ms;
        // Whatever is predicted, more rays do not follow too many.
        let is_too_long = self.last.is_some_and(|last| last.ms > target_ms);
        let growth = if is_too_long { 1.0 } else { 1.0 / MOST_STEP };
        let most = (self.asked * growth).clamp(LEAST_SHARE, 1.0);
        let settings = (0..=CANDIDATES).map(|i| {
            let part = f64::from(i) / f64::from(CANDIDATES);
            let asked = (most * (LEAST_SHARE / most).powf(part)).max(LEAST_SHARE);
            (asked, Setting::new(asked, request.steps))
        });
        let (mut best, mut least_ms, mut fits) = (LEAST_SHARE, f64::INFINITY, None);
        for (asked, setting) in settings.clone() {
            let ms = self.cautious_ms(outlook, &setting);
            if ms <= target_ms {
                fits = Some(asked);
                break;
            }
            if ms < least_ms {
                (best, least_ms) = (asked, ms);
            }
        }
        if let Some(more) = self.trial(outlook, target_ms, settings)
            && fits.is_none_or(|fits| fits < more)
        {
            return Fitting { asked: more, fits: true, is_trial: true };
        }
        if let Some(fits) = fits {
            return Fitting { asked: fits, fits: true, is_trial: false };
        }
        let before_ms = self.cautious_ms(outlook, &Setting::new(self.asked, request.steps));
        let at_least = self.asked <= LEAST_SHARE;
        let is_best = at_least || least_ms < CLEARLY_LESS * before_ms;
        let asked = if is_best { best } else { (0.5 * self.asked).max(LEAST_SHARE) };
        Fitting { asked, fits: false, is_trial: false }
    }

    /// The largest share that fits if it costs as much per unit of work as the frame before, where that one left much room
    /// and it is time to try: what was never tried, or was slow once for another reason, would never be tried else. Of what
    /// is new, the least share with the same steps, which teaches as much.
    fn trial(
        &self,
        outlook: &Outlook,
        target_ms: f64,
        mut settings: impl Iterator<Item = (f64, Setting)>,
    ) -> Option<f64> {
        if self.trial_in > 0 {
            return None;
        }
        let last = self.last.filter(|last| last.work > 0.0 && last.ms < ROOM * target_ms)?;
        let kept_free = self.kept_free();
        let ms_of = |setting: &Setting| last.ms * outlook.units(setting) / last.work * kept_free;
        let fits = |(_, setting): &(f64, Setting)| ms_of(setting) <= target_ms;
        let (most, tried) = settings.find(fits)?;
        let (_, novelty) = self.predict(outlook, &tried)?;
        let is_alike = |(_, s): &(f64, Setting)| [s.first, s.last] == [tried.first, tried.last];
        let least = settings.take_while(is_alike).last().filter(|_| novelty > NEW);
        Some(least.map_or(most, |(least, _)| least))
    }

    /// More than most times that are predicted like this: about one in five of those that scatter as the newest did lies
    /// above.
    fn cautious_ms(&self, outlook: &Outlook, setting: &Setting) -> f64 {
        let kept_free = self.kept_free();
        self.predict(outlook, setting)
            .map_or(f64::INFINITY, |(ms, novelty)| ms * (1.0 + CAUTION * novelty) * kept_free)
    }

    /// What predictions are multiplied by, so that typical errors stay below a target.
    fn kept_free(&self) -> f64 {
        (SPREADS * self.errors.spread()).exp()
    }

    /// Milliseconds, and how new this is.
    fn predict(&self, outlook: &Outlook, setting: &Setting) -> Option<(f64, f64)> {
        let level = self.level?;
        let (cost, novelty) = self.model.predict(&outlook.features(setting));
        let cost = level + cost + self.errors.drift();
        Some((outlook.units(setting) * cost.exp(), novelty))
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
mod tests;
