//! Encoding samples to a fixed-rate stream, block by block.

use zfp_rs::{ZfpBitStream, ZfpBitStreamRef, ZfpConfig, ZfpDimensionality};

use crate::error::{Error, Result};
use crate::grid::{Grid, bits_per_block, pad_block};
use crate::source::{DistortionSum, Format, SampleType, Source};
use crate::volume::{Geometry, ZfpVolume, fixed_rate};

/// Magnitudes from here on belong to blocks with a biased exponent above 250.
pub(crate) const TOO_LARGE: f32 = f32::from_bits((123 + 127) << 23);

/// Magnitudes below this belong to blocks that the GPU decodes as zero.
const TINY: f32 = f32::from_bits((127 - 97) << 23);

/// Encodes a volume whose blocks arrive one at a time, so that the decoded volume never has to
/// exist as a whole. The stream is byte for byte that of libzfp's fixed-rate mode.
#[derive(Debug)]
pub struct BlockEncoder {
    grid: Grid,
    bits_per_block: u32,
    config: ZfpConfig,
    next: u64,
    /// Holds the bits of an incomplete last word, then one block.
    scratch: ZfpBitStream,
    carry: u64,
    carry_bits: u32,
    bytes: Vec<u8>,
    tiny_blocks: u64,
    distortion: Option<DistortionSum>,
}

impl BlockEncoder {
    /// Starts a volume of `dims` voxels at `rate` bits per voxel.
    ///
    /// # Errors
    /// [`Error::Dims`] or [`Error::Rate`].
    pub fn new(dims: [u32; 3], rate: f64) -> Result<Self> {
        let grid = Grid::new(dims)?;
        let bits_per_block = bits_per_block(rate)?;
        let scratch_bytes = bits_per_block.div_ceil(8) + 24;
        let scratch = ZfpBitStream::new(scratch_bytes as usize)
            .map_err(|error| Error::OutOfMemory { bytes: error.bytes as u64 })?;
        Ok(Self {
            grid,
            bits_per_block,
            config: fixed_rate(bits_per_block),
            next: 0,
            scratch,
            carry: 0,
            carry_bits: 0,
            bytes: Vec::new(),
            tiny_blocks: 0,
            distortion: None,
        })
    }

    /// Measures the error introduced, at the price of decoding every block again.
    #[must_use]
    pub fn measured(mut self) -> Self {
        self.distortion = Some(DistortionSum::new());
        self
    }

    /// Number of blocks of the volume.
    #[must_use]
    pub fn block_count(&self) -> u64 {
        self.grid.block_count()
    }

    /// First voxel of the block that [`BlockEncoder::push`] expects next.
    #[must_use]
    pub fn next_origin(&self) -> [u32; 3] {
        self.grid.origin(self.next)
    }

    /// Number of its voxels inside the volume along each axis.
    #[must_use]
    pub fn next_valid(&self) -> [u32; 3] {
        self.grid.valid(self.next_origin())
    }

    /// Adds the next block, x-fastest. Sample (x, y, z) is at x + 4y + 16z; samples outside the
    /// volume are the caller's choice and cost least after [`pad_block`].
    ///
    /// # Errors
    /// [`Error::NonFinite`], [`Error::TooLarge`], [`Error::BlockCount`] after the last block, or
    /// [`Error::OutOfMemory`]. The encoder is unchanged then.
    pub fn push(&mut self, samples: &[f32; 64]) -> Result<()> {
        self.push_exact(samples, |i| f64::from(samples[i]))
    }

    /// As [`BlockEncoder::push`], for samples that are `exact(i)` before rounding.
    pub(crate) fn push_exact(
        &mut self,
        samples: &[f32; 64],
        exact: impl Fn(usize) -> f64,
    ) -> Result<()> {
        if self.next >= self.block_count() {
            let expected = self.block_count();
            return Err(Error::BlockCount { expected, found: expected + 1 });
        }
        let largest = self.check(samples)?;
        self.reserve()?;
        self.encode(samples)?;
        self.measure(exact)?;
        self.take_words();
        self.tiny_blocks += u64::from(largest > 0.0 && largest < TINY);
        self.next += 1;
        Ok(())
    }

    /// The volume, once all its blocks were added.
    ///
    /// # Errors
    /// [`Error::BlockCount`] if blocks are missing.
    pub fn finish(mut self) -> Result<ZfpVolume> {
        let expected = self.block_count();
        if self.next != expected {
            return Err(Error::BlockCount { expected, found: self.next });
        }
        if self.carry_bits > 0 {
            self.bytes.extend_from_slice(&self.carry.to_le_bytes());
        }
        let mut source = Source::new(Format::Memory, SampleType::F32);
        source.encoded = true;
        source.tiny_blocks = self.tiny_blocks;
        source.distortion = self.distortion.map(|sum| sum.distortion());
        Ok(ZfpVolume {
            dims: self.grid.dims,
            bits_per_block: self.bits_per_block,
            first_bit: 0,
            bytes: self.bytes.into(),
            geometry: Geometry::default(),
            source,
        })
    }

