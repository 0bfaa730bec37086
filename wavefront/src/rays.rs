//! Rays of one picture: their start, the shading of their hits, the list of the active ones. Shared
//! by all strategies.

use bytemuck::{Pod, Zeroable};
use gpu_primitives::kernel::{Binding, Kernel, KernelSource};
use gpu_primitives::memory::{Buffer, Category, Ledger};
use gpu_primitives::scan;
use gpu_primitives::upload::UploadRing;
use gpu_primitives::wgsl::{Constant, Module, compose_fixed};
use gpu_primitives::{indirect, wgpu};

use crate::foveation::{SamplingParams, mask_source};
use crate::frame::{FrameParams, PARAMS_BYTES};
use crate::outputs::{OUTPUT_TEXTURES, OUTPUTS, OutputTextures, Outputs, SHADING, ShadingParams};
use crate::plan::{
    ARGS_BYTES, FILL_ARGS_BYTES, MASKED_LIST_ARGS_BYTES, RAYS_HEADER_WORDS, WavefrontPlan,
};
use crate::samples::{SampleLayout, Samples};

pub(crate) const FRAME: Module =
    Module { name: "frame", source: include_str!("../shader/lib/frame.wgsl") };
pub(crate) const CELL: Module =
    Module { name: "cell", source: include_str!("../shader/lib/cell.wgsl") };
const BLOCK_WALK: Module =
    Module { name: "block_walk", source: include_str!("../shader/lib/block_walk.wgsl") };
pub(crate) const FIRST_BLOCK: Module =
    Module { name: "first_block", source: include_str!("../shader/lib/first_block.wgsl") };
const RAY_WORDS: Module =
    Module { name: "ray_words", source: include_str!("../shader/lib/ray_words.wgsl") };
const WORK: Module = Module { name: "work", source: include_str!("../shader/lib/work.wgsl") };
const LIST: Module = Module { name: "list", source: include_str!("../shader/list.wgsl") };
pub(crate) const BLOCK_NEED: Module =
    Module { name: "block_need", source: include_str!("../shader/lib/block_need.wgsl") };
/// Asking for those that are missing.
pub(crate) const BLOCK_REQUEST: Module =
    Module { name: "block_request", source: include_str!("../shader/lib/block_request.wgsl") };
const START: Module = Module { name: "start", source: include_str!("../shader/start.wgsl") };
const RESOLVE: Module = Module { name: "resolve", source: include_str!("../shader/resolve.wgsl") };

/// Rays of one workgroup of `shader/lib/ray_words.wgsl`.
const RAYS_PER_WORD_GROUP: u32 = 64 * 32;

/// Binding of the rays' header and states.
pub(crate) const RAYS: Binding = Binding::StorageReadWrite { min_bytes: 4 * RAYS_HEADER_WORDS + 4 };
/// Binding of anything that is only read.
pub(crate) const READ: Binding = Binding::StorageRead { min_bytes: 4 };
/// Binding of the active masks, two words each.
pub(crate) const MASKS: Binding = Binding::StorageRead { min_bytes: 8 };
/// Binding of anything that is written.
pub(crate) const WRITE: Binding = Binding::StorageReadWrite { min_bytes: 4 };
/// Binding of the frame's uniform.
pub(crate) const FRAME_PARAMS: Binding = Binding::Uniform { bytes: PARAMS_BYTES };
/// Binding of a page of slots.
pub(crate) const SLOTS: Binding = Binding::StorageRead { min_bytes: 256 };

/// What the rays of a frame have done so far.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Counters {
    /// Rays that are not finished.
    pub active: u32,
    /// Rays that enter the volume.
    pub entered: u32,
    /// Hits shaded.
    pub hits: u32,
    /// Active rays that the next round takes.
    pub listed: u32,
    /// Lists of active rays made so far: one by every round that had any, and those of
    /// [`crate::Rounds::lists_at_start`].
    pub lists: u32,
    /// Cells that the walk since the last list visited; 0 after a round.
    pub cells: u32,
    /// `RunAhead`: most cells that the rays of a walk visited together.
    pub most_cells: u32,
    /// `RunAhead`: how often a ray stopped because all together had visited
    /// [`FrameParams::with_most_cells`].
    pub cut: u32,
    /// Scratch of the round that is going on.
    open_now: u32,
    /// Bits of [`Counters::open_depth_voxels`].
    open: u32,
    masked: u32,
    /// Pixels whose rays the sampling mask has had cast so far in the frame; 0 without one.
    pub sampled: u32,
}

