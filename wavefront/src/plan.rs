//! Sizes, before anything is allocated.

use gpu_primitives::wgpu;

use crate::foveation::{BlueNoise, SamplingParams};
use crate::frame::{FrameParams, PARAMS_BYTES, preview_size};
use crate::order::RayOrder;
use crate::outputs::ShadingParams;
use crate::{Error, Outputs};

/// Words before the rays' states, as in `shader/lib/frame.wgsl`.
pub(crate) const RAYS_HEADER_WORDS: u64 = 18;

/// Bytes of the indirect arguments of dispatches over the listed rays and over the list itself.
pub(crate) const ARGS_BYTES: u64 = 32;

/// Those of the list's first kernel where a sampling mask may empty the list before all rays are finished.
pub(crate) const MASKED_LIST_ARGS_BYTES: u64 = 16;

/// Bytes of the indirect arguments of the list's second kernel.
pub(crate) const FILL_ARGS_BYTES: u64 = 16;

/// Words of active bits that one workgroup of the list's kernels takes.
pub(crate) const LIST_WORDS_PER_GROUP: u64 = 256;

/// Rays that the active list holds at most; the others wait for a later round.
const MOST_LISTED: u64 = 1 << 21;

/// Rays that the active list of a picture of `size` pixels holds.
pub(crate) fn list_capacity(size: [u32; 2]) -> u64 {
    (u64::from(size[0]) * u64::from(size[1])).min(MOST_LISTED)
}

/// Sizes of everything this crate allocates for pictures of one size.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WavefrontPlan {
    /// Rays in a row and in a column, and their order.
    size: [u32; 2],
    order: RayOrder,
    outputs: Outputs,
    foveation: Option<&'static BlueNoise>,
}

impl WavefrontPlan {
    /// Plans pictures of `size` = [width, height] pixels.
    ///
    /// # Errors
    /// If the picture has no pixel, or its rays or textures exceed the limits.
    pub fn new(size: [u32; 2], outputs: Outputs, limits: &wgpu::Limits) -> Result<Self, Error> {
        let [width, height] = size;
        let binding = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let most_edge = limits.max_texture_dimension_2d;
        let plan = Self { size, order: RayOrder::new(size), outputs, foveation: None };
        let fits = width > 0 && height > 0 && width <= most_edge && height <= most_edge;
        if !fits || plan.state_bytes() > binding {
            // About: what lies outside the picture in its last squares counts, too.
            let most = (binding / 4).saturating_sub(MOST_LISTED) / 33 * 32;
            return Err(Error::PictureSize { width, height, most, most_edge });
        }
        Ok(plan)
    }

    /// The same with what [`crate::Foveation`] needs.
    #[must_use]
    pub fn with_foveation(self, tiles: Option<&'static BlueNoise>) -> Self {
        Self { foveation: tiles, ..self }
    }

    /// The same for previews: pictures of every `step`-th pixel in both directions. `None` unless `step` is a power of two
    /// above 1 and the picture is large enough for it.
    #[must_use]
    pub fn preview(&self, step: u32) -> Option<Self> {
        let order = self.order.preview(step).filter(|_| step > 1)?;
        Some(Self { size: preview_size(self.size, step), order, ..self.clone() })
    }

    /// Tiles of the sampling masks.
    pub fn foveation(&self) -> Option<&'static BlueNoise> {
        self.foveation
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

    /// Numbers of rays in their order; a few more than pixels.
    pub fn numbers(&self) -> u64 {
        self.order.numbers()
    }

    /// Header, states, active bits and active list.
    pub(crate) fn state_bytes(&self) -> u64 {
        let numbers = self.numbers();
        4 * (RAYS_HEADER_WORDS + numbers + numbers / 32 + list_capacity(self.size))
    }

    /// Workgroups of the list's kernels.
    pub(crate) fn list_groups(&self) -> u64 {
        (self.numbers() / 32).div_ceil(LIST_WORDS_PER_GROUP)
    }

    /// Bytes of ray states, the active list and what makes it.
    pub fn ray_bytes(&self) -> u64 {
        self.state_bytes()
            + 4 * self.list_groups()
            + ARGS_BYTES
            + FILL_ARGS_BYTES
            + PARAMS_BYTES
            + size_of::<ShadingParams>() as u64
    }

    /// Bytes of the sampling mask.
    pub(crate) fn mask_bytes(&self) -> u64 {
        self.numbers() / 8
    }

    /// Bytes of the sampling mask and what makes it.
    pub fn foveation_bytes(&self) -> u64 {
        let beside = BlueNoise::BYTES + SamplingParams::BYTES + MASKED_LIST_ARGS_BYTES;
        self.foveation.map_or(0, |_| self.mask_bytes() + beside)
    }

    /// Bytes of the pictures.
    pub fn output_bytes(&self) -> u64 {
        self.rays() * self.outputs.bytes_per_pixel()
    }

    /// Everything together.
    pub fn bytes(&self) -> u64 {
        self.ray_bytes() + self.foveation_bytes() + self.output_bytes()
    }
}

const _: () = assert!(PARAMS_BYTES == size_of::<FrameParams>() as u64);
