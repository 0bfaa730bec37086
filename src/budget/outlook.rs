//! What is known of a frame before its setting is chosen: what its first pass has to do.

use super::Request;
use super::setting::{Setting, squared};
use super::work::Work;

/// Number of features.
pub(super) const FEATURES: usize = 10;
/// Work of starting a ray, of going on with one from a preview, of filling a pixel, of making a pixel from a preview and of
/// decoding a coarse cell, in visits of a block, before anything was learned.
const START_WORK: f64 = 0.27;
const RESUME_WORK: f64 = 0.4;
const FILL_WORK: f64 = 2.5;
const UPSCALE_WORK: f64 = 0.19;
const DECODE_WORK: f64 = 2000.0;
/// Part of what is decoded that a doubled look-ahead adds, before anything was learned.
const LOOK_AHEAD_WORK: f64 = 0.25;

/// What is known of a frame, in visits of a block where it is work.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outlook {
    pixels: f64,
    /// If all rays are cast, if all pixels are filled instead, and for all blocks that such a frame decodes.
    cast: f64,
    filled: f64,
    decoded: f64,
    /// But for what follows from the setting.
    features: [f64; FEATURES],
}

impl Outlook {
    pub(super) fn new(request: &Request<'_>, work: &Work, cached: bool) -> Self {
        let Request { view, size, look_ahead, fills, .. } = *request;
        let middle = size.map(|s| s / 2);
        let (_, direction, _) = view.ray(middle);
        let (_, beside, _) = view.ray([middle[0] + 1, middle[1]]);
        let apart = glam::DVec3::from(direction).distance(beside.into());
        let voxels_per_pixel = (apart * work.distance_voxels).max(1e-3);
        let pixels = size.map(f64::from).iter().product::<f64>();
        let fresh = if cached { work.fresh } else { 0.0 };
        let ahead = 1.0 + LOOK_AHEAD_WORK * f64::from(look_ahead.max(1)).log2();
        Self {
            pixels,
            cast: pixels * work.entered * (1.0 + work.visited),
            filled: if fills { pixels * work.entered * FILL_WORK } else { 0.0 },
            decoded: fresh * work.in_sight * DECODE_WORK * ahead,
            features: [
                0.0,
                (1.0 + work.visited).ln(),
                work.entered,
                0.5 * (1.0 + work.depth_voxels).ln(),
                2.0 * fresh,
                0.3 * f64::from(look_ahead.max(1)).ln(),
                0.3 * voxels_per_pixel.ln(),
                0.0,
                0.4 * direction[0],
                0.4 * direction[1],
            ],
        }
    }

    /// What a setting costs whatever its rays meet: rays are started, pictures made from previews.
    fn fixed(&self, setting: &Setting) -> f64 {
        let rays = |step| self.pixels / squared(step);
        let mut work = rays(setting.first) * START_WORK;
        if setting.last < setting.first {
            work += rays(setting.last) * RESUME_WORK;
        }
        if setting.last > 1 {
            work += self.pixels * UPSCALE_WORK;
        }
        work
    }

    /// Work in visits of a block.
    pub(super) fn units(&self, setting: &Setting) -> f64 {
        let all = squared(setting.first);
        // Whoever goes on from a preview has cast all of it.
        let open = (1.0 - setting.share * all).max(0.0);
        self.fixed(setting)
            + setting.share * self.cast
            + open * self.filled / all
            + setting.share.sqrt() * self.decoded
    }

    pub(super) fn features(&self, setting: &Setting) -> [f64; FEATURES] {
        let mut features = self.features;
        features[0] = 0.7 * setting.share.ln();
        features[7] = 0.5 * self.fixed(setting).ln();
        features
    }
}
