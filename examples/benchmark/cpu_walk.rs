//! A ray's way through a decoded volume to the first hit, in f32.
//!
//! Written apart from the library's shaders and their CPU twins, so that what it says about a
//! picture is a second opinion.

use crate::cpu_volume::{CpuVolume, Masks};

/// A ray in index space; the direction has unit length, so that t is in voxels.
#[derive(Clone, Copy)]
pub struct Ray {
    origin: [f32; 3],
    pub direction: [f32; 3],
    inverse: [f32; 3],
}

impl Ray {
    pub fn new(origin: [f32; 3], direction: [f32; 3]) -> Self {
        // No component is 0, so that every division below is defined.
        const LEAST: f32 = 1e-12;
        let direction = direction.map(|d| if d.abs() < LEAST { LEAST.copysign(d) } else { d });
        Self { origin, direction, inverse: direction.map(|d| 1.0 / d) }
    }

    /// Parameter at which the ray crosses a plane.
    fn plane(&self, axis: usize, plane: i32) -> f32 {
        (plane as f32 - self.origin[axis]) * self.inverse[axis]
    }

    /// The plane through which the ray leaves the cells `low .. low + size` on an axis.
    fn far_plane(&self, axis: usize, low: i32, size: i32) -> i32 {
        if self.direction[axis] > 0.0 { low + size } else { low }
    }

    fn at(&self, axis: usize, t: f32) -> f32 {
        self.origin[axis] + t * self.direction[axis]
    }

    /// Coordinates in the dual cell, in [0, 1].
    fn local(&self, cell: [i32; 3], t: f32) -> [f32; 3] {
        std::array::from_fn(|axis| (self.at(axis, t) - cell[axis] as f32).clamp(0.0, 1.0))
    }
}

/// Where a ray is: in this dual cell from `t` on.
#[derive(Clone, Copy)]
struct Place {
    cell: [i32; 3],
    t: f32,
}

/// The first crossing of the surface along a ray.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Of the trilinear field, per voxel.
    pub gradient: [f32; 3],
}

/// Sees what a walk passes. Drawing needs nothing of it and uses `()`.
pub trait Visitor {
    /// A dual cell in an active block; `crosses`: its samples are not all on one side.
    fn cell(&mut self, cell: [i32; 3], crosses: bool);
}

impl Visitor for () {
    fn cell(&mut self, _cell: [i32; 3], _crosses: bool) {}
}

/// The isosurface of a decoded volume.
#[derive(Clone, Copy)]
pub struct Surface<'a> {
    pub volume: &'a CpuVolume,
    pub masks: &'a Masks,
    pub isovalue: f32,
}

impl Surface<'_> {
    /// The first hit of a ray.
    pub fn trace(&self, ray: &Ray, visitor: &mut impl Visitor) -> Option<Hit> {
        let last = self.volume.dims().map(|n| n as i32 - 2);
        let mut place = enter(ray, last)?;
        while (0..3).all(|a| (0..=last[a]).contains(&place.cell[a])) {
            let word = self.masks.word(self.volume.coarse_index(place.cell));
            if word == 0 {
                place = leave(ray, place, 16);
            } else if word >> block_bit(place.cell) & 1 == 0 {
                place = leave(ray, place, 4);
            } else {
                match self.walk_block(ray, place, last, visitor) {
                    Ok(hit) => return Some(hit),
                    Err(next) => place = next,
                }
            }
        }
        None
    }

    /// The first hit in an active block, or the place after it.
    fn walk_block(
        &self,
        ray: &Ray,
        place: Place,
        last: [i32; 3],
        visitor: &mut impl Visitor,
    ) -> Result<Hit, Place> {
        let Place { mut cell, mut t } = place;
        let [nx, ny, _] = self.volume.dims();
        let strides = [1, nx as isize, (nx * ny) as isize];
        let mut index = (0..3).map(|a| cell[a] as isize * strides[a]).sum::<isize>();
        let mut next: [f32; 3] =
            std::array::from_fn(|a| ray.plane(a, ray.far_plane(a, cell[a], 1)));
        loop {
            let axis = least(next);
            let corners = self.corners(index as usize);
            let inside = corners.iter().filter(|&&value| value >= 0.0).count();
            let crosses = inside != 0 && inside != 8;
            visitor.cell(cell, crosses);
            let end = next[axis].max(t);
            let hit = crosses.then(|| intersect(ray, cell, &corners, [t, end])).flatten();
            if let Some(hit) = hit {
                return Ok(hit);
            }
            t = end;
            let (before, step) = (cell[axis], if ray.direction[axis] > 0.0 { 1 } else { -1 });
            cell[axis] += step;
            // Another block, or the end of the volume inside the last one.
            if cell[axis] >> 2 != before >> 2 || cell[axis] > last[axis] {
                return Err(Place { cell, t });
            }
            index += step as isize * strides[axis];
            next[axis] = ray.plane(axis, ray.far_plane(axis, cell[axis], 1));
        }
    }

    /// The samples of a dual cell minus the isovalue, at x + 2y + 4z.
    fn corners(&self, index: usize) -> [f32; 8] {
        let [nx, ny, _] = self.volume.dims();
        let samples = &self.volume.samples()[index..][..nx * ny + nx + 2];
        let [low, high] = [0, nx * ny];
        [low, low + 1, low + nx, low + nx + 1, high, high + 1, high + nx, high + nx + 1]
            .map(|i| samples[i] - self.isovalue)
    }
}