impl Counters {
    /// Where the counters are in [`RayBuffers::rays`]: byte offset and length.
    pub const BYTES: (u64, u64) = (0, size_of::<Counters>() as u64);

    /// What a frame's counters go on from when it goes on from a preview: hits; lists and what follows them up to `cut`,
    /// of which `cells` is 0 then. Byte offsets and lengths.
    pub(crate) const CARRIED: [(u64, u64); 2] = [(8, 4), (16, 16)];

    /// The longest part of an active ray, in voxels, in which its first hit may still lie: from where
    /// it waits to where it leaves the volume. 0 when no ray is active.
    pub fn open_depth_voxels(&self) -> f32 {
        f32::from_bits(self.open)
    }
}

/// The kernels that all strategies share. Immutable; used with any number of pictures.
#[derive(Debug)]
pub struct Rays {
    start: Kernel,
    resolve: Kernel,
    list_sum: Kernel,
    list_fill: Kernel,
    /// None unless frames may be foveated.
    sampling_mask: Option<Kernel>,
}

/// Every module that a kernel of this crate may import.
pub(crate) fn library(samples: SampleLayout) -> Vec<Module> {
    let mut modules = vec![
        FRAME,
        CELL,
        BLOCK_NEED,
        BLOCK_REQUEST,
        BLOCK_WALK,
        FIRST_BLOCK,
        RAY_WORDS,
        WORK,
        samples.module(),
        OUTPUT_TEXTURES,
        OUTPUTS,
        SHADING,
        indirect::MODULE,
        scan::GROUP_MODULE,
    ];
    #[cfg(feature = "block-sorted")]
    modules.push(crate::block_sorted::PAIRS);
    modules.extend(macrocell::wgsl::MODULES);
    modules.extend(lru_cache_gpu::wgsl::MODULES);
    modules
}

