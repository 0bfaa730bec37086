//! Blocks of a volume: how many there are, where they lie and how much of them is valid.

use crate::error::{Error, Result};

/// Largest number of voxels along an axis (zfp's header holds 16 bits per axis).
pub const MAX_DIM: u32 = 1 << 16;

/// Bits of the header of a block that is not all zero: one flag and eight exponent bits.
pub(crate) const BLOCK_HEADER_BITS: u32 = 9;

/// Most bits that zfp gives to a block.
pub(crate) const MAX_BITS_PER_BLOCK: u32 = 16658;

/// Bits per block of 64 voxels at `rate` bits per voxel, as zfp computes them for 3D floats:
/// the nearest integer, at least 9.
///
/// # Errors
/// [`Error::Rate`] for a rate that is not a positive number or gives more than 16658 bits.
pub fn bits_per_block(rate: f64) -> Result<u32> {
    let bits = (64.0 * rate + 0.5).floor();
    if rate > 0.0 && bits <= f64::from(MAX_BITS_PER_BLOCK) {
        Ok((bits as u32).max(BLOCK_HEADER_BITS))
    } else {
        Err(Error::Rate { rate })
    }
}

/// Splits a volume into blocks of 4^3 voxels, counted x-fastest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Grid {
    pub(crate) dims: [u32; 3],
    pub(crate) blocks: [u32; 3],
}

impl Grid {
    pub(crate) fn new(dims: [u32; 3]) -> Result<Self> {
        if dims.iter().any(|&n| n == 0 || n > MAX_DIM) {
            return Err(Error::Dims { dims: dims.map(u64::from).to_vec() });
        }
        Ok(Self::unchecked(dims))
    }

    /// As [`Grid::new`], for sizes that were checked before.
    pub(crate) fn unchecked(dims: [u32; 3]) -> Self {
        Self { dims, blocks: dims.map(|n| n.div_ceil(4)) }
    }

    pub(crate) fn block_count(&self) -> u64 {
        self.blocks.iter().fold(1, |product, &n| product.saturating_mul(u64::from(n)))
    }

    pub(crate) fn voxel_count(&self) -> u64 {
        self.dims.iter().fold(1, |product, &n| product.saturating_mul(u64::from(n)))
    }

    /// First voxel of block `block`.
    pub(crate) fn origin(&self, block: u64) -> [u32; 3] {
        let [bx, by, _] = self.blocks.map(|n| u64::from(n.max(1)));
        let index = [block % bx, block / bx % by, block / bx / by];
        index.map(|i| u32::try_from(i.saturating_mul(4)).unwrap_or(u32::MAX))
    }

    /// Number of voxels of a block inside the volume along each axis, given its first voxel.
    pub(crate) fn valid(&self, origin: [u32; 3]) -> [u32; 3] {
        std::array::from_fn(|axis| self.dims[axis].saturating_sub(origin[axis]).min(4))
    }

    /// The voxel of sample `i` of block `block`.
    pub(crate) fn voxel(&self, block: u64, i: usize) -> [u32; 3] {
        let origin = self.origin(block);
        let local = [i & 3, (i >> 2) & 3, i >> 4];
        std::array::from_fn(|axis| origin[axis].saturating_add(local[axis] as u32))
    }

    /// Bytes of a fixed-rate stream that starts at `first_bit`, without padding at its end.
    pub(crate) fn stream_bytes(&self, bits_per_block: u32, first_bit: u64) -> u64 {
        self.block_count()
            .saturating_mul(u64::from(bits_per_block))
            .saturating_add(first_bit)
            .div_ceil(8)
    }
}

/// Fills the samples of a block that lie outside the volume as zfp's encoder does, so that they
/// cost few bits: with `valid` samples along an axis, 1 is repeated, 2 continue as `v1, v0` and
/// 3 as `v0`.
///
/// Sample (x, y, z) of the block is at x + 4y + 16z; `valid` is the number of samples inside the
/// volume along each axis, 1 to 4 (other numbers count as 4).
pub fn pad_block<T: Copy>(samples: &mut [T; 64], valid: [u32; 3]) {
    for (axis, stride) in [1, 4, 16].into_iter().enumerate() {
        let sources: &[usize] = match valid[axis] {
            1 => &[0, 0, 0],
            2 => &[1, 0],
            3 => &[0],
            _ => continue,
        };
        let first = 4 - sources.len();
        for line in 0..16 {
            let base = line_start(line, axis);
            for (i, source) in sources.iter().enumerate() {
                samples[base + (first + i) * stride] = samples[base + source * stride];
            }
        }
    }
}

/// First sample of one of the 16 lines of a block along an axis.
fn line_start(line: usize, axis: usize) -> usize {
    match axis {
        0 => 4 * line,
        1 => (line & 3) + 16 * (line >> 2),
        _ => line,
    }
}
