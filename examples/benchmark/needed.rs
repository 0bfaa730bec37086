//! What a finished picture needs, counted on the CPU without the renderer.

use std::sync::{Mutex, PoisonError};

use serde::Serialize;

use crate::cpu_renderer::PictureRays;
use crate::cpu_volume::for_each;
use crate::cpu_walk::{Surface, Visitor};

/// Counts over all rays of a picture.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Needed {
    /// Blocks with a sample of a dual cell that a ray visits in an active block, up to and including
    /// its first hit.
    pub blocks: u64,
    /// Dual cells with samples on both sides that rays visit, once per ray.
    pub intersections: u64,
}

/// Marks blocks while rays walk.
struct Marks {
    blocks: [usize; 3],
    bits: Vec<u64>,
    intersections: u64,
}

impl Marks {
    fn new(dims: [usize; 3]) -> Self {
        let blocks = dims.map(|n| n.div_ceil(4));
        let bits = vec![0; blocks.iter().product::<usize>().div_ceil(64)];
        Self { blocks, bits, intersections: 0 }
    }

    fn add(&mut self, other: &Self) {
        self.bits.iter_mut().zip(&other.bits).for_each(|(a, b)| *a |= b);
        self.intersections += other.intersections;
    }
}

impl Visitor for Marks {
    fn cell(&mut self, cell: [i32; 3], crosses: bool) {
        self.intersections += u64::from(crosses);
        // Of the cell's lowest voxel and of its highest one: 1, 2, 4 or 8 blocks.
        let [low, high] = [0, 1].map(|offset| cell.map(|c| ((c + offset) >> 2) as usize));
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    let index = x + self.blocks[0] * (y + self.blocks[1] * z);
                    self.bits[index / 64] |= 1 << (index % 64);
                }
            }
        }
    }
}

/// Walks all rays of a picture.
pub fn needed(surface: &Surface<'_>, rays: &PictureRays) -> Needed {
    let dims = surface.volume.dims();
    let [width, height] = rays.size();
    let total = Mutex::new(Marks::new(dims));
    let rows_each = height.div_ceil(16);
    for_each((0..height).step_by(rows_each as usize), |first| {
        let mut marks = Marks::new(dims);
        for y in first..(first + rows_each).min(height) {
            for x in 0..width {
                surface.trace(&rays.ray([x, y]), &mut marks);
            }
        }
        total.lock().unwrap_or_else(PoisonError::into_inner).add(&marks);
    });
    let total = total.into_inner().unwrap_or_else(PoisonError::into_inner);
    let blocks = total.bits.iter().map(|word| u64::from(word.count_ones())).sum();
    Needed { blocks, intersections: total.intersections }
}
