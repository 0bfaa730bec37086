//! Twin of `shader/lib/block_walk.wgsl`: a ray's way through the dual cells of one box.

use macrocell::cpu::dda::{CellBox, Event, Ray};
use macrocell::cpu::skip::Place;

use super::cell::{self, Bracket, Corners};

/// Where a walk through a box ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BlockWalk {
    /// At a crossing of the surface.
    Hit(Crossing),
    /// At the first cell after the box.
    Left(Place),
}

/// A dual cell in which the ray crosses the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// The cell and how it was entered.
    pub place: Place,
    /// Where the ray leaves it.
    pub exit: Event,
    /// Its corner values minus the isovalue.
    pub corners: Corners,
    /// The field along the ray inside it.
    pub bernstein: [f32; 4],
    /// Where the field changes sides.
    pub bracket: Bracket,
    /// The side on which the ray enters the cell.
    pub inside_low: bool,
}

/// One dual cell on a ray's way, with the sides on which it is entered and left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// The cell and how it was entered.
    pub place: Place,
    /// Where the ray leaves it.
    pub exit: Event,
    /// Its corner values minus the isovalue.
    pub corners: Corners,
    /// The field along the ray; `None` where the corners are all on one side.
    pub bernstein: Option<[f32; 4]>,
    /// The side at the entry as this cell sees it.
    pub inside_low: bool,
    /// The side at the exit.
    pub inside_high: bool,
}

/// The cell after `exit`.
pub fn next(ray: &Ray, cell: [i32; 3], exit: Event) -> [i32; 3] {
    let mut next = cell;
    if let Some(position) = next.get_mut(exit.axis as usize) {
        *position += if ray.direction[exit.axis as usize] < 0.0 { -1 } else { 1 };
    }
    next
}

/// Values of a dual cell's corners minus the isovalue.
pub fn corners(cell: [i32; 3], isovalue: f32, sample: &impl Fn([i32; 3]) -> f32) -> Corners {
    let face = |x: i32| {
        [[0, 0], [1, 0], [0, 1], [1, 1]]
            .map(|[y, z]| sample([cell[0] + x, cell[1] + y, cell[2] + z]) - isovalue)
    };
    Corners { low: face(0), high: face(1) }
}

/// What a cell looks like along the ray.
pub fn step(ray: &Ray, place: Place, isovalue: f32, sample: &impl Fn([i32; 3]) -> f32) -> Step {
    let cell = place.cell;
    let exit = ray.exit(CellBox { low: cell, high: cell });
    let corners = corners(cell, isovalue, sample);
    let (inside, outside) = (corners.all_inside(), corners.all_outside());
    let mut step =
        Step { place, exit, corners, bernstein: None, inside_low: inside, inside_high: inside };
    if !inside && !outside {
        let b =
            corners.bernstein(cell::local(ray, place.event, cell), cell::local(ray, exit, cell));
        step.bernstein = Some(b);
        step.inside_low = b[0] >= 0.0;
        step.inside_high = b[3] >= 0.0;
    }
    step
}

/// Walks from `start` to the first crossing in `bounds` or out of them.
pub fn block_walk(
    ray: &Ray,
    start: Place,
    bounds: CellBox,
    isovalue: f32,
    sample: &impl Fn([i32; 3]) -> f32,
) -> BlockWalk {
    let mut place = start;
    while bounds.contains(place.cell) {
        let step = step(ray, place, isovalue, sample);
        if let Some(bernstein) = step.bernstein {
            let Step { exit, corners, inside_low, inside_high, .. } = step;
            if let Some(bracket) = cell::first_crossing(bernstein, inside_low, inside_high) {
                return BlockWalk::Hit(Crossing {
                    place,
                    exit,
                    corners,
                    bernstein,
                    bracket,
                    inside_low,
                });
            }
        }
        place = Place { event: step.exit, cell: next(ray, place.cell, step.exit) };
    }
    BlockWalk::Left(place)
}
