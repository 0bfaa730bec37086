//! A fixed-rate ZFP stream of a 3D field, and its blocks.

use std::fmt;
use std::sync::Arc;

use zfp_rs::{ZfpBitStreamRef, ZfpConfig, ZfpDimensionality, ZfpScalar};

use crate::error::{Error, Result};
use crate::grid::{BLOCK_HEADER_BITS, Grid, MAX_BITS_PER_BLOCK};
use crate::source::{Format, SampleType, Source};

/// Largest biased exponent of a block that 32-bit arithmetic decodes without overflow.
pub const MAX_EXPONENT: u32 = 250;

/// Blocks with a biased exponent up to this are decoded as zero on the GPU.
pub const TINY_EXPONENT: u32 = 30;

/// Places the voxels in space: voxel (i, j, k) lies at origin + spacing * (i, j, k).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// Distance between neighbouring voxels along each axis, in world units; positive.
    pub spacing: [f64; 3],
    /// Position of voxel (0, 0, 0), in world units.
    pub origin: [f64; 3],
}

impl Default for Geometry {
    fn default() -> Self {
        Self { spacing: [1.0; 3], origin: [0.0; 3] }
    }
}

/// A fixed-rate ZFP stream of a 3D field of 32-bit floats, ready for the GPU.
///
/// Block k (x-fastest, 4^3 voxels) occupies the bits from `first_bit` + k * `bits_per_block`;
/// bit i of the stream is bit i % 8 of byte i / 8.
#[derive(Clone)]
#[non_exhaustive]
pub struct ZfpVolume {
    /// Voxels along x, y and z; 1 to 65536 each.
    pub dims: [u32; 3],
    /// Bits of every block, 9 to 16658.
    pub bits_per_block: u32,
    /// Position of the first bit of block 0 in `bytes`.
    pub first_bit: u64,
    /// The stream, at least as long as its blocks need.
    pub bytes: Arc<[u8]>,
    /// Placement in space.
    pub geometry: Geometry,
    /// Where the volume comes from.
    pub source: Source,
}

impl ZfpVolume {
    /// Takes a fixed-rate stream as it is, after checking that it is complete and that every
    /// block can be decoded in 32-bit arithmetic.
    ///
    /// # Errors
    /// [`Error::Dims`], [`Error::BitsPerBlock`], [`Error::TooShort`] or [`Error::BlockExponent`].
    pub fn from_stream(
        dims: [u32; 3],
        bits_per_block: u32,
        first_bit: u64,
        bytes: impl Into<Arc<[u8]>>,
    ) -> Result<Self> {
        let grid = Grid::new(dims)?;
        check_bits_per_block(bits_per_block)?;
        let bytes = bytes.into();
        let (expected, found) = (grid.stream_bytes(bits_per_block, first_bit), bytes.len() as u64);
        if found < expected {
            return Err(Error::TooShort { expected, found });
        }
        let mut source = Source::new(Format::Memory, SampleType::F32);
        source.tiny_blocks = check_exponents(&bytes, &grid, bits_per_block, first_bit)?;
        let geometry = Geometry::default();
        Ok(Self { dims, bits_per_block, first_bit, bytes, geometry, source })
    }

    /// Bits per voxel.
    #[must_use]
    pub fn rate(&self) -> f64 {
        f64::from(self.bits_per_block) / 64.0
    }

    /// Blocks along x, y and z.
    #[must_use]
    pub fn blocks(&self) -> [u32; 3] {
        self.grid().blocks
    }

    /// Number of blocks.
    #[must_use]
    pub fn block_count(&self) -> u64 {
        self.grid().block_count()
    }

    /// Number of voxels.
    #[must_use]
    pub fn voxel_count(&self) -> u64 {
        self.grid().voxel_count()
    }

    /// Block `block` (x-fastest) as libzfp decodes it; bits outside the stream count as zero.
    #[must_use]
    pub fn decode_block(&self, block: u64) -> Block {
        self.decoder().block(self, block)
    }

