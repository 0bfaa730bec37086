//! Twin of `shader/calibrate.wgsl`: where in the blocks' ranges the surface lies.

use wavefront::cpu::frame::FrameRay;

use super::field::{CoarseField, CoarseSample};
use super::fill::{Finished, Scene};

/// Pixels of a tile's edge, and pixels between samples.
const TILE: u32 = 16;
const STRIDE: u32 = 2;
/// Steps of a share in the sum.
const STEPS: f32 = 128.0;
/// Samples that a share of one half counts for.
const PRIOR_SAMPLES: f32 = 16.0;

/// The share of a value between the interpolated ends of the blocks' ranges, in steps; `None` where these are equal.
fn share_of(sample: &CoarseSample, value: f32) -> Option<u32> {
    let [low, high] = sample.ends;
    (high > low).then(|| (((value - low) / (high - low)).clamp(0.0, 1.0) * STEPS + 0.5) as u32)
}

/// The mean of shares that sum up to so many steps.
fn mean(sum: u32, samples: u32) -> f32 {
    (sum as f32 / STEPS + 0.5 * PRIOR_SAMPLES) / (samples as f32 + PRIOR_SAMPLES)
}

impl Scene<'_> {
    /// Share of the way from the lower to the upper end of a block's range at which the surface lies, from the finished
    /// hits of tiles with holes and of their neighbours; one half where there are none.
    pub fn share(&self, field: &CoarseField) -> f32 {
        let size = self.size();
        let tiles = size.map(|s| s.div_ceil(TILE));
        let mut holes = vec![false; (tiles[0] * tiles[1]) as usize];
        let tile_of = |x: u32, y: u32| (x + tiles[0] * y) as usize;
        for (i, _) in self.pixels.iter().enumerate().filter(|(_, pixel)| pixel.is_none()) {
            let [x, y] = [i as u32 % size[0], i as u32 / size[0]];
            holes[tile_of(x / TILE, y / TILE)] = true;
        }
        let near_holes = |tile: [u32; 2]| {
            let around =
                |axis: usize| tile[axis].saturating_sub(1)..=(tile[axis] + 1).min(tiles[axis] - 1);
            around(1).any(|y| around(0).any(|x| holes[tile_of(x, y)]))
        };
        let (mut sum, mut samples) = (0, 0);
        for y in (0..size[1]).step_by(STRIDE as usize) {
            for x in (0..size[0]).step_by(STRIDE as usize) {
                let Some(Finished::Hit { depth, .. }) = self.pixels[(x + size[0] * y) as usize]
                else {
                    continue;
                };
                if !near_holes([x / TILE, y / TILE]) {
                    continue;
                }
                let frame_ray = FrameRay::new(self.frame, [x, y]);
                let (t, ray) = (frame_ray.t(self.frame, depth), &frame_ray.ray);
                let sample =
                    field.at(std::array::from_fn(|a| ray.origin[a] + t * ray.direction[a]));
                if let Some(share) = share_of(&sample, self.frame.isovalue()) {
                    sum += share;
                    samples += 1;
                }
            }
        }
        mean(sum, samples)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_outside_the_range_counts_as_its_end() {
        let sample = CoarseSample { ends: [2.0, 6.0], ..CoarseSample::default() };
        assert_eq!(
            [1.0, 3.0, 9.0].map(|value| share_of(&sample, value)),
            [Some(0), Some(32), Some(128)]
        );
        let flat = CoarseSample { ends: [2.0; 2], ..sample };
        assert_eq!(share_of(&flat, 2.0), None);
    }

    #[test]
    fn few_samples_stay_near_one_half() {
        assert_eq!(mean(0, 0), 0.5);
        assert_eq!(mean(16 * 128, 16), 0.75);
        assert!(mean(10_000 * 128, 10_000) > 0.99);
    }
}
