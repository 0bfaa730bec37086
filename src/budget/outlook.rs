//! What is known of a frame before its setting is chosen: what its first pass has to do.

use super::Request;
use super::krls;
use super::setting::{Setting, squared};
use super::work::Work;

/// Numbers of features that say what a frame is like, and of kinds of work.
pub(super) const LIKENESS: usize = 9;
pub(super) const KINDS: usize = 6;
/// What the cost per unit of work depends on: what the frame is like, and the shares of the kinds of work, since each of them has a
/// cost of its own on every machine.
pub(super) type Features = krls::Features<LIKENESS, KINDS>;

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
    local: [f64; LIKENESS],
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
            local: [
                0.0,
                (1.0 + work.visited).ln(),
                work.entered,
                0.5 * (1.0 + work.depth_voxels).ln(),
                2.0 * fresh,
                0.3 * f64::from(look_ahead.max(1)).ln(),
                0.3 * voxels_per_pixel.ln(),
                0.4 * direction[0],
                0.4 * direction[1],
            ],
        }
    }

    /// Work of every kind: rays are started, those of a preview gone on with, pictures made from previews, rays cast, pixels filled
    /// and blocks decoded.
    pub(super) fn parts(&self, setting: &Setting) -> [f64; KINDS] {
        let Setting { first, last, share } = *setting;
        let rays = |step| self.pixels / squared(step);
        // Whoever goes on from a preview has cast all of it.
        let open = (1.0 / squared(first) - share).max(0.0);
        [
            rays(first) * START_WORK,
            if last < first { rays(last) * RESUME_WORK } else { 0.0 },
            if last > 1 { self.pixels * UPSCALE_WORK } else { 0.0 },
            share * self.cast,
            open * self.filled,
            share.sqrt() * self.decoded,
        ]
    }

    /// Work in visits of a block.
    pub(super) fn units(&self, setting: &Setting) -> f64 {
        self.parts(setting).iter().sum()
    }

    pub(super) fn features(&self, setting: &Setting) -> Features {
        let (mut local, parts) = (self.local, self.parts(setting));
        local[0] = 0.7 * setting.share.ln();
        let units: f64 = parts.iter().sum();
        Features { local, linear: parts.map(|part| part / units) }
    }
}
