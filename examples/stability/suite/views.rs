//! Cameras of the cases.

use progressive_iso::Camera;

use super::case::{View, Volume};

/// How much is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// For the test suite.
    Reduced,
    /// For the example.
    Full,
}

impl Effort {
    /// Pictures whose sides are no multiples of a tile.
    pub fn size(self) -> [u32; 2] {
        match self {
            Self::Reduced => [39, 27],
            Self::Full => [101, 77],
        }
    }
}

pub fn aspect(size: [u32; 2]) -> f64 {
    f64::from(size[0]) / f64::from(size[1])
}

pub fn view(camera: Camera, size: [u32; 2]) -> View {
    View { camera, size, stride: 1 }
}

/// From two sides, from inside, and along every axis with rays on voxel planes.
pub fn all_around(volume: &Volume, effort: Effort) -> Vec<View> {
    let size = effort.size();
    let mut views = vec![
        orbit(volume, [33.0, 21.0], 40.0, size),
        orbit(volume, [-127.0, -48.0], 40.0, size),
        inside(volume, [0.47, 0.55, 0.41], [0.9, 0.45, 0.2], size),
    ];
    views.extend((0..3).map(|axis| along_axis(volume, axis, axis == 1, 4.0, size)));
    views
}

/// The volume fitted to the picture.
pub fn orbit(volume: &Volume, [azimuth, elevation]: [f64; 2], fov: f64, size: [u32; 2]) -> View {
    let (center, radius) = volume.compressed.bounding_ball();
    let camera = Camera::orbit(center, radius * 0.8, azimuth, elevation, fov, aspect(size));
    view(camera, size)
}

/// A wide view from one place to another, both as shares of the extent.
pub fn inside(volume: &Volume, eye: [f64; 3], target: [f64; 3], size: [u32; 2]) -> View {
    let at = |share: [f64; 3]| [0, 1, 2].map(|a| share[a] * (f64::from(volume.dims[a]) - 1.0));
    looking(volume, at(eye), at(target), 75.0, size)
}

/// A perspective view from one index-space position towards another.
pub fn looking(volume: &Volume, eye: [f64; 3], target: [f64; 3], fov: f64, size: [u32; 2]) -> View {
    let (_, radius) = volume.compressed.bounding_ball();
    let (eye, target) = (volume.world(eye), volume.world(target));
    let distance = (0..3).map(|a| (eye[a] - target[a]).powi(2)).sum::<f64>().sqrt();
    let (near, far) = (1e-3 * radius.max(1.0), 4.0 * radius + 2.0 * distance);
    let camera = Camera::perspective(eye, target, [0.1, 1.0, 0.2], fov, aspect(size), near, far);
    view(camera, size)
}

/// A parallel view along an axis of an axis-aligned volume: pixel centres are `1 / per_voxel` voxels
/// apart, and one of them is on a vertex.
pub fn along_axis(
    volume: &Volume,
    axis: usize,
    backwards: bool,
    per_voxel: f64,
    size: [u32; 2],
) -> View {
    // Pictures of odd size have a pixel at the centre.
    let size = size.map(|n| n | 1);
    let center = volume.middle().map(f64::floor);
    parallel(volume, center, axis_direction(axis, backwards), per_voxel, size)
}

pub fn axis_direction(axis: usize, backwards: bool) -> [f64; 3] {
    let mut direction = [0.0; 3];
    direction[axis] = if backwards { -1.0 } else { 1.0 };
    direction
}

/// A parallel view along an index-space direction through `center`; pixels are `1 / per_voxel` world
/// units apart.
pub fn parallel(
    volume: &Volume,
    center: [f64; 3],
    direction: [f64; 3],
    per_voxel: f64,
    size: [u32; 2],
) -> View {
    let (_, radius) = volume.compressed.bounding_ball();
    let reach = 2.0 * radius.max(1.0);
    let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
    let target = volume.world(center);
    let ahead = volume.world([0, 1, 2].map(|a| center[a] + direction[a] / length));
    let eye = [0, 1, 2].map(|a| target[a] - reach * (ahead[a] - target[a]));
    let up =
        if direction[0] == 0.0 && direction[2] == 0.0 { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] };
    let height = f64::from(size[1]) / per_voxel;
    let camera = Camera::orthographic(eye, target, up, height, aspect(size), 0.0, 2.0 * reach);
    view(camera, size)
}
