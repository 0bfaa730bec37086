//! Something of fixed size in a volume of any size.

use crate::Turbulence;
use crate::field::{Field, Formula};
use crate::math::Real;

/// A patch of turbulence of at most 256^3 voxels in the middle of a volume that is 1 everywhere else:
/// what costs more in a larger volume is what depends on its size.
///
/// With t the [`Turbulence`] of a volume of the patch's size and w the product, over the patch's six
/// faces, of `S((d - 4) / 12)`, where d is the distance from the face in voxels and S the quintic
/// smooth step:
///
/// `f = 1 + (t - 1) w`
///
/// The patch begins at the border of a block and its outermost blocks are constant, so that it has the
/// same samples and the same active blocks in every volume of 256^3 voxels and more.
#[derive(Clone, Debug)]
pub struct Patch {
    origin: [f64; 3],
    last: [f64; 3],
    fluids: Turbulence,
}

/// Largest extent of the patch in voxels.
const EDGE: u32 = 256;
/// Constant voxels at each face.
const MARGIN: f64 = 4.0;
/// Voxels from there to the undamped turbulence.
const RAMP: f64 = 12.0;
/// The value outside.
const OUTSIDE: f64 = 1.0;

impl Patch {
    /// Seed 1.
    #[must_use]
    pub fn new(dims: [u32; 3]) -> Self {
        let size = dims.map(|n| n.min(EDGE));
        let origin = [0, 1, 2].map(|a| f64::from((dims[a] - size[a]) / 2 / 4 * 4));
        let last = [0, 1, 2].map(|a| origin[a] + f64::from(size[a].saturating_sub(1)));
        Self { origin, last, fluids: Turbulence::new(size) }
    }

    /// The patch's middle in index space, and the radius of the ball around it: for a camera that
    /// sees the same of it in every volume.
    #[must_use]
    pub fn ball(&self) -> ([f64; 3], f64) {
        let half = [0, 1, 2].map(|a| (self.last[a] - self.origin[a]) / 2.0);
        let radius = half.iter().map(|h| h * h).sum::<f64>().sqrt();
        ([0, 1, 2].map(|a| self.origin[a] + half[a]), radius)
    }
}

impl Formula for Patch {
    fn at<T: Real>(&self, p: [T; 3]) -> T {
        let mut weight = T::from(1.0);
        for axis in 0..3 {
            let low = p[axis].plus(-self.origin[axis] - MARGIN);
            let high = (-p[axis]).plus(self.last[axis] - MARGIN);
            for distance in [low, high] {
                weight = weight * distance.scale(1.0 / RAMP).smoothstep();
            }
        }
        let local = [0, 1, 2].map(|axis| p[axis].plus(-self.origin[axis]));
        (self.fluids.at(local).plus(-OUTSIDE) * weight).plus(OUTSIDE)
    }
}

impl Field for Patch {
    fn value(&self, p: [f64; 3]) -> f64 {
        self.at(p)
    }

    fn gradient(&self, p: [f64; 3]) -> Option<[f64; 3]> {
        Some(self.gradient_at(p))
    }

    fn name(&self) -> &'static str {
        "patch"
    }

    /// Equal parts of both fluids.
    fn suggested_isovalue(&self) -> f64 {
        self.fluids.suggested_isovalue()
    }

    fn constant(&self, low: [f64; 3], high: [f64; 3]) -> Option<f64> {
        let outside = |axis: usize| {
            high[axis] <= self.origin[axis] + MARGIN || low[axis] >= self.last[axis] - MARGIN
        };
        (0..3).any(outside).then_some(OUTSIDE)
    }
}
