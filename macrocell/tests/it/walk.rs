//! The nested walk visits the cells of one walk through all dual cells, in the same order.

use macrocell::Grid;
use macrocell::cpu::dda::{CellBox, Ray};
use macrocell::cpu::skip::{Masks, Place, advance, enter, leave};
use proptest::prelude::*;

use crate::common::Random;
use crate::rays::{masks, ray, visited};

fn volume(grid: &Grid) -> CellBox {
    CellBox { low: [0; 3], high: grid.last_cell() }
}

fn block_of(cell: [i32; 3]) -> [u32; 3] {
    cell.map(|c| c as u32 / 4)
}

fn active(grid: &Grid, masks: &Masks, cells: &[[i32; 3]]) -> Vec<[i32; 3]> {
    let is_active = |cell: &&[i32; 3]| masks.block_active(grid, block_of(**cell));
    cells.iter().filter(is_active).copied().collect()
}

/// Cells of active blocks from a place on.
fn walk(grid: &Grid, masks: &Masks, ray: &Ray, start: Option<Place>) -> Vec<[i32; 3]> {
    let mut cells = Vec::new();
    let mut place = start;
    while let Some(found) = place.and_then(|place| advance(grid, masks, ray, place)) {
        cells.push(found.cell);
        place = Some(leave(grid, ray, found, 0));
    }
    cells
}

fn check(grid: &Grid, masks: &Masks, ray: &Ray) -> Result<(), TestCaseError> {
    if grid.last_cell().iter().any(|&last| last < 0) {
        return Ok(());
    }
    let expected = active(grid, masks, &visited(grid, ray));
    let found = walk(grid, masks, ray, enter(ray, volume(grid)));
    prop_assert_eq!(&found, &expected);
    // Resume in every block that the walk visits, knowing nothing but the block.
    let mut first = 0;
    for index in 1..=expected.len() {
        let block = block_of(expected[first]);
        if index < expected.len() && block_of(expected[index]) == block {
            continue;
        }
        let bounds = CellBox::around(expected[first], 2, grid.last_cell());
        prop_assert!(ray.meets(bounds), "{block:?}");
        let resumed = walk(grid, masks, ray, enter(ray, bounds));
        prop_assert_eq!(&resumed, &expected[first..], "from block {:?}", block);
        first = index;
    }
    Ok(())
}

fn check_seed(dims: [u32; 3], density: u32, rays: usize, seed: u64) -> Result<(), TestCaseError> {
    let grid = Grid::new(dims);
    let mut random = Random::new(seed);
    let masks = masks(&grid, density, &mut random);
    for _ in 0..rays {
        let ray = ray(dims, &mut random);
        check(&grid, &masks, &ray)
            .map_err(|error| TestCaseError::fail(format!("{dims:?} {ray:?}: {error}")))?;
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(256) })]

    #[test]
    fn every_cell_of_a_fully_active_volume(dims in prop::array::uniform3(1..40u32), seed: u64) {
        check_seed(dims, 64, 16, seed)?;
    }

    #[test]
    fn the_cells_of_active_blocks(dims in prop::array::uniform3(1..80u32), seed: u64) {
        check_seed(dims, 12, 16, seed)?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(16) })]

    #[test]
    fn three_levels(seed: u64, density in prop::sample::select(vec![1u32, 8, 64])) {
        check_seed([260, 140, 131], density, 16, seed)?;
    }
}

#[test]
fn boxes_are_met_exactly_when_a_cell_in_them_is_visited() {
    let grid = Grid::new([14, 11, 9]);
    let mut random = Random::new(11);
    for _ in 0..400 {
        let ray = ray(grid.dims(), &mut random);
        if ray.direction.contains(&0.0) {
            continue; // rays along a face count as in both boxes
        }
        let cells = visited(&grid, &ray);
        for block in crate::common::positions(grid.blocks()) {
            let low = block.map(|b| 4 * b as i32);
            if (0..3).any(|a| low[a] > grid.last_cell()[a]) {
                continue;
            }
            let bounds = CellBox::around(low, 2, grid.last_cell());
            let first = cells.iter().find(|cell| bounds.contains(**cell)).copied();
            assert_eq!(ray.meets(bounds), first.is_some(), "{ray:?} {bounds:?}");
            assert_eq!(enter(&ray, bounds).map(|place| place.cell), first, "{ray:?} {bounds:?}");
        }
    }
}

#[test]
fn a_ray_without_direction_stays_and_ends() {
    let grid = Grid::new([20; 3]);
    let mut random = Random::new(2);
    let ray = Ray::new([3.5; 3], [0.0; 3]);
    let full = masks(&grid, 64, &mut random);
    assert_eq!(walk(&grid, &full, &ray, enter(&ray, volume(&grid))), [[3; 3]]);
    let none = masks(&grid, 0, &mut random);
    assert_eq!(walk(&grid, &none, &ray, enter(&ray, volume(&grid))), [[0; 3]; 0]);
}

#[test]
fn components_below_the_least_are_zero() {
    let ray = Ray::new([0.0; 3], [1.0, 2.0f32.powi(-40), -9.0e-13]);
    assert_eq!(ray.direction, [1.0, 2.0f32.powi(-40), 0.0]);
    assert_eq!(ray.inverse, [1.0, 2.0f32.powi(40), 0.0]);
}
