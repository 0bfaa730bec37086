//! Twin of `shader/ranges.wgsl`, `activate.wgsl` and `third_level.wgsl`: value ranges straight from samples.

use super::skip::Masks;
use crate::Grid;

/// Code of a block without dual cells: low 255, high 0.
pub const EMPTY_CODE: u16 = 255;

/// Ranges of a whole volume.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranges {
    /// (low, high) of every coarse cell; low > high where it has no dual cell.
    pub coarse: Vec<[f32; 2]>,
    /// Low code in the lower byte, high code in the upper one; 64 per coarse cell, `x + 4y + 16z`.
    pub codes: Vec<u16>,
}

const NO_VALUE: f32 = 3.0e38;

/// Power of two `s` with `(high - low) * s < 256`.
pub fn scale(low: f32, high: f32) -> f32 {
    let exponent = (((high - low).to_bits() >> 23) & 255).max(8);
    f32::from_bits((261 - exponent) << 23)
}

/// Monotone 8-bit code of a value within a coarse cell's range.
pub fn code(value: f32, low: f32, scale: f32) -> u16 {
    ((value - low) * scale).floor().clamp(0.0, 255.0) as u16
}

/// Exact range over the samples of a block's own dual cells; low > high without dual cells.
pub fn block_range(dims: [u32; 3], samples: &[f32], block: [u32; 3]) -> [f32; 2] {
    let mut range = [NO_VALUE, -NO_VALUE];
    if (0..3).any(|a| block[a] * 4 + 1 >= dims[a]) {
        return range;
    }
    let end: [u32; 3] = std::array::from_fn(|a| (block[a] * 4 + 5).min(dims[a]));
    for z in block[2] * 4..end[2] {
        for y in block[1] * 4..end[1] {
            for x in block[0] * 4..end[0] {
                let value = samples[(x as usize)
                    + dims[0] as usize * (y as usize + dims[1] as usize * z as usize)];
                range = [range[0].min(value), range[1].max(value)];
            }
        }
    }
    range
}

/// Ranges of all blocks of a volume (`samples`: x fastest).
pub fn build(grid: &Grid, samples: &[f32]) -> Ranges {
    let count = grid.coarse_count() as usize;
    let mut ranges =
        Ranges { coarse: vec![[NO_VALUE, -NO_VALUE]; count], codes: vec![EMPTY_CODE; count * 64] };
    for index in 0..count {
        let coarse = grid.coarse_position(index as u64);
        let exact: Vec<[f32; 2]> = (0..64)
            .map(|lane| {
                let block = [
                    coarse[0] * 4 + lane % 4,
                    coarse[1] * 4 + lane / 4 % 4,
                    coarse[2] * 4 + lane / 16,
                ];
                if (0..3).all(|a| block[a] < grid.blocks()[a]) {
                    block_range(grid.dims(), samples, block)
                } else {
                    [NO_VALUE, -NO_VALUE]
                }
            })
            .collect();
        let low = exact.iter().fold(NO_VALUE, |m, r| m.min(r[0]));
        let high = exact.iter().fold(-NO_VALUE, |m, r| m.max(r[1]));
        ranges.coarse[index] = [low, high];
        for (lane, range) in exact.iter().enumerate() {
            if range[0] <= range[1] {
                let s = scale(low, high);
                ranges.codes[index * 64 + lane] =
                    code(range[0], low, s) | (code(range[1], low, s) << 8);
            }
        }
    }
    ranges
}

/// Active masks for one isovalue, third level included where the grid has one.
pub fn activate(grid: &Grid, ranges: &Ranges, isovalue: f32) -> Masks {
    let mut words: Vec<u64> = ranges
        .coarse
        .iter()
        .zip(ranges.codes.chunks_exact(64))
        .map(|(&[low, high], codes)| {
            if !(low < isovalue && isovalue <= high) {
                return 0;
            }
            let iso = code(isovalue, low, scale(low, high));
            codes.iter().enumerate().fold(0, |mask, (lane, &code)| {
                mask | (u64::from(code & 255 <= iso && iso <= code >> 8) << lane)
            })
        })
        .collect();
    if grid.has_third_level() {
        words.resize((grid.coarse_count() + grid.third_count()) as usize, 0);
        for index in 0..grid.coarse_count() {
            if words[index as usize] != 0 {
                let c = grid.coarse_position(index);
                let third = grid.coarse_count() + grid.third_index(c.map(|v| v / 4));
                words[third as usize] |= 1 << (c[0] % 4 + c[1] % 4 * 4 + c[2] % 4 * 16);
            }
        }
    }
    Masks { words }
}
