//! How far a picture computed in f32 may be from the f64 reference: the bounds that
//! `docs/numerics.md` derives, in code.

use crate::reference::{Ray, Scene};

/// Unit roundoff of f32.
pub const U: f64 = 1.0 / 16_777_216.0;

/// Roundings of a field value in units of U times the largest corner value: one subtraction, three
/// for each of six interpolations, three for the sums of polar forms, the rest for turning points.
const VALUE_ROUNDINGS: f64 = 32.0;

/// Width of the bracket at which the root search stops, as a share of a cell's diagonal.
const BRACKET: f64 = 4.0 * U * 1.733;

/// Origin (voxels), unit direction, and view depth per voxel of a pixel's ray, in f64.
pub type PixelRay = ([f64; 3], [f64; 3], f64);

/// The affine map from pixels to rays, recovered from three rays: it tells what f32 does to each.
#[derive(Clone, Copy, Debug)]
pub struct RayErrors {
    size: [u32; 2],
    start_depth: f64,
    origin: [[f64; 3]; 3],
    direction: [[f64; 3]; 3],
}

/// What f32 does to one ray.
#[derive(Clone, Copy, Debug)]
pub struct RayError {
    /// Voxels.
    origin: [f64; 3],
    /// Voxels per voxel of t.
    direction: [f64; 3],
    unit: [f64; 3],
}

/// The ray of a pixel, how depth is counted along it, and how well f32 knows it.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// The ray in f64; t counts voxels.
    pub ray: Ray,
    /// View depth in world units gained per voxel.
    pub depth_per_voxel: f64,
    /// View depth in world units at t = 0.
    pub start_depth: f64,
    /// What f32 does to the ray.
    pub error: RayError,
}

impl RayErrors {
    /// For a picture of `size` pixels; `ray` gives the ray of any pixel, also of those next to the
    /// picture.
    #[must_use]
    pub fn new(size: [u32; 2], start_depth: f64, ray: impl Fn([u32; 2]) -> PixelRay) -> Self {
        let at = |pixel| {
            let (origin, unit, depth_per_voxel) = ray(pixel);
            (origin, unit.map(|d| d / depth_per_voxel))
        };
        let [zero, right, down] = [at([0, 0]), at([1, 0]), at([0, 1])];
        let minus = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|i| a[i] - b[i]);
        let center = |v: [f64; 3], dx: [f64; 3], dy: [f64; 3]| {
            let [x, y] = size.map(|n| 0.5 * f64::from(n) - 0.5);
            [0, 1, 2].map(|i| v[i] + x * dx[i] + y * dy[i])
        };
        let affine = |v: [f64; 3], r: [f64; 3], d: [f64; 3]| {
            let (dx, dy) = (minus(r, v), minus(d, v));
            [center(v, dx, dy), dx, dy]
        };
        Self {
            size,
            start_depth,
            origin: affine(zero.0, right.0, down.0),
            direction: affine(zero.1, right.1, down.1),
        }
    }

    /// The ray of a pixel with its error: each of the three terms of a sum is rounded at most four
    /// times.
    #[must_use]
    pub fn sight(&self, pixel: [u32; 2], ray: PixelRay) -> Sight {
        let offset = [0, 1].map(|a| f64::from(pixel[a]) + 0.5 - 0.5 * f64::from(self.size[a]));
        let sum = |v: &[[f64; 3]; 3], i: usize| {
            v[0][i].abs() + (offset[0] * v[1][i]).abs() + (offset[1] * v[2][i]).abs()
        };
        let (origin, unit, depth_per_voxel) = ray;
        let error = RayError {
            origin: [0, 1, 2].map(|i| 4.0 * U * sum(&self.origin, i)),
            direction: [0, 1, 2].map(|i| {
                depth_per_voxel * 4.0 * U * sum(&self.direction, i) + U * unit[i].abs() + 1e-12
            }),
            unit,
        };
        let ray = Ray { origin, direction: unit, t_min: 0.0 };
        Sight { ray, depth_per_voxel, start_depth: self.start_depth, error }
    }
}

impl Sight {
    /// Parameter of a hit, from its depth.
    #[must_use]
    pub fn parameter(&self, depth: f32) -> f64 {
        (f64::from(depth) - self.start_depth) / self.depth_per_voxel
    }

    /// How far the parameter of a hit read from the depth output may be from that of a point where
    /// the GPU's field is zero: the root search's bracket, the mix of two parameters, the depth's
    /// roundings.
    #[must_use]
    pub fn parameter_error(&self, t: f64) -> f64 {
        let depth = self.start_depth + t * self.depth_per_voxel;
        let depth_error = U * (self.start_depth.abs() + 2.0 * depth.abs()) / self.depth_per_voxel;
        BRACKET + 4.0 * U * t + depth_error
    }
}

impl RayError {
    /// How far a point of the GPU's ray at parameter `t` may be from the true one on each axis:
    /// rounded origin and direction, rounded parameters of planes, rounded local coordinates.
    #[must_use]
    pub fn position(&self, t: f64) -> [f64; 3] {
        [0, 1, 2].map(|i| {
            self.origin[i] + t * (self.direction[i] + 7.0 * U * self.unit[i].abs()) + 2.0 * U
        })
    }
}

/// The samples around a position: its cell and the neighbouring ones.
#[derive(Clone, Copy, Debug)]
pub struct Around {
    /// Largest |sample - isovalue|.
    pub largest: f64,
    /// Largest difference of neighbouring samples on each axis.
    pub steps: [f64; 3],
}

impl Around {
    /// `samples` holds `dims` values, x fastest; the position is in voxels.
    #[must_use]
    pub fn new(dims: [u32; 3], samples: &[f32], isovalue: f64, position: [f64; 3]) -> Self {
        let last = dims.map(|n| i64::from(n) - 1);
        let first = position.map(|x| x.floor() as i64 - 1);
        let clamped = |axis: usize, offset: i64| (first[axis] + offset).clamp(0, last[axis]);
        let value = |p: [i64; 3]| {
            let at = p[0] + i64::from(dims[0]) * (p[1] + i64::from(dims[1]) * p[2]);
            f64::from(samples[at as usize]) - isovalue
        };
        let mut around = Self { largest: 0.0, steps: [0.0; 3] };
        for n in 0..64 {
            let p = [clamped(0, n & 3), clamped(1, n >> 2 & 3), clamped(2, n >> 4)];
            let here = value(p);
            around.largest = around.largest.max(here.abs());
            for axis in 0..3 {
                let mut next = p;
                next[axis] = (p[axis] + 1).min(last[axis]);
                around.steps[axis] = around.steps[axis].max((value(next) - here).abs());
            }
        }
        around
    }

    /// How far the GPU's value minus isovalue may be from the true one, given its position error.
    #[must_use]
    pub fn value_error(&self, position_error: [f64; 3]) -> f64 {
        let moved: f64 = (0..3).map(|a| self.steps[a] * position_error[a]).sum();
        VALUE_ROUNDINGS * U * self.largest + moved
    }
}

/// How far one has to go from `t`, forwards (`sign` = 1) or backwards, until the true field is
/// farther than `error` from the isovalue; `None` when that does not happen within a voxel.
#[must_use]
pub fn reach(scene: &Scene<'_>, ray: &Ray, t: f64, sign: f64, error: f64) -> Option<f64> {
    let mut distance = 1e-7;
    while distance < 1.0 {
        if scene.value(ray.at(t + sign * distance)).abs() > error {
            return Some(distance);
        }
        distance *= 1.2;
    }
    None
}
