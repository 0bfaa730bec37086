//! Twin of `shader/lib/frame.wgsl`: the ray of a pixel.

use macrocell::cpu::dda::{CellBox, Ray};

use crate::plan::RAYS_HEADER_WORDS;
use crate::{FrameParams, RayOrder};

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
        let offset = [0, 1].map(|a| frame.step * pixel[a] as f32 + 0.5 - frame.middle[a]);
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

    /// Parameter at a view depth.
    pub fn t(&self, frame: &FrameParams, depth: f32) -> f32 {
        (depth - frame.start_depth) / self.depth_per_voxel
    }
}

/// First word of the box of the active blocks, `RAYS_BOX`.
const BOX_WORD: usize = size_of::<crate::Counters>() / 4;

/// The rays' states, as read back from [`crate::RayBuffers::rays`].
#[derive(Clone, Copy, Debug)]
pub struct RayStates<'a> {
    frame: &'a FrameParams,
    order: RayOrder,
    words: &'a [u32],
}

impl<'a> RayStates<'a> {
    /// The words of the buffer of a frame's rays.
    pub fn new(frame: &'a FrameParams, words: &'a [u32]) -> Self {
        Self {
            frame,
            order: RayOrder::of(frame.ray_level, frame.ray_columns, frame.ray_numbers),
            words,
        }
    }

    /// Bytes of header, states and active bits of rays with so many numbers.
    #[must_use]
    pub fn bytes(numbers: u64) -> u64 {
        4 * (RAYS_HEADER_WORDS + numbers + numbers / 32)
    }

    /// Whether a pixel's ray is not finished.
    pub fn is_active(&self, pixel: [u32; 2]) -> bool {
        let number = self.order.number(pixel) as usize;
        let first = RAYS_HEADER_WORDS as usize + self.frame.ray_numbers as usize;
        (self.words[first + number / 32] >> (number % 32)) & 1 != 0
    }

    fn state(&self, pixel: [u32; 2]) -> u32 {
        self.words[RAYS_HEADER_WORDS as usize + self.order.number(pixel) as usize]
    }

    /// The block in which an active ray that has started waits.
    pub fn block(&self, pixel: [u32; 2]) -> [i32; 3] {
        let FrameParams { shift_y, shift_z, shift_misses, .. } = *self.frame;
        let state = self.state(pixel);
        let place = |from: u32, to: u32| ((state & ((1 << to) - 1)) >> from) as i32;
        [place(0, shift_y), place(shift_y, shift_z), place(shift_z, shift_misses)]
    }

    /// Where an active ray enters the block in which it waits, or the box of the active blocks if it has not
    /// started: no hit is nearer.
    pub fn t_low(&self, pixel: [u32; 2]) -> f32 {
        let ray = FrameRay::new(self.frame, pixel).ray;
        let cells = if self.state(pixel) == 0 {
            let cell = |first: usize| std::array::from_fn(|a| self.words[first + a] as i32);
            CellBox { low: cell(BOX_WORD), high: cell(BOX_WORD + 3) }
        } else {
            let cell = self.block(pixel).map(|b| 4 * b);
            CellBox::around(cell, 2, self.frame.grid.last_cell)
        };
        ray.entry(cells).t
    }
}
