//! Which rays of a picture are cast first: more where the eye looks, by a threshold on spatiotemporal blue noise
//! (D. Bauer, Q. Wu, K.-L. Ma, `FoVolNet`: Fast Volume Rendering using Foveated Deep Neural Networks, 2023).

use std::sync::LazyLock;

use bytemuck::{Pod, Zeroable};
use gpu_primitives::kernel::{Binding, KernelSource};
use gpu_primitives::wgsl::{Constant, Module};

use crate::Error;
use crate::rays::{FRAME_PARAMS, RAYS, READ, WRITE, source};
use crate::samples::SampleLayout;

/// Tiles of spatiotemporal blue noise: [`Self::SLICES`] slices of [`Self::EDGE`]^2 pixels, toroidal in all three
/// directions. In every slice each rank below [`Self::RANKS`] occurs once.
#[derive(Clone, PartialEq, Eq)]
pub struct BlueNoise {
    /// Slice by slice, row by row.
    ranks: Vec<u16>,
}

impl BlueNoise {
    /// Width and height of a slice in pixels.
    pub const EDGE: u32 = 32;
    /// Slices; frames go through them in turn.
    pub const SLICES: u32 = 64;
    /// Ranks in a slice.
    pub const RANKS: u32 = Self::EDGE * Self::EDGE;
    /// Bytes on the GPU, and of the file: a rank in two bytes.
    pub const BYTES: u64 = 2 * Self::RANKS as u64 * Self::SLICES as u64;

    /// The tiles that come with the crate, made by its example `blue_noise`. A program that does not call this does not
    /// contain them.
    pub fn tiles() -> &'static Self {
        static TILES: LazyLock<BlueNoise> = LazyLock::new(|| {
            let bytes = include_bytes!("../data/blue_noise.u16");
            BlueNoise {
                ranks: bytes.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect(),
            }
        });
        &TILES
    }

    /// The rank of a pixel of the picture, the tiles repeated, in the slice of a frame's number.
    #[must_use]
    pub fn rank(&self, pixel: [u32; 2], frame: u64) -> u32 {
        let [x, y] = pixel.map(|p| (p % Self::EDGE) as usize);
        let slice = (frame % u64::from(Self::SLICES)) as usize;
        self.ranks[x + Self::EDGE as usize * y + Self::RANKS as usize * slice].into()
    }

    /// Slice by slice, row by row.
    #[must_use]
    pub fn ranks(&self) -> &[u16] {
        &self.ranks
    }
}

impl std::fmt::Debug for BlueNoise {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("BlueNoise").finish_non_exhaustive()
    }
}

/// Which rays a frame casts in its first pass, and how the others follow.
///
/// Pass k = 0, 1, .. of a frame may cast the ray of a pixel if the pixel's value of blue noise is below
/// `1 - (1 - tau)^(k + 1)`, with `tau = (1 - base_density) P + base_density` and `P = exp(-0.5 r^2 / sigma)`,
/// where r is the pixel's distance from the gaze in shares of the picture's width and height (equations 1 and 2 of
/// the publication, the first with sigma as a divisor, as its results have it). So rays are added from pass to
/// pass as if every pass drew anew, and none is cast twice. Another frame has another slice of the blue noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foveation {
    /// Where the eye looks, in shares of width and height from the upper left corner; may lie outside the picture.
    pub gaze: [f32; 2],
    /// Variance of the fovea in squares of those shares. 0: no fovea, all of the picture has the base density.
    pub sigma: f32,
    /// Share of the rays far from the gaze, 0 to 1.
    pub base_density: f32,
    /// Passes from which on all rays may be cast, 1 to [`Self::MOST_PASSES`]: a frame ends however small its
    /// density is.
    pub passes: u32,
}

impl Default for Foveation {
    /// Looks at the middle, with the density and size of the publication's middle setting.
    fn default() -> Self {
        Self { gaze: [0.5, 0.5], sigma: 0.02, base_density: 0.03, passes: Self::MOST_PASSES }
    }
}

