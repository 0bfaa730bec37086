//! The chosen strategy: what it needs, and its pipelines.

use wavefront::{RunAhead, SampleLayout, Strategy};

use crate::plan::Part;
use crate::{Error, TraversalStrategy, wgpu};

/// What the chosen strategy allocates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StrategyPlan {
    RunAhead,
    #[cfg(feature = "block-sorted")]
    BlockSorted(wavefront::BlockSortedOptions, wavefront::BlockSortedPlan),
}

impl StrategyPlan {
    #[cfg_attr(
        not(feature = "block-sorted"),
        expect(unused_variables, reason = "RunAhead needs no memory of its own")
    )]
    pub(crate) fn new(
        strategy: TraversalStrategy,
        rays: u64,
        limits: &wgpu::Limits,
    ) -> Result<Self, Error> {
        match strategy {
            TraversalStrategy::RunAhead => Ok(Self::RunAhead),
            #[cfg(feature = "block-sorted")]
            TraversalStrategy::BlockSorted(options) => {
                let plan = wavefront::BlockSortedPlan::new(rays, options, limits)?;
                Ok(Self::BlockSorted(options, plan))
            }
        }
    }

    /// The strategy's pipelines.
    pub(crate) fn pipelines(
        self,
        device: &wgpu::Device,
        samples: SampleLayout,
    ) -> Box<dyn Strategy> {
        match self {
            Self::RunAhead => Box::new(RunAhead::new(device, samples)),
            #[cfg(feature = "block-sorted")]
            Self::BlockSorted(_, plan) => {
                Box::new(wavefront::BlockSorted::new(device, samples.pages, plan))
            }
        }
    }

    /// Pages of slots that the strategy's kernels have bindings for beside their other buffers.
    pub(crate) fn most_slot_pages(self) -> u64 {
        match self {
            Self::RunAhead => 4,
            #[cfg(feature = "block-sorted")]
            Self::BlockSorted(..) => 3,
        }
    }

    /// Whether the strategy works on a volume that is resident as a whole.
    pub(crate) fn can_be_resident(self) -> bool {
        match self {
            Self::RunAhead => true,
            #[cfg(feature = "block-sorted")]
            Self::BlockSorted(..) => false,
        }
    }

    /// Bytes beside rays and pictures, with a cache of `slots` slots.
    #[cfg_attr(
        not(feature = "block-sorted"),
        expect(unused_variables, reason = "RunAhead needs nothing for a slot")
    )]
    pub(crate) fn bytes(&self, slots: u64) -> u64 {
        match self {
            Self::RunAhead => 0,
            #[cfg(feature = "block-sorted")]
            Self::BlockSorted(_, plan) => plan.bytes(slots),
        }
    }

    /// The same as a part of a scene.
    #[cfg_attr(
        not(feature = "block-sorted"),
        expect(unused_variables, reason = "RunAhead needs nothing for a slot")
    )]
    pub(crate) fn part(&self, slots: u64) -> Part {
        match self {
            Self::RunAhead => Part::left_out("block pairs", "strategy RunAhead"),
            #[cfg(feature = "block-sorted")]
            Self::BlockSorted(options, plan) => {
                let why = format!("strategy BlockSorted, start factor {}", options.start_factor);
                Part::new("block pairs", crate::When::Rendering, plan.bytes(slots), why)
            }
        }
    }
}
