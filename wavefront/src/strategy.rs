//! What a traversal strategy is: rounds that end with shaded hits and a shorter list of active rays.

use std::fmt::Debug;

use gpu_primitives::memory::Ledger;
use gpu_primitives::wgpu;

use crate::Error;
use crate::rays::{RayBuffers, Rays};
use crate::samples::Samples;

/// What a strategy works on.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    /// The picture's rays.
    pub rays: &'a RayBuffers,
    /// Active masks, as `macrocell` makes them.
    pub masks: &'a wgpu::Buffer,
    /// The blocks' samples.
    pub samples: Samples<'a>,
}

/// A strategy's pipelines. All strategies make the same picture, bit for bit.
pub trait Strategy: Debug {
    /// Allocates and binds what one picture needs.
    ///
    /// # Errors
    /// [`Error::NeedsCache`] for a strategy that cannot work on a volume that is resident as a whole.
    fn bind(
        &self,
        device: &wgpu::Device,
        ledger: &Ledger,
        scene: Scene<'_>,
    ) -> Result<Box<dyn Rounds>, Error>;
}

/// Records whatever makes the requested blocks resident: the cache's service and the decode.
pub type MakeResident<'a> = &'a mut dyn FnMut(&mut wgpu::CommandEncoder);

/// A strategy at work on one picture.
pub trait Rounds: Debug {
    /// Records what a new frame needs before its first round, once its rays have started.
    fn record_start(&self, encoder: &mut wgpu::CommandEncoder, stage: &Rays, rays: &RayBuffers);

    /// Records one round.
    fn record_round(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        stage: &Rays,
        rays: &RayBuffers,
        make_resident: MakeResident<'_>,
    );

    /// Lists of active rays made before the first round.
    fn lists_at_start(&self) -> u32 {
        1
    }

    /// Where the strategy's [`Statistics`] are, if it has any: parts (buffer, byte offset, bytes)
    /// in the order of the fields.
    fn statistics(&self) -> Vec<(&wgpu::Buffer, u64, u64)>;
}

/// What a strategy tells about its newest round; zero where it does not apply.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Statistics {
    /// Blocks that every active ray went ahead.
    pub speculation: u32,
    /// Ray-block pairs.
    pub pairs: u32,
    /// Different blocks among the pairs whose samples were resident.
    pub visible_blocks: u32,
}