    /// All blocks, decoded one at a time in x-fastest order.
    pub fn decoded_blocks(&self) -> impl Iterator<Item = Block> + '_ {
        let mut decoder = self.decoder();
        (0..self.block_count()).map(move |block| decoder.block(self, block))
    }

    /// All samples as libzfp decodes them, x-fastest. Needs four bytes per voxel: meant for tests
    /// and small volumes; [`ZfpVolume::decoded_blocks`] needs no such buffer.
    ///
    /// Unlike on the GPU, blocks of tiny magnitude ([`TINY_EXPONENT`]) keep their values.
    #[must_use]
    pub fn decode(&self) -> Vec<f32> {
        let [nx, ny, _] = self.dims.map(|n| n as usize);
        let mut samples = vec![0.0; usize::try_from(self.voxel_count()).unwrap_or(usize::MAX)];
        for block in self.decoded_blocks() {
            for ([x, y, z], value) in block.voxels() {
                let at = x as usize + nx * (y as usize + ny * z as usize);
                if let Some(sample) = samples.get_mut(at) {
                    *sample = value;
                }
            }
        }
        samples
    }

    pub(crate) fn grid(&self) -> Grid {
        Grid::unchecked(self.dims)
    }

    fn decoder(&self) -> Decoder {
        Decoder::fixed_rate(self.bits_per_block)
    }
}

impl fmt::Debug for ZfpVolume {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ZfpVolume")
            .field("dims", &self.dims)
            .field("bits_per_block", &self.bits_per_block)
            .field("first_bit", &self.first_bit)
            .field("byte_count", &self.bytes.len())
            .field("geometry", &self.geometry)
            .field("source", &self.source)
            .finish()
    }
}

/// One decoded block of 4^3 samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Index of the block, x-fastest.
    pub index: u64,
    /// Its first voxel.
    pub origin: [u32; 3],
    /// Samples inside the volume along each axis, 1 to 4 (0 for a block outside).
    pub valid: [u32; 3],
    /// Sample (x, y, z) at x + 4y + 16z; those outside the volume have no meaning.
    pub samples: [f32; 64],
}

impl Block {
    /// The samples inside the volume with their voxels, x-fastest.
    pub fn voxels(&self) -> impl Iterator<Item = ([u32; 3], f32)> + '_ {
        let [nx, ny, nz] = self.valid.map(|n| n.min(4));
        let local =
            (0..nz).flat_map(move |z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
        local.map(|[x, y, z]| {
            let [ox, oy, oz] = self.origin;
            ([ox + x, oy + y, oz + z], self.samples[(x + 4 * y + 16 * z) as usize])
        })
    }
}

/// Decodes single blocks wherever they start, by copying their words to an aligned window.
#[derive(Debug)]
pub(crate) struct Decoder {
    config: ZfpConfig,
    rank: ZfpDimensionality,
    window: Vec<u64>,
}

impl Decoder {
    pub(crate) fn new(config: ZfpConfig, rank: ZfpDimensionality) -> Self {
        // Three more words: the shift within the first byte, and the decoder's look-ahead.
        let words = config.max_bits().max(config.min_bits()) as usize / 64 + 3;
        Self { config, rank, window: vec![0; words] }
    }

    /// For a fixed-rate stream of 3D floats.
    pub(crate) fn fixed_rate(bits_per_block: u32) -> Self {
        Self::new(fixed_rate(bits_per_block), ZfpDimensionality::D3)
    }

    /// Decodes the block at `first_bit` and returns its length in bits. `samples` holds a whole
    /// block of the decoder's rank.
    pub(crate) fn decode<T: ZfpScalar>(
        &mut self,
        bytes: &[u8],
        first_bit: u64,
        samples: &mut [T],
    ) -> Result<u64> {
        load_words(bytes, first_bit / 8, &mut self.window);
        let mut stream = ZfpBitStreamRef::from_words(&self.window);
        stream.seek_read(first_bit % 8);
        zfp_rs::codec::block::decode_block(&mut stream, &self.config, samples, self.rank)
            .map(|bits| bits as u64)
            .map_err(|error| Error::Codec { reason: error.to_string() })
    }

