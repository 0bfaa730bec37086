//! The held-out volumes and how the camera moves.

use progressive_iso::{Camera, CompressedVolume};

use crate::support::{Failure, camera_at};

/// Volumes that no training picture shows: the bundled scan, kinds that were never trained on, and other seeds of kinds
/// that were. With each the radius, as a share of the volume's own, of the ball that the camera holds in the picture: so
/// close that the first pass of 640x360 pixels ends near 85 % of the pixels, the first cut.
pub const VIEWS: [(&str, f64); 6] = [
    ("brain", 0.52),
    ("tubes", 0.84),
    ("gyroid", 0.88),
    ("turbulence", 0.85),
    ("blobs", 0.79),
    ("sheets", 0.88),
];

/// Seed of the generated ones; `infill/training/splits.json` uses the seeds 1 to 3 to draw others.
const SEED: u32 = 20_001;
/// Their voxels on each axis and the rate of their streams in bits per voxel.
pub const EDGE: u32 = 192;
const RATE: f64 = 8.0;

const FIELD_OF_VIEW_DEGREES: f64 = 50.0;
const ELEVATION_DEGREES: f64 = 20.0;
const FIRST_AZIMUTH_DEGREES: f64 = 30.0;
/// Share of the isovalue from the middle of a sequence with a jump on.
const JUMP: f32 = 0.95;

/// What changes from frame to frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Degrees per frame.
    Orbit(f64),
    Static,
    /// An orbit of one degree per frame with another isovalue from the middle on.
    IsovalueJump,
}

impl Motion {
    pub fn degrees(self) -> f64 {
        match self {
            Self::Orbit(degrees) => degrees,
            Self::Static => 0.0,
            Self::IsovalueJump => 1.0,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Orbit(_) => "orbit",
            Self::Static => "static",
            Self::IsovalueJump => "isovalue-jump",
        }
    }
}

/// A volume and its surface.
pub struct Subject {
    pub name: &'static str,
    pub volume: CompressedVolume,
    isovalue: f32,
    /// Of [`VIEWS`].
    closeness: f64,
}

impl Subject {
    /// One of [`VIEWS`], with `edge` voxels on each axis if it is generated.
    pub fn new((name, closeness): (&'static str, f64), edge: u32) -> Result<Self, Failure> {
        if name == "brain" {
            let volume = CompressedVolume::try_from(&volumes::brain())?;
            return Ok(Self { name, volume, isovalue: volumes::BRAIN_ISOVALUE, closeness });
        }
        let dims = [edge; 3];
        let field = volumes::by_name_with_seed(name, dims, SEED)?;
        let volume = CompressedVolume::try_from(&volumes::generate(&*field, dims, RATE)?)?;
        Ok(Self { name, volume, isovalue: field.suggested_isovalue() as f32, closeness })
    }

    /// Camera and isovalue of a frame.
    pub fn view(&self, motion: Motion, frame: u32, frames: u32, size: [u32; 2]) -> (Camera, f32) {
        let (_, radius) = self.volume.bounding_ball();
        let azimuth = FIRST_AZIMUTH_DEGREES + motion.degrees() * f64::from(frame);
        let fov = FIELD_OF_VIEW_DEGREES;
        let distance = self.closeness * radius / (fov.to_radians() / 2.0).sin();
        let angles = [azimuth, ELEVATION_DEGREES];
        let camera = camera_at(&self.volume, angles, distance, fov, size, 4.0);
        let jumped = motion == Motion::IsovalueJump && 2 * frame >= frames;
        (camera, self.isovalue * if jumped { JUMP } else { 1.0 })
    }
}
