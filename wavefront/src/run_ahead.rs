//! Strategy RunAhead: walk through what is resident, stop at the first missing block.

use std::sync::Arc;

use gpu_primitives::kernel::{Kernel, KernelSource};
use gpu_primitives::memory::Ledger;
use gpu_primitives::wgpu;
use gpu_primitives::wgsl::Module;

use crate::Error;
use crate::rays::{
    FRAME_PARAMS, MASKS, RAYS, READ, RayBuffers, Rays, SLOTS, WRITE, begin, resources, source,
};
use crate::samples::{SampleLayout, Samples};
use crate::strategy::{MakeResident, Rounds, Scene, Strategy};

const WALK: Module = Module { name: "walk", source: include_str!("../shader/walk.wgsl") };
const REQUEST: Module = Module { name: "request", source: include_str!("../shader/request.wgsl") };
const WALK_RESIDENT: Module =
    Module { name: "walk_resident", source: include_str!("../shader/walk_resident.wgsl") };

/// The strategy's kernels. Immutable; used with any number of pictures.
#[derive(Debug)]
pub struct RunAhead {
    walk: Arc<Kernel>,
    /// None where all samples are resident.
    request: Option<Arc<Kernel>>,
}

/// The strategy allocates nothing.
#[derive(Debug)]
struct RunAheadRounds {
    walk: (Arc<Kernel>, wgpu::BindGroup),
    request: Option<(Arc<Kernel>, wgpu::BindGroup)>,
}

impl RunAhead {
    /// Makes the pipelines.
    pub fn new(device: &wgpu::Device, samples: SampleLayout) -> Self {
        let request = Self::request_source(samples);
        Self {
            walk: Arc::new(Self::walk_source(samples).kernel(device)),
            request: request.map(|source| Arc::new(source.kernel(device))),
        }
    }

    /// Texts and bindings of the kernels.
    pub fn sources(samples: SampleLayout) -> Vec<KernelSource> {
        [Self::walk_source(samples)].into_iter().chain(Self::request_source(samples)).collect()
    }

    fn walk_source(samples: SampleLayout) -> KernelSource {
        let module = if samples.resident { WALK_RESIDENT } else { WALK };
        let mut bindings = vec![FRAME_PARAMS, RAYS, MASKS];
        // The cache's directory and state.
        bindings.extend(if samples.resident { vec![] } else { vec![READ, WRITE] });
        bindings.extend(vec![SLOTS; samples.pages as usize]);
        source("wavefront.walk", module, bindings, samples, &[], None)
    }

    fn request_source(samples: SampleLayout) -> Option<KernelSource> {
        let bindings = vec![FRAME_PARAMS, RAYS, MASKS, WRITE, WRITE];
        let source = || source("wavefront.request", REQUEST, bindings, samples, &[], None);
        (!samples.resident).then(source)
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
        let mut request = resources(&[rays.frame(), rays.rays(), masks]);
        match (samples, &self.request) {
            (Samples::Cached(cache), Some(_)) => {
                request.extend(resources(&[cache.directory(), cache.state()]));
            }
            (Samples::Resident(_), None) => {}
            _ => return Err(Error::OtherSamples),
        }
        let mut walk = request.clone();
        walk.extend(samples.slots().iter().map(|page| page.as_entire_binding()));
        let bind = self.walk.bind(device, "wavefront.walk", &walk);
        let request = self
            .request
            .as_ref()
            .map(|kernel| (Arc::clone(kernel), kernel.bind(device, "wavefront.request", &request)));
        Ok(Box::new(RunAheadRounds { walk: (Arc::clone(&self.walk), bind), request }))
    }
}

impl Rounds for RunAheadRounds {
    fn record_start(&self, _: &mut wgpu::CommandEncoder, _: &Rays, _: &RayBuffers) {}

    /// A walk of the active rays, the shading of new hits, then requests and what serves them.
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
            let (kernel, bind) = &self.walk;
            kernel.dispatch_indirect(&mut pass, bind, rays.args(), 0);
        }
        stage.record_resolve(encoder, rays);
        if let Some((kernel, bind)) = &self.request {
            let _span = tracing::trace_span!("wavefront.request").entered();
            let mut pass = begin(encoder, "wavefront.request");
            kernel.dispatch_indirect(&mut pass, bind, rays.args(), 0);
        }
        make_resident(encoder);
    }

    fn statistics(&self) -> Vec<(&wgpu::Buffer, u64, u64)> {
        Vec::new()
    }
}