/// Position of a dual cell's block among the 64 of its coarse cell.
fn block_bit(cell: [i32; 3]) -> i32 {
    let [x, y, z] = cell.map(|c| c >> 2 & 3);
    x + 4 * y + 16 * z
}

fn least(t: [f32; 3]) -> usize {
    if t[0] <= t[1] {
        if t[0] <= t[2] { 0 } else { 2 }
    } else if t[1] <= t[2] {
        1
    } else {
        2
    }
}

/// The ray's first dual cell; `last` is the volume's last one.
fn enter(ray: &Ray, last: [i32; 3]) -> Option<Place> {
    let (mut t, mut end) = (0.0_f32, f32::INFINITY);
    for axis in 0..3 {
        let (a, b) = (ray.plane(axis, 0), ray.plane(axis, last[axis] + 1));
        (t, end) = (t.max(a.min(b)), end.min(a.max(b)));
    }
    let cell = std::array::from_fn(|axis| (ray.at(axis, t).floor() as i32).clamp(0, last[axis]));
    (t < end && last.iter().all(|&l| l >= 0)).then_some(Place { cell, t })
}

/// The place after the box of `size`^3 cells around a place.
fn leave(ray: &Ray, place: Place, size: i32) -> Place {
    let low = place.cell.map(|c| c & -size);
    let planes: [i32; 3] = std::array::from_fn(|a| ray.far_plane(a, low[a], size));
    let times: [f32; 3] = std::array::from_fn(|a| ray.plane(a, planes[a]));
    let axis = least(times);
    let t = times[axis].max(place.t);
    // Inside the box on the other axes, so that rounding cannot lead a ray off its way.
    let mut cell: [i32; 3] =
        std::array::from_fn(|a| (ray.at(a, t).floor() as i32).clamp(low[a], low[a] + size - 1));
    cell[axis] = if ray.direction[axis] > 0.0 { planes[axis] } else { planes[axis] - 1 };
    Place { cell, t }
}

/// The first crossing inside a dual cell, between the parameters at which the ray enters and leaves.
fn intersect(ray: &Ray, cell: [i32; 3], corners: &[f32; 8], t: [f32; 2]) -> Option<Hit> {
    let (from, to) = (ray.local(cell, t[0]), ray.local(cell, t[1]));
    let cubic = Cubic::along(corners, from, to);
    let s = cubic.first_root()?;
    let position = std::array::from_fn(|a| from[a] + s * (to[a] - from[a]));
    Some(Hit { gradient: gradient(corners, position) })
}

/// The field along a straight line through a cell, over the parameter s in [0, 1].
struct Cubic {
    /// Coefficients of 1, s, s^2, s^3.
    c: [f32; 4],
}

