//! Rays of one picture: their start, the shading of their hits, the list of the active ones. Shared
//! by all strategies.

use bytemuck::{Pod, Zeroable};
use gpu_primitives::compact::{Compact, CompactBuffers};
use gpu_primitives::indirect::{IndirectArgs, IndirectArgsBuffers};
use gpu_primitives::kernel::{Binding, Kernel, KernelSource};
use gpu_primitives::memory::{Buffer, Category, Ledger};
use gpu_primitives::upload::UploadRing;
use gpu_primitives::wgsl::{Constant, Module, compose_fixed};
use gpu_primitives::{indirect, wgpu};
use lru_cache_gpu::CacheBuffers;

use crate::frame::{FrameParams, PARAMS_BYTES};
use crate::outputs::{OUTPUTS, OutputTextures, Outputs, ShadingParams};
use crate::plan::{ARGS_BYTES, RAYS_HEADER_WORDS, WavefrontPlan};

const FRAME: Module = Module { name: "frame", source: include_str!("../shader/lib/frame.wgsl") };
const CELL: Module = Module { name: "cell", source: include_str!("../shader/lib/cell.wgsl") };
const BLOCK_WALK: Module =
    Module { name: "block_walk", source: include_str!("../shader/lib/block_walk.wgsl") };
const BLOCK_SLOTS: Module =
    Module { name: "block_slots", source: include_str!("../shader/lib/block_slots.wgsl") };
const START: Module = Module { name: "start", source: include_str!("../shader/start.wgsl") };
const RESOLVE: Module = Module { name: "resolve", source: include_str!("../shader/resolve.wgsl") };

/// Rays of one workgroup of every kernel that goes over rays.
pub(crate) const RAYS_PER_GROUP: u32 = 64;

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
    pad: u32,
}

impl Counters {
    /// Where the counters are in [`RayBuffers::rays`]: byte offset and length.
    pub const BYTES: (u64, u64) = (0, size_of::<Counters>() as u64);
}

/// The kernels that all strategies share. Immutable; used with any number of pictures.
#[derive(Debug)]
pub struct Rays {
    start: Kernel,
    resolve: Kernel,
    compact: Compact,
    args: IndirectArgs,
}

/// Every module that a kernel of this crate may import.
pub(crate) fn library() -> Vec<Module> {
    let mut modules = vec![FRAME, CELL, BLOCK_WALK, BLOCK_SLOTS, OUTPUTS, indirect::MODULE];
    #[cfg(feature = "block-sorted")]
    modules.push(crate::block_sorted::PAIRS);
    modules.extend(macrocell::wgsl::MODULES);
    modules.extend(lru_cache_gpu::wgsl::MODULES);
    modules
}

