//! The volume a renderer is made for.

use std::borrow::Cow;
use std::fmt;
use std::sync::Arc;

use zfp_gpu::StreamLayout;

use crate::Error;
use crate::arriving::{self, Arriving, Found, StreamFeed};

/// Bytes of a compressed stream, wherever they live: a `Vec`, an `Arc<[u8]>`, a memory map.
pub type StreamBytes = Arc<dyn AsRef<[u8]> + Send + Sync>;

/// A fixed-rate ZFP stream of a 3D f32 field and where it lies in the world.
///
/// The stream must be free of blocks whose biased exponent exceeds 250, which `volume-io` checks
/// when it reads; others would overflow f32 arithmetic.
#[derive(Clone)]
pub struct CompressedVolume {
    layout: StreamLayout,
    source: Source,
    /// World position of the voxel at index (i, j, k), column-major; must be invertible.
    pub world_from_index: [[f64; 4]; 4],
}

/// Where a stream's bytes come from.
#[derive(Clone)]
enum Source {
    Whole(StreamBytes),
    Arriving(Arriving),
}

impl CompressedVolume {
    /// A volume of `dims` voxels whose blocks have `bits_per_block` bits and start at bit
    /// `first_bit` of `bytes`; voxel (i, j, k) lies at world position (i, j, k).
    ///
    /// # Errors
    /// If the layout is impossible or `bytes` is too short for it.
    pub fn new(
        dims: [u32; 3],
        bits_per_block: u32,
        first_bit: u64,
        bytes: StreamBytes,
    ) -> Result<Self, Error> {
        let layout = StreamLayout::new(dims, bits_per_block, first_bit)?;
        let (expected, found) = (layout.stream_bytes(), (*bytes).as_ref().len() as u64);
        if found < expected {
            return Err(Error::ShortStream { dims, bits_per_block, expected, found });
        }
        Ok(Self::with_source(layout, Source::Whole(bytes)))
    }

    /// Like [`CompressedVolume::new`], but the stream arrives through the [`StreamFeed`] while a renderer
    /// loads it, and its bytes are let go as soon as they are on the way to the GPU. So it never is in main
    /// memory as a whole, and a single renderer can load it: a second one, for which a clone would have to
    /// serve, is told [`Error::StreamTaken`].
    ///
    /// # Errors
    /// If the layout is impossible.
    pub fn streamed(
        dims: [u32; 3],
        bits_per_block: u32,
        first_bit: u64,
    ) -> Result<(Self, StreamFeed), Error> {
        let layout = StreamLayout::new(dims, bits_per_block, first_bit)?;
        let (feed, arriving) = arriving::channel();
        Ok((Self::with_source(layout, Source::Arriving(arriving)), feed))
    }

    fn with_source(layout: StreamLayout, source: Source) -> Self {
        Self { layout, source, world_from_index: Self::placed([1.0; 3], [0.0; 3]) }
    }

    /// Matrix that puts voxel (i, j, k) at `origin + spacing * (i, j, k)`.
    #[must_use]
    pub fn placed(spacing: [f64; 3], origin: [f64; 3]) -> [[f64; 4]; 4] {
        [
            [spacing[0], 0.0, 0.0, 0.0],
            [0.0, spacing[1], 0.0, 0.0],
            [0.0, 0.0, spacing[2], 0.0],
            [origin[0], origin[1], origin[2], 1.0],
        ]
    }

    /// Voxels on each axis.
    #[must_use]
    pub fn dims(&self) -> [u32; 3] {
        self.layout.dims
    }

    /// Where the blocks lie in the stream.
    #[must_use]
    pub fn layout(&self) -> &StreamLayout {
        &self.layout
    }

    /// Whether there are bytes to read behind the first `position` ones, which were read before.
    ///
    /// # Errors
    /// If there will be none.
    pub(crate) fn has_bytes(&self, position: u64) -> Result<bool, Error> {
        let Source::Arriving(arriving) = &self.source else { return Ok(true) };
        match arriving.find(position) {
            Found::Bytes => Ok(true),
            Found::Nothing => Ok(false),
            Found::Taken => Err(Error::StreamTaken),
            Found::End => Err(Error::ShortStream {
                dims: self.layout.dims,
                bits_per_block: self.layout.bits_per_block,
                expected: self.layout.stream_bytes(),
                found: position,
            }),
        }
    }

    /// Reads at most `most` bytes behind the first `position` ones.
    pub(crate) fn read(&self, position: u64, most: u64) -> Cow<'_, [u8]> {
        let most = most.min(self.layout.stream_bytes().saturating_sub(position));
        match &self.source {
            Source::Whole(bytes) => {
                let bytes = (**bytes).as_ref();
                // Within the slice, as `new` checks.
                Cow::Borrowed(&bytes[position as usize..(position + most) as usize])
            }
            Source::Arriving(arriving) => Cow::Owned(arriving.take(most)),
        }
    }

    /// World-space centre of the volume and the radius of the ball around it, for cameras.
    #[must_use]
    pub fn bounding_ball(&self) -> ([f64; 3], f64) {
        let world = glam::DMat4::from_cols_array_2d(&self.world_from_index);
        let last = glam::DVec3::from(self.dims().map(|d| f64::from(d) - 1.0));
        let center = world.transform_point3(last / 2.0);
        let radius = (0..8u32)
            .map(|corner| {
                let pick = |axis: u32| f64::from((corner >> axis) & 1);
                let index = glam::DVec3::new(pick(0), pick(1), pick(2)) * last;
                world.transform_point3(index).distance(center)
            })
            .fold(0.0, f64::max);
        (center.to_array(), radius)
    }
}

impl fmt::Debug for CompressedVolume {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("CompressedVolume")
            .field("layout", &self.layout)
            .field("source", &self.source)
            .field("world_from_index", &self.world_from_index)
            .finish()
    }
}

impl fmt::Debug for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole(bytes) => write!(f, "{} bytes", (**bytes).as_ref().len()),
            Self::Arriving(arriving) => arriving.fmt(f),
        }
    }
}

#[cfg(feature = "volume-io")]
impl TryFrom<&volume_io::ZfpVolume> for CompressedVolume {
    type Error = Error;

    /// Shares the bytes; takes spacing and origin.
    fn try_from(volume: &volume_io::ZfpVolume) -> Result<Self, Error> {
        let bytes = Arc::new(Arc::clone(&volume.bytes));
        let mut result = Self::new(volume.dims, volume.bits_per_block, volume.first_bit, bytes)?;
        let geometry = &volume.geometry;
        result.world_from_index = Self::placed(geometry.spacing, geometry.origin);
        Ok(result)
    }
}
