//! Strategy RunAhead: walk through what is resident, stop at the first missing block.

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
const START: Module = Module { name: "start", source: include_str!("../shader/start.wgsl") };
const WALK: Module = Module { name: "walk", source: include_str!("../shader/walk.wgsl") };
const RESOLVE: Module = Module { name: "resolve", source: include_str!("../shader/resolve.wgsl") };

/// Rays of one workgroup of every kernel here.
const RAYS_PER_GROUP: u32 = 64;

const HEADER_BYTES: u64 = 4 * RAYS_HEADER_WORDS;

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
    /// Where the counters are in [`WavefrontBuffers::rays`]: byte offset and length.
    pub const BYTES: (u64, u64) = (0, size_of::<Counters>() as u64);
}

/// The strategy's kernels. Immutable; used with any number of pictures.
#[derive(Debug)]
pub struct RunAhead {
    start: Kernel,
    walk: Kernel,
    resolve: Kernel,
    compact: Compact,
    args: IndirectArgs,
}

fn library() -> Vec<Module> {
    let mut modules = vec![FRAME, CELL, BLOCK_WALK, OUTPUTS, indirect::MODULE];
    modules.extend(macrocell::wgsl::MODULES);
    modules.extend(lru_cache_gpu::wgsl::MODULES);
    modules
}

impl RunAhead {
    /// Makes the pipelines for pictures with `outputs` and a cache of `slot_pages` pages.
    pub fn new(device: &wgpu::Device, outputs: Outputs, slot_pages: u32) -> Self {
        let [start, walk, resolve] = Self::sources(outputs, slot_pages).map(|s| s.kernel(device));
        Self {
            start,
            walk,
            resolve,
            compact: Compact::new(device),
            args: IndirectArgs::new(device),
        }
    }

    /// Texts and bindings of the kernels.
    pub fn sources(outputs: Outputs, slot_pages: u32) -> [KernelSource; 3] {
        let library = library();
        let uniforms = [
            Binding::Uniform { bytes: PARAMS_BYTES },
            Binding::Uniform { bytes: size_of::<ShadingParams>() as u64 },
        ];
        let read = Binding::StorageRead { min_bytes: 4 };
        let write = Binding::StorageReadWrite { min_bytes: 4 };
        let rays = Binding::StorageReadWrite { min_bytes: HEADER_BYTES + 4 };
        let slots = vec![Binding::StorageRead { min_bytes: 256 }; slot_pages as usize];
        let source = |label, module, buffers: Vec<Binding>, textures: bool| {
            let mut constants: Vec<(&str, Constant)> =
                lru_cache_gpu::wgsl::page_constants(slot_pages).to_vec();
            let mut bindings = buffers;
            if textures {
                constants.extend(outputs.constants(bindings.len() as u32));
                bindings.extend(outputs.bindings());
            }
            let wgsl = compose_fixed(module, &library, &constants);
            KernelSource { label, wgsl, entry_point: "main", bindings }
        };
        let start = [&uniforms[..], &[rays, write, write]].concat();
        let masks = Binding::StorageRead { min_bytes: 8 };
        let walk = [&uniforms[..1], &[rays, read, masks, write, write], &slots].concat();
        let resolve = [&uniforms[..], &[rays, read, write, read], &slots].concat();
        [
            source("wavefront.start", START, start, true),
            source("wavefront.walk", WALK, walk, false),
            source("wavefront.resolve", RESOLVE, resolve, true),
        ]
    }

    /// Records the start of a frame: clears the pictures and lists the rays that enter the volume.
    pub fn record_start(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        upload: &mut UploadRing,
        buffers: &mut WavefrontBuffers,
        frame: &FrameParams,
        shading: &ShadingParams,
    ) {
        upload.write(device, encoder, &buffers.frame, 0, bytemuck::bytes_of(frame));
        upload.write(device, encoder, &buffers.shading, 0, bytemuck::bytes_of(shading));
        encoder.clear_buffer(&buffers.rays, 0, Some(HEADER_BYTES));
        {
            let mut pass = begin(encoder, "wavefront.start");
            let groups = buffers.plan.rays().div_ceil(u64::from(RAYS_PER_GROUP));
            self.start.dispatch(&mut pass, &buffers.start, groups);
        }
        // The kernel lists all rays in the second list; compaction puts those that enter into the first.
        buffers.current = 1;
        self.record_compaction(encoder, buffers);
    }

