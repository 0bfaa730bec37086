//! Where a frame's holes come from.

use clap::ValueEnum;
use progressive_iso::{Foveation, FrameOptions};
use serde::Serialize;

use crate::random::Random;

/// Least and most share of the rays far from the gaze.
const BASE_DENSITY: [f64; 2] = [0.01, 0.10];
/// Most variance of the fovea in squares of the picture's edges.
const MOST_SIGMA: f64 = 0.04;
/// One sequence of so many has an empty cache as well, so that rays that were cast may be unfinished.
const COLD_SHARE: u32 = 4;
/// Most rounds of a pass with an empty cache.
const MOST_COLD_ROUNDS: u32 = 12;
/// More than any pass with a resident volume needs.
const WARM_ROUNDS: u32 = 64;

/// How pictures get their holes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Sampling {
    /// Frames from an empty cache end at the first pass that finishes a share of the pixels.
    Cut,
    /// Foveated frames end with their first pass: most rays were not cast. Most sequences have the volume resident, the
    /// others an empty cache.
    Sparse,
}

/// At which pass a frame ends.
#[derive(Clone, Copy, Debug, Serialize)]
#[serde(untagged)]
pub enum End {
    /// The first that finishes this share of the pixels.
    Share { cut: f64 },
    /// The first one, of so many rounds.
    FirstPass { gaze: [f32; 2], sigma: f32, base_density: f32, rounds: u32 },
}

impl Sampling {
    /// Whether a sequence has the volume resident.
    pub fn resident(self, random: &mut Random) -> bool {
        self == Self::Sparse && random.below(COLD_SHARE) > 0
    }

    /// The end of a frame; `resident`: nothing is missing.
    pub fn end(self, resident: bool, random: &mut Random) -> End {
        if self == Self::Cut {
            return End::Share { cut: random.between(0.80, 0.98) };
        }
        let [least, most] = BASE_DENSITY;
        let base_density = least * (most / least).powf(random.between(0.0, 1.0));
        let cold_rounds = 1 + random.below(MOST_COLD_ROUNDS);
        End::FirstPass {
            gaze: [0; 2].map(|_| random.between(0.0, 1.0) as f32),
            sigma: random.between(0.0, MOST_SIGMA) as f32,
            base_density: base_density as f32,
            rounds: if resident { WARM_ROUNDS } else { cold_rounds },
        }
    }
}

impl End {
    /// The options of a frame with this end. Foveated ones cast all rays in their second pass, so that the whole
    /// picture follows soon.
    pub fn options(self) -> FrameOptions {
        match self {
            Self::Share { .. } => FrameOptions { rounds_per_pass: 1, ..Default::default() },
            Self::FirstPass { gaze, sigma, base_density, rounds } => FrameOptions {
                rounds_per_pass: rounds,
                pass_ms: f32::INFINITY,
                foveation: Some(Foveation { gaze, sigma, base_density, passes: 2 }),
                ..Default::default()
            },
        }
    }

    /// Share of the pixels that the frame waits for.
    pub fn share(self) -> f64 {
        match self {
            Self::Share { cut } => cut,
            Self::FirstPass { .. } => 0.0,
        }
    }
}
