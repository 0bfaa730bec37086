//! Twin of `shader/lib/frame.wgsl`: the ray of a pixel.

use macrocell::cpu::dda::Ray;

use crate::FrameParams;

/// A pixel's ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameRay {
    /// Unit direction: t is in voxels.
    pub ray: Ray,
    /// View depth in world units gained per voxel along the ray.
    pub depth_per_voxel: f32,
}

impl FrameRay {
    /// The ray through the centre of `pixel`.
    pub fn new(frame: &FrameParams, pixel: [u32; 2]) -> Self {
        let size = [frame.width, frame.height];
        let offset = [0, 1].map(|a| pixel[a] as f32 + 0.5 - 0.5 * size[a] as f32);
        let affine = |v: [f32; 3], dx: [f32; 3], dy: [f32; 3]| -> [f32; 3] {
            std::array::from_fn(|i| v[i] + offset[0] * dx[i] + offset[1] * dy[i])
        };
        let origin = affine(frame.origin, frame.origin_dx, frame.origin_dy);
        let d = affine(frame.direction, frame.direction_dx, frame.direction_dy);
        let depth_per_voxel = 1.0 / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        Self { ray: Ray::new(origin, d.map(|v| v * depth_per_voxel)), depth_per_voxel }
    }

    /// View depth at parameter `t`.
    pub fn depth(&self, frame: &FrameParams, t: f32) -> f32 {
        frame.start_depth + t * self.depth_per_voxel
    }
}