/// A kernel of this crate for a cache of `slot_pages` pages, whose last bindings are those of the
/// `pictures`, if any.
pub(crate) fn source(
    label: &'static str,
    module: Module,
    mut bindings: Vec<Binding>,
    slot_pages: u32,
    constants: &[(&'static str, Constant)],
    pictures: Option<Outputs>,
) -> KernelSource {
    let mut constants = constants.to_vec();
    constants.extend(lru_cache_gpu::wgsl::page_constants(slot_pages));
    if let Some(outputs) = pictures {
        constants.extend(outputs.constants(bindings.len() as u32));
        bindings.extend(outputs.bindings());
    }
    let wgsl = compose_fixed(module, &library(), &constants);
    KernelSource { label, wgsl, entry_point: "main", bindings }
}

impl Rays {
    /// Makes the pipelines for pictures with `outputs` and a cache of `slot_pages` pages.
    pub fn new(device: &wgpu::Device, outputs: Outputs, slot_pages: u32) -> Self {
        let [start, resolve] = Self::sources(outputs, slot_pages).map(|s| s.kernel(device));
        Self { start, resolve, compact: Compact::new(device), args: IndirectArgs::new(device) }
    }

    /// Texts and bindings of the kernels.
    pub fn sources(outputs: Outputs, slot_pages: u32) -> [KernelSource; 2] {
        let shading = Binding::Uniform { bytes: size_of::<ShadingParams>() as u64 };
        let start = vec![FRAME_PARAMS, shading, RAYS, WRITE, WRITE];
        let mut resolve = vec![FRAME_PARAMS, shading, RAYS, READ, WRITE, READ];
        resolve.extend(vec![SLOTS; slot_pages as usize]);
        [
            source("wavefront.start", START, start, slot_pages, &[], Some(outputs)),
            source("wavefront.resolve", RESOLVE, resolve, slot_pages, &[], Some(outputs)),
        ]
    }

    /// Records the start of a frame: clears the pictures and lists the rays that enter the volume.
    pub fn record_start(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        upload: &mut UploadRing,
        buffers: &mut RayBuffers,
        frame: &FrameParams,
        shading: &ShadingParams,
    ) {
        upload.write(device, encoder, &buffers.frame, 0, bytemuck::bytes_of(frame));
        upload.write(device, encoder, &buffers.shading, 0, bytemuck::bytes_of(shading));
        encoder.clear_buffer(&buffers.rays, 0, Some(4 * RAYS_HEADER_WORDS));
        {
            let mut pass = begin(encoder, "wavefront.start");
            let groups = buffers.plan.rays().div_ceil(u64::from(RAYS_PER_GROUP));
            self.start.dispatch(&mut pass, &buffers.start, groups);
        }
        // The kernel lists all rays in the second list; compaction puts those that enter into the first.
        buffers.side = 1;
        self.record_compaction(encoder, buffers);
    }

    /// Records the shading of new hits and the new list of active rays: the end of every round.
    /// Blocks with hits must still be resident.
    pub(crate) fn record_resolve(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        buffers: &mut RayBuffers,
    ) {
        let _span = tracing::trace_span!("wavefront.resolve").entered();
        {
            let mut pass = begin(encoder, "wavefront.resolve");
            let side = &buffers.sides[buffers.side];
            self.resolve.dispatch_indirect(&mut pass, &side.resolve, &buffers.args, 0);
        }
        self.record_compaction(encoder, buffers);
    }

    fn record_compaction(&self, encoder: &mut wgpu::CommandEncoder, buffers: &mut RayBuffers) {
        self.compact.record(encoder, &buffers.sides[buffers.side].compact);
        buffers.side = 1 - buffers.side;
        self.args.record(encoder, &buffers.args_bind);
    }
}

/// Ray states, active lists and scratch memory of one picture.
#[derive(Debug)]
pub struct RayBuffers {
    plan: WavefrontPlan,
    rays: Buffer,
    lists: [Buffer; 2],
    frame: Buffer,
    shading: Buffer,
    args: Buffer,
    args_bind: IndirectArgsBuffers,
    start: wgpu::BindGroup,
    sides: [Side; 2],
    side: usize,
    _keep: Buffer,
}

/// What reads one of the two active lists.
#[derive(Debug)]
struct Side {
    resolve: wgpu::BindGroup,
    compact: CompactBuffers,
}

impl RayBuffers {
    /// Allocates the state of one picture. `cache` holds the samples, `textures` have the plan's
    /// outputs and size.
    pub fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        stage: &Rays,
        plan: &WavefrontPlan,
        cache: &CacheBuffers,
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
        let list = |label| buffer(Category::Rays, label, 4 * plan.rays(), Usage::STORAGE);
        let lists = [list("wavefront.active_0"), list("wavefront.active_1")];
        let keep = list("wavefront.keep");
        let uniform = Usage::UNIFORM | Usage::COPY_DST;
        let frame = buffer(Category::Params, "wavefront.frame", PARAMS_BYTES, uniform);
        let shading_bytes = size_of::<ShadingParams>() as u64;
        let shading = buffer(Category::Params, "wavefront.shading", shading_bytes, uniform);
        let args_usage = Usage::STORAGE | Usage::INDIRECT;
        let args = buffer(Category::Scratch, "wavefront.args", ARGS_BYTES, args_usage);
        let args_bind = stage.args.bind(device, ledger, (&rays, 0), RAYS_PER_GROUP, (&args, 0));
        let views = || textures.views().iter().map(wgpu::BindingResource::TextureView);
        let mut start = resources(&[&frame, &shading, &rays, &lists[1], &keep]);
        start.extend(views());
        let start = stage.start.bind(device, "wavefront.start", &start);
        let compact_plan = Compact::plan(plan.rays());
        let sides = [0, 1].map(|i| {
            let (here, there, count) = (&lists[i], &lists[1 - i], (&*rays, 0));
            let mut resolve = resources(&[&frame, &shading, &rays, here, &keep, cache.directory()]);
            resolve.extend(cache.slots().iter().map(|page| page.as_entire_binding()));
            resolve.extend(views());
            let resolve = stage.resolve.bind(device, "wavefront.resolve", &resolve);
            let stage = &stage.compact;
            let compact = CompactBuffers::new(
                device,
                ledger,
                stage,
                &compact_plan,
                &keep,
                here,
                count,
                there,
                count,
            );
            Side { resolve, compact }
        });
        Self {
            plan: plan.clone(),
            rays,
            lists,
            frame,
            shading,
            args,
            args_bind,
            start,
            sides,
            side: 0,
            _keep: keep,
        }
    }

    /// Header and states of the rays, as in `shader/lib/frame.wgsl`.
    pub fn rays(&self) -> &wgpu::Buffer {
        &self.rays
    }

    /// The plan these buffers were made from.
    pub fn plan(&self) -> &WavefrontPlan {
        &self.plan
    }

    /// The frame's uniform.
    pub(crate) fn frame(&self) -> &wgpu::Buffer {
        &self.frame
    }

    /// Both active lists.
    pub(crate) fn lists(&self) -> [&wgpu::Buffer; 2] {
        [&self.lists[0], &self.lists[1]]
    }

    /// Which of the lists holds the active rays now.
    pub(crate) fn side(&self) -> usize {
        self.side
    }

    /// Arguments of a dispatch over the active rays.
    pub(crate) fn args(&self) -> &wgpu::Buffer {
        &self.args
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
