//! Guided requests: the blocks up to where the coarse field is crossed.

use gpu_primitives::kernel::{Kernel, KernelSource};
use gpu_primitives::profile::begin_pass;
use gpu_primitives::wgpu;
use macrocell::RangeBuffers;
use wavefront::RayBuffers;

use crate::kernels;
use crate::plan::InfillPlan;
use crate::stage::{InfillBuffers, coarse_field};

/// The kernel. Immutable; used with any number of pictures.
#[derive(Debug)]
pub struct Guide {
    kernel: Kernel,
}

/// The kernel, bound to a picture.
#[derive(Debug)]
pub struct GuideBinds {
    bind: wgpu::BindGroup,
}

/// What guiding reads and where it puts its requests.
#[derive(Clone, Copy, Debug)]
pub struct GuideScene<'a> {
    /// The picture's rays.
    pub rays: &'a RayBuffers,
    /// Active masks, as `macrocell` makes them.
    pub masks: &'a wgpu::Buffer,
    /// The volume's value ranges.
    pub ranges: &'a RangeBuffers,
    /// Directory and state of the cache.
    pub cache: [&'a wgpu::Buffer; 2],
}

impl Guide {
    /// Makes the pipeline; `None` where the plan has no coarse field.
    pub fn new(device: &wgpu::Device, plan: &InfillPlan) -> Option<Self> {
        Some(Self { kernel: Self::source(plan)?.kernel(device) })
    }

    /// Text and bindings of the kernel; `None` where the plan has no coarse field.
    pub fn source(plan: &InfillPlan) -> Option<KernelSource> {
        plan.sources().coarse_field.then(|| kernels::guide(plan))
    }

    /// Binds a picture. The parameters are those of its in-fill.
    pub fn bind(
        &self,
        device: &wgpu::Device,
        buffers: &InfillBuffers,
        scene: GuideScene<'_>,
    ) -> GuideBinds {
        let GuideScene { rays, masks, ranges, cache: [directory, state] } = scene;
        let mut resources = vec![rays.frame().as_entire_binding(), buffers.params()];
        let storage = [rays.rays(), masks, directory, state];
        resources.extend(storage.map(|buffer| buffer.as_entire_binding()));
        resources.extend(coarse_field(ranges));
        GuideBinds { bind: self.kernel.bind(device, "infill.guide", &resources) }
    }

    /// Records the requests of the rays that wait: in a round, after the strategy's own and before they are served.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        binds: &GuideBinds,
        rays: &RayBuffers,
    ) {
        let mut pass = begin_pass(encoder, "infill.guide");
        self.kernel.dispatch_indirect(&mut pass, &binds.bind, rays.active_args(), 0);
    }
}
