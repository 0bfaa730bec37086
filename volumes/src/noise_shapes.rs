//! Shapes cut out of noise, each hard in its own way for what guesses at pixels: separate blobs, thin
//! sheets, thin tubes, and the steps of label volumes.

use crate::field::{Field, Formula, longest};
use crate::math::Real;
use crate::noise::Octaves;

/// Spacing of the coarsest lattice over the longest extent, unless a shape has a reason for another.
const SPACING: f64 = 0.2;

/// Mean size of the gradient of one octave of noise of root mean square 1, times its spacing.
const SLOPE: f64 = 3.5;

fn octaves(dims: [u32; 3], spacing: f64, seed: u32) -> (f64, Octaves) {
    let spacing = (spacing * longest(dims)).max(4.0);
    (spacing, Octaves::new(spacing, spacing, 1.0, seed))
}

/// Separate blobs: one octave of gradient noise of root mean square 1, cut at 0.9.
#[derive(Clone, Debug)]
pub struct Blobs {
    noise: Octaves,
}

/// A sheet that folds through the volume: where one octave of noise is nearly zero.
///
/// `f = 1 - |o(p)| spacing / (3.5 thickness)`, so that the isovalue 0.5 is a sheet about `thickness` voxels
/// thick, whose both sides are surfaces.
#[derive(Clone, Debug)]
pub struct Sheets {
    noise: Octaves,
    per_thickness: f64,
}

/// Tubes along the curves where two octaves of noise a and b are both zero.
///
/// `f = 1 - sqrt(a^2 + b^2) spacing / (3.5 thickness)`
#[derive(Clone, Debug)]
pub struct Tubes {
    noise: [Octaves; 2],
    per_thickness: f64,
}

/// Labels of a segmentation: integers 0 to 7 in steps, from two octaves of noise.
///
/// `f = floor(clamp(4 + 2 o(p), 0, 7))`
#[derive(Clone, Debug)]
pub struct Labels {
    noise: Octaves,
}

/// Thickness of sheets and tubes in voxels.
const SHEET_VOXELS: f64 = 2.0;
const TUBE_VOXELS: f64 = 6.0;
const LABELS: f64 = 8.0;

impl Blobs {
    /// Seed 1.
    #[must_use]
    pub fn new(dims: [u32; 3]) -> Self {
        Self::with_seed(dims, 1)
    }

    /// As [`Blobs::new`] with another seed.
    #[must_use]
    pub fn with_seed(dims: [u32; 3], seed: u32) -> Self {
        Self { noise: octaves(dims, SPACING, seed).1 }
    }
}

impl Sheets {
    /// Two voxels thick, seed 1.
    #[must_use]
    pub fn new(dims: [u32; 3]) -> Self {
        Self::with_seed(dims, 1)
    }

    /// As [`Sheets::new`] with another seed.
    #[must_use]
    pub fn with_seed(dims: [u32; 3], seed: u32) -> Self {
        let (spacing, noise) = octaves(dims, SPACING, seed);
        Self { noise, per_thickness: spacing / (SLOPE * SHEET_VOXELS) }
    }
}

impl Tubes {
    /// About six voxels thick, seed 1.
    #[must_use]
    pub fn new(dims: [u32; 3]) -> Self {
        Self::with_seed(dims, 1)
    }

    /// As [`Tubes::new`] with another seed.
    #[must_use]
    pub fn with_seed(dims: [u32; 3], seed: u32) -> Self {
        let (spacing, first) = octaves(dims, SPACING, seed);
        let (_, second) = octaves(dims, SPACING, seed ^ 0x5555_5555);
        Self { noise: [first, second], per_thickness: spacing / (SLOPE * TUBE_VOXELS) }
    }
}

impl Labels {
    /// Seed 1.
    #[must_use]
    pub fn new(dims: [u32; 3]) -> Self {
        Self::with_seed(dims, 1)
    }

    /// As [`Labels::new`] with another seed.
    #[must_use]
    pub fn with_seed(dims: [u32; 3], seed: u32) -> Self {
        let spacing = (0.3 * longest(dims)).max(8.0);
        Self { noise: Octaves::new(spacing, 0.5 * spacing, 0.5, seed) }
    }
}

impl Formula for Blobs {
    fn at<T: Real>(&self, p: [T; 3]) -> T {
        self.noise.at(p)
    }
}

impl Formula for Sheets {
    fn at<T: Real>(&self, p: [T; 3]) -> T {
        let noise = self.noise.at(p);
        let size = noise.chain(noise.value().abs(), noise.value().signum());
        (-size.scale(self.per_thickness)).plus(1.0)
    }
}

impl Formula for Tubes {
    fn at<T: Real>(&self, p: [T; 3]) -> T {
        let [a, b] = [0, 1].map(|i| self.noise[i].at(p));
        (-(a * a + b * b).sqrt().scale(self.per_thickness)).plus(1.0)
    }
}

impl Formula for Labels {
    fn at<T: Real>(&self, p: [T; 3]) -> T {
        let place = self.noise.at(p).scale(2.0).plus(0.5 * LABELS);
        place.chain(place.value().clamp(0.0, LABELS - 1.0).floor(), 0.0)
    }
}

macro_rules! field {
    ($type:ty, $name:literal, $isovalue:expr) => {
        impl Field for $type {
            fn value(&self, p: [f64; 3]) -> f64 {
                self.at(p)
            }

            fn gradient(&self, p: [f64; 3]) -> Option<[f64; 3]> {
                Some(self.gradient_at(p))
            }

            fn name(&self) -> &'static str {
                $name
            }

            fn suggested_isovalue(&self) -> f64 {
                $isovalue
            }
        }
    };
}

field!(Blobs, "blobs", 0.9);
field!(Sheets, "sheets", 0.5);
field!(Tubes, "tubes", 0.5);
field!(Labels, "labels", 4.5);
