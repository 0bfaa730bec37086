//! Encoding to a writer instead of memory, for volumes of any size.

use std::io::Write;

use crate::encode::{Encoded, Encoder};
use crate::error::Result;
use crate::formats::header_words;
use crate::grid::{Grid, bits_per_block};
use crate::sink::Stream;
use crate::source::Source;
use crate::volume::{Geometry, ZfpVolume};

/// Encodes a volume whose blocks arrive one at a time and writes the stream away as it goes,
/// behind zfp's own header, so that the `zfp` program (option `-h`) and [`crate::read_file`] read
/// it. Needs no memory that grows with the volume.
///
/// ```
/// # fn main() -> Result<(), volume_io::Error> {
/// let mut file = Vec::new();
/// let mut encoder = volume_io::StreamEncoder::new([8, 4, 4], 8.0, &mut file)?;
/// encoder.push(&[1.0; 64])?;
/// encoder.push(&[2.0; 64])?;
/// assert_eq!(encoder.finish()?.bytes, 144);
/// let volume = volume_io::read_bytes("file.zfp", file, &Default::default())?;
/// assert_eq!(volume.decode()[3..5], [1.0, 2.0]);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct StreamEncoder<W: Write> {
    inner: Encoder<Stream<W>>,
}

impl<W: Write> StreamEncoder<W> {
    /// Starts a volume of `dims` voxels at `rate` bits per voxel by writing its header.
    ///
    /// # Errors
    /// [`crate::Error::Dims`], [`crate::Error::Rate`] or [`crate::Error::Io`].
    pub fn new(dims: [u32; 3], rate: f64, writer: W) -> Result<Self> {
        let grid = Grid::new(dims)?;
        let bits_per_block = bits_per_block(rate)?;
        let (header, bits) = header_words(dims, bits_per_block)?;
        let sink = Stream::new(writer);
        let inner = Encoder::behind_header(grid, bits_per_block, sink, &header, bits)?;
        Ok(Self { inner })
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

    /// First voxel of the block that [`StreamEncoder::push`] expects next.
    #[must_use]
    pub fn next_origin(&self) -> [u32; 3] {
        self.inner.next_origin()
    }

    /// Number of its voxels inside the volume along each axis.
    #[must_use]
    pub fn next_valid(&self) -> [u32; 3] {
        self.inner.next_valid()
    }

    /// Adds the next block, as [`crate::BlockEncoder::push`] does.
    ///
    /// # Errors
    /// [`crate::Error::NonFinite`], [`crate::Error::TooLarge`] or [`crate::Error::BlockCount`],
    /// which leave the encoder unchanged; [`crate::Error::Io`], after which the file is unusable.
    pub fn push(&mut self, samples: &[f32; 64]) -> Result<()> {
        self.inner.push(samples)
    }

    /// Writes what is left, once all blocks were added.
    ///
    /// # Errors
    /// [`crate::Error::BlockCount`] if blocks are missing, or [`crate::Error::Io`].
    pub fn finish(self) -> Result<Conversion> {
        Conversion::finish(self.inner.finish()?)
    }

    pub(crate) fn into_inner(self) -> Encoder<Stream<W>> {
        self.inner
    }
}

/// What was written by [`StreamEncoder`] or [`convert_bytes`](crate::convert_bytes).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Conversion {
    /// Voxels along x, y and z.
    pub dims: [u32; 3],
    /// Bits of every block of 4^3 voxels.
    pub bits_per_block: u32,
    /// Bytes written, with the header.
    pub bytes: u64,
    /// Placement in space, for which the file written has no place.
    pub geometry: Geometry,
    /// Where the volume comes from and what was done to it.
    pub source: Source,
}

impl Conversion {
    pub(crate) fn new(volume: &ZfpVolume, bytes: u64) -> Self {
        Self {
            dims: volume.dims,
            bits_per_block: volume.bits_per_block,
            bytes,
            geometry: volume.geometry,
            source: volume.source.clone(),
        }
    }

    pub(crate) fn finish<W: Write>(encoded: Encoded<Stream<W>>) -> Result<Self> {
        Ok(Self {
            dims: encoded.dims,
            bits_per_block: encoded.bits_per_block,
            bytes: encoded.sink.finish()?,
            geometry: encoded.geometry,
            source: encoded.source,
        })
    }
}
