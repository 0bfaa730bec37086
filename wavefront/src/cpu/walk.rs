//! Twin of `shader/start.wgsl`, `walk.wgsl` and the geometry of `resolve.wgsl`, with every sample at
//! hand: a ray's first hit.

use macrocell::Grid;
use macrocell::cpu::dda::{CellBox, Ray};
use macrocell::cpu::skip::{Masks, Place, advance, enter};

use super::block_walk::{self, BlockWalk, Crossing, Step, block_walk};
use super::cell;

/// A ray's first hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Dual cell.
    pub cell: [i32; 3],
    /// Parameter along the ray, voxels.
    pub t: f32,
    /// Gradient of the field, per voxel.
    pub gradient: [f32; 3],
}

/// Parameter and gradient of a crossing.
pub fn resolve(ray: &Ray, crossing: &Crossing) -> Hit {
    let Crossing { place, exit, corners, bernstein, bracket, inside_low } = *crossing;
    let s = cell::root(bernstein, bracket, inside_low);
    let low = cell::local(ray, place.event, place.cell);
    let high = cell::local(ray, exit, place.cell);
    let position = std::array::from_fn(|a| low[a] * (1.0 - s) + high[a] * s);
    Hit {
        cell: place.cell,
        t: cell::parameter(place.event, exit, s),
        gradient: corners.gradient(position),
    }
}

fn volume(grid: &Grid) -> CellBox {
    CellBox { low: [0; 3], high: grid.last_cell() }
}

fn start(grid: &Grid, ray: &Ray) -> Option<Place> {
    let bounds = volume(grid);
    if grid.last_cell().iter().any(|&last| last < 0) {
        return None;
    }
    enter(ray, bounds)
}

/// The first hit of a ray, skipping what the masks call inactive. `sample` gives the value at a voxel.
pub fn first_hit(
    grid: &Grid,
    masks: &Masks,
    ray: &Ray,
    isovalue: f32,
    sample: &impl Fn([i32; 3]) -> f32,
) -> Option<Hit> {
    let mut place = start(grid, ray)?;
    loop {
        place = advance(grid, masks, ray, place)?;
        let bounds = CellBox::around(place.cell, 2, grid.last_cell());
        match block_walk(ray, place, bounds, isovalue, sample) {
            BlockWalk::Hit(crossing) => return Some(resolve(ray, &crossing)),
            BlockWalk::Left(next) => place = next,
        }
    }
}

/// Every dual cell on a ray's way through the volume, in order.
pub fn steps(
    grid: &Grid,
    ray: &Ray,
    isovalue: f32,
    sample: &impl Fn([i32; 3]) -> f32,
) -> Vec<Step> {
    let mut steps = Vec::new();
    let mut next = start(grid, ray);
    while let Some(place) = next.filter(|place| volume(grid).contains(place.cell)) {
        let step = block_walk::step(ray, place, isovalue, sample);
        steps.push(step);
        let cell = block_walk::next(ray, place.cell, step.exit);
        next = (cell != place.cell).then_some(Place { event: step.exit, cell });
    }
    steps
}

/// The cells of [`steps`] in which the ray crosses the surface, with the number of crossings.
///
/// # Errors
/// Where the walk leaks: a cell whose sides do not join those of its neighbours, or whose crossings do not
/// add up to its sides.
pub fn crossings(steps: &[Step]) -> Result<Vec<([i32; 3], usize)>, String> {
    let mut found = Vec::new();
    for (n, step) in steps.iter().enumerate() {
        if n > 0 && steps[n - 1].inside_high != step.inside_low {
            return Err(format!("{:?} and {step:?} see different sides", steps[n - 1]));
        }
        let count = match step.bernstein {
            Some(b) => {
                let all = cell::crossings(b, step.inside_low, step.inside_high);
                if all.first().copied()
                    != cell::first_crossing(b, step.inside_low, step.inside_high)
                {
                    return Err(format!("the first of {all:?} is not the first"));
                }
                all.len()
            }
            None => 0,
        };
        if count % 2 != usize::from(step.inside_low != step.inside_high) {
            return Err(format!("{count} crossings in {step:?}"));
        }
        if count > 0 {
            found.push((step.place.cell, count));
        }
    }
    Ok(found)
}
