//! The viewer's camera: an orbit around a point that can be moved.

use progressive_iso::Camera;

/// Vertical field of view in degrees.
const FIELD_OF_VIEW: f64 = 40.0;
/// Nearest and farthest eye, in radii of the volume.
const DISTANCES: [f64; 2] = [0.05, 50.0];
/// Most radii that the target is away from the volume's centre, on each axis.
const FARTHEST_TARGET: f64 = 4.0;
/// Elevation in degrees beyond which "up" would turn over.
const STEEPEST: f64 = 89.0;
/// Decimals that views are kept with, so that a link holds the same view as the page.
const DECIMALS: f64 = 1e4;

/// Where the viewer is, relative to the ball around the volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// Degrees around the world's z axis, which is up, as in scans of heads and bodies; 0 looks along -y.
    pub azimuth: f64,
    /// Degrees above the plane of x and y.
    pub elevation: f64,
    /// Eye to target, in radii of the volume.
    pub distance: f64,
    /// Target, in radii from the volume's centre.
    pub target: [f64; 3],
}

impl Default for Orbit {
    /// The whole volume, from the front and a little above.
    fn default() -> Self {
        Self { azimuth: 30.0, elevation: 20.0, distance: 2.0, target: [0.0; 3] }
    }
}

impl Orbit {
    /// The same view with every number in its range and rounded.
    #[must_use]
    pub fn settled(self) -> Self {
        let round = |x: f64| (x * DECIMALS).round() / DECIMALS;
        let [near, far] = DISTANCES;
        Self {
            azimuth: round((self.azimuth + 180.0).rem_euclid(360.0) - 180.0),
            elevation: round(self.elevation.clamp(-STEEPEST, STEEPEST)),
            distance: round(self.distance.clamp(near, far)),
            target: self.target.map(|t| round(t.clamp(-FARTHEST_TARGET, FARTHEST_TARGET))),
        }
    }

    /// Turns by shares of the picture's height: a drag over the whole height is half a turn.
    #[must_use]
    pub fn turned(self, right: f64, down: f64) -> Self {
        let (azimuth, elevation) = (self.azimuth + 180.0 * right, self.elevation + 180.0 * down);
        Self { azimuth, elevation, ..self }.settled()
    }

    /// Moves the target by shares of the picture's height, so that it follows a drag.
    #[must_use]
    pub fn moved(self, right: f64, down: f64) -> Self {
        let height = 2.0 * self.distance * (FIELD_OF_VIEW.to_radians() / 2.0).tan();
        let [x_axis, y_axis, _] = self.axes();
        let target =
            [0, 1, 2].map(|i| self.target[i] + height * (down * y_axis[i] - right * x_axis[i]));
        Self { target, ..self }.settled()
    }

    /// Comes nearer by a factor.
    #[must_use]
    pub fn zoomed(self, factor: f64) -> Self {
        let factor = if factor.is_finite() && factor > 0.0 { factor } else { 1.0 };
        Self { distance: self.distance / factor, ..self }.settled()
    }

    /// Axes of view space in the world: right, up, towards the viewer.
    fn axes(self) -> [[f64; 3]; 3] {
        let (azimuth, elevation) = (self.azimuth.to_radians(), self.elevation.to_radians());
        let ((sin_a, cos_a), (sin_e, cos_e)) = (azimuth.sin_cos(), elevation.sin_cos());
        [
            [-cos_a, sin_a, 0.0],
            [-sin_a * sin_e, -cos_a * sin_e, cos_e],
            [sin_a * cos_e, cos_a * cos_e, sin_e],
        ]
    }