impl Foveation {
    /// Most passes before all rays may be cast.
    pub const MOST_PASSES: u32 = 64;

    /// Checks the ranges.
    ///
    /// # Errors
    /// [`Error::Foveation`] if a number is out of its range or not finite.
    pub fn check(&self) -> Result<(), Error> {
        let finite = self.gaze.iter().all(|g| g.is_finite()) && self.sigma.is_finite();
        let inside = self.sigma >= 0.0 && (0.0..=1.0).contains(&self.base_density);
        let passes = (1..=Self::MOST_PASSES).contains(&self.passes);
        if finite && inside && passes { Ok(()) } else { Err(Error::Foveation { found: *self }) }
    }

    /// Share of the rays of a picture of `size` pixels that the first pass casts: the mean of tau, which the
    /// publication calls `C_max` (equation 3). Its inverse is the most that a frame of one pass can be faster.
    #[must_use]
    pub fn mean_density(&self, size: [u32; 2]) -> f64 {
        let base = f64::from(self.base_density);
        if self.sigma == 0.0 {
            return base;
        }
        // P is a product of a function of the column and one of the row.
        let mean = |axis: usize| {
            let pixels = (0..size[axis]).map(|p| {
                let share = (f64::from(p) + 0.5) / f64::from(size[axis]);
                (-0.5 * (share - f64::from(self.gaze[axis])).powi(2) / f64::from(self.sigma)).exp()
            });
            pixels.sum::<f64>() / f64::from(size[axis].max(1))
        };
        base + (1.0 - base) * mean(0) * mean(1)
    }
}

/// Uniform struct `SamplingParams` of `shader/sampling_mask.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct SamplingParams {
    pub(crate) gaze: [f32; 2],
    pub(crate) share_per_pixel: [f32; 2],
    /// `0.5 / sigma`, or 0 for no fovea.
    pub(crate) falloff: f32,
    pub(crate) base_density: f32,
    /// Word of the first rank of the frame's slice.
    pub(crate) slice: u32,
    /// Passes that have drawn after this one; 0 for all rays.
    pub(crate) draws: u32,
    pub(crate) lattice_level: u32,
    pub(crate) pad0: u32,
}

impl SamplingParams {
    /// Bytes of the uniform.
    pub(crate) const BYTES: u64 = size_of::<Self>() as u64;

    /// Pass `pass`, counted from 0, of a frame of `size` pixels.
    #[must_use]
    pub fn new(foveation: &Foveation, size: [u32; 2], frame: u64, pass: u32) -> Self {
        let Foveation { gaze, sigma, base_density, passes } = *foveation;
        Self {
            gaze,
            share_per_pixel: size.map(|s| 1.0 / s.max(1) as f32),
            falloff: if sigma > 0.0 { 0.5 / sigma } else { 0.0 },
            base_density,
            slice: (frame % u64::from(BlueNoise::SLICES)) as u32 * (BlueNoise::RANKS / 2),
            draws: if pass + 1 < passes { pass + 1 } else { 0 },
            lattice_level: 0,
            pad0: 0,
        }
    }

    /// The same with every `step`-th pixel in both directions, whatever its value of blue noise: 1 for none, 2 or 4.
    #[must_use]
    pub fn with_lattice(self, step: u32) -> Self {
        Self { lattice_level: step.clamp(1, 4).ilog2(), ..self }
    }
}

const SAMPLING_MASK: Module =
    Module { name: "sampling_mask", source: include_str!("../shader/sampling_mask.wgsl") };

/// Text and bindings of the kernel that makes the mask.
pub(crate) fn mask_source(samples: SampleLayout) -> KernelSource {
    let params = Binding::Uniform { bytes: SamplingParams::BYTES };
    let constants = [("TILE_EDGE", BlueNoise::EDGE), ("TILE_RANKS", BlueNoise::RANKS)];
    let constants = constants.map(|(name, value)| (name, Constant::U32(value)));
    let bindings = vec![FRAME_PARAMS, params, RAYS, READ, WRITE];
    source("wavefront.sampling_mask", SAMPLING_MASK, bindings, samples, &constants, None)
}
