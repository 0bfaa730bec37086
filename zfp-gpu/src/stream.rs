//! Where the blocks of a fixed-rate stream lie.

use crate::Error;

/// Samples per axis of a block.
pub const BLOCK_EDGE: u32 = 4;
/// Samples per block.
pub const BLOCK_SAMPLES: usize = 64;
/// Fewest bits per block: one bit "not zero" and eight bits of exponent.
pub const MIN_BITS_PER_BLOCK: u32 = 9;
/// Most bits per block that zfp accepts; everything beyond 2120 bits is padding for `f32`.
pub const MAX_BITS_PER_BLOCK: u32 = 16_658;

/// Where the blocks of a fixed-rate stream lie.
///
/// Blocks follow each other in x-fastest order without any alignment: block `k` occupies the bits
/// `first_bit + k * bits_per_block ..` of the stream, counted from the least significant bit of
/// the first byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct StreamLayout {
    /// Samples per axis, x first; at least 1 each.
    pub dims: [u32; 3],
    /// Compressed bits per block, in 9..=16658.
    pub bits_per_block: u32,
    /// Bit at which block 0 starts: 0 without a header, 96 or 148 behind zfp's own headers.
    pub first_bit: u64,
}

impl StreamLayout {
    /// Layout of a stream of `dims` samples with `bits_per_block` bits per block from `first_bit` on.
    ///
    /// # Errors
    /// [`Error::EmptyVolume`], [`Error::BitsPerBlock`], or [`Error::StreamTooLong`] when the end of
    /// the stream has no 64-bit bit address.
    pub fn new(dims: [u32; 3], bits_per_block: u32, first_bit: u64) -> Result<Self, Error> {
        if dims.contains(&0) {
            return Err(Error::EmptyVolume { dims });
        }
        if !(MIN_BITS_PER_BLOCK..=MAX_BITS_PER_BLOCK).contains(&bits_per_block) {
            return Err(Error::BitsPerBlock {
                found: bits_per_block,
                least: MIN_BITS_PER_BLOCK,
                most: MAX_BITS_PER_BLOCK,
            });
        }
        let layout = Self { dims, bits_per_block, first_bit };
        let blocks = layout.blocks().map(u128::from).iter().product::<u128>();
        let end = blocks * u128::from(bits_per_block) + u128::from(first_bit);
        // The slack of one word lets readers look past the end without a check for overflow.
        if end > u128::from(u64::MAX - 64) {
            return Err(Error::StreamTooLong { dims, bits_per_block });
        }
        Ok(layout)
    }

    /// Bits per block of zfp's fixed-rate mode at `rate` bits per sample.
    ///
    /// # Errors
    /// [`Error::Rate`] if the rate is negative, not finite or beyond what zfp accepts.
    pub fn bits_per_block_at_rate(rate: f64) -> Result<u32, Error> {
        let bits = (rate * 64.0 + 0.5).floor();
        if !(rate >= 0.0 && bits <= f64::from(MAX_BITS_PER_BLOCK)) {
            let most = f64::from(MAX_BITS_PER_BLOCK) / 64.0;
            return Err(Error::Rate { found: rate, most });
        }
        Ok((bits as u32).max(MIN_BITS_PER_BLOCK))
    }

    /// Blocks per axis, partial blocks included.
    pub fn blocks(&self) -> [u32; 3] {
        self.dims.map(|d| d.div_ceil(BLOCK_EDGE))
    }

    /// Number of blocks.
    pub fn block_count(&self) -> u64 {
        self.blocks().iter().fold(1, |product: u64, &n| product.saturating_mul(u64::from(n)))
    }

    /// Least number of bytes that hold the stream, header included. Files are
    /// padded to 1 to 8 bytes, depending on how zfp was built.
    pub fn stream_bytes(&self) -> u64 {
        self.block_bit(self.block_count()).div_ceil(8)
    }

    /// First bit of block `block`.
    pub fn block_bit(&self, block: u64) -> u64 {
        block.saturating_mul(u64::from(self.bits_per_block)).saturating_add(self.first_bit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn partial_blocks_count_as_blocks() {
        let layout = StreamLayout::new([5, 8, 1], 100, 96).unwrap();
        assert_eq!(layout.blocks(), [2, 2, 1]);
        assert_eq!(layout.block_count(), 4);
        assert_eq!(layout.block_bit(3), 396);
        assert_eq!(layout.stream_bytes(), 62);
    }

    #[test]
    fn rates_become_bits_as_in_zfp() {
        let bits = |rate| StreamLayout::bits_per_block_at_rate(rate).unwrap();
        assert_eq!(
            [bits(0.0), bits(0.1), bits(1.0), bits(2.5), bits(33.125)],
            [9, 9, 64, 160, 2120]
        );
        assert_eq!(bits(1.0 + 0.5 / 64.0), 65, "halves round up");
        for rate in [-1.0, f64::NAN, f64::INFINITY, 300.0] {
            let result = StreamLayout::bits_per_block_at_rate(rate);
            assert!(matches!(result, Err(Error::Rate { .. })), "rate {rate} must be refused");
        }
    }

    #[test]
    fn impossible_layouts_are_refused() {
        assert!(matches!(StreamLayout::new([4, 0, 4], 64, 0), Err(Error::EmptyVolume { .. })));
        for bits in [0, 8, 16_659] {
            let result = StreamLayout::new([4; 3], bits, 0);
            assert!(matches!(result, Err(Error::BitsPerBlock { found, .. }) if found == bits));
        }
        assert!(matches!(StreamLayout::new([u32::MAX; 3], 9, 0), Err(Error::StreamTooLong { .. })));
        assert!(matches!(StreamLayout::new([4; 3], 9, u64::MAX), Err(Error::StreamTooLong { .. })));
        assert!(StreamLayout::new([1 << 16; 3], 2120, 148).is_ok());
    }
}
