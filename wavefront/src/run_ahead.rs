//! Strategy RunAhead: walk through what is resident, stop at the first missing block.

use std::sync::Arc;

use gpu_primitives::kernel::{Kernel, KernelSource};
use gpu_primitives::memory::Ledger;
use gpu_primitives::wgpu;
use gpu_primitives::wgsl::Module;

use crate::rays::{
    FRAME_PARAMS, MASKS, RAYS, RayBuffers, Rays, SLOTS, WRITE, begin, resources, source,
};
use crate::strategy::{MakeResident, Rounds, Scene, Strategy};

const WALK: Module = Module { name: "walk", source: include_str!("../shader/walk.wgsl") };

/// The strategy's kernel. Immutable; used with any number of pictures.
#[derive(Debug)]
pub struct RunAhead {
    walk: Arc<Kernel>,
}

/// The strategy allocates nothing.
#[derive(Debug)]
struct RunAheadRounds {
    walk: Arc<Kernel>,
    bind: wgpu::BindGroup,
}

impl RunAhead {
    /// Makes the pipeline for a cache of `slot_pages` pages.
    pub fn new(device: &wgpu::Device, slot_pages: u32) -> Self {
        Self { walk: Arc::new(Self::source(slot_pages).kernel(device)) }
    }

    /// Text and bindings of the kernel.
    pub fn source(slot_pages: u32) -> KernelSource {
        let mut bindings = vec![FRAME_PARAMS, RAYS, MASKS, WRITE, WRITE];
        bindings.extend(vec![SLOTS; slot_pages as usize]);
        source("wavefront.walk", WALK, bindings, slot_pages, &[], None)
    }
}

impl Strategy for RunAhead {
    fn bind(&self, device: &wgpu::Device, _ledger: &Ledger, scene: Scene<'_>) -> Box<dyn Rounds> {
        let Scene { rays, masks, cache } = scene;
        let (directory, state) = (cache.directory(), cache.state());
        let mut bindings = resources(&[rays.frame(), rays.rays(), masks, directory, state]);
        bindings.extend(cache.slots().iter().map(|page| page.as_entire_binding()));
        let bind = self.walk.bind(device, "wavefront.walk", &bindings);
        Box::new(RunAheadRounds { walk: Arc::clone(&self.walk), bind })
    }
}

impl Rounds for RunAheadRounds {
    fn record_start(&self, _: &mut wgpu::CommandEncoder, _: &Rays, _: &RayBuffers) {}

    /// A walk of the active rays, the shading of new hits, then what serves the requests.
    fn record_round(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        stage: &Rays,
        rays: &RayBuffers,
        make_resident: MakeResident<'_>,
    ) {
        {
            let _span = tracing::trace_span!("wavefront.walk").entered();
            let mut pass = begin(encoder, "wavefront.walk");
            self.walk.dispatch_indirect(&mut pass, &self.bind, rays.args(), 0);
        }
        stage.record_resolve(encoder, rays);
        make_resident(encoder);
    }

    fn statistics(&self) -> Vec<(&wgpu::Buffer, u64, u64)> {
        Vec::new()
    }
}
