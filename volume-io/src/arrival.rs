//! A fixed-rate zfp file that arrives in pieces, so that it need not be in memory as a whole.

use crate::error::{Error, Result};
use crate::formats::fixed_rate_header;
use crate::grid::Grid;
use crate::stats::Histogram;
use crate::volume::{Decoder, check_exponent};

/// What zfp's own header says of a stream that the GPU decodes as it is: fixed-rate, 3D, 32-bit
/// floats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct FixedRateHeader {
    /// Voxels along x, y and z; 1 to 65536 each.
    pub dims: [u32; 3],
    /// Bits of every block, 9 to 16658.
    pub bits_per_block: u32,
    /// Position of the first bit of block 0 in the file.
    pub first_bit: u64,
}

impl FixedRateHeader {
    /// Bytes of a file that are enough for [`FixedRateHeader::parse`].
    pub const BYTES: usize = 24;

    /// The header of a file with these first bytes; none if they start anything else, which
    /// [`crate::convert_bytes`] turns into such a file where it can.
    #[must_use]
    pub fn parse(start: &[u8]) -> Option<Self> {
        let (dims, bits_per_block, first_bit) = fixed_rate_header(start)?;
        Some(Self { dims, bits_per_block, first_bit })
    }

    /// Least number of bytes that the file has.
    #[must_use]
    pub fn stream_bytes(&self) -> u64 {
        Grid::unchecked(self.dims).stream_bytes(self.bits_per_block, self.first_bit)
    }

    fn block_bit(&self, block: u64) -> u64 {
        block.saturating_mul(u64::from(self.bits_per_block)).saturating_add(self.first_bit)
    }
}

/// Looks at the blocks of a fixed-rate stream while its bytes go by: checks what
/// [`crate::ZfpVolume::from_stream`] checks, and keeps the samples of some blocks for a histogram.
///
/// ```
/// # fn main() -> Result<(), volume_io::Error> {
/// # let mut file = Vec::new();
/// # let mut encoder = volume_io::StreamEncoder::new([8, 4, 4], 8.0, &mut file)?;
/// # encoder.push(&[1.0; 64])?;
/// # encoder.push(&[2.0; 64])?;
/// # encoder.finish()?;
/// let header = volume_io::FixedRateHeader::parse(&file).expect("a fixed-rate file");
/// let mut scan = volume_io::StreamScan::new(header, 1 << 20);
/// for piece in file.chunks(50) {
///     scan.push(piece)?;
/// }
/// assert!(scan.is_complete());
/// assert_eq!(scan.histogram(2).counts(), [64, 64]);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct StreamScan {
    header: FixedRateHeader,
    grid: Grid,
    decoder: Decoder,
    next_block: u64,
    /// Bytes from the one where `next_block` starts on.
    begun: Vec<u8>,
    /// Position in the file of the first of them.
    begun_at: u64,
    /// One block of so many is sampled.
    stride: u64,
    samples: Vec<f32>,
}

impl StreamScan {
    /// Expects the file of `header` from its first byte on and will keep about `most_samples`
    /// samples, from blocks all over the volume.
    #[must_use]
    pub fn new(header: FixedRateHeader, most_samples: usize) -> Self {
        let grid = Grid::unchecked(header.dims);
        let voxels = grid.block_count().saturating_mul(64);
        Self {
            header,
            grid,
            decoder: Decoder::fixed_rate(header.bits_per_block),
            next_block: 0,
            begun: Vec::new(),
            begun_at: 0,
            stride: voxels.div_ceil(most_samples.max(1) as u64).max(1),
            samples: Vec::new(),
        }
    }

    /// Takes in the next bytes of the file. Those behind the last block are ignored.
    ///
    /// # Errors
    /// [`Error::BlockExponent`] for the first block that cannot be decoded in 32-bit arithmetic.
    pub fn push(&mut self, bytes: &[u8]) -> Result<()> {
        self.begun.extend_from_slice(bytes);
        let end = 8 * (self.begun_at + self.begun.len() as u64);
        while !self.is_complete() && self.header.block_bit(self.next_block + 1) <= end {
            self.take_block()?;
        }
        let needed = if self.is_complete() {
            self.begun.len()
        } else {
            let start = self.header.block_bit(self.next_block) / 8;
            start.saturating_sub(self.begun_at).min(self.begun.len() as u64) as usize
        };
        self.begun.drain(..needed);
        self.begun_at += needed as u64;
        Ok(())
    }

    fn take_block(&mut self) -> Result<()> {
        let block = self.next_block;
        let bit = self.header.block_bit(block) - 8 * self.begun_at;
        check_exponent(&self.begun, &self.grid, block, bit)?;
        if scattered(block).is_multiple_of(self.stride) {
            let block = self.decoder.block_at(&self.begun, bit, &self.grid, block);
            self.samples.extend(block.voxels().map(|(_, value)| value));
        }
        self.next_block += 1;
        Ok(())
    }