    /// Records one walk of the active rays, the shading of new hits and the new list of active rays.
    /// The requested blocks must be decoded before the next one.
    pub fn record_round(&self, encoder: &mut wgpu::CommandEncoder, buffers: &mut WavefrontBuffers) {
        {
            let side = &buffers.sides[buffers.current];
            let mut pass = begin(encoder, "wavefront.walk");
            self.walk.dispatch_indirect(&mut pass, &side.walk, &buffers.args, 0);
            self.resolve.dispatch_indirect(&mut pass, &side.resolve, &buffers.args, 0);
        }
        self.record_compaction(encoder, buffers);
    }

    fn record_compaction(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        buffers: &mut WavefrontBuffers,
    ) {
        self.compact.record(encoder, &buffers.sides[buffers.current].compact);
        buffers.current = 1 - buffers.current;
        self.args.record(encoder, &buffers.args_bind);
    }
}

/// Ray states, active lists and scratch memory of one picture.
#[derive(Debug)]
pub struct WavefrontBuffers {
    plan: WavefrontPlan,
    rays: Buffer,
    frame: Buffer,
    shading: Buffer,
    args: Buffer,
    args_bind: IndirectArgsBuffers,
    start: wgpu::BindGroup,
    sides: [Side; 2],
    current: usize,
    _lists: [Buffer; 3],
}

/// Everything that reads one of the two active lists.
#[derive(Debug)]
struct Side {
    walk: wgpu::BindGroup,
    resolve: wgpu::BindGroup,
    compact: CompactBuffers,
}

impl WavefrontBuffers {
    /// Allocates the state of one picture. `masks` are the active masks, `cache` holds the samples,
    /// `textures` have the plan's outputs and size.
    pub fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        stage: &RunAhead,
        plan: &WavefrontPlan,
        masks: &wgpu::Buffer,
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
        let slots = || cache.slots().iter().map(|page| page.as_entire_binding());
        let mut start = resources(&[&frame, &shading, &rays, &lists[1], &keep]);
        start.extend(views());
        let start = stage.start.bind(device, "wavefront.start", &start);
        let sides = [0, 1].map(|i| {
            let (here, there) = (&lists[i], &lists[1 - i]);
            let (directory, state) = (cache.directory(), cache.state());
            let mut walk = resources(&[&frame, &rays, here, masks, directory, state]);
            walk.extend(slots());
            let mut resolve = resources(&[&frame, &shading, &rays, here, &keep, directory]);
            resolve.extend(slots());
            resolve.extend(views());
            let count = (&*rays, 0);
            let plan = Compact::plan(plan.rays());
            Side {
                walk: stage.walk.bind(device, "wavefront.walk", &walk),
                resolve: stage.resolve.bind(device, "wavefront.resolve", &resolve),
                compact: CompactBuffers::new(
                    device,
                    ledger,
                    &stage.compact,
                    &plan,
                    &keep,
                    here,
                    count,
                    there,
                    count,
                ),
            }
        });
        let [first, second] = lists;
        let _lists = [first, second, keep];
        let plan = plan.clone();
        Self { plan, rays, frame, shading, args, args_bind, start, sides, current: 0, _lists }
    }

    /// Header and states of the rays, as in `shader/lib/frame.wgsl`.
    pub fn rays(&self) -> &wgpu::Buffer {
        &self.rays
    }

    /// The plan these buffers were made from.
    pub fn plan(&self) -> &WavefrontPlan {
        &self.plan
    }
}

fn resources<'a>(buffers: &[&'a wgpu::Buffer]) -> Vec<wgpu::BindingResource<'a>> {
    buffers.iter().map(|buffer| buffer.as_entire_binding()).collect()
}

fn begin<'a>(encoder: &'a mut wgpu::CommandEncoder, label: &str) -> wgpu::ComputePass<'a> {
    encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: Some(label),
        timestamp_writes: None,
    })
}
