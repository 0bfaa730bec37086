//! What is measured.

use clap::ValueEnum;

use crate::support::subject::{BRAIN, Subject};

/// Variance of the fovea, as in the publication's results.
pub const SIGMA: f32 = 0.02;

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Set {
    /// A volume in small pictures: some minutes on two cores with a software adapter.
    Brief,
    /// Dense volumes of the benchmark's set `ci`.
    Full,
    /// So little that the measurement can be tested.
    Test,
}

/// Everything that a set asks for.
#[derive(Debug)]
pub struct Plan {
    pub subjects: &'static [Subject],
    /// Base densities whose quality is measured.
    pub densities: &'static [f32],
    /// The one of a resting gaze and of times of other places and residencies.
    pub middle_density: f32,
    /// Pixels of the pictures whose quality is measured.
    pub quality_size: [u32; 2],
    /// Frames of an orbit.
    pub frames: u32,
    /// Base densities whose times are taken.
    pub speed_densities: &'static [f32],
    /// Pixels of the pictures whose times are taken.
    pub speed_size: [u32; 2],
    /// Frames of which the times are medians.
    pub runs: u32,
}

const fn generated(volume: &'static str, edge: u32, rate: f64) -> Subject {
    Subject { volume, dims: [edge; 3], rate }
}

const DENSITIES: &[f32] = &[0.10, 0.07, 0.03, 0.01];

static BRIEF: Plan = Plan {
    subjects: &[generated("turbulence", 128, 4.0)],
    densities: DENSITIES,
    middle_density: 0.03,
    quality_size: [640, 360],
    frames: 4,
    speed_densities: &[0.01, 0.03, 0.1],
    speed_size: [1280, 720],
    runs: 3,
};

static FULL: Plan = Plan {
    subjects: &[
        BRAIN,
        generated("turbulence", 256, 4.0),
        generated("rough-solid", 256, 4.0),
        generated("shells", 256, 2.0),
    ],
    speed_densities: &[0.01, 0.03, 0.1, 0.4],
    frames: 3,
    runs: 7,
    densities: DENSITIES,
    middle_density: 0.03,
    quality_size: [640, 360],
    speed_size: [1280, 720],
};

static TEST: Plan = Plan {
    subjects: &[Subject { volume: "gyroid", dims: [30, 26, 28], rate: 8.0 }],
    densities: &[0.1],
    middle_density: 0.1,
    quality_size: [64, 48],
    frames: 2,
    speed_densities: &[0.1, 1.0],
    speed_size: [64, 48],
    runs: 1,
};

impl Set {
    pub fn plan(self) -> &'static Plan {
        match self {
            Self::Brief => &BRIEF,
            Self::Full => &FULL,
            Self::Test => &TEST,
        }
    }
}
