//! Strategy RunAhead: walk through what is resident, stop at the first missing block.

use gpu_primitives::kernel::{Kernel, KernelSource};
use gpu_primitives::wgpu;
use gpu_primitives::wgsl::Module;
use lru_cache_gpu::CacheBuffers;

use crate::rays::{
    FRAME_PARAMS, RAYS, READ, RayBuffers, Rays, SLOTS, WRITE, begin, resources, source,
};

const WALK: Module = Module { name: "walk", source: include_str!("../shader/walk.wgsl") };

/// The strategy's kernel. Immutable; used with any number of pictures.
#[derive(Debug)]
pub struct RunAhead {
    walk: Kernel,
}

/// What the strategy binds for one picture; it allocates nothing.
#[derive(Debug)]
pub struct RunAheadBuffers {
    /// One for each active list.
    walk: [wgpu::BindGroup; 2],
}

impl RunAhead {
    /// Makes the pipeline for a cache of `slot_pages` pages.
    pub fn new(device: &wgpu::Device, slot_pages: u32) -> Self {
        Self { walk: Self::source(slot_pages).kernel(device) }
    }

    /// Text and bindings of the kernel.
    pub fn source(slot_pages: u32) -> KernelSource {
        let mut bindings = vec![FRAME_PARAMS, RAYS, READ, READ, WRITE, WRITE];
        bindings.extend(vec![SLOTS; slot_pages as usize]);
        source("wavefront.walk", WALK, bindings, slot_pages, None)
    }

    /// Binds one picture's rays, the active `masks` and the cache.
    pub fn bind(
        &self,
        device: &wgpu::Device,
        rays: &RayBuffers,
        masks: &wgpu::Buffer,
        cache: &CacheBuffers,
    ) -> RunAheadBuffers {
        let walk = rays.lists().map(|list| {
            let (directory, state) = (cache.directory(), cache.state());
            let mut bindings =
                resources(&[rays.frame(), rays.rays(), list, masks, directory, state]);
            bindings.extend(cache.slots().iter().map(|page| page.as_entire_binding()));
            self.walk.bind(device, "wavefront.walk", &bindings)
        });
        RunAheadBuffers { walk }
    }

    /// Records one round: a walk of the active rays, the shading of new hits, and what
    /// `make_resident` records to serve the requests.
    pub fn record_round(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        stage: &Rays,
        rays: &mut RayBuffers,
        buffers: &RunAheadBuffers,
        make_resident: impl FnOnce(&mut wgpu::CommandEncoder),
    ) {
        {
            let mut pass = begin(encoder, "wavefront.walk");
            let walk = &buffers.walk[rays.side()];
            self.walk.dispatch_indirect(&mut pass, walk, rays.args(), 0);
        }
        stage.record_resolve(encoder, rays);
        make_resident(encoder);
    }
}
