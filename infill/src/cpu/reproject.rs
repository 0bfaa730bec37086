//! Twin of `shader/scatter.wgsl`: the hits of the previous frame in the picture of this one.

use macrocell::Grid;
use macrocell::cpu::dda::CellBox;
use wavefront::FrameParams;
use wavefront::cpu::frame::FrameRay;
use wavefront::cpu::shading::{self, dot};

use super::candidate::{Candidate, pack_normal, unpack_normal};

/// What stands for a pixel that no hit falls on.
pub const EMPTY: u32 = u32::MAX;

/// Steps of a depth: 16 bits over the volume's diagonal, the last one kept for [`EMPTY`].
const DEPTH_STEPS: f32 = 65534.0;

/// How much nearer in voxels than the nearest possible hit a point may be: it stands for the surface somewhere in
/// a pixel of the other picture.
const SLACK: f32 = 1.0;

/// Diagonal of the volume in voxels: no ray is longer inside it.
pub fn diagonal(grid: &Grid) -> f32 {
    grid.dims().iter().map(|&d| d as f32 * d as f32).sum::<f32>().sqrt()
}

/// A hit of the previous frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OldHit {
    /// Index-space position.
    pub position: [f32; 3],
    /// World-space unit normal.
    pub normal: [f32; 3],
}

/// Where a hit falls in this frame: its pixel and its key, in which the depth behind the ray's entry into the volume
/// lies above the normal, so that the least key is that of the nearest hit.
pub fn key(
    frame: &FrameParams,
    grid: &Grid,
    pixel_from_index: &[[f32; 4]; 4],
    shading: &wavefront::ShadingParams,
    hit: &OldHit,
) -> Option<([u32; 2], u32)> {
    let [x, y, z] = hit.position;
    let [column, row, w, depth] = pixel_from_index.map(|r| r[0] * x + r[1] * y + r[2] * z + r[3]);
    let place = [column / w, row / w];
    let size = frame.size().map(|s| s as f32);
    let inside = w > 0.0 && (0..2).all(|a| place[a] >= 0.0 && place[a] < size[a]);
    if !inside {
        return None;
    }
    let pixel = place.map(|p| p as u32);
    let frame_ray = FrameRay::new(frame, pixel);
    let ray = frame_ray.ray;
    let volume = CellBox { low: [0; 3], high: grid.last_cell() };
    let to_viewer = shading::to_viewer(shading, ray.direction);
    if !ray.meets(volume) || dot(hit.normal, to_viewer) <= 0.0 {
        return None;
    }
    let behind = frame_ray.t(frame, depth) - ray.entry(volume).t;
    let share = (behind / diagonal(grid)).clamp(0.0, 1.0);
    Some((pixel, ((share * DEPTH_STEPS + 0.5) as u32) << 16 | pack_normal(hit.normal) >> 16))
}

/// The candidate that a pixel's least key stands for; none where it would have been found already, which is nearer
/// than `t_low`.
pub fn candidate(grid: &Grid, frame_ray: &FrameRay, key: u32, t_low: f32) -> Option<Candidate> {
    if key == EMPTY {
        return None;
    }
    let volume = CellBox { low: [0; 3], high: grid.last_cell() };
    let behind = (key >> 16) as f32 * (diagonal(grid) / DEPTH_STEPS);
    let distance = frame_ray.ray.entry(volume).t + behind - t_low;
    let normal = unpack_normal(key << 16);
    (distance >= -SLACK).then_some(Candidate { coverage: 1.0, normal, distance })
}
