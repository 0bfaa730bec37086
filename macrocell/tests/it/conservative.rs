//! No dual cell that holds the isosurface lies in a block that counts as empty.

use macrocell::Grid;
use macrocell::cpu::ranges::{Ranges, activate, build, code, scale};
use proptest::prelude::*;

use crate::common::{Kind, Random, cell_range, isovalues, positions, sample, voxels};

/// Range that a block's code stands for: whole steps around its samples.
fn widened(grid: &Grid, ranges: &Ranges, block: [u32; 3]) -> Option<[f64; 2]> {
    let coarse = grid.coarse_index(block.map(|b| b / 4)) as usize;
    let lane = block.map(|b| b as usize % 4);
    let code = ranges.codes[64 * coarse + lane[0] + 4 * lane[1] + 16 * lane[2]];
    let (first, last) = (code & 255, code >> 8);
    let [low, high] = ranges.coarse[coarse];
    let step = 1.0 / f64::from(scale(low, high));
    let at = |code: u16| f64::from(low) + f64::from(code) * step;
    (first <= last).then(|| [at(first), at(last + 1)])
}

fn cells(dims: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    positions(dims.map(|d| d - 1))
}

fn check_ranges(grid: &Grid, samples: &[f32], ranges: &Ranges) -> Result<(), TestCaseError> {
    let dims = grid.dims();
    for cell in cells(dims) {
        let block = cell.map(|c| c / 4);
        let [low, high] = cell_range(dims, samples, cell);
        let [coarse_low, coarse_high] =
            ranges.coarse[grid.coarse_index(block.map(|b| b / 4)) as usize];
        prop_assert!(coarse_low <= low && high <= coarse_high);
        let Some([from, to]) = widened(grid, ranges, block) else {
            return Err(TestCaseError::fail(format!("{block:?} has cells but no code")));
        };
        // One subtraction is rounded, which may carry a value over a step's border.
        let rounding = (f64::from(coarse_high) - f64::from(coarse_low)) * f64::from(f32::EPSILON);
        prop_assert!(from - rounding <= f64::from(low) && f64::from(high) <= to + rounding);
    }
    Ok(())
}

fn check_masks(
    grid: &Grid,
    samples: &[f32],
    ranges: &Ranges,
    isovalue: f32,
) -> Result<(), TestCaseError> {
    let dims = grid.dims();
    let masks = activate(grid, ranges, isovalue);
    for cell in cells(dims) {
        let [low, high] = cell_range(dims, samples, cell);
        if low < isovalue && isovalue <= high {
            let block = cell.map(|c| c / 4);
            prop_assert!(masks.block_active(grid, block), "{cell:?} at {isovalue}");
            prop_assert_eq!(masks.empty_level(grid, cell.map(|c| c as i32)), 0);
        }
    }
    for block in positions(grid.blocks()) {
        if masks.block_active(grid, block) {
            // Active means within one step of the block's own range.
            let Some([from, to]) = widened(grid, ranges, block) else {
                return Err(TestCaseError::fail(format!("{block:?} is active without cells")));
            };
            let (iso, step) = (f64::from(isovalue), (to - from) * f64::from(f32::EPSILON));
            prop_assert!(from - step <= iso && iso <= to + step, "{block:?} at {isovalue}");
        }
    }
    check_levels(grid, &masks.words)
}

/// A bit of the third level is set iff that coarse cell has an active block.
fn check_levels(grid: &Grid, words: &[u64]) -> Result<(), TestCaseError> {
    let coarse_count = grid.coarse_count() as usize;
    if !grid.has_third_level() {
        prop_assert_eq!(words.len(), coarse_count);
        return Ok(());
    }
    for third in positions(grid.third()) {
        let word = words[coarse_count + grid.third_index(third) as usize];
        for (bit, child) in positions([4; 3]).enumerate() {
            let coarse: [u32; 3] = std::array::from_fn(|a| 4 * third[a] + child[a]);
            let inside = (0..3).all(|a| coarse[a] < grid.coarse()[a]);
            let any = inside && words[grid.coarse_index(coarse) as usize] != 0;
            prop_assert_eq!(word >> bit & 1 != 0, any, "{:?}", coarse);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(96) })]

    #[test]
    fn every_cell_with_the_isosurface_is_in_an_active_block(
        dims in prop::array::uniform3(1..24u32),
        kind in prop::sample::select(Kind::ALL.to_vec()),
        seed: u64,
    ) {
        let mut random = Random::new(seed);
        let grid = Grid::new(dims);
        let samples = kind.volume(dims, &mut random);
        let ranges = build(&grid, &samples);
        check_ranges(&grid, &samples, &ranges)?;
        for isovalue in isovalues(&grid, &samples, &mut random) {
            check_masks(&grid, &samples, &ranges, isovalue)?;
        }
    }

    #[test]
    fn codes_never_decrease(
        low in -1.0e30..1.0e30f32,
        size in prop::num::f32::POSITIVE,
        a in 0.0..=1.0f32,
        b in 0.0..=1.0f32,
    ) {
        let high = low + size.min(1.0e36);
        let scale = scale(low, high);
        let [a, b] = [a, b].map(|part| (low + (high - low) * part).clamp(low, high));
        let (a, b) = (a.min(b), a.max(b));
        prop_assert!(code(a, low, scale) <= code(b, low, scale));
        prop_assert_eq!(code(low, low, scale), 0);
        prop_assert!((high - low) * scale < 256.0);
        // The step is at most 1/128 of the range: codes are not wasted.
        prop_assert!(high - low < f32::MIN_POSITIVE * 256.0 || (high - low) * scale >= 128.0);
    }
}

#[test]
fn a_third_level_keeps_every_cell_too() {
    let dims = [131, 129, 130];
    let grid = Grid::new(dims);
    assert!(grid.has_third_level());
    let mut random = Random::new(3);
    let samples = Kind::Smooth.volume(dims, &mut random);
    assert_eq!(samples.len(), voxels(dims));
    let ranges = build(&grid, &samples);
    check_ranges(&grid, &samples, &ranges).unwrap();
    for isovalue in [0.0, 37.5, sample(dims, &samples, [64, 64, 64]), -1.0e9] {
        check_masks(&grid, &samples, &ranges, isovalue).unwrap();
    }
}

#[test]
fn a_constant_volume_is_never_active() {
    let grid = Grid::new([20, 20, 20]);
    let ranges = build(&grid, &vec![2.5; 8000]);
    for isovalue in [2.5, 2.5f32.next_up(), 2.5f32.next_down(), 0.0] {
        assert!(activate(&grid, &ranges, isovalue).words.iter().all(|&word| word == 0));
    }
}

#[test]
fn a_missing_bit_and_a_wrong_code_are_noticed() {
    let dims = [20, 9, 9];
    let grid = Grid::new(dims);
    let mut random = Random::new(9);
    let samples = Kind::Noise.volume(dims, &mut random);
    let good = build(&grid, &samples);
    check_masks(&grid, &samples, &good, 1.0).unwrap();
    let mut narrow = good.clone();
    narrow.codes[0] = 0;
    assert!(check_ranges(&grid, &samples, &narrow).is_err());
    assert!(check_masks(&grid, &samples, &narrow, 1.0).is_err());
    let mut low = good;
    low.coarse[0][1] = 1.0;
    assert!(check_ranges(&grid, &samples, &low).is_err());
    assert!(check_levels(&Grid::new([129; 3]), &[1; 729 + 27]).is_err());
}
