//! Recorded interaction: what a user does with a volume, second by second.

use progressive_iso::{Camera, CompressedVolume};

use crate::random::Random;
use crate::support::camera_at;

/// Frames that are shown in a second of the recording.
const FRAMES_PER_SECOND: u32 = 6;
const FIELD_OF_VIEW_DEGREES: f64 = 50.0;

/// What a frame shows.
#[derive(Clone, Copy, Debug)]
pub struct View {
    azimuth: f64,
    elevation: f64,
    /// Of the distance at which the whole volume is seen.
    distance: f64,
    /// Of the suggested isovalue.
    pub isovalue: f64,
}

/// What a user is doing, for about a second.
enum Action {
    Rotate([f64; 2]),
    Zoom(f64),
    Rest,
}

/// A recording of `seconds`, the same for the same seed: rotations, zooms, rests and jumps of the isovalue.
pub fn record(seconds: u32, seed: u64) -> Vec<View> {
    let mut random = Random::new(seed);
    let mut view = View { azimuth: 20.0, elevation: 15.0, distance: 1.0, isovalue: 1.0 };
    let (mut views, mut action, mut left) = (Vec::new(), Action::Rest, 0);
    for _ in 0..seconds * FRAMES_PER_SECOND {
        if left == 0 {
            left = 3 + random.below(FRAMES_PER_SECOND);
            action = match random.below(8) {
                0..=3 => Action::Rotate([random.between(-9.0, 9.0), random.between(-3.0, 3.0)]),
                4 | 5 => Action::Zoom(random.between(0.88, 1.13)),
                6 => Action::Rest,
                _ => {
                    view.isovalue = random.between(0.85, 1.1);
                    Action::Rest
                }
            };
        }
        left -= 1;
        match action {
            Action::Rotate([azimuth, elevation]) => {
                view.azimuth += azimuth;
                view.elevation = (view.elevation + elevation).clamp(-60.0, 60.0);
            }
            Action::Zoom(factor) => view.distance = (view.distance * factor).clamp(0.45, 1.6),
            Action::Rest => {}
        }
        views.push(view);
    }
    views
}

impl View {
    pub fn camera(&self, volume: &CompressedVolume, size: [u32; 2]) -> Camera {
        let (_, radius) = volume.bounding_ball();
        let fov = FIELD_OF_VIEW_DEGREES;
        let distance = self.distance * radius / (fov / 2.0).to_radians().sin();
        camera_at(volume, [self.azimuth, self.elevation], distance, fov, size, 6.0)
    }
}
