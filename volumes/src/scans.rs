//! Fields made to behave like scanned data: plateaus with steep edges, offsets and sensor noise.

use crate::field::{Field, Formula, centre, extent, longest};
use crate::math::Real;
use crate::noise::{Octaves, voxel_noise};

/// Nested shells with the plateaus of a CT head scan in Hounsfield units, plus an offset and noise
/// per voxel.
///
/// With q = |(p - c) / h| + 0.03 w(p), where h is half the extent of each axis and w is two octaves
/// of gradient noise of root mean square 1, and S the quintic smooth step:
///
/// `f = offset - 1000 + sum over shells k of rise_k S(1/2 + (radius_k - q) / width) + noise g(p)`
///
/// Shells from outside in: fat -100 HU at radius 0.86, muscle 50 at 0.80, bone 1100 at 0.70, soft
/// tissue 35 at 0.58, a fluid core 5 at 0.22. The edges are 3 voxels wide (along the shortest
/// axis); g is white on the voxels, smooth between them, with standard deviation 1 and at most 3.46
/// in magnitude.
#[derive(Clone, Debug)]
pub struct Shells {
    /// Added to the Hounsfield scale; 1024 as in files that store unsigned numbers. Thousands are
    /// fine.
    pub offset: f64,
    /// Standard deviation of the noise in Hounsfield units.
    pub noise: f64,
    seed: u32,
    centre: [f64; 3],
    per_half: [f64; 3],
    per_width: f64,
    warp: Octaves,
}

/// Radius as a fraction of the half extent, and the value inside it in Hounsfield units.
const SHELLS: [(f64, f64); 5] =
    [(0.86, -100.0), (0.80, 50.0), (0.70, 1100.0), (0.58, 35.0), (0.22, 5.0)];
const AIR: f64 = -1000.0;

impl Shells {
    /// Offset 1024, noise 12 HU, edges 3 voxels wide, seed 1.
    #[must_use]
    pub fn new(dims: [u32; 3]) -> Self {
        Shells::with_seed(dims, 1)
    }

    /// As [`Shells::new`] with another seed of the noise and of the shells' dents.
    #[must_use]
    pub fn with_seed(dims: [u32; 3], seed: u32) -> Self {
        let half = extent(dims).map(|e| 0.5 * e.max(1.0));
        let shortest = half.into_iter().fold(f64::INFINITY, f64::min);
        let spacing = longest(dims) / 3.0;
        Shells {
            offset: 1024.0,
            noise: 12.0,
            seed,
            centre: centre(dims),
            per_half: half.map(|h| 1.0 / h),
            per_width: shortest / 3.0,
            warp: Octaves::new(spacing, 0.5 * spacing, 0.5, seed),
        }
    }
}

impl Formula for Shells {
    fn at<T: Real>(&self, p: [T; 3]) -> T {
        let [x, y, z] =
            [0, 1, 2].map(|axis| p[axis].plus(-self.centre[axis]).scale(self.per_half[axis]));
        let q = (x * x + y * y + z * z).sqrt() + self.warp.at(p).scale(0.03);
        let mut value = T::from(self.offset + AIR);
        let mut outside = AIR;
        for (radius, inside) in SHELLS {
            let depth = (-q).plus(radius).scale(self.per_width).plus(0.5);
            value = value + depth.smoothstep().scale(inside - outside);
            outside = inside;
        }
        value + voxel_noise(p, self.seed).scale(self.noise)
    }
}

impl Field for Shells {
    fn value(&self, p: [f64; 3]) -> f64 {
        self.at(p)
    }

    fn gradient(&self, p: [f64; 3]) -> Option<[f64; 3]> {
        // The cone |p - c| has no gradient at its tip.
        (p != self.centre).then(|| self.gradient_at(p))
    }

    fn name(&self) -> &'static str {
        "shells"
    }

    /// Halfway between muscle and bone.
    fn suggested_isovalue(&self) -> f64 {
        self.offset + 575.0
    }
}

/// A porous core with a rough surface under strong noise, like an unfiltered micro-CT scan of a
/// rock: many small pieces of surface, few empty blocks, the hard case for skipping.
///
/// With o(p) two octaves of gradient noise (root mean square 1, coarsest lattice a sixth of the
/// longest extent), r(p) one octave of spacing 4 voxels, d the distance to the volume's z axis over
/// half the smaller of its x and y extents, h that half in voxels, and S the quintic smooth step:
///
/// `solid = S(1/2 + 2 (o + 1/4) + 0.3 r) S(1/2 + (0.92 - d) h / 4)`
///
/// `f = 60 + 110 solid + 5 r + noise g(p)`
///
/// g is white on the voxels, smooth between them, with standard deviation 1 and at most 3.46 in
/// magnitude.
#[derive(Clone, Debug)]
pub struct RoughSolid {
    /// Standard deviation of the noise; surface specks appear where it reaches half the contrast,
    /// 55.
    pub noise: f64,
    seed: u32,
    axis: [f64; 2],
    per_radius: f64,
    per_edge: f64,
    pores: Octaves,
    roughness: Octaves,
}

impl RoughSolid {
    /// Noise of standard deviation 18 (about one voxel in a thousand crosses the suggested
    /// isovalue), seed 1.
    #[must_use]
    pub fn new(dims: [u32; 3]) -> Self {
        RoughSolid::with_seed(dims, 1)
    }

    /// As [`RoughSolid::new`] with another seed.
    #[must_use]
    pub fn with_seed(dims: [u32; 3], seed: u32) -> Self {
        let [cx, cy, _] = centre(dims);
        let radius = cx.min(cy).max(0.5);
        let spacing = longest(dims) / 6.0;
        RoughSolid {
            noise: 18.0,
            seed,
            axis: [cx, cy],
            per_radius: 1.0 / radius,
            per_edge: radius / 4.0,
            pores: Octaves::new(spacing, 0.5 * spacing, 0.5, seed),
            roughness: Octaves::new(4.0, 4.0, 1.0, seed.wrapping_add(1)),
        }
    }
}

impl Formula for RoughSolid {
    fn at<T: Real>(&self, p: [T; 3]) -> T {
        let rough = self.roughness.at(p);
        let pore = (self.pores.at(p).scale(2.0) + rough.scale(0.3)).plus(1.0).smoothstep();
        let [x, y] = [0, 1].map(|axis| p[axis].plus(-self.axis[axis]).scale(self.per_radius));
        let core = (-(x * x + y * y).sqrt()).plus(0.92).scale(self.per_edge).plus(0.5).smoothstep();
        let solid = (pore * core).scale(110.0).plus(60.0);
        solid + rough.scale(5.0) + voxel_noise(p, self.seed).scale(self.noise)
    }
}

impl Field for RoughSolid {
    fn value(&self, p: [f64; 3]) -> f64 {
        self.at(p)
    }

    fn gradient(&self, p: [f64; 3]) -> Option<[f64; 3]> {
        // The cone of the core has no gradient on the axis, unless the smooth step is flat there.
        let on_axis = [p[0], p[1]] == self.axis;
        let flat = 0.92 * self.per_edge >= 0.5;
        (flat || !on_axis).then(|| self.gradient_at(p))
    }

    fn name(&self) -> &'static str {
        "rough-solid"
    }

    /// Halfway between void and solid.
    fn suggested_isovalue(&self) -> f64 {
        115.0
    }
}