    /// Whether every block has gone by.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.next_block == self.grid.block_count()
    }

    /// Fails if blocks are missing: for the end of a file.
    ///
    /// # Errors
    /// [`Error::TooShort`].
    pub fn finish(&self) -> Result<()> {
        if self.is_complete() {
            return Ok(());
        }
        let found = self.begun_at + self.begun.len() as u64;
        Err(Error::TooShort { expected: self.header.stream_bytes(), found })
    }

    /// Histogram of the samples kept so far, over their range.
    #[must_use]
    pub fn histogram(&self, bins: usize) -> Histogram {
        let widen = |[min, max]: [f32; 2], &value: &f32| [min.min(value), max.max(value)];
        let range = self.samples.iter().fold([f32::INFINITY, f32::NEG_INFINITY], widen);
        let range = if self.samples.is_empty() { [0.0; 2] } else { range };
        let mut histogram = Histogram::new(range, bins);
        self.samples.iter().for_each(|&value| histogram.add(value));
        histogram
    }
}

/// A number without the regularities of `block`, whose rows and slices must not show in a sample.
fn scattered(block: u64) -> u64 {
    let mixed = (block ^ (block >> 31)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{StreamEncoder, ZfpVolume, read_bytes};

    fn file(dims: [u32; 3], rate: f64) -> Vec<u8> {
        let mut file = Vec::new();
        let mut encoder = StreamEncoder::new(dims, rate, &mut file).unwrap();
        for block in 0..encoder.block_count() {
            encoder.push(&std::array::from_fn(|i| (block * 64 + i as u64) as f32)).unwrap();
        }
        encoder.finish().unwrap();
        file
    }

    fn scan(file: &[u8], piece: usize, most_samples: usize) -> StreamScan {
        let mut scan = StreamScan::new(FixedRateHeader::parse(file).unwrap(), most_samples);
        for bytes in file.chunks(piece) {
            scan.push(bytes).unwrap();
        }
        scan
    }

    fn whole(file: &[u8]) -> ZfpVolume {
        read_bytes("file.zfp", file, &Default::default()).unwrap()
    }

    #[test]
    fn the_header_is_that_of_the_volume() {
        let file = file([9, 6, 5], 5.2);
        let header = FixedRateHeader::parse(&file[..FixedRateHeader::BYTES]).unwrap();
        let volume = whole(&file);
        assert_eq!(header.dims, volume.dims);
        assert_eq!(
            (header.bits_per_block, header.first_bit),
            (volume.bits_per_block, volume.first_bit)
        );
        assert!(header.stream_bytes() <= file.len() as u64);
        assert_eq!(FixedRateHeader::parse(&file[..8]), None, "too short");
        assert_eq!(FixedRateHeader::parse(b"\x93NUMPY and more, much more"), None);
        let variable = include_bytes!("../tests/data/accuracy.zfp");
        assert_eq!(FixedRateHeader::parse(variable), None, "variable rate");
        let integers = include_bytes!("../tests/data/i32_reversible.zfp");
        assert_eq!(FixedRateHeader::parse(integers), None, "integers");
    }

    #[test]
    fn pieces_of_any_size_hold_the_same_samples() {
        let file = file([9, 6, 5], 5.2);
        let samples: Vec<f32> = whole(&file)
            .decoded_blocks()
            .flat_map(|b| b.voxels().map(|v| v.1).collect::<Vec<_>>())
            .collect();
        for piece in [1, 7, 24, 41, 1 << 20] {
            let scan = scan(&file, piece, usize::MAX);
            assert!(scan.is_complete());
            assert_eq!(scan.samples, samples, "pieces of {piece} bytes");
            assert!(scan.begun.len() <= 64, "bytes are let go");
        }
    }

    #[test]
    fn a_part_of_the_blocks_is_sampled() {
        let file = file([64, 64, 64], 1.0);
        let scan = scan(&file, 999, 64 * 512);
        assert!((64 * 400..64 * 630).contains(&scan.samples.len()), "{}", scan.samples.len());
        let (histogram, range) = (scan.histogram(16), whole(&file).value_range());
        assert_eq!(histogram.total(), scan.samples.len() as u64);
        assert!(range[0] <= histogram.range()[0] && histogram.range()[1] <= range[1]);
    }

    #[test]
    fn what_a_whole_stream_is_refused_for_is_refused() {
        let mut file = file([8, 8, 8], 8.0);
        let header = FixedRateHeader::parse(&file).unwrap();
        let mut short = StreamScan::new(header, 64);
        short.push(&file[..file.len() - 9]).unwrap();
        assert!(matches!(short.finish(), Err(Error::TooShort { .. })));
        // Block 5 of 64 bytes behind a header of 12: "not zero", exponent 255.
        file[12 + 5 * 64] |= 0xff;
        file[12 + 5 * 64 + 1] |= 0x01;
        let mut scan = StreamScan::new(header, 64);
        let refused = file.chunks(100).find_map(|piece| scan.push(piece).err()).unwrap();
        let expected = read_bytes("file.zfp", file, &Default::default()).unwrap_err();
        assert_eq!(refused.to_string(), expected.to_string());
        assert!(matches!(refused, Error::BlockExponent { block: 5, exponent: 255, .. }));
    }

    #[test]
    fn nothing_scanned_is_an_empty_histogram() {
        let scan = StreamScan::new(FixedRateHeader::parse(&file([4; 3], 8.0)).unwrap(), 64);
        assert_eq!((scan.histogram(4).total(), scan.histogram(4).range()), (0, [0.0; 2]));
        assert!(scan.finish().is_err());
    }
}
