//! What is measured.

use clap::ValueEnum;
use progressive_iso::{BlockSortedOptions, TraversalStrategy};

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Set {
    /// Under a minute on two cores with a software adapter.
    Quick,
    /// Every kind of volume.
    Ci,
    /// Every kind of volume, large ones and large pictures included.
    Full,
}

/// One volume in one picture size.
#[derive(Clone, Debug)]
pub struct Case {
    /// "brain", or the name of a generator.
    pub volume: &'static str,
    /// Voxels per axis of a generated volume.
    pub edge: u32,
    /// Bits per voxel of a generated volume.
    pub rate: f64,
    /// Pixels.
    pub size: [u32; 2],
    /// Isovalues as factors of the suggested one.
    pub isovalues: &'static [f64],
    /// Orbit positions: azimuth and elevation in degrees.
    pub positions: &'static [[f64; 2]],
}

impl Case {
    /// Name with the volume's size, as in the reports.
    pub fn name(&self) -> String {
        if self.volume == "brain" {
            "brain".into()
        } else {
            format!("{}-{}", self.volume, self.edge)
        }
    }
}

/// One way of rendering.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    pub label: &'static str,
    pub strategy: TraversalStrategy,
    /// 0 where it does not apply.
    pub start_factor: u32,
    pub look_ahead: u32,
}

const fn run_ahead(label: &'static str, look_ahead: u32) -> Setting {
    Setting { label, strategy: TraversalStrategy::RunAhead, start_factor: 0, look_ahead }
}

const fn block_sorted(label: &'static str, start_factor: u32, speculation: bool) -> Setting {
    let options = BlockSortedOptions { start_factor, speculation };
    Setting {
        label,
        strategy: TraversalStrategy::BlockSorted(options),
        start_factor,
        look_ahead: 1,
    }
}

/// All ways of rendering, in the order in which they take turns.
pub const SETTINGS: [Setting; 9] = [
    run_ahead("RunAhead, look-ahead 1", 1),
    block_sorted("BlockSorted, no speculation", 1, false),
    run_ahead("RunAhead, look-ahead 2", 2),
    block_sorted("BlockSorted, start factor 1", 1, true),
    run_ahead("RunAhead, look-ahead 4", 4),
    block_sorted("BlockSorted, start factor 2", 2, true),
    run_ahead("RunAhead, look-ahead 8", 8),
    block_sorted("BlockSorted, start factor 4", 4, true),
    block_sorted("BlockSorted, start factor 8", 8, true),
];

const TWO_POSITIONS: &[[f64; 2]] = &[[20.0, 15.0], [200.0, -25.0]];
const FIVE_POSITIONS: &[[f64; 2]] =
    &[[20.0, 15.0], [92.0, -10.0], [164.0, 35.0], [236.0, -25.0], [308.0, 5.0]];

/// The cases of a set.
pub fn cases(set: Set) -> Vec<Case> {
    let case = |volume, edge, rate, size| Case {
        volume,
        edge,
        rate,
        size,
        isovalues: if set == Set::Quick { &[1.0] } else { &[1.0, 0.9] },
        positions: if set == Set::Quick { TWO_POSITIONS } else { FIVE_POSITIONS },
    };
    let small = [640, 368];
    let mut cases = vec![case("brain", 0, 4.0, small), case("turbulence", 128, 4.0, small)];
    if set == Set::Quick {
        return cases;
    }
    cases.extend([
        case("shells", 128, 2.0, small),
        case("rough-solid", 128, 4.0, small),
        case("turbulence", 256, 4.0, small),
        case("shells", 256, 2.0, small),
        case("rough-solid", 256, 4.0, small),
        case("turbulence", 256, 4.0, [1280, 720]),
    ]);
    if set == Set::Full {
        cases.extend([
            case("turbulence", 512, 4.0, [1280, 720]),
            case("shells", 512, 2.0, [1280, 720]),
            case("rough-solid", 512, 4.0, [1920, 1088]),
        ]);
    }
    cases
}