    /// The camera for a volume in the ball of this centre and radius, and pictures of `size` pixels. In
    /// upright pictures the width counts, so that the volume stays within them.
    #[must_use]
    pub fn camera(self, (center, radius): ([f64; 3], f64), size: [u32; 2]) -> Camera {
        let aspect = f64::from(size[0]) / f64::from(size[1].max(1));
        let radius = if radius > 0.0 { radius } else { 1.0 };
        let [_, up, away] = self.axes();
        let distance = self.distance * radius / aspect.min(1.0);
        let target = [0, 1, 2].map(|i| center[i] + radius * self.target[i]);
        let eye = [0, 1, 2].map(|i| target[i] + distance * away[i]);
        // Nothing is cut off: rays start at the near distance and end with the volume.
        let far = distance + 8.0 * radius;
        Camera::perspective(eye, target, up, FIELD_OF_VIEW, aspect, 1e-4 * far, far)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BALL: ([f64; 3], f64) = ([1.0, 2.0, 3.0], 10.0);

    /// A world position in view space.
    fn view(camera: &Camera, p: [f64; 3]) -> [f64; 3] {
        let m = camera.view_from_world;
        [0, 1, 2].map(|r| m[0][r] * p[0] + m[1][r] * p[1] + m[2][r] * p[2] + m[3][r])
    }

    /// Position in the picture as shares of its height, from its centre to the right and down.
    fn seen(orbit: Orbit, size: [u32; 2], p: [f64; 3]) -> [f64; 2] {
        let camera = orbit.camera(BALL, size);
        let v = view(&camera, p);
        let scale = [camera.clip_from_view[0][0], camera.clip_from_view[1][1]];
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        [v[0] * scale[0] / -v[2] / 2.0 * aspect, -v[1] * scale[1] / -v[2] / 2.0]
    }

    #[test]
    fn the_volume_is_in_the_middle_and_fits() {
        for size in [[320, 240], [100, 400], [400, 100]] {
            let camera = Orbit::default().camera(BALL, size);
            let center = view(&camera, BALL.0);
            assert!(center[0].abs() < 1e-9 && center[1].abs() < 1e-9, "{center:?}");
            let smaller = camera.clip_from_view[0][0].min(camera.clip_from_view[1][1]);
            assert!(smaller * 0.7 * BALL.1 < -center[2], "{size:?}");
        }
    }

    #[test]
    fn what_is_dragged_follows() {
        let (orbit, size) = (Orbit::default(), [320, 240]);
        let before = seen(orbit, size, BALL.0);
        let after = seen(orbit.moved(0.1, 0.05), size, BALL.0);
        assert!((after[0] - before[0] - 0.1).abs() < 1e-3, "{after:?}");
        assert!((after[1] - before[1] - 0.05).abs() < 1e-3, "{after:?}");
        // The side that faces the viewer goes the way of the drag.
        let away = orbit.axes()[2];
        let front = [0, 1, 2].map(|i| BALL.0[i] + BALL.1 * away[i]);
        let turned = seen(orbit.turned(0.1, 0.05), size, front);
        assert!(turned[0] > 0.05 && turned[1] > 0.02, "{turned:?}");
    }

    #[test]
    fn zooming_changes_the_distance_and_keeps_its_range() {
        let orbit = Orbit::default();
        assert_eq!(orbit.zoomed(2.0).distance, orbit.distance / 2.0);
        for factor in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(orbit.zoomed(factor), orbit);
        }
        assert_eq!(orbit.zoomed(1e9).distance, DISTANCES[0]);
        assert_eq!(orbit.zoomed(1e-9).distance, DISTANCES[1]);
    }

    #[test]
    fn views_stay_in_range_and_axes_stay_orthonormal() {
        let mut orbit = Orbit::default();
        for step in 0..200 {
            orbit = orbit.turned(0.37, -0.21 * f64::from(step % 7 - 3)).moved(0.4, 0.3);
            assert_eq!(orbit, orbit.settled());
            assert!(orbit.azimuth.abs() <= 180.0 && orbit.elevation.abs() <= STEEPEST);
            let axes = orbit.axes();
            let dot = |a: usize, b: usize| (0..3).map(|i| axes[a][i] * axes[b][i]).sum::<f64>();
            for a in 0..3 {
                for b in 0..3 {
                    assert!((dot(a, b) - f64::from(u8::from(a == b))).abs() < 1e-12);
                }
            }
        }
    }
}