    fn block(&mut self, volume: &ZfpVolume, index: u64) -> Block {
        let first_bit =
            index.saturating_mul(u64::from(volume.bits_per_block)).saturating_add(volume.first_bit);
        self.block_at(&volume.bytes, first_bit, &volume.grid(), index)
    }

    /// Block `index`, which starts at `first_bit` of `bytes`.
    pub(crate) fn block_at(
        &mut self,
        bytes: &[u8],
        first_bit: u64,
        grid: &Grid,
        index: u64,
    ) -> Block {
        let origin = grid.origin(index);
        let mut samples = [0.0f32; 64];
        if self.decode(bytes, first_bit, &mut samples).is_err() {
            samples = [0.0; 64];
        }
        Block { index, origin, valid: grid.valid(origin), samples }
    }
}

/// Copies the bytes from `first` as little-endian words; zeros follow the end of `bytes`.
pub(crate) fn load_words(bytes: &[u8], first: u64, words: &mut [u64]) {
    let tail = usize::try_from(first).ok().and_then(|first| bytes.get(first..)).unwrap_or(&[]);
    let mut chunks = tail.chunks(8);
    for word in words {
        let mut buffer = [0; 8];
        if let Some(chunk) = chunks.next() {
            buffer[..chunk.len()].copy_from_slice(chunk);
        }
        *word = u64::from_le_bytes(buffer);
    }
}

/// Codec parameters of a fixed-rate stream; `bits` is at most 16658.
pub(crate) fn fixed_rate(bits: u32) -> ZfpConfig {
    let bits = bits.min(MAX_BITS_PER_BLOCK);
    let any = ZfpConfig::fixed_precision(64);
    // Cannot fail: the two limits are equal and the precision is valid.
    ZfpConfig::expert(bits, bits, any.max_prec(), any.min_exp()).unwrap_or(any)
}

pub(crate) fn check_bits_per_block(bits: u32) -> Result<()> {
    if (BLOCK_HEADER_BITS..=MAX_BITS_PER_BLOCK).contains(&bits) {
        Ok(())
    } else {
        Err(Error::BitsPerBlock { found: u64::from(bits) })
    }
}

/// Reads the exponent of every block: refuses those that may overflow, counts tiny ones.
fn check_exponents(bytes: &[u8], grid: &Grid, bits_per_block: u32, first_bit: u64) -> Result<u64> {
    let mut tiny = 0;
    for block in 0..grid.block_count() {
        let bit = first_bit + block * u64::from(bits_per_block);
        tiny += u64::from(check_exponent(bytes, grid, block, bit)?);
    }
    Ok(tiny)
}

/// Whether a block, which starts at `bit` of `bytes`, is tiny; refuses one that may overflow.
pub(crate) fn check_exponent(bytes: &[u8], grid: &Grid, block: u64, bit: u64) -> Result<bool> {
    match biased_exponent(bytes, bit) {
        Some(exponent) if exponent > MAX_EXPONENT => {
            Err(Error::BlockExponent { block, voxel: grid.origin(block), exponent })
        }
        exponent => Ok(exponent.is_some_and(|exponent| exponent <= TINY_EXPONENT)),
    }
}

/// The biased exponent of the block that starts at `bit`; none for a block of zeros.
fn biased_exponent(bytes: &[u8], bit: u64) -> Option<u32> {
    let first = usize::try_from(bit / 8).ok()?;
    let byte = |i: usize| first.checked_add(i).and_then(|i| bytes.get(i)).copied().unwrap_or(0);
    let word = u32::from_le_bytes([byte(0), byte(1), byte(2), 0]) >> (bit % 8);
    (word & 1 == 1).then_some((word >> 1) & 0xff)
}
