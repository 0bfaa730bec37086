//! Twin of `shader/calibrate.wgsl`: where in the blocks' ranges the surface lies.

use wavefront::cpu::frame::FrameRay;

use super::field::CoarseField;
use super::fill::{Finished, Scene};
use crate::plan::TILE;

/// Pixels between samples.
const STRIDE: usize = 2;
/// Steps of a share in the sum.
const STEPS: f32 = 128.0;
/// Samples that a share of one half counts for.
const PRIOR_SAMPLES: f32 = 16.0;

/// The share of a value between the interpolated ends of the blocks' ranges, in steps; `None` where these are equal.
fn share_of([low, high]: [f32; 2], value: f32) -> Option<u32> {
    (high > low).then(|| (((value - low) / (high - low)).clamp(0.0, 1.0) * STEPS + 0.5) as u32)
}

/// The mean of shares that sum up to so many steps.
fn mean(sum: u32, samples: u32) -> f32 {
    (sum as f32 / STEPS + 0.5 * PRIOR_SAMPLES) / (samples as f32 + PRIOR_SAMPLES)
}

/// Tiles of a picture on each axis.
fn tiles(size: [u32; 2]) -> [u32; 2] {
    size.map(|s| s.div_ceil(TILE))
}

/// For every tile whether it or a neighbour has holes.
fn near_holes(size: [u32; 2], pixels: &[Option<Finished>]) -> Vec<bool> {
    let tiles = tiles(size);
    let mut near = vec![false; (tiles[0] * tiles[1]) as usize];
    for (i, _) in pixels.iter().enumerate().filter(|(_, pixel)| pixel.is_none()) {
        let [x, y] = [i as u32 % size[0] / TILE, i as u32 / size[0] / TILE];
        for y in y.saturating_sub(1)..=(y + 1).min(tiles[1] - 1) {
            for x in x.saturating_sub(1)..=(x + 1).min(tiles[0] - 1) {
                near[(x + tiles[0] * y) as usize] = true;
            }
        }
    }
    near
}

impl Scene<'_> {
    /// Share of the way from the lower to the upper end of a block's range at which the surface lies, from the finished
    /// hits of tiles with holes and of their neighbours; one half where there are none.
    pub fn share(&self, field: &CoarseField) -> f32 {
        let size = self.size();
        let near = near_holes(size, self.pixels);
        let (mut sum, mut samples) = (0, 0);
        for y in (0..size[1]).step_by(STRIDE) {
            for x in (0..size[0]).step_by(STRIDE) {
                let tile = (x / TILE + tiles(size)[0] * (y / TILE)) as usize;
                if let Some(share) = self.pixel_share(field, [x, y]).filter(|_| near[tile]) {
                    sum += share;
                    samples += 1;
                }
            }
        }
        mean(sum, samples)
    }

    /// The share at a finished hit, in steps.
    fn pixel_share(&self, field: &CoarseField, pixel: [u32; 2]) -> Option<u32> {
        let Some(Finished::Hit { depth, .. }) = self.pixels[self.index(pixel)] else {
            return None;
        };
        let frame_ray = FrameRay::new(self.frame, pixel);
        let (t, ray) = (frame_ray.t(self.frame, depth), &frame_ray.ray);
        let position = std::array::from_fn(|a| ray.origin[a] + t * ray.direction[a]);
        share_of(field.at(position).ends(), self.frame.isovalue())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_outside_the_range_counts_as_its_end() {
        let ends = [2.0, 6.0];
        assert_eq!(
            [1.0, 3.0, 9.0].map(|value| share_of(ends, value)),
            [Some(0), Some(32), Some(128)]
        );
        assert_eq!(share_of([2.0; 2], 2.0), None);
    }

    #[test]
    fn few_samples_stay_near_one_half() {
        assert_eq!(mean(0, 0), 0.5);
        assert_eq!(mean(16 * 128, 16), 0.75);
        assert!(mean(10_000 * 128, 10_000) > 0.99);
    }

    #[test]
    fn tiles_are_near_a_hole_up_to_the_next_one() {
        let size = [80, 40];
        let mut pixels = vec![Some(Finished::Background); 80 * 40];
        pixels[50 + 80 * 3] = None;
        let row = |near: [u8; 5]| near.map(|near| near != 0);
        let rows = [row([0, 0, 1, 1, 1]), row([0, 0, 1, 1, 1]), row([0; 5])];
        assert_eq!(near_holes(size, &pixels), rows.concat());
    }
}
