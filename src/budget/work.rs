//! The pre-pass: what a frame has to do, estimated on the CPU from the value ranges of coarse cells and a few rays.

use macrocell::Grid;
use wavefront::FrameView;

/// Most voxels along an edge of a coarse cell.
const CELL_VOXELS: f64 = 16.0;
/// Rays of the pre-pass, across and down.
const RAYS: [u32; 2] = [32, 18];
/// Chance that a ray that crosses an active coarse cell hits the surface in it.
const HIT_CHANCE: f64 = 0.5;
/// A ray of which less is left is at its end.
const LEAST_LEFT: f64 = 0.02;
/// Blocks that a ray visits in an active coarse cell, and what an empty one costs of a block.
const BLOCKS_IN_ACTIVE: f64 = 4.0;
const COST_OF_EMPTY: f64 = 0.25;

/// What a frame has to do if all of its rays are cast.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Work {
    /// Share of the rays that enter the volume.
    pub(crate) entered: f64,
    /// Blocks that such a ray is expected to visit.
    pub(crate) visited: f64,
    /// Depth in voxels, from where it enters, at which it is expected to end.
    pub(crate) depth_voxels: f64,
    /// Depth in voxels from where rays start to there.
    pub(crate) distance_voxels: f64,
    /// Share of the coarse cells in sight that no earlier frame saw, hence the part that is to be decoded.
    pub(crate) fresh: f64,
    /// Coarse cells in sight.
    pub(crate) in_sight: f64,
}

/// What is known of the volume, and what was in sight since the cache was empty.
#[derive(Debug)]
pub(crate) struct PrePass {
    grid: Grid,
    ranges: Vec<[f32; 2]>,
    /// Number of the frame that saw a coarse cell last; 0: none.
    seen: Vec<u32>,
    frame: u32,
}

impl PrePass {
    /// (low, high) of every coarse cell.
    pub(crate) fn new(grid: Grid, ranges: Vec<[f32; 2]>) -> Self {
        let seen = vec![0; ranges.len()];
        Self { grid, ranges, seen, frame: 0 }
    }

    /// Nothing is decoded any more.
    pub(crate) fn forget(&mut self) {
        self.seen.fill(0);
    }

    /// Follows a few rays through the coarse cells.
    pub(crate) fn estimate(&mut self, view: &FrameView, size: [u32; 2], isovalue: f32) -> Work {
        self.frame += 1;
        let (mut work, mut entered) = (Work::default(), 0.0);
        let mut cells = [0.0; 2];
        for y in 0..RAYS[1] {
            for x in 0..RAYS[0] {
                let place = [(x, 0), (y, 1)].map(|(i, axis)| {
                    ((f64::from(i) + 0.5) * f64::from(size[axis]) / f64::from(RAYS[axis])) as u32
                });
                let (origin, direction, _) = view.ray(place);
                if self.follow(origin, direction, isovalue, &mut work, &mut cells) {
                    entered += 1.0;
                }
            }
        }
        let per_ray = 1.0 / f64::max(entered, 1.0);
        let [in_sight, fresh] = cells;
        Work {
            entered: entered / f64::from(RAYS[0] * RAYS[1]),
            visited: work.visited * per_ray,
            depth_voxels: work.depth_voxels * per_ray,
            distance_voxels: work.distance_voxels * per_ray,
            fresh: fresh / f64::max(in_sight, 1.0),
            in_sight,
        }
    }

    /// Adds a ray's sums; true if it enters the volume. `cells`: those in sight, and those of them never seen before.
    fn follow(
        &mut self,
        origin: [f64; 3],
        direction: [f64; 3],
        isovalue: f32,
        work: &mut Work,
        cells: &mut [f64; 2],
    ) -> bool {
        let (mut left, mut enters) = (1.0, false);
        for step in Walk::new(&self.grid, origin, direction) {
            if !std::mem::replace(&mut enters, true) {
                work.distance_voxels += step.t[0];
            }
            let index = self.grid.coarse_index(step.cell) as usize;
            let [low, high] = self.ranges[index];
            work.depth_voxels += left * (step.t[1] - step.t[0]);
            if !(low < isovalue && isovalue <= high) {
                work.visited += left * COST_OF_EMPTY;
                continue;
            }
            work.visited += left * BLOCKS_IN_ACTIVE;
            let seen = std::mem::replace(&mut self.seen[index], self.frame);
            if seen != self.frame {
                cells[0] += 1.0;
                cells[1] += if seen == 0 { 1.0 } else { 0.0 };
            }
            left *= 1.0 - HIT_CHANCE;
            if left < LEAST_LEFT {
                break;
            }
        }
        enters
    }
}

