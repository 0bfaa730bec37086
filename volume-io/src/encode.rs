//! Encoding samples to a fixed-rate stream, block by block.

use zfp_rs::{ZfpBitStream, ZfpBitStreamRef, ZfpConfig, ZfpDimensionality};

use crate::error::{Error, Result};
use crate::grid::{Grid, bits_per_block, pad_block};
use crate::sink::{Memory, Sink};
use crate::source::{DistortionSum, Format, SampleType, Source};
use crate::volume::{Geometry, ZfpVolume, fixed_rate};

/// Magnitudes from here on belong to blocks with a biased exponent above 250.
pub(crate) const TOO_LARGE: f32 = f32::from_bits((123 + 127) << 23);

/// Magnitudes below this belong to blocks that the GPU decodes as zero.
const TINY: f32 = f32::from_bits((127 - 97) << 23);

/// Encodes a volume whose blocks arrive one at a time, so that the decoded volume never has to
/// exist as a whole. The stream is byte for byte that of libzfp's fixed-rate mode.
///
/// The memory of the whole stream is allocated with the first block, and becomes the volume's
/// without a copy. [`StreamEncoder`](crate::StreamEncoder) writes the stream away instead.
#[derive(Debug)]
pub struct BlockEncoder {
    inner: Encoder<Memory>,
}

impl BlockEncoder {
    /// Starts a volume of `dims` voxels at `rate` bits per voxel.
    ///
    /// # Errors
    /// [`Error::Dims`] or [`Error::Rate`].
    pub fn new(dims: [u32; 3], rate: f64) -> Result<Self> {
        Ok(Self { inner: Encoder::in_memory(dims, rate, true)? })
    }

    /// Measures the error introduced, at the price of decoding every block again.
    #[must_use]
    pub fn measured(mut self) -> Self {
        self.inner.measure();
        self
    }

    /// Number of blocks of the volume.
    #[must_use]
    pub fn block_count(&self) -> u64 {
        self.inner.block_count()
    }

    /// First voxel of the block that [`BlockEncoder::push`] expects next.
    #[must_use]
    pub fn next_origin(&self) -> [u32; 3] {
        self.inner.next_origin()
    }

    /// Number of its voxels inside the volume along each axis.
    #[must_use]
    pub fn next_valid(&self) -> [u32; 3] {
        self.inner.next_valid()
    }

    /// Adds the next block, x-fastest. Sample (x, y, z) is at x + 4y + 16z; samples outside the
    /// volume are the caller's choice and cost least after [`pad_block`].
    ///
    /// # Errors
    /// [`Error::NonFinite`], [`Error::TooLarge`], [`Error::BlockCount`] after the last block, or
    /// [`Error::OutOfMemory`]. The encoder is unchanged then.
    pub fn push(&mut self, samples: &[f32; 64]) -> Result<()> {
        self.inner.push(samples)
    }

    /// The volume, once all its blocks were added.
    ///
    /// # Errors
    /// [`Error::BlockCount`] if blocks are missing.
    pub fn finish(self) -> Result<ZfpVolume> {
        self.inner.finish()?.into_volume()
    }
}

/// Turns blocks into the words of a stream, which go to `sink`.
#[derive(Debug)]
pub(crate) struct Encoder<S> {
    grid: Grid,
    bits_per_block: u32,
    config: ZfpConfig,
    next: u64,
    /// Holds the bits of an incomplete last word, then one block.
    scratch: ZfpBitStream,
    carry: u64,
    carry_bits: u32,
    sink: S,
    tiny_blocks: u64,
    distortion: Option<DistortionSum>,
}

/// What an encoder leaves behind.
pub(crate) struct Encoded<S> {
    pub(crate) dims: [u32; 3],
    pub(crate) bits_per_block: u32,
    pub(crate) source: Source,
    pub(crate) geometry: Geometry,
    pub(crate) sink: S,
}