/// A kernel of this crate, whose last bindings are those of the `pictures`, if any.
pub(crate) fn source(
    label: &'static str,
    module: Module,
    mut bindings: Vec<Binding>,
    samples: SampleLayout,
    constants: &[(&'static str, Constant)],
    pictures: Option<Outputs>,
) -> KernelSource {
    let mut constants = constants.to_vec();
    constants.extend(lru_cache_gpu::wgsl::page_constants(samples.pages));
    constants.push(("RESIDENT", Constant::Bool(samples.resident)));
    if let Some(outputs) = pictures {
        constants.extend(outputs.constants(bindings.len() as u32));
        bindings.extend(outputs.bindings());
    }
    let wgsl = compose_fixed(module, &library(samples), &constants);
    KernelSource { label, wgsl, entry_point: "main", bindings }
}

impl Rays {
    /// Makes the pipelines for pictures with `outputs`.
    pub fn new(device: &wgpu::Device, outputs: Outputs, samples: SampleLayout) -> Self {
        let [start, resolve, list_sum, list_fill] =
            Self::sources(outputs, samples).map(|s| s.kernel(device));
        Self { start, resolve, list_sum, list_fill, sampling_mask: None }
    }

    /// The same for pictures whose frames may be foveated.
    pub fn with_foveation(device: &wgpu::Device, outputs: Outputs, samples: SampleLayout) -> Self {
        let [start, resolve, ..] = Self::sources(outputs, samples);
        let [start, resolve] = [start, resolve].map(|s| s.kernel(device));
        let [sampling_mask, list_sum, list_fill] =
            Self::foveation_sources(samples).map(|s| s.kernel(device));
        Self { start, resolve, list_sum, list_fill, sampling_mask: Some(sampling_mask) }
    }

    /// Texts and bindings of the kernels.
    pub fn sources(outputs: Outputs, samples: SampleLayout) -> [KernelSource; 4] {
        let shading = Binding::Uniform { bytes: size_of::<ShadingParams>() as u64 };
        let start = vec![FRAME_PARAMS, shading, RAYS, MASKS];
        let mut resolve = vec![FRAME_PARAMS, shading, RAYS];
        resolve.extend(samples.bindings());
        let [list_sum, list_fill] = Self::list_sources(samples, false);
        let resume = [("RESUME", Constant::Bool(false))];
        [
            source("wavefront.start", START, start, samples, &resume, Some(outputs)),
            source("wavefront.resolve", RESOLVE, resolve, samples, &[], Some(outputs)),
            list_sum,
            list_fill,
        ]
    }

    /// The start of a frame that goes on from a preview, whose rays are bound behind what the usual one binds.
    pub(crate) fn resume_source(outputs: Outputs, samples: SampleLayout) -> KernelSource {
        let shading = Binding::Uniform { bytes: size_of::<ShadingParams>() as u64 };
        let bindings = vec![FRAME_PARAMS, shading, RAYS, MASKS, READ];
        let constants = [("RESUME", Constant::Bool(true))];
        source("wavefront.resume", START, bindings, samples, &constants, Some(outputs))
    }

    /// Texts and bindings of the kernels that make a sampling mask and list only the rays that it has.
    pub fn foveation_sources(samples: SampleLayout) -> [KernelSource; 3] {
        let [list_sum, list_fill] = Self::list_sources(samples, true);
        [mask_source(samples), list_sum, list_fill]
    }

    fn list_sources(samples: SampleLayout, foveation: bool) -> [KernelSource; 2] {
        let mut bindings = vec![FRAME_PARAMS, RAYS, WRITE, WRITE];
        bindings.extend(foveation.then_some(READ));
        [("wavefront.list.sum", false), ("wavefront.list.fill", true)].map(|(label, fill)| {
            let constants =
                [("LIST_FILL", Constant::Bool(fill)), ("FOVEATION", Constant::Bool(foveation))];
            source(label, LIST, bindings.clone(), samples, &constants, None)
        })
    }

    /// Records the start of a frame: makes every pixel of the `textures`, those that the buffers were made for, an
    /// unfinished one and lists the rays that enter the volume, those of the `sampling` mask alone if there is one.
    pub fn record_start(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        upload: &mut UploadRing,
        buffers: &RayBuffers,
        textures: &OutputTextures,
        (frame, shading): (&FrameParams, &ShadingParams),
        sampling: Option<&SamplingParams>,
    ) {
        // A render pass's clearing costs a fraction of as many writes.
        textures.record_unfinished(encoder, shading.start_color());
        buffers.record_params(device, encoder, upload, frame);
        buffers.record_start(device, encoder, upload, shading);
        {
            let mut pass = begin(encoder, "wavefront.start");
            self.start.dispatch(&mut pass, &buffers.start, buffers.word_groups());
        }
        self.record_first_list(device, encoder, upload, buffers, sampling);
    }

    /// Records the first list of a frame's rays.
    pub(crate) fn record_first_list(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        upload: &mut UploadRing,
        buffers: &RayBuffers,
        sampling: Option<&SamplingParams>,
    ) {
        if let (Some(sampling), Some(foveation)) = (sampling, &buffers.foveation) {
            encoder.clear_buffer(&foveation.mask, 0, None);
            self.record_mask(device, encoder, upload, buffers, sampling);
        } else {
            self.record_list(&mut begin(encoder, "wavefront.list"), buffers);
        }
    }

    /// Records that the rays of another pass of a foveated frame may be cast, too. Nothing unless the plan has
    /// foveation.
    pub fn record_mask(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        upload: &mut UploadRing,
        buffers: &RayBuffers,
        sampling: &SamplingParams,
    ) {
        if let (Some(kernel), Some(foveation)) = (&self.sampling_mask, &buffers.foveation) {
            upload.write(device, encoder, &foveation.params, 0, bytemuck::bytes_of(sampling));
            let mut pass = begin(encoder, "wavefront.sampling_mask");
            kernel.dispatch(&mut pass, &foveation.bind, buffers.word_groups());
            self.record_list(&mut pass, buffers);
        }
    }

    /// Records the list of the active rays, whatever it was before.
    fn record_list(&self, pass: &mut wgpu::ComputePass<'_>, buffers: &RayBuffers) {
        let groups = buffers.plan.list_groups();
        self.list_sum.dispatch(pass, &buffers.list_sum, groups);
        self.list_fill.dispatch(pass, &buffers.list_fill, groups);
    }

    /// Records the shading of new hits and the new list of active rays: the end of every round.
    /// Blocks with hits must still be resident.
    pub(crate) fn record_resolve(&self, encoder: &mut wgpu::CommandEncoder, buffers: &RayBuffers) {
        let _span = tracing::trace_span!("wavefront.resolve").entered();
        {
            let mut pass = begin(encoder, "wavefront.resolve");
            self.resolve.dispatch_indirect(&mut pass, &buffers.resolve, &buffers.args, 0);
        }
        let mut pass = begin(encoder, "wavefront.list");
        let (sum, fill) = (&buffers.list_sum, &buffers.list_fill);
        self.list_sum.dispatch_indirect(&mut pass, sum, &buffers.args, buffers.list_args_offset());
        self.list_fill.dispatch_indirect(&mut pass, fill, &buffers.fill_args, 0);
    }
}

/// Where the arguments of the list's first kernel are in [`RayBuffers::args`].
const LIST_ARGS_OFFSET: u64 = 16;

/// The sampling mask of one picture.
#[derive(Debug)]
struct FoveationBuffers {
    params: Buffer,
    mask: Buffer,
    bind: wgpu::BindGroup,
    _tiles: Buffer,
}

/// Ray states, the active list and scratch memory of one picture.
#[derive(Debug)]
pub struct RayBuffers {
    plan: WavefrontPlan,
    rays: Buffer,
    frame: Buffer,
    shading: Buffer,
    args: Buffer,
    fill_args: Buffer,
    start: wgpu::BindGroup,
    resolve: wgpu::BindGroup,
    list_sum: wgpu::BindGroup,
    list_fill: wgpu::BindGroup,
    foveation: Option<FoveationBuffers>,
    _sums: Buffer,
}

impl RayBuffers {
    /// Allocates the state of one picture. `masks` are the active masks, as `macrocell` makes them;
    /// `textures` have the plan's outputs and size. `stage` is [`Rays::with_foveation`] if and only if the plan has
    /// foveation.
    pub fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        stage: &Rays,
        plan: &WavefrontPlan,
        masks: &wgpu::Buffer,
        samples: Samples<'_>,
        textures: &OutputTextures,
    ) -> Self {
        use wgpu::BufferUsages as Usage;
        let buffer = |category, label, size, usage| {
            let label = Some(label);
            let desc = wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false };
            ledger.buffer(device, category, &desc)
        };
        let usage = Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST;
        let rays = buffer(Category::Rays, "wavefront.rays", plan.state_bytes(), usage);
        let sums = 4 * plan.list_groups();
        let sums = buffer(Category::Scratch, "wavefront.list.sums", sums, Usage::STORAGE);
        let uniform = Usage::UNIFORM | Usage::COPY_DST;
        let frame = buffer(Category::Params, "wavefront.frame", PARAMS_BYTES, uniform);
        let shading_bytes = size_of::<ShadingParams>() as u64;
        let shading = buffer(Category::Params, "wavefront.shading", shading_bytes, uniform);
        let args = |label, bytes| {
            buffer(Category::Scratch, label, bytes, Usage::STORAGE | Usage::INDIRECT)
        };
        let fill_args = args("wavefront.list.fill_args", FILL_ARGS_BYTES);
        let masked_args = plan.foveation().map_or(0, |_| MASKED_LIST_ARGS_BYTES);
        let args = args("wavefront.args", ARGS_BYTES + masked_args);
        let foveation = FoveationBuffers::new(device, ledger, stage, plan, [&frame, &rays]);
        let views = || textures.views().iter().map(wgpu::BindingResource::TextureView);
        let mut start = resources(&[&frame, &shading, &rays, masks]);
        start.extend(views());
        let mut resolve = resources(&[&frame, &shading, &rays]);
        resolve.extend(samples.resources());
        resolve.extend(views());
        let mask = foveation.as_ref().map(|foveation| foveation.mask.as_entire_binding());
        let mut sum = resources(&[&frame, &rays, &sums, &fill_args]);
        sum.extend(mask.clone());
        let mut fill = resources(&[&frame, &rays, &sums, &args]);
        fill.extend(mask);
        Self {
            start: stage.start.bind(device, "wavefront.start", &start),
            resolve: stage.resolve.bind(device, "wavefront.resolve", &resolve),
            list_sum: stage.list_sum.bind(device, "wavefront.list.sum", &sum),
            list_fill: stage.list_fill.bind(device, "wavefront.list.fill", &fill),
            plan: plan.clone(),
            rays,
            frame,
            shading,
            args,
            fill_args,
            foveation,
            _sums: sums,
        }
    }

    /// Records that what comes has these parameters. Those of one frame may only differ in how far rays look ahead.
    pub fn record_params(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        upload: &mut UploadRing,
        params: &FrameParams,
    ) {
        upload.write(device, encoder, &self.frame, 0, bytemuck::bytes_of(params));
    }

    /// Records that no ray has started, and how hits look.
    pub(crate) fn record_start(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        upload: &mut UploadRing,
        shading: &ShadingParams,
    ) {
        upload.write(device, encoder, &self.shading, 0, bytemuck::bytes_of(shading));
        let words = RAYS_HEADER_WORDS + self.plan.numbers();
        encoder.clear_buffer(&self.rays, 0, Some(4 * words));
    }

    /// Workgroups of a kernel over words of rays.
    pub(crate) fn word_groups(&self) -> u64 {
        self.plan.numbers().div_ceil(u64::from(RAYS_PER_WORD_GROUP))
    }

    /// Where the arguments of the list's first kernel are in [`Self::args`].
    fn list_args_offset(&self) -> u64 {
        if self.foveation.is_some() { ARGS_BYTES } else { LIST_ARGS_OFFSET }
    }

    /// Header, states, active bits and list of the rays, as in `shader/lib/frame.wgsl`.
    pub fn rays(&self) -> &wgpu::Buffer {
        &self.rays
    }

    /// The sampling mask, a bit for every ray's number, if the plan has foveation; stale in a frame without it.
    pub fn sampling_mask(&self) -> Option<&wgpu::Buffer> {
        self.foveation.as_ref().map(|foveation| &*foveation.mask)
    }

    /// The plan these buffers were made from.
    pub fn plan(&self) -> &WavefrontPlan {
        &self.plan
    }

    /// The frame's uniform: [`FrameParams`].
    pub fn frame(&self) -> &wgpu::Buffer {
        &self.frame
    }

    /// The shading's uniform: [`ShadingParams`].
    pub fn shading(&self) -> &wgpu::Buffer {
        &self.shading
    }

    /// Words 0, 1 and 2: arguments of a dispatch over the listed rays, 64 for a workgroup. Words 4, 5 and 6: arguments of a dispatch over all words of active bits, 256 for a workgroup. They give no
    /// workgroup when no ray is active.
    pub fn active_args(&self) -> &wgpu::Buffer {
        &self.args
    }

    /// Arguments of a dispatch over the listed rays.
    pub(crate) fn args(&self) -> &wgpu::Buffer {
        &self.args
    }
}

