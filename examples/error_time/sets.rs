//! What is measured.

use clap::ValueEnum;
use progressive_iso::{BlockSortedOptions, TraversalStrategy};
use serde::Serialize;

use crate::support::subject::{BRAIN, Subject, cube, turbulence};

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Set {
    /// One view in one size of every volume: a minute each on two cores with a software adapter.
    Brief,
    /// Two views and a larger picture, too.
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
    /// The least budget that the library accepts and that leaves a cache of [`LEAST_SLOTS`].
    Smallest,
}

/// With fewer slots, frames end, too, but take a pass for as few rays as the cache serves.
pub const LEAST_SLOTS: u64 = 2048;

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

/// The published strategy needs a cache. The last one is for small pictures: all rays of a larger one ask
/// for more blocks at a time than such a cache holds, and few get theirs.
const SETTINGS: &[Setting; 5] = &[
    Setting { strategy: TraversalStrategy::RunAhead, memory: Memory::Full },
    Setting { strategy: TraversalStrategy::RunAhead, memory: Memory::Cached },
    Setting { strategy: TraversalStrategy::RunAhead, memory: Memory::Smallest },
    Setting { strategy: BLOCK_SORTED, memory: Memory::Cached },
    Setting { strategy: BLOCK_SORTED, memory: Memory::Smallest },
];

const RATES: &[f64] = &[1.0, 2.0, 4.0, 8.0, 16.0];

/// What is looked at, and how it is rendered.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Azimuth and elevation in degrees.
    pub position: [f64; 2],
    /// Pixels.
    pub size: [u32; 2],
    pub settings: &'static [Setting],
}

/// One volume.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Its rate does not count.
    pub subject: Subject,
    pub views: &'static [View],
    /// Bits per voxel.
    pub rates: &'static [f64],
    /// Runs of every setting, an odd number: the one of median length counts.
    pub runs: usize,
}

/// The cases of a set.
pub fn cases(set: Set) -> Vec<Case> {
    const SMALL: View = View { position: [20.0, 15.0], size: [320, 184], settings: SETTINGS };
    const BEHIND: View = View { position: [200.0, -25.0], ..SMALL };
    const LARGE: View =
        View { size: [640, 368], settings: SETTINGS.split_at(SETTINGS.len() - 1).0, ..SMALL };
    const TINY: View = View { size: [48, 32], ..SMALL };
    let brief = |subject| Case { subject, views: &[SMALL], rates: RATES, runs: 3 };
    let volumes = [BRAIN, turbulence(128), cube("shells", 128, 4.0)];
    match set {
        Set::Brief => volumes.map(brief).to_vec(),
        Set::Ci => {
            let views = &[SMALL, BEHIND, LARGE];
            volumes.map(|subject| Case { views, ..brief(subject) }).to_vec()
        }
        Set::Test => {
            let subject = Subject { volume: "gyroid", dims: [30, 26, 28], rate: 4.0 };
            vec![Case { views: &[TINY], rates: &[2.0, 8.0], runs: 1, ..brief(subject) }]
        }
    }
}
