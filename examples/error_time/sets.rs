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
    /// Azimuth and elevation in degrees, and pixels.
    pub pictures: &'static [([f64; 2], [u32; 2])],
    /// Bits per voxel.
    pub rates: &'static [f64],
    pub settings: &'static [Setting],
    /// Timed runs of every setting, an odd number: the one of median length counts.
    pub runs: usize,
}

/// The cases of a set.
pub fn cases(set: Set) -> Vec<Case> {
    const FRONT: [f64; 2] = [20.0, 15.0];
    const SMALL: [u32; 2] = [320, 184];
    let brief = |subject| Case {
        subject,
        pictures: &[(FRONT, SMALL)],
        rates: RATES,
        settings: SETTINGS,
        runs: 3,
    };
    let volumes = [BRAIN, turbulence(128), cube("shells", 128, 4.0)];
    match set {
        Set::Brief => volumes.map(brief).to_vec(),
        Set::Ci => {
            let pictures = &[(FRONT, SMALL), ([200.0, -25.0], SMALL), (FRONT, [640, 368])];
            volumes.map(|subject| Case { pictures, ..brief(subject) }).to_vec()
        }
        Set::Test => {
            let subject = Subject { volume: "gyroid", dims: [30, 26, 28], rate: 4.0 };
            vec![Case {
                pictures: &[(FRONT, [48, 32])],
                rates: &[2.0, 8.0],
                runs: 1,
                ..brief(subject)
            }]
        }
    }
}
