//! Sizes, before anything is allocated.

use gpu_primitives::compact::Compact;
use gpu_primitives::wgpu;

use crate::frame::{FrameParams, PARAMS_BYTES};
use crate::outputs::ShadingParams;
use crate::{Error, Outputs};

/// Words before the rays' states, as in `shader/lib/frame.wgsl`.
pub(crate) const RAYS_HEADER_WORDS: u64 = 4;

/// Bytes of the indirect arguments.
pub(crate) const ARGS_BYTES: u64 = 16;

/// Sizes of everything this crate allocates for pictures of one size.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WavefrontPlan {
    size: [u32; 2],
    outputs: Outputs,
}

impl WavefrontPlan {
    /// Plans pictures of `size` = [width, height] pixels.
    ///
    /// # Errors
    /// If the picture has no pixel, or its rays or textures exceed the limits.
    pub fn new(size: [u32; 2], outputs: Outputs, limits: &wgpu::Limits) -> Result<Self, Error> {
        let [width, height] = size;
        let binding = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let most = binding / 4 - RAYS_HEADER_WORDS;
        let most_edge = limits.max_texture_dimension_2d;
        let pixels = u64::from(width) * u64::from(height);
        if pixels == 0 || pixels > most || width > most_edge || height > most_edge {
            return Err(Error::PictureSize { width, height, most, most_edge });
        }
        Ok(Self { size, outputs })
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Which pictures are made beside the colour.
    pub fn outputs(&self) -> Outputs {
        self.outputs
    }

    /// Pixels, hence rays.
    pub fn rays(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1])
    }

    pub(crate) fn state_bytes(&self) -> u64 {
        4 * (RAYS_HEADER_WORDS + self.rays())
    }

    /// Bytes of ray states, both active lists, flags and the scratch memory of compaction.
    pub fn ray_bytes(&self) -> u64 {
        self.state_bytes() + 3 * 4 * self.rays() + self.scratch_bytes()
    }

    fn scratch_bytes(&self) -> u64 {
        let args = gpu_primitives::indirect::IndirectArgs::BIND_BYTES + ARGS_BYTES;
        2 * Compact::plan(self.rays()).bytes()
            + args
            + PARAMS_BYTES
            + size_of::<ShadingParams>() as u64
    }

    /// Bytes of the pictures.
    pub fn output_bytes(&self) -> u64 {
        self.rays() * self.outputs.bytes_per_pixel()
    }

    /// Everything together.
    pub fn bytes(&self) -> u64 {
        self.ray_bytes() + self.output_bytes()
    }
}

const _: () = assert!(PARAMS_BYTES == size_of::<FrameParams>() as u64);
