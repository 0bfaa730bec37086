//! Cameras: where the viewer is and how view space is projected.

use glam::{DMat4, DVec3};

/// A right-handed camera, looking along -z of view space with +y up; clip space is WebGPU's
/// (y up, 0 <= z <= w, reversed and infinite depth allowed).
///
/// Matrices are column-major: `m[column][row]`. In f64, so that a far eye keeps its digits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// View space from world space.
    pub view_from_world: [[f64; 4]; 4],
    /// Clip space from view space; w must depend on z alone (any usual perspective, off-axis or
    /// parallel projection).
    pub clip_from_view: [[f64; 4]; 4],
}

impl Camera {
    /// A camera at `eye` that looks at `target`; perspective with the vertical field of view in
    /// degrees, `aspect` = width / height, near and far distance in world units.
    ///
    /// A degenerate `up` (parallel to the view) is replaced.
    #[must_use]
    pub fn perspective(
        eye: [f64; 3],
        target: [f64; 3],
        up: [f64; 3],
        vertical_fov_degrees: f64,
        aspect: f64,
        near: f64,
        far: f64,
    ) -> Self {
        let half = (vertical_fov_degrees.to_radians() / 2.0).tan();
        let k = far / (near - far);
        let clip_from_view = [
            [1.0 / (aspect * half), 0.0, 0.0, 0.0],
            [0.0, 1.0 / half, 0.0, 0.0],
            [0.0, 0.0, k, -1.0],
            [0.0, 0.0, k * near, 0.0],
        ];
        Self { view_from_world: look_at(eye, target, up), clip_from_view }
    }

    /// A parallel projection that shows `height` world units from bottom to top.
    #[must_use]
    pub fn orthographic(
        eye: [f64; 3],
        target: [f64; 3],
        up: [f64; 3],
        height: f64,
        aspect: f64,
        near: f64,
        far: f64,
    ) -> Self {
        let k = 1.0 / (near - far);
        let clip_from_view = [
            [2.0 / (height * aspect), 0.0, 0.0, 0.0],
            [0.0, 2.0 / height, 0.0, 0.0],
            [0.0, 0.0, k, 0.0],
            [0.0, 0.0, k * near, 1.0],
        ];
        Self { view_from_world: look_at(eye, target, up), clip_from_view }
    }

    /// A perspective camera on a sphere about `center`: azimuth and elevation in degrees, +y up;
    /// (0, 0) looks along -z. The distance is such that a ball of `radius` fills the frame's
    /// smaller side; near and far enclose it. A radius of 0, that of a volume of one voxel, counts as 1.
    #[must_use]
    pub fn orbit(
        center: [f64; 3],
        radius: f64,
        azimuth_degrees: f64,
        elevation_degrees: f64,
        vertical_fov_degrees: f64,
        aspect: f64,
    ) -> Self {
        let radius = if radius == 0.0 { 1.0 } else { radius };
        let half = (vertical_fov_degrees.to_radians() / 2.0).min(1.5);
        let half = half.min((half.tan() * aspect).atan());
        let distance = radius / half.sin();
        let (azimuth, elevation) = (azimuth_degrees.to_radians(), elevation_degrees.to_radians());
        let away = DVec3::new(
            azimuth.sin() * elevation.cos(),
            elevation.sin(),
            azimuth.cos() * elevation.cos(),
        );
        let up = if elevation.cos().abs() > 1e-9 { DVec3::Y } else { -DVec3::Z };
        let eye = DVec3::from(center) + away * distance;
        let near = (distance - radius * 1.01).max(distance * 1e-3);
        let far = distance + radius * 1.01;
        Self::perspective(
            eye.to_array(),
            center,
            up.to_array(),
            vertical_fov_degrees,
            aspect,
            near,
            far,
        )
    }

    /// From f32 matrices, column-major.
    #[must_use]
    pub fn from_f32(view_from_world: [[f32; 4]; 4], clip_from_view: [[f32; 4]; 4]) -> Self {
        let wide = |m: [[f32; 4]; 4]| m.map(|column| column.map(f64::from));
        Self { view_from_world: wide(view_from_world), clip_from_view: wide(clip_from_view) }
    }
}

fn look_at(eye: [f64; 3], target: [f64; 3], up: [f64; 3]) -> [[f64; 4]; 4] {
    let (eye, target, up) = (DVec3::from(eye), DVec3::from(target), DVec3::from(up));
    let back = (eye - target).try_normalize().unwrap_or(DVec3::Z);
    let right = up
        .cross(back)
        .try_normalize()
        .filter(|_| up.normalize_or_zero().cross(back).length() > 1e-9)
        .unwrap_or_else(|| back.any_orthonormal_vector());
    let up = back.cross(right);
    let rotation = DMat4::from_cols(
        DVec3::new(right.x, up.x, back.x).extend(0.0),
        DVec3::new(right.y, up.y, back.y).extend(0.0),
        DVec3::new(right.z, up.z, back.z).extend(0.0),
        glam::DVec4::W,
    );
    (rotation * DMat4::from_translation(-eye)).to_cols_array_2d()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(camera: &Camera, p: [f64; 3]) -> [f64; 3] {
        DMat4::from_cols_array_2d(&camera.view_from_world).transform_point3(p.into()).to_array()
    }

    #[test]
    fn orbit_zero_looks_along_minus_z_with_y_up() {
        let camera = Camera::orbit([1.0, 2.0, 3.0], 10.0, 0.0, 0.0, 40.0, 1.5);
        let center = view(&camera, [1.0, 2.0, 3.0]);
        assert!(center[0].abs() < 1e-9 && center[1].abs() < 1e-9 && center[2] < -10.0);
        assert!(view(&camera, [1.0, 3.0, 3.0])[1] > 0.99);
        assert!(view(&camera, [2.0, 2.0, 3.0])[0] > 0.99);
        assert!(view(&camera, [1.0, 2.0, 4.0])[2] > center[2]);
    }

    #[test]
    fn perspective_maps_near_and_far_to_0_and_1() {
        let camera =
            Camera::perspective([0.0, 0.0, 5.0], [0.0; 3], [0.0, 1.0, 0.0], 60.0, 1.0, 2.0, 9.0);
        let clip = DMat4::from_cols_array_2d(&camera.clip_from_view);
        for (z, expected) in [(-2.0, 0.0), (-9.0, 1.0)] {
            let p = clip * glam::DVec4::new(0.3, 0.1, z, 1.0);
            assert!((p.z / p.w - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn up_parallel_to_the_view_still_gives_a_rotation() {
        let camera =
            Camera::perspective([0.0, 5.0, 0.0], [0.0; 3], [0.0, 1.0, 0.0], 60.0, 1.0, 1.0, 9.0);
        let m = DMat4::from_cols_array_2d(&camera.view_from_world);
        assert!((m.determinant() - 1.0).abs() < 1e-9);
    }
}