    /// The largest magnitude of a block without values that cannot be encoded.
    fn check(&self, samples: &[f32; 64]) -> Result<f32> {
        let mut largest = 0.0f32;
        for (i, &sample) in samples.iter().enumerate() {
            if sample.is_nan() || sample.abs() >= TOO_LARGE {
                let (voxel, value) = (self.grid.voxel(self.next, i), f64::from(sample));
                return Err(if value.is_finite() {
                    Error::TooLarge { voxel, value }
                } else {
                    Error::NonFinite { voxel, value }
                });
            }
            largest = largest.max(sample.abs());
        }
        Ok(largest)
    }

    fn reserve(&mut self) -> Result<()> {
        let more = self.bits_per_block as usize / 8 + 24;
        self.bytes
            .try_reserve(more)
            .map_err(|_error| Error::OutOfMemory { bytes: self.bytes.len() as u64 * 2 })
    }

    fn encode(&mut self, samples: &[f32; 64]) -> Result<()> {
        self.scratch.rewind();
        self.scratch.write_bits(self.carry, self.carry_bits);
        zfp_rs::codec::block::encode_block(
            &mut self.scratch,
            &self.config,
            samples,
            ZfpDimensionality::D3,
        )
        .map_err(|error| Error::Codec { reason: error.to_string() })?;
        self.scratch.flush();
        Ok(())
    }

    fn measure(&mut self, exact: impl Fn(usize) -> f64) -> Result<()> {
        let [nx, ny, nz] = self.next_valid().map(|n| n as usize);
        let Some(sum) = &mut self.distortion else { return Ok(()) };
        let mut decoded = [0.0f32; 64];
        let mut stream = ZfpBitStreamRef::from_words(self.scratch.backing_words());
        stream.seek_read(u64::from(self.carry_bits));
        zfp_rs::codec::block::decode_block(
            &mut stream,
            &self.config,
            &mut decoded,
            ZfpDimensionality::D3,
        )
        .map_err(|error| Error::Codec { reason: error.to_string() })?;
        for z in 0..nz {
            for y in 0..ny {
                for i in (0..nx).map(|x| x + 4 * y + 16 * z) {
                    sum.add(exact(i), decoded[i]);
                }
            }
        }
        Ok(())
    }

    /// Moves the complete words of the scratch stream to the output.
    fn take_words(&mut self) {
        let bits = self.carry_bits + self.bits_per_block;
        let complete = (bits / 64) as usize;
        let words = self.scratch.as_words();
        for word in words.iter().take(complete) {
            self.bytes.extend_from_slice(&word.to_le_bytes());
        }
        self.carry_bits = bits % 64;
        self.carry = words.get(complete).copied().unwrap_or(0);
    }
}

/// Encodes `samples` (x-fastest, `dims` of them) at `rate` bits per voxel, byte for byte as
/// libzfp does in its fixed-rate mode.
///
/// # Errors
/// [`Error::Dims`], [`Error::Rate`], [`Error::SampleCount`], [`Error::NonFinite`] or
/// [`Error::TooLarge`].
pub fn encode(samples: &[f32], dims: [u32; 3], rate: f64) -> Result<ZfpVolume> {
    let mut encoder = BlockEncoder::new(dims, rate)?;
    let expected = encoder.grid.voxel_count();
    if samples.len() as u64 != expected {
        return Err(Error::SampleCount { expected, found: samples.len() as u64 });
    }
    for _ in 0..encoder.block_count() {
        let (origin, valid) = (encoder.next_origin(), encoder.next_valid());
        let mut block = gather(samples, dims, origin, valid);
        pad_block(&mut block, valid);
        encoder.push(&block)?;
    }
    encoder.finish()
}

/// The samples of a block, which lies inside `samples`; those outside the volume are zero.
pub(crate) fn gather<T: Copy + Default>(
    samples: &[T],
    dims: [u32; 3],
    origin: [u32; 3],
    valid: [u32; 3],
) -> [T; 64] {
    let [nx, ny, _] = dims.map(|n| n as usize);
    let [ox, oy, oz] = origin.map(|n| n as usize);
    let [vx, vy, vz] = valid.map(|n| n as usize);
    let mut block = [T::default(); 64];
    for z in 0..vz {
        for y in 0..vy {
            let start = ox + nx * (oy + y + ny * (oz + z));
            if let Some(row) = samples.get(start..start + vx) {
                block[4 * y + 16 * z..][..vx].copy_from_slice(row);
            }
        }
    }
    block
}
