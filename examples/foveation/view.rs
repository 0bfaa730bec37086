//! A volume, the camera on its orbit and the moving gaze.

use progressive_iso::{Camera, CompressedVolume, Foveation};
use serde::{Deserialize, Serialize};

use crate::sets::SIGMA;
use crate::support::subject::{Subject, stream};
use crate::support::{Failure, camera_at};

const FIELD_OF_VIEW_DEGREES: f64 = 50.0;
const ELEVATION_DEGREES: f64 = 15.0;
const FIRST_AZIMUTH_DEGREES: f64 = 20.0;
/// Between the frames of an orbit.
const STEP_DEGREES: f64 = 1.0;
/// Shares of the picture's edges from its middle within which the gaze moves, and its radians per frame.
const GAZE_REACH: f32 = 0.2;
const GAZE_STEP: f32 = 0.7;

/// Where the camera is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Place {
    /// Far enough to see the whole volume.
    Far,
    /// As far from the middle as the volume's corners: it covers the picture.
    Near,
}

/// A volume and its surface.
pub struct Volume {
    pub name: String,
    pub compressed: CompressedVolume,
    pub isovalue: f32,
}

impl Volume {
    pub fn new(subject: &Subject) -> Result<Self, Failure> {
        let (zfp, isovalue) = stream(subject)?;
        let compressed = CompressedVolume::try_from(&zfp)?;
        Ok(Self { name: subject.name(), compressed, isovalue })
    }

    /// The camera of a frame of the orbit.
    pub fn camera(&self, place: Place, frame: u32, size: [u32; 2]) -> Camera {
        let (center, radius) = self.compressed.bounding_ball();
        let azimuth = FIRST_AZIMUTH_DEGREES + STEP_DEGREES * f64::from(frame);
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let (elevation, fov) = (ELEVATION_DEGREES, FIELD_OF_VIEW_DEGREES);
        if place == Place::Far {
            return Camera::orbit(center, radius, azimuth, elevation, fov, aspect);
        }
        camera_at(&self.compressed, [azimuth, elevation], radius, fov, size, 2.01)
    }
}

/// What is foveated in a frame of an orbit.
pub fn foveation(frame: u32, base_density: f32) -> Foveation {
    let angle = GAZE_STEP * frame as f32;
    let gaze = [angle.cos(), angle.sin()].map(|v| 0.5 + GAZE_REACH * v);
    Foveation { gaze, sigma: SIGMA, base_density, ..Foveation::default() }
}

/// Which pixels lie within a standard deviation of the gaze.
pub fn fovea(foveation: &Foveation, size: [u32; 2]) -> Vec<bool> {
    let inside = |x: u32, y: u32| {
        let share = |p: u32, axis: usize| (p as f32 + 0.5) / size[axis] as f32;
        let r = [share(x, 0) - foveation.gaze[0], share(y, 1) - foveation.gaze[1]];
        r[0] * r[0] + r[1] * r[1] <= foveation.sigma
    };
    (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| inside(x, y))).collect()
}
