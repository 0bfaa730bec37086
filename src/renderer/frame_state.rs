//! The state of the current frame.

use wavefront::{Foveation, FrameParams, FrameView, LookAhead, SamplingParams};

use crate::budget::Choice;
use crate::{Frame, ScenePlan};

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
    pub(super) foveation: Option<Foveation>,
    /// What its setting was chosen by, if it is held to a time.
    pub(super) choice: Option<Choice>,
}

impl FrameState {
    /// What the next pass adds to the sampling mask of a foveated frame, if anything.
    pub(super) fn sampling(&self, size: [u32; 2]) -> Option<SamplingParams> {
        let foveation = self.foveation?;
        let adds = self.passes < foveation.passes;
        adds.then(|| SamplingParams::new(&foveation, size, self.number, self.passes))
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
        let (grid, lru) = (plan.macrocell.grid(), plan.samples.params());
        let params = self.view.params(grid, lru, self.frame.isovalues[0], self.look_ahead());
        params.with_most_cells(self.most_cells)
    }

    /// Lists of rays made before the first rounds of the passes after the first, so far.
    pub(super) fn lists_between(&self) -> u32 {
        let passes = self.foveation.map_or(1, |foveation| foveation.passes);
        self.passes.clamp(1, passes) - 1
    }
}