impl Encoded<Memory> {
    pub(crate) fn into_volume(self) -> Result<ZfpVolume> {
        Ok(ZfpVolume {
            dims: self.dims,
            bits_per_block: self.bits_per_block,
            first_bit: 0,
            bytes: self.sink.into_bytes()?,
            geometry: self.geometry,
            source: self.source,
        })
    }
}

impl Encoder<Memory> {
    /// `whole`: the stream will be complete, so its memory can be allocated at once.
    pub(crate) fn in_memory(dims: [u32; 3], rate: f64, whole: bool) -> Result<Self> {
        let grid = Grid::new(dims)?;
        let bits_per_block = bits_per_block(rate)?;
        let total = grid.stream_bytes(bits_per_block, 0).next_multiple_of(8);
        Self::new(grid, bits_per_block, Memory::new(total, whole))
    }
}

impl<S: Sink> Encoder<S> {
    pub(crate) fn new(grid: Grid, bits_per_block: u32, sink: S) -> Result<Self> {
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
            sink,
            tiny_blocks: 0,
            distortion: None,
        })
    }

    /// As [`Encoder::new`]; the first `bits` bits of the stream are those of `header`.
    pub(crate) fn behind_header(
        grid: Grid,
        bits_per_block: u32,
        sink: S,
        header: &[u64],
        bits: u32,
    ) -> Result<Self> {
        let mut encoder = Self::new(grid, bits_per_block, sink)?;
        encoder.carry_bits = bits % 64;
        let complete = (bits / 64) as usize;
        encoder.carry = header.get(complete).copied().unwrap_or(0);
        for word in header.iter().take(complete) {
            encoder.sink.write(word.to_le_bytes())?;
        }
        Ok(encoder)
    }

    pub(crate) fn measure(&mut self) {
        self.distortion = Some(DistortionSum::new());
    }

    pub(crate) fn block_count(&self) -> u64 {
        self.grid.block_count()
    }

    /// Number of blocks that were added.
    pub(crate) fn blocks_done(&self) -> u64 {
        self.next
    }

    pub(crate) fn next_origin(&self) -> [u32; 3] {
        self.grid.origin(self.next)
    }

    pub(crate) fn next_valid(&self) -> [u32; 3] {
        self.grid.valid(self.next_origin())
    }

    pub(crate) fn push(&mut self, samples: &[f32; 64]) -> Result<()> {
        self.push_exact(samples, |i| f64::from(samples[i]))
    }

    /// As [`Encoder::push`], for samples that are `exact(i)` before rounding.
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
        self.sink.reserve(u64::from(self.bits_per_block) / 8 + 16)?;
        self.encode(samples)?;
        self.compare(exact)?;
        self.take_words()?;
        self.tiny_blocks += u64::from(largest > 0.0 && largest < TINY);
        self.next += 1;
        Ok(())
    }

    pub(crate) fn finish(mut self) -> Result<Encoded<S>> {
        let expected = self.block_count();
        if self.next != expected {
            return Err(Error::BlockCount { expected, found: self.next });
        }
        if self.carry_bits > 0 {
            self.sink.write(self.carry.to_le_bytes())?;
        }
        let mut source = Source::new(Format::Memory, SampleType::F32);
        source.encoded = true;
        source.tiny_blocks = self.tiny_blocks;
        source.distortion = self.distortion.map(|sum| sum.distortion());
        Ok(Encoded {
            dims: self.grid.dims,
            bits_per_block: self.bits_per_block,
            source,
            geometry: Geometry::default(),
            sink: self.sink,
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

    /// Adds the differences between the block just encoded and its exact samples.
    fn compare(&mut self, exact: impl Fn(usize) -> f64) -> Result<()> {
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
    fn take_words(&mut self) -> Result<()> {
        let bits = self.carry_bits + self.bits_per_block;
        let complete = (bits / 64) as usize;
        let words = self.scratch.as_words();
        for word in words.iter().take(complete) {
            self.sink.write(word.to_le_bytes())?;
        }
        self.carry_bits = bits % 64;
        self.carry = words.get(complete).copied().unwrap_or(0);
        Ok(())
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
    let expected = encoder.inner.grid.voxel_count();
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
fn gather<T: Copy + Default>(
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
