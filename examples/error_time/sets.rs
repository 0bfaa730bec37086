//! What is measured.

use clap::ValueEnum;
use progressive_iso::{BlockSortedOptions, TraversalStrategy};
use serde::Serialize;

use crate::support::subject::{BRAIN, Subject, cube, turbulence};

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Set {
    /// One view in one size of every volume: a minute or two each on two cores with a software adapter.
    Brief,
    /// Two views and two sizes of every volume.
    Ci,
    /// Volumes so small that the measurement can be tested.
    Test,
}

/// Where samples are, and how much memory there is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Memory {
    /// The decoded volume as a whole.
    Full,
    /// Blocks are decoded when rays need them, into a cache that holds them all.
    Cached,
    /// The least budget that the library accepts.
    Smallest,
}

/// One way of rendering.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting {
    pub strategy: TraversalStrategy,
    pub memory: Memory,
}

impl Setting {
    pub fn strategy_name(self) -> &'static str {
        if self.strategy == TraversalStrategy::RunAhead { "run-ahead" } else { "block-sorted" }
    }
}

impl Memory {
    pub fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Cached => "cached",
            Self::Smallest => "smallest",
        }
    }
}

const BLOCK_SORTED: TraversalStrategy =
    TraversalStrategy::BlockSorted(BlockSortedOptions { start_factor: 1, speculation: true });

/// The published strategy needs a cache.
const SETTINGS: &[Setting] = &[
    Setting { strategy: TraversalStrategy::RunAhead, memory: Memory::Full },
    Setting { strategy: TraversalStrategy::RunAhead, memory: Memory::Cached },
    Setting { strategy: TraversalStrategy::RunAhead, memory: Memory::Smallest },
    Setting { strategy: BLOCK_SORTED, memory: Memory::Cached },
    Setting { strategy: BLOCK_SORTED, memory: Memory::Smallest },
];

const RATES: &[f64] = &[1.0, 2.0, 4.0, 8.0, 16.0];

/// One volume.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Its rate does not count.
    pub subject: Subject,
    /// Azimuth and elevation in degrees.
    pub views: &'static [[f64; 2]],
    /// Pixels.
    pub sizes: &'static [[u32; 2]],
    /// Bits per voxel.
    pub rates: &'static [f64],
    pub settings: &'static [Setting],
    /// Timed runs of every setting, an odd number: the one of median length counts.
    pub runs: usize,
}

impl Case {
    /// Views in all sizes.
    pub fn scenes(&self) -> impl Iterator<Item = ([f64; 2], [u32; 2])> {
        let (views, sizes) = (self.views, self.sizes);
        views.iter().flat_map(move |&view| sizes.iter().map(move |&size| (view, size)))
    }
}

/// The cases of a set.
pub fn cases(set: Set) -> Vec<Case> {
    const ONE_VIEW: &[[f64; 2]] = &[[20.0, 15.0]];
    let brief = |subject| Case {
        subject,
        views: ONE_VIEW,
        sizes: &[[320, 184]],
        rates: RATES,
        settings: SETTINGS,
        runs: 3,
    };
    let volumes = [BRAIN, turbulence(128), cube("shells", 128, 4.0)];
    match set {
        Set::Brief => volumes.map(brief).to_vec(),
        Set::Ci => {
            let views = &[[20.0, 15.0], [200.0, -25.0]];
            let sizes = &[[320, 184], [640, 368]];
            volumes.map(|subject| Case { views, sizes, ..brief(subject) }).to_vec()
        }
        Set::Test => {
            let subject = Subject { volume: "gyroid", dims: [30, 26, 28], rate: 4.0 };
            vec![Case { sizes: &[[48, 32]], rates: &[2.0, 8.0], runs: 1, ..brief(subject) }]
        }
    }
}
