//! Twin of `shader/lib/coarse_field.wgsl`: the volume at one value per block.

use macrocell::Grid;
use macrocell::cpu::ranges::{Ranges, scale};
use wavefront::cpu::cell::Corners;

/// Voxels between the middles of neighbouring blocks, and from a block's first voxel to the middle of its dual cells.
const SPACING: f32 = 4.0;
const MIDDLE: f32 = 2.0;

/// The ends of the blocks' value ranges, interpolated between the blocks' middles.
#[derive(Clone, Debug)]
pub struct CoarseField {
    last_block: [u32; 3],
    blocks: [u32; 3],
    ranges: Vec<[f32; 2]>,
}

/// The ends of the ranges of the eight blocks around a position.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CoarseSample {
    /// Lower ends.
    pub lower: Corners,
    /// Upper ends.
    pub upper: Corners,
    /// The place between the blocks' middles, 0 to 1 on each axis.
    pub place: [f32; 3],
}

impl CoarseField {
    /// From the value ranges that `macrocell` keeps: codes relative to the coarse cell's range.
    pub fn new(grid: &Grid, ranges: &Ranges) -> Self {
        let blocks = grid.blocks();
        let decode = |index: u64| {
            let [x, y, z] = [
                index as u32 % blocks[0],
                index as u32 / blocks[0] % blocks[1],
                index as u32 / (blocks[0] * blocks[1]),
            ];
            let coarse = grid.coarse_index([x / 4, y / 4, z / 4]) as usize;
            let lane = (x % 4 + 4 * (y % 4) + 16 * (z % 4)) as usize;
            let [low, high] = ranges.coarse[coarse];
            let code = ranges.codes[64 * coarse + lane];
            let step = 1.0 / scale(low, high);
            [code & 255, code >> 8].map(|end| low + (f32::from(end) + 0.5) * step)
        };
        Self {
            last_block: grid.last_cell().map(|last| (last / 4) as u32),
            blocks,
            ranges: (0..grid.block_count()).map(decode).collect(),
        }
    }

    fn block(&self, block: [u32; 3]) -> [f32; 2] {
        let [x, y, z] = block;
        self.ranges[(x + self.blocks[0] * (y + self.blocks[1] * z)) as usize]
    }

    /// The field at an index-space position; constant beyond the outermost blocks' middles.
    pub fn at(&self, position: [f32; 3]) -> CoarseSample {
        let axes: [(u32, u32, f32); 3] = std::array::from_fn(|a| {
            let last = self.last_block[a] as f32;
            let q = ((position[a] - MIDDLE) / SPACING).clamp(0.0, last);
            let first = q.floor();
            (first as u32, (first as u32 + 1).min(self.last_block[a]), q - first)
        });
        let pick = |axis: usize, upper: bool| if upper { axes[axis].1 } else { axes[axis].0 };
        let at =
            |x: bool, i: usize| self.block([pick(0, x), pick(1, i & 1 == 1), pick(2, i >> 1 == 1)]);
        let corners = |end: usize| Corners {
            low: std::array::from_fn(|i| at(false, i)[end]),
            high: std::array::from_fn(|i| at(true, i)[end]),
        };
        CoarseSample { lower: corners(0), upper: corners(1), place: axes.map(|axis| axis.2) }
    }
}

impl CoarseSample {
    /// The interpolated ends.
    pub fn ends(&self) -> [f32; 2] {
        [&self.lower, &self.upper].map(|corners| corners.value(self.place))
    }

    /// The value at a share of the way from the lower to the upper end.
    pub fn value(&self, share: f32) -> f32 {
        let [low, high] = self.ends();
        low + share * (high - low)
    }

    /// The gradient of the values at a share, per voxel.
    pub fn gradient(&self, share: f32) -> [f32; 3] {
        let mixed = |low: [f32; 4], high: [f32; 4]| {
            std::array::from_fn(|i| low[i] + share * (high[i] - low[i]))
        };
        let corners = Corners {
            low: mixed(self.lower.low, self.upper.low),
            high: mixed(self.lower.high, self.upper.high),
        };
        corners.gradient(self.place).map(|g| g / SPACING)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use macrocell::cpu::ranges;

    #[test]
    fn a_ramp_comes_back_within_the_codes() {
        let dims = [33, 20, 17];
        let grid = Grid::new(dims);
        let mut samples = Vec::new();
        for z in 0..dims[2] {
            for y in 0..dims[1] {
                for x in 0..dims[0] {
                    samples.push(x as f32 + 2.0 * y as f32 - z as f32);
                }
            }
        }
        let field = CoarseField::new(&grid, &ranges::build(&grid, &samples));
        for p in [[9.0, 7.5, 6.0], [20.25, 13.0, 8.0], [4.0, 2.0, 2.0]] {
            let found = field.at(p);
            // Half a code of a coarse cell's range of at most 64 values.
            assert!(
                (found.value(0.5) - (p[0] + 2.0 * p[1] - p[2])).abs() <= 0.5,
                "{p:?} {found:?}"
            );
            for (g, expected) in found.gradient(0.5).into_iter().zip([1.0, 2.0, -1.0]) {
                assert!((g - expected).abs() < 0.2, "{p:?} {found:?}");
            }
        }
    }
}
