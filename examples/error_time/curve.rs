//! One curve of error against time, as it is written to `error_time.json`. `docs/accuracy.md`
//! explains the keys.

use gpu_testkit::picture::PictureErrors;
use serde::Serialize;

use crate::sets::Memory;

/// The picture after a pass.
#[derive(Clone, Debug, Serialize)]
pub struct Point {
    pub pass: u32,
    /// Wall clock since before the renderer was made.
    pub ms: f64,
    /// Finished share of the rays that enter the volume.
    pub completeness: f64,
    /// What the report says of the depth that is still open.
    pub open_depth_voxels: f32,
    /// Against the f64 renderer on the uncompressed samples.
    #[serde(flatten)]
    pub errors: PictureErrors,
    /// Against the finished picture of the same setting: what unfinished rays do.
    pub against_finished: PictureErrors,
    /// No picture of this volume, view and size that came as early has a higher PSNR.
    pub on_front: bool,
}

/// One setting at one view of one volume.
#[derive(Clone, Debug, Serialize)]
pub struct Curve {
    pub volume: String,
    /// Azimuth and elevation in degrees.
    pub view: [f64; 2],
    pub strategy: &'static str,
    /// Bits per voxel.
    pub rate: f64,
    /// Pixels.
    pub size: [u32; 2],
    pub residency: Memory,
    pub budget_bytes: u64,
    /// Blocks that can be decoded at a time.
    pub slots: u64,
    pub passes: u32,
    /// Pipelines and memory, part of every `ms`.
    pub setup_ms: f64,
    /// The finished picture against the f64 renderer on the decoded samples: what f32 does.
    pub arithmetic: PictureErrors,
    /// The f64 renderer on decoded against uncompressed samples: what the rate does.
    pub compression: PictureErrors,
    pub points: Vec<Point>,
}

impl Curve {
    /// The setting in words.
    pub fn label(&self) -> String {
        format!("{}, {}, {} bit/voxel", self.strategy, self.residency.name(), self.rate)
    }

    /// Everything but the setting.
    pub fn scene(&self) -> (&str, [f64; 2], [u32; 2]) {
        (&self.volume, self.view, self.size)
    }

    /// A line for the terminal.
    pub fn line(&self) -> String {
        let (ms, psnr) = self.points.last().map_or((0.0, 0.0), |p| (p.ms, p.errors.psnr));
        let [width, height] = self.size;
        format!(
            "{width}x{height} {}: {} passes, {ms:.0} ms, {psnr:.1} dB",
            self.label(),
            self.passes
        )
    }
}
