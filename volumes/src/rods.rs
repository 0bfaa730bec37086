//! Straight rods that cross: thin features of another kind than those of noise.

use crate::field::{Field, Formula, centre, longest};
use crate::math::Real;
use crate::noise::lattice_value;

/// How many there are.
const RODS: u32 = 24;

/// Radius in voxels: the least and the most.
const RADIUS_VOXELS: [f64; 2] = [1.0, 3.5];

/// Rods that cross the volume in random directions.
///
/// `f` is the greatest `1 - d / (2 r)` of all rods, `d` being the distance in voxels to a rod's axis and `r` its radius, so that the
/// isovalue 0.5 is their surface.
#[derive(Clone, Debug)]
pub struct Rods {
    rods: Vec<Rod>,
}

#[derive(Clone, Debug)]
struct Rod {
    on_axis: [f64; 3],
    /// Unit vector.
    direction: [f64; 3],
    per_diameter: f64,
}

impl Rods {
    /// Seed 1.
    #[must_use]
    pub fn new(dims: [u32; 3]) -> Self {
        Self::with_seed(dims, 1)
    }

    /// As [`Rods::new`] with another seed.
    #[must_use]
    pub fn with_seed(dims: [u32; 3], seed: u32) -> Self {
        Self { rods: (0..RODS).map(|number| Rod::random(dims, seed, number)).collect() }
    }
}

impl Rod {
    fn random(dims: [u32; 3], seed: u32, number: u32) -> Self {
        let random = |what: u32| lattice_value([number, what, 0], seed);
        let vector = |first: u32| [0, 1, 2].map(|axis| random(first + axis));
        let offset = vector(0).map(|x| 0.35 * longest(dims) * x);
        let centre = centre(dims);
        // A direction of length 0 does not come up for any seed that is used: 96 bits would have to agree.
        let direction = vector(3);
        let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-6);
        let [least, most] = RADIUS_VOXELS;
        let radius = least + (most - least) * 0.5 * (1.0 + random(6));
        Self {
            on_axis: [0, 1, 2].map(|axis| centre[axis] + offset[axis]),
            direction: direction.map(|x| x / length),
            per_diameter: 0.5 / radius,
        }
    }

    fn at<T: Real>(&self, p: [T; 3]) -> T {
        let from = [0, 1, 2].map(|axis| p[axis].plus(-self.on_axis[axis]));
        let dot = |a: [T; 3]| a[0] * a[0] + a[1] * a[1] + a[2] * a[2];
        let along = from[0].scale(self.direction[0])
            + from[1].scale(self.direction[1])
            + from[2].scale(self.direction[2]);
        let across = [0, 1, 2].map(|axis| from[axis] - along.scale(self.direction[axis]));
        (-dot(across).sqrt().scale(self.per_diameter)).plus(1.0)
    }
}

impl Formula for Rods {
    fn at<T: Real>(&self, p: [T; 3]) -> T {
        let mut most = T::from(f64::NEG_INFINITY);
        for rod in &self.rods {
            let value = rod.at(p);
            if value.value() > most.value() {
                most = value;
            }
        }
        most
    }
}

impl Field for Rods {
    fn value(&self, p: [f64; 3]) -> f64 {
        self.at(p)
    }

    fn gradient(&self, p: [f64; 3]) -> Option<[f64; 3]> {
        Some(self.gradient_at(p))
    }

    fn name(&self) -> &'static str {
        "rods"
    }

    fn suggested_isovalue(&self) -> f64 {
        0.5
    }
}
