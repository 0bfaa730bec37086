//! Twin of `shader/lib/macrocell_skip.wgsl`: advancing to the next active block. The shader goes from
//! block to block where the twin goes by cells: the blocks and the crossings are the same.

use super::dda::{CellBox, Event, Ray, START};
use crate::Grid;

/// Where a walk stands: `cell` was reached by `event`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The crossing (or start) that led into `cell`.
    pub event: Event,
    /// Dual cell.
    pub cell: [i32; 3],
}

/// Active masks: one 64-bit mask per coarse cell, then one per third-level cell where there are any.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Masks {
    /// Bit `x + 4y + 16z` stands for that child.
    pub words: Vec<u64>,
}

fn bit(mask: u64, position: [i32; 3]) -> bool {
    let bit = (position[0] & 3) | ((position[1] & 3) << 2) | ((position[2] & 3) << 4);
    (mask >> bit) & 1 != 0
}

impl Masks {
    /// First block and last dual cell, on each axis, of the box of all active blocks, to the granularity of
    /// the coarsest level's children; twin of `shader/active_box.wgsl`.
    pub fn active_box(&self, grid: &Grid) -> [[i32; 3]; 2] {
        let third = grid.has_third_level();
        let (first, edge) = if third { (grid.coarse_count(), 4) } else { (0, 1) };
        let (mut low, mut high) = ([1 << 24; 3], [0; 3]);
        for (index, &mask) in (0u64..).zip(&self.words[first as usize..]) {
            let cell = if third { grid.third_position(index) } else { grid.coarse_position(index) };
            for child in (0..64u32).filter(|child| (mask >> child) & 1 != 0) {
                for axis in 0..3 {
                    let place = (4 * cell[axis] + ((child >> (2 * axis)) & 3)) as i32;
                    low[axis] = low[axis].min(place);
                    high[axis] = high[axis].max(place + 1);
                }
            }
        }
        let last = grid.last_cell();
        [low.map(|b| b * edge), std::array::from_fn(|a| (4 * edge * high[a] - 1).min(last[a]))]
    }

    /// What the GPU's buffer holds: the masks and the active box.
    pub fn buffer(&self, grid: &Grid) -> Vec<u64> {
        let [first, last] = self.active_box(grid).map(|v| v.map(|v| u64::from(v as u32)));
        let third = u64::from(grid.has_third_level());
        let mut words = self.words.clone();
        words.extend([
            first[0] | first[1] << 32,
            first[2] | third << 32,
            last[0] | last[1] << 32,
            last[2],
        ]);
        words
    }

    /// Whether the block is active.
    pub fn block_active(&self, grid: &Grid, block: [u32; 3]) -> bool {
        let coarse = block.map(|b| b / 4);
        bit(self.words[grid.coarse_index(coarse) as usize], block.map(|b| b as i32))
    }

    /// Size, as a power of two, of the largest box around the cell without active blocks; 0 if its block is active.
    pub fn empty_level(&self, grid: &Grid, cell: [i32; 3]) -> u32 {
        let coarse = cell.map(|c| c >> 4);
        if grid.has_third_level() {
            let third = cell.map(|c| (c >> 6) as u32);
            let index = grid.coarse_count() + grid.third_index(third);
            let mask = self.words[index as usize];
            if mask == 0 {
                return 6;
            }
            if !bit(mask, coarse) {
                return 4;
            }
        }
        let mask = self.words[grid.coarse_index(coarse.map(|c| c as u32)) as usize];
        if mask == 0 {
            4
        } else if bit(mask, cell.map(|c| c >> 2)) {
            0
        } else {
            2
        }
    }
}

/// Leaves the box of `2^level` cells around the place.
pub fn leave(grid: &Grid, ray: &Ray, place: Place, level: u32) -> Place {
    let bounds = CellBox::around(place.cell, level, grid.last_cell());
    let event = ray.exit(bounds);
    if event.axis == START {
        return Place { event, cell: [-1; 3] };
    }
    Place { event, cell: ray.cell_after(event, bounds) }
}

/// Advances to the first cell, at or after `place`, of an active block; `None` when the ray leaves the volume.
pub fn advance(grid: &Grid, masks: &Masks, ray: &Ray, mut place: Place) -> Option<Place> {
    let volume = CellBox { low: [0; 3], high: grid.last_cell() };
    while volume.contains(place.cell) {
        match masks.empty_level(grid, place.cell) {
            0 => return Some(place),
            level => place = leave(grid, ray, place, level),
        }
    }
    None
}

/// The first place of the ray in `bounds`, if it meets it.
pub fn enter(ray: &Ray, bounds: CellBox) -> Option<Place> {
    if !ray.meets(bounds) {
        return None;
    }
    let event = ray.entry(bounds);
    Some(Place { event, cell: ray.cell_after(event, bounds) })
}