impl Cubic {
    fn along(v: &[f32; 8], from: [f32; 3], to: [f32; 3]) -> Self {
        let step: [f32; 3] = std::array::from_fn(|a| to[a] - from[a]);
        // On the four edges along x, linear in s.
        let edge = |i: usize| {
            let slope = v[i + 1] - v[i];
            [v[i] + slope * from[0], slope * step[0]]
        };
        // On the two faces across z, quadratic in s.
        let face = |i: usize| {
            let (a, b) = (edge(i), edge(i + 2));
            let d = [b[0] - a[0], b[1] - a[1]];
            [a[0] + d[0] * from[1], a[1] + d[1] * from[1] + d[0] * step[1], d[1] * step[1]]
        };
        let (a, b) = (face(0), face(4));
        let d: [f32; 3] = std::array::from_fn(|i| b[i] - a[i]);
        let c = [
            a[0] + d[0] * from[2],
            a[1] + d[1] * from[2] + d[0] * step[2],
            a[2] + d[2] * from[2] + d[1] * step[2],
            d[2] * step[2],
        ];
        Self { c }
    }

    fn at(&self, s: f32) -> f32 {
        let [c0, c1, c2, c3] = self.c;
        c0 + s * (c1 + s * (c2 + s * c3))
    }

    /// Where the field first changes sides.
    fn first_root(&self) -> Option<f32> {
        let [c0, c1, c2, c3] = self.c;
        // Bernstein coefficients: no more changes of side than they have.
        let sides =
            [c0, c0 + c1 / 3.0, c0 + (2.0 * c1 + c2) / 3.0, c0 + c1 + c2 + c3].map(|b| b >= 0.0);
        let changes = sides.windows(2).filter(|pair| pair[0] != pair[1]).count();
        match changes {
            0 => None,
            1 => Some(self.root(0.0, 1.0)),
            _ => self.first_root_between_turns(),
        }
    }

    fn first_root_between_turns(&self) -> Option<f32> {
        let mut low = 0.0;
        for high in self.turns().into_iter().chain([1.0]) {
            if high > low && high <= 1.0 {
                if (self.at(low) >= 0.0) != (self.at(high) >= 0.0) {
                    return Some(self.root(low, high));
                }
                low = high;
            }
        }
        None
    }

    /// Where the derivative vanishes, in order; NaN where it does not.
    fn turns(&self) -> [f32; 2] {
        let [_, c1, c2, c3] = self.c;
        let q = -(c2 + (c2 * c2 - 3.0 * c1 * c3).sqrt().copysign(c2));
        let (a, b) = (q / (3.0 * c3), c1 / q);
        if a < b { [a, b] } else { [b, a] }
    }

    /// The root in an interval whose ends are on different sides: regula falsi that halves the
    /// value of an end that stays (the Illinois rule).
    fn root(&self, mut low: f32, mut high: f32) -> f32 {
        let (mut at_low, mut at_high) = (self.at(low), self.at(high));
        let inside_low = at_low >= 0.0;
        let mut root = low;
        for _ in 0..24 {
            let share = at_low / (at_low - at_high);
            root = if share > 0.0 && share < 1.0 {
                low + share * (high - low)
            } else {
                (low + high) / 2.0
            };
            let value = self.at(root);
            if high - low < 1e-6 || value.abs() < 1e-30 {
                break;
            }
            let last = (low, high);
            if (value >= 0.0) == inside_low {
                (low, at_low, at_high) = (root, value, at_high / 2.0);
            } else {
                (high, at_high, at_low) = (root, value, at_low / 2.0);
            }
            if last == (low, high) {
                break;
            }
        }
        root
    }
}

/// Of the trilinear field at a position in its cell.
fn gradient(v: &[f32; 8], p: [f32; 3]) -> [f32; 3] {
    let mix = |a: f32, b: f32, w: f32| a + w * (b - a);
    let over = |f: &dyn Fn(usize) -> f32, w0: f32, w1: f32| {
        mix(mix(f(0), f(1), w0), mix(f(2), f(3), w0), w1)
    };
    [
        over(&|i| v[2 * i + 1] - v[2 * i], p[1], p[2]),
        over(&|i| v[i % 2 + i / 2 * 4 + 2] - v[i % 2 + i / 2 * 4], p[0], p[2]),
        over(&|i| v[i + 4] - v[i], p[0], p[1]),
    ]
}
