//! The volume a renderer is made for.

use std::fmt;
use std::sync::Arc;

use zfp_gpu::StreamLayout;

use crate::Error;

/// Bytes of a compressed stream, wherever they live: a `Vec`, an `Arc<[u8]>`, a memory map.
pub type StreamBytes = Arc<dyn AsRef<[u8]> + Send + Sync>;

/// A fixed-rate ZFP stream of a 3D f32 field and where it lies in the world.
///
/// The stream must be free of blocks whose biased exponent exceeds 250, which `volume-io` checks
/// when it reads; others would overflow f32 arithmetic.
#[derive(Clone)]
pub struct CompressedVolume {
    layout: StreamLayout,
    bytes: StreamBytes,
    /// World position of the voxel at index (i, j, k), column-major; must be invertible.
    pub world_from_index: [[f64; 4]; 4],
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
        Ok(Self { layout, bytes, world_from_index: Self::placed([1.0; 3], [0.0; 3]) })
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

    pub(crate) fn bytes(&self) -> &[u8] {
        (*self.bytes).as_ref()
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
            .field("bytes", &self.bytes().len())
            .field("world_from_index", &self.world_from_index)
            .finish()
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