impl FoveationBuffers {
    /// None unless both the stage and the plan have foveation.
    fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        stage: &Rays,
        plan: &WavefrontPlan,
        [frame, rays]: [&wgpu::Buffer; 2],
    ) -> Option<Self> {
        use wgpu::BufferUsages as Usage;
        let (kernel, tiles) = (stage.sampling_mask.as_ref()?, plan.foveation()?);
        let buffer = |category, label, size, usage| {
            let label = Some(label);
            let desc = wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false };
            ledger.buffer(device, category, &desc)
        };
        let uniform = Usage::UNIFORM | Usage::COPY_DST;
        let params = buffer(Category::Params, "wavefront.sampling", SamplingParams::BYTES, uniform);
        let storage = Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC;
        let mask = buffer(Category::Rays, "wavefront.mask", plan.mask_bytes(), storage);
        let bytes = bytemuck::cast_slice(tiles.ranks());
        let label = "wavefront.blue_noise";
        let tiles = ledger.buffer_with(device, Category::Rays, label, Usage::STORAGE, bytes);
        let bind = resources(&[frame, &params, rays, &tiles, &mask]);
        let bind = kernel.bind(device, "wavefront.sampling_mask", &bind);
        Some(Self { params, mask, bind, _tiles: tiles })
    }
}

pub(crate) fn resources<'a>(buffers: &[&'a wgpu::Buffer]) -> Vec<wgpu::BindingResource<'a>> {
    buffers.iter().map(|buffer| buffer.as_entire_binding()).collect()
}

pub(crate) fn begin<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    label: &str,
) -> wgpu::ComputePass<'a> {
    gpu_primitives::profile::begin_pass(encoder, label)
}