/// A coarse cell that a ray crosses, and where it does in voxels along the ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Step {
    pub(crate) cell: [u32; 3],
    pub(crate) t: [f64; 2],
}

/// The coarse cells along a ray (J. Amanatides, A. Woo, A Fast Voxel Traversal Algorithm for Ray Tracing, 1987).
#[derive(Clone, Debug)]
pub(crate) struct Walk {
    cell: [i64; 3],
    count: [i64; 3],
    step: [i64; 3],
    /// Where the ray leaves the cell through the faces of each axis, and how far apart such faces are.
    next: [f64; 3],
    between: [f64; 3],
    t: f64,
    exit: f64,
}

impl Walk {
    pub(crate) fn new(grid: &Grid, origin: [f64; 3], direction: [f64; 3]) -> Self {
        let last = grid.dims().map(|n| f64::from(n) - 1.0);
        let count = grid.coarse().map(i64::from);
        let (mut t, mut exit) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let faces = [0.0, last[axis]].map(|face| (face - origin[axis]) / direction[axis]);
            if direction[axis] == 0.0 {
                if !(0.0..=last[axis]).contains(&origin[axis]) {
                    exit = f64::NEG_INFINITY;
                }
            } else {
                t = t.max(faces[0].min(faces[1]));
                exit = exit.min(faces[0].max(faces[1]));
            }
        }
        let cell = [0, 1, 2].map(|axis| {
            let place = (origin[axis] + t * direction[axis]) / CELL_VOXELS;
            (place.floor() as i64).clamp(0, count[axis] - 1)
        });
        let step = direction.map(|d| if d < 0.0 { -1 } else { 1 });
        let next = [0, 1, 2].map(|axis| {
            let face = (cell[axis] + (step[axis] + 1) / 2) as f64 * CELL_VOXELS;
            let t = (face - origin[axis]) / direction[axis];
            if direction[axis] == 0.0 { f64::INFINITY } else { t }
        });
        let between = direction.map(|d| (CELL_VOXELS / d).abs());
        Self { cell, count, step, next, between, t, exit }
    }
}

impl Iterator for Walk {
    type Item = Step;

    fn next(&mut self) -> Option<Step> {
        let inside = (0..3).all(|axis| (0..self.count[axis]).contains(&self.cell[axis]));
        if !inside || self.t >= self.exit {
            return None;
        }
        let axis = (0..3)
            .fold(0, |best, axis| if self.next[axis] < self.next[best] { axis } else { best });
        let end = self.next[axis].min(self.exit).max(self.t);
        let step = Step { cell: self.cell.map(|c| c as u32), t: [self.t, end] };
        self.t = end;
        self.cell[axis] += self.step[axis];
        self.next[axis] += self.between[axis];
        Some(step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::noise;

    #[test]
    fn a_walk_has_every_cell_along_the_ray_in_order() {
        let (grid, mut numbers) = (Grid::new([70, 45, 33]), noise(7));
        let mut random = move || 2.0 * numbers() - 1.0;
        let mut found = 0;
        for ray in 0..1000 {
            let origin = [0, 0, 0].map(|_| 100.0 * random());
            let direction = glam::DVec3::new(random(), random(), random()).normalize().to_array();
            let steps: Vec<Step> = Walk::new(&grid, origin, direction).collect();
            for pair in steps.windows(2) {
                assert_eq!(pair[0].t[1].to_bits(), pair[1].t[0].to_bits(), "seed 7, ray {ray}");
            }
            // Every place along the ray lies in the cell that the walk has there.
            for i in 0..4000 {
                let t = 0.1 * f64::from(i);
                let p = [0, 1, 2].map(|a| origin[a] + t * direction[a]);
                if (0..3).any(|a| p[a] < 0.0 || p[a] > f64::from(grid.dims()[a]) - 1.0) {
                    continue;
                }
                let step = steps.iter().find(|s| s.t[0] <= t + 1e-9 && t <= s.t[1] + 1e-9);
                let step = step.unwrap_or_else(|| panic!("seed 7, ray {ray}: no cell at {p:?}"));
                for a in 0..3 {
                    let low = f64::from(step.cell[a]) * CELL_VOXELS;
                    let inside = p[a] >= low - 1e-6 && p[a] <= low + CELL_VOXELS + 1e-6;
                    assert!(inside, "seed 7, ray {ray}: {p:?} in {step:?}");
                }
                found += 1;
            }
        }
        assert!(found > 10_000, "{found} places looked at");
    }
}
