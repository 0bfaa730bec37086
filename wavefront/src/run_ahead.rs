//! Strategy RunAhead: walk through what is resident, stop at the first missing block.

use std::sync::Arc;

use gpu_primitives::kernel::{Kernel, KernelSource};
use gpu_primitives::memory::Ledger;
use gpu_primitives::wgpu;
use gpu_primitives::wgsl::Module;

use crate::Error;
use crate::rays::{
    FRAME_PARAMS, MASKS, RAYS, RayBuffers, Rays, SLOTS, WRITE, begin, resources, source,
};
use crate::samples::{SampleLayout, Samples};
use crate::strategy::{MakeResident, Rounds, Scene, Strategy};

const WALK: Module = Module { name: "walk", source: include_str!("../shader/walk.wgsl") };
const WALK_RESIDENT: Module =
    Module { name: "walk_resident", source: include_str!("../shader/walk_resident.wgsl") };

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
    /// Makes the pipeline.
    pub fn new(device: &wgpu::Device, samples: SampleLayout) -> Self {
        Self { walk: Arc::new(Self::source(samples).kernel(device)) }
    }

    /// Text and bindings of the kernel.
    pub fn source(samples: SampleLayout) -> KernelSource {
        // The directory and the cache's state.
        let (module, tables) = if samples.resident { (WALK_RESIDENT, 0) } else { (WALK, 2) };
        let mut bindings = vec![FRAME_PARAMS, RAYS, MASKS];
        bindings.extend(vec![WRITE; tables]);
        bindings.extend(vec![SLOTS; samples.pages as usize]);
        source("wavefront.walk", module, bindings, samples, &[], None)
    }
}

impl Strategy for RunAhead {
    fn bind(
        &self,
        device: &wgpu::Device,
        _ledger: &Ledger,
        scene: Scene<'_>,
    ) -> Result<Box<dyn Rounds>, Error> {
        let Scene { rays, masks, samples } = scene;
        let mut bindings = resources(&[rays.frame(), rays.rays(), masks]);
        if let Samples::Cached(cache) = samples {
            bindings.extend(resources(&[cache.directory(), cache.state()]));
        }
        bindings.extend(samples.slots().iter().map(|page| page.as_entire_binding()));
        let bind = self.walk.bind(device, "wavefront.walk", &bindings);
        Ok(Box::new(RunAheadRounds { walk: Arc::clone(&self.walk), bind }))
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
