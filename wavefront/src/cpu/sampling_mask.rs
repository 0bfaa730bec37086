//! Twin of `shader/sampling_mask.wgsl`: which rays a pass of a foveated frame may cast.

use crate::foveation::{BlueNoise, SamplingParams};

/// Ranks by which a pixel is drawn in the pass: it is if the margin is positive. Infinite where all rays are.
///
/// A GPU's `exp` and `pow` may differ, so the kernel may decide otherwise where the margin is small.
#[must_use]
pub fn margin(tiles: &BlueNoise, params: &SamplingParams, pixel: [u32; 2]) -> f32 {
    let on_lattice = pixel.iter().all(|p| p % (1 << params.lattice_level) == 0);
    if params.draws == 0 || (params.lattice_level > 0 && on_lattice) {
        return f32::INFINITY;
    }
    let mut left = not_drawn(params, pixel);
    if params.draws > 1 {
        left = left.max(1e-30).powi(params.draws as i32);
    }
    let slice = u64::from(params.slice / (BlueNoise::RANKS / 2));
    let above = (BlueNoise::RANKS - tiles.rank(pixel, slice)) as f32 - 0.5;
    above - BlueNoise::RANKS as f32 * left
}

/// Probability that one pass does not draw the pixel: 1 - tau.
#[must_use]
pub fn not_drawn(params: &SamplingParams, pixel: [u32; 2]) -> f32 {
    let r = [0, 1].map(|a| (pixel[a] as f32 + 0.5) * params.share_per_pixel[a] - params.gaze[a]);
    // Of both axes, since the kernel works out a row's part once.
    let fovea =
        r.map(|r| if params.falloff > 0.0 { (-params.falloff * (r * r)).exp() } else { 0.0 });
    (1.0 - params.base_density) * (1.0 - fovea[1] * fovea[0])
}
