//! In-fill at half the picture's resolution: what it works on in the picture's place, and how that is made and shown.

use gpu_primitives::kernel::Kernel;
use gpu_primitives::memory::{Buffer, Category, Ledger};
use gpu_primitives::profile::begin_pass;
use gpu_primitives::wgpu;
use wavefront::{FrameParams, OutputTextures, Outputs, RayBuffers};

use crate::Error;
use crate::kernels;
use crate::plan::InfillPlan;

/// Invocations of a workgroup of both kernels, one for a pixel of the reduced picture.
const PIXELS_PER_GROUP: u64 = 64;

/// The pictures that in-fill reads.
pub(crate) const OUTPUTS: Outputs = Outputs { depth: true, normal: true, status: false };

/// The kernels.
#[derive(Debug)]
pub(crate) struct ReduceKernels {
    reduce: Kernel,
    spread: Kernel,
}

/// A reduced picture's rays and textures.
#[derive(Debug)]
pub(crate) struct Reduced {
    pub(crate) rays: Buffer,
    pub(crate) frame: Buffer,
    pub(crate) textures: OutputTextures,
    groups: u64,
    reduce: wgpu::BindGroup,
}

impl ReduceKernels {
    pub(crate) fn new(device: &wgpu::Device) -> Self {
        let [reduce, spread] = kernels::reduction().map(|source| source.kernel(device));
        Self { reduce, spread }
    }

    /// Records making the reduced picture from the picture as it is.
    pub(crate) fn record_reduce(&self, encoder: &mut wgpu::CommandEncoder, reduced: &Reduced) {
        let mut pass = begin_pass(encoder, "infill.reduce");
        self.reduce.dispatch(&mut pass, &reduced.reduce, reduced.groups);
    }

    /// Records showing the reduced picture in the picture's holes.
    pub(crate) fn record_spread(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        reduced: &Reduced,
        spread: &wgpu::BindGroup,
    ) {
        let mut pass = begin_pass(encoder, "infill.spread");
        self.spread.dispatch(&mut pass, spread, reduced.groups);
    }

    /// Binds what shows the reduced picture. `params` and `gate` are in-fill's.
    pub(crate) fn bind_spread(
        &self,
        device: &wgpu::Device,
        reduced: &Reduced,
        [params, gate]: [&wgpu::Buffer; 2],
        rays: &RayBuffers,
        textures: &OutputTextures,
    ) -> wgpu::BindGroup {
        let buffers = [&*reduced.frame, params, rays.rays(), gate];
        let views = [reduced.textures.color_view(), textures.color_view()];
        self.spread.bind(device, "infill.spread", &resources(&buffers, &views))
    }
}

impl Reduced {
    pub(crate) fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        kernels: &ReduceKernels,
        plan: &InfillPlan,
        rays: &RayBuffers,
        pictures: &OutputTextures,
    ) -> Result<Self, Error> {
        use wgpu::BufferUsages as Usage;
        let buffer = |category, label, size, usage| {
            let label = Some(label);
            let desc = wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false };
            ledger.buffer(device, category, &desc)
        };
        let usage = Usage::STORAGE | Usage::COPY_SRC;
        let own = buffer(Category::Scratch, "infill.reduced", plan.reduced_ray_bytes(), usage);
        let usage = Usage::UNIFORM | Usage::COPY_DST;
        let frame = buffer(Category::Params, "infill.reduced.frame", FrameParams::BYTES, usage);
        let textures = OutputTextures::new(device, ledger, OUTPUTS, plan.size());
        let reduce = {
            let (Some(depth), Some(normal)) = (pictures.depth_view(), pictures.normal_view())
            else {
                return Err(Error::MissingOutputs);
            };
            let (Some(depth_out), Some(normal_out)) =
                (textures.depth_view(), textures.normal_view())
            else {
                return Err(Error::MissingOutputs);
            };
            let buffers = [&*frame, rays.rays(), rays.active_args(), &*own];
            let from = [pictures.color_view(), depth, normal];
            let views = [from, [textures.color_view(), depth_out, normal_out]].concat();
            kernels.reduce.bind(device, "infill.reduce", &resources(&buffers, &views))
        };
        let groups = plan.reduced_numbers().div_ceil(PIXELS_PER_GROUP);
        Ok(Self { rays: own, frame, textures, groups, reduce })
    }
}

fn resources<'a>(
    buffers: &[&'a wgpu::Buffer],
    views: &[&'a wgpu::TextureView],
) -> Vec<wgpu::BindingResource<'a>> {
    let buffers = buffers.iter().map(|buffer| buffer.as_entire_binding());
    buffers.chain(views.iter().map(|view| wgpu::BindingResource::TextureView(view))).collect()
}
