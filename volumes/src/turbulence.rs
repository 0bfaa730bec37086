//! Multi-octave turbulence between two fluids.

use crate::field::{Field, Formula, centre, longest};
use crate::math::Real;
use crate::noise::Octaves;

/// The density of two fluids that mix, the heavy one (3) above the light one (1), as in simulations
/// of the Rayleigh-Taylor instability: a folded interface of many scales that fills most of the
/// volume, with plateaus where a fluid is pure.
///
/// With h in [-1, 1] from the bottom to the top voxel along z, o(p) octaves of gradient noise of
/// root mean square 1, and S the quintic smooth step:
///
/// `f = 1 + 2 S(1/2 + 0.25 h + mixing o(p))`
///
/// The octaves' lattices begin at a quarter of the longest extent and halve down to 8 voxels, so a
/// larger volume has more detail rather than larger features: 2 octaves at 64, 4 at 256, 6 at 1024.
/// Each has 2^(-1/3) times the amplitude of the one before it, the scaling of A. N. Kolmogorov's
/// inertial range (1941).
#[derive(Clone, Debug)]
pub struct Turbulence {
    /// Strength of the mixing; 0 leaves two layers with a flat interface.
    pub mixing: f64,
    centre_z: f64,
    per_half: f64,
    octaves: Octaves,
}

impl Turbulence {
    /// Mixing 0.2, seed 1.
    #[must_use]
    pub fn new(dims: [u32; 3]) -> Self {
        Turbulence::with_seed(dims, 1)
    }

    /// As [`Turbulence::new`] with another seed.
    #[must_use]
    pub fn with_seed(dims: [u32; 3], seed: u32) -> Self {
        const KOLMOGOROV: f64 = 0.793_700_525_984_099_7;
        let centre_z = centre(dims)[2];
        Turbulence {
            mixing: 0.2,
            centre_z,
            per_half: 1.0 / centre_z.max(0.5),
            octaves: Octaves::new(0.25 * (longest(dims) + 1.0), 8.0, KOLMOGOROV, seed),
        }
    }

    /// Number of octaves, which follows from the size of the volume.
    #[must_use]
    pub fn octaves(&self) -> usize {
        self.octaves.len()
    }
}

impl Formula for Turbulence {
    fn at<T: Real>(&self, p: [T; 3]) -> T {
        let height = p[2].plus(-self.centre_z).scale(self.per_half);
        let mixture = height.scale(0.25) + self.octaves.at(p).scale(self.mixing);
        mixture.plus(0.5).smoothstep().scale(2.0).plus(1.0)
    }
}

impl Field for Turbulence {
    fn value(&self, p: [f64; 3]) -> f64 {
        self.at(p)
    }

    fn gradient(&self, p: [f64; 3]) -> Option<[f64; 3]> {
        Some(self.gradient_at(p))
    }

    fn name(&self) -> &'static str {
        "turbulence"
    }

    /// Equal parts of both fluids.
    fn suggested_isovalue(&self) -> f64 {
        2.0
    }
}
