//! The state of the current frame.

use wavefront::{FrameParams, FrameView, LookAhead, SamplingParams};

use crate::budget::{Choice, STEPS, Sampling, step_index};
use crate::{Frame, ScenePlan};

/// Isovalues of the hits that the rays of each step have found last, as long as their pictures show those.
#[derive(Debug, Default)]
pub(super) struct ShownHits([Option<f32>; STEPS]);

impl ShownHits {
    fn at(&mut self, step: u32) -> &mut Option<f32> {
        &mut self.0[step_index(step)]
    }

    /// The pictures begin to show those of another isovalue; that of those before.
    pub(super) fn replace(&mut self, step: u32, isovalue: f32) -> Option<f32> {
        self.at(step).replace(isovalue)
    }

    /// The pictures show something else.
    pub(super) fn forget(&mut self, step: u32) {
        *self.at(step) = None;
    }

    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }
}

/// A frame and how far it is.
#[derive(Debug)]
pub(super) struct FrameState {
    pub(super) frame: Frame,
    pub(super) view: FrameView,
    pub(super) number: u64,
    /// Whether the pictures show nothing of earlier frames.
    pub(super) cleared: bool,
    pub(super) started: bool,
    /// Whether its start forgets what is decoded.
    pub(super) clears_cache: bool,
    /// Cells that a walk may visit, and rounds that count as missed before the first one.
    pub(super) most_cells: u32,
    pub(super) first_misses: u32,
    pub(super) passes: u32,
    pub(super) rounds: u32,
    /// Which rays its passes may cast, once it has started; `None`: all.
    pub(super) sampling: Option<Sampling>,
    /// What its setting was chosen by, if it is held to a time.
    pub(super) choice: Option<Choice>,
    /// Pixels from one of the newest rays to the next in both directions, and of these rays from one of those of a preview that
    /// they go on from to the next; 1 for all.
    pub(super) step: u32,
    pub(super) resumed_step: u32,
    /// First lists of rays made so far, by the start, by every mask, and when it went on from a preview.
    pub(super) lists: u32,
}

impl FrameState {
    /// What pass `pass`, counted from 0, adds to the sampling mask of the rays that are cast, if anything.
    pub(super) fn sampling(&self, pass: u32) -> Option<SamplingParams> {
        let Sampling { foveation, lattice } = self.sampling?;
        let size = self.ray_view().ray_size();
        let params = SamplingParams::new(&foveation, size, self.number, pass);
        (pass < foveation.passes).then(|| params.with_lattice(lattice))
    }

    /// Whether its rays go on from a preview, which unfinished pixels show.
    pub(super) fn is_resumed(&self) -> bool {
        self.resumed_step > 1
    }

    /// The view of the rays that are cast.
    pub(super) fn ray_view(&self) -> FrameView {
        self.view.preview(self.step)
    }

    /// How far its rays look ahead: in its first pass as was chosen.
    pub(super) fn look_ahead(&self) -> LookAhead {
        let asked = self.frame.options.look_ahead;
        match self.choice {
            Some(choice) if self.passes <= 1 && choice.look_ahead < asked => LookAhead::NONE,
            _ => LookAhead { blocks: asked, first_misses: self.first_misses },
        }
    }

    pub(super) fn params(&self, plan: &ScenePlan) -> FrameParams {
        self.params_of(&self.ray_view(), plan)
    }

    /// The parameters of rays with another view.
    pub(super) fn params_of(&self, view: &FrameView, plan: &ScenePlan) -> FrameParams {
        let (grid, lru) = (plan.macrocell.grid(), plan.samples.params());
        let params = view.params(grid, lru, self.frame.isovalues[0], self.look_ahead());
        params.with_most_cells(self.most_cells).after_preview(self.resumed_step)
    }
}
