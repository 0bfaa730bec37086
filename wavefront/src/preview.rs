//! Previews: pictures of every second or fourth pixel in both directions, shown in a picture's place until its other
//! rays are cast. They have rays, textures and rounds of their own; here is how the picture comes from them and how its
//! frame goes on.

use bytemuck::{Pod, Zeroable};
use gpu_primitives::kernel::{Binding, Kernel, KernelSource};
use gpu_primitives::memory::{Buffer, Category, Ledger};
use gpu_primitives::upload::UploadRing;
use gpu_primitives::wgpu;
use gpu_primitives::wgsl::Module;

use crate::foveation::SamplingParams;
use crate::frame::FrameParams;
use crate::outputs::{OutputTextures, Outputs, ShadingParams};
use crate::rays::{Counters, FRAME_PARAMS, RayBuffers, Rays, begin, resources, source};
use crate::samples::SampleLayout;

const UPSCALE: Module = Module { name: "upscale", source: include_str!("../shader/upscale.wgsl") };

/// Invocations of a workgroup of `shader/upscale.wgsl`, one for a ray.
const RAYS_PER_GROUP: u64 = 64;

/// Uniform struct `UpscaleParams` of `shader/upscale.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct UpscaleParams {
    pub(crate) size: [u32; 2],
    pub(crate) step: u32,
    pub(crate) crisp: u32,
}

/// The kernels. Immutable; used with any number of pictures.
#[derive(Debug)]
pub struct Previews {
    upscale: Kernel,
    resume: Kernel,
}

/// A preview and its picture, with everything bound.
#[derive(Debug)]
pub struct PreviewBinds {
    step: u32,
    size: [u32; 2],
    params: Buffer,
    upscale: wgpu::BindGroup,
    resume: wgpu::BindGroup,
}

impl Previews {
    /// Makes the pipelines for pictures with `outputs`.
    pub fn new(device: &wgpu::Device, outputs: Outputs, samples: SampleLayout) -> Self {
        let [upscale, resume] = Self::sources(outputs, samples).map(|s| s.kernel(device));
        Self { upscale, resume }
    }

    /// Texts and bindings of the kernels.
    pub fn sources(outputs: Outputs, samples: SampleLayout) -> [KernelSource; 2] {
        let shading = Binding::Uniform { bytes: size_of::<ShadingParams>() as u64 };
        let params = Binding::Uniform { bytes: size_of::<UpscaleParams>() as u64 };
        let mut bindings = vec![FRAME_PARAMS, shading, params];
        let constants = outputs.read_constants(bindings.len() as u32);
        bindings.extend(outputs.read_bindings());
        [
            source("wavefront.upscale", UPSCALE, bindings, samples, &constants, Some(outputs)),
            Rays::resume_source(outputs, samples),
        ]
    }

    /// Binds a preview's rays and textures and the picture's, of whose pixels the preview has every `step`-th in both
    /// directions. `masks` are the active masks.
    pub fn bind(
        &self,
        device: &wgpu::Device,
        ledger: &Ledger,
        preview: (&RayBuffers, &OutputTextures),
        picture: (&RayBuffers, &OutputTextures),
        masks: &wgpu::Buffer,
        step: u32,
    ) -> PreviewBinds {
        let ((from, textures), (to, pictures)) = (preview, picture);
        let params = ledger.buffer(
            device,
            Category::Params,
            &wgpu::BufferDescriptor {
                label: Some("wavefront.upscale"),
                size: size_of::<UpscaleParams>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            },
        );
        let mut upscale = resources(&[from.frame(), from.shading(), &params]);
        upscale.extend(views(textures));
        upscale.extend(views(pictures));
        let mut resume = resources(&[to.frame(), to.shading(), to.rays(), masks, from.rays()]);
        resume.extend(views(pictures));
        PreviewBinds {
            step,
            size: to.plan().size(),
            upscale: self.upscale.bind(device, "wavefront.upscale", &upscale),
            resume: self.resume.bind(device, "wavefront.resume", &resume),
            params,
        }
    }

    /// Records making the picture from the preview, after the preview's rounds: pixels that the preview has are as they are
    /// there, the others unfinished, in colours between theirs; `crisp`: in one of theirs. `shading` is the preview's.
    pub fn record_upscale(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        upload: &mut UploadRing,
        binds: &PreviewBinds,
        (rays, pictures): (&RayBuffers, &OutputTextures),
        shading: &ShadingParams,
        crisp: bool,
    ) {
        let PreviewBinds { step, size, .. } = *binds;
        let params = UpscaleParams { size, step, crisp: crisp.into() };
        upload.write(device, encoder, &binds.params, 0, bytemuck::bytes_of(&params));
        pictures.record_unfinished(encoder, shading.background);
        let mut pass = begin(encoder, "wavefront.upscale");
        let groups = rays.plan().numbers().div_ceil(RAYS_PER_GROUP);
        self.upscale.dispatch(&mut pass, &binds.upscale, groups);
    }

    /// Records that the picture's frame goes on from the preview, in place of [`Rays::record_start`]: what the preview has
    /// finished stays, its unfinished rays and all others are to be cast, those of the `sampling` mask first if there is one.
    /// Pixels keep their colours until they are finished, and the counters go on. `frame` is
    /// [`FrameParams::after_preview`].
    pub fn record_resume(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        upload: &mut UploadRing,
        stage: &Rays,
        binds: &PreviewBinds,
        (from, to): (&RayBuffers, &RayBuffers),
        (frame, shading): (&FrameParams, &ShadingParams),
        sampling: Option<&SamplingParams>,
    ) {
        to.record_params(device, encoder, upload, frame);
        to.record_start(device, encoder, upload, &shading.drawn_over());
        for (offset, bytes) in Counters::CARRIED {
            encoder.copy_buffer_to_buffer(from.rays(), offset, to.rays(), offset, bytes);
        }
        {
            let mut pass = begin(encoder, "wavefront.start");
            self.resume.dispatch(&mut pass, &binds.resume, to.word_groups());
        }
        stage.record_first_list(device, encoder, upload, to, sampling);
    }
}

fn views(textures: &OutputTextures) -> impl Iterator<Item = wgpu::BindingResource<'_>> {
    textures.views().iter().map(wgpu::BindingResource::TextureView)
}

impl PreviewBinds {
    /// Bytes of GPU memory.
    pub const BYTES: u64 = size_of::<UpscaleParams>() as u64;
}
