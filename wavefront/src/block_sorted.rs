//! Strategy BlockSorted, the published one: every round takes each active ray to its next n active
//! blocks, makes them resident, groups the rays by block, intersects block by block and puts each
//! ray's results together (Dyken, Usher, Kumar: Speculative Progressive Raycasting for Memory
//! Constrained Isosurface Visualization of Massive Volumes, 2024, sections III and IV).
//!
//! Differences from the published program: counts stay on the GPU, nothing is as long as the volume
//! has blocks, pairs are grouped by one counting scatter, the cache has a fixed size, and a ray waits
//! at a pair whose samples are missing.

use std::sync::Arc;

use gpu_primitives::compact::{Compact, CompactBuffers};
use gpu_primitives::indirect::{IndirectArgs, IndirectArgsBuffers};
use gpu_primitives::kernel::{Binding, Kernel, KernelSource};
use gpu_primitives::memory::{Buffer, Category, Ledger};
use gpu_primitives::scan::{Scan, ScanBuffers};
use gpu_primitives::wgpu;
use gpu_primitives::wgsl::{Constant, Module};

use lru_cache_gpu::CacheBuffers;

use crate::Error;
use crate::rays::{
    FRAME_PARAMS, MASKS, RAYS, READ, RayBuffers, Rays, SLOTS, WRITE, begin, resources, source,
};
use crate::samples::{SampleLayout, Samples};
use crate::strategy::{MakeResident, Rounds, Scene, Strategy};

/// Layout of the pairs.
pub(crate) const PAIRS: Module =
    Module { name: "pairs", source: include_str!("../shader/lib/pairs.wgsl") };
const SPECULATE: Module =
    Module { name: "speculate", source: include_str!("../shader/speculate.wgsl") };
const ADVANCE: Module = Module { name: "advance", source: include_str!("../shader/advance.wgsl") };
const MARK: Module = Module { name: "mark", source: include_str!("../shader/mark.wgsl") };
const COUNT: Module = Module { name: "count", source: include_str!("../shader/count.wgsl") };
const SCATTER: Module = Module { name: "scatter", source: include_str!("../shader/scatter.wgsl") };
const INTERSECT: Module =
    Module { name: "intersect", source: include_str!("../shader/intersect.wgsl") };
const COMPOSITE: Module =
    Module { name: "composite", source: include_str!("../shader/composite.wgsl") };

/// Pairs of one workgroup of the kernels that go over pairs.
const PAIRS_PER_GROUP: u32 = 64;

/// Largest speculation count of the published algorithm.
const MOST_AHEAD: u32 = 64;

const PAIRS_HEADER_WORDS: u64 = 4;
const SPECULATE_BYTES: u64 = 16;
const ARGS_BYTES: u64 = 16;

/// Choices of the strategy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockSortedOptions {
    /// Ray-block pairs per pixel, 1 to 8: how far the first rounds look ahead.
    pub start_factor: u32,
    /// Whether rays go on to further blocks as the active ones become fewer, 64 at most.
    pub speculation: bool,
}

impl Default for BlockSortedOptions {
    fn default() -> Self {
        Self { start_factor: 1, speculation: true }
    }
}

/// Sizes of everything the strategy allocates for one picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockSortedPlan {
    capacity: u64,
    most_ahead: u32,
}

impl BlockSortedPlan {
    /// Plans a picture of `rays` pixels.
    ///
    /// # Errors
    /// If the start factor is not 1 to 8, or the pairs exceed a binding.
    pub fn new(
        rays: u64,
        options: BlockSortedOptions,
        limits: &wgpu::Limits,
    ) -> Result<Self, Error> {
        if !(1..=8).contains(&options.start_factor) {
            return Err(Error::StartFactor { found: options.start_factor });
        }
        let most_ahead = if options.speculation { MOST_AHEAD } else { 1 };
        let plan = Self { capacity: rays * u64::from(options.start_factor), most_ahead };
        let available = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if plan.pair_bytes() > available {
            let (pairs, needed) = (plan.capacity, plan.pair_bytes());
            return Err(Error::TooManyPairs { pairs, needed, available });
        }
        Ok(plan)
    }

    fn pair_bytes(&self) -> u64 {
        4 * (PAIRS_HEADER_WORDS + 2 * self.capacity)
    }

    /// Bytes with a cache of `slots` slots.
    pub fn bytes(&self, slots: u64) -> u64 {
        let scan = Scan::plan(slots).bytes();
        let compact = Compact::plan(slots).bytes();
        let args = 2 * (ARGS_BYTES + IndirectArgs::BIND_BYTES);
        // Counts, numbers and visible slots, the visible count, and the number of slots.
        self.pair_bytes() + 12 * slots + 8 + scan + compact + args + SPECULATE_BYTES
    }
}

/// The strategy's kernels. Immutable; used with any number of pictures.
#[derive(Debug)]
pub struct BlockSorted {
    kernels: Arc<Kernels>,
    plan: BlockSortedPlan,
}

#[derive(Debug)]
struct Kernels {
    speculate: Kernel,
    skip: Kernel,
    advance: Kernel,
    mark: Kernel,
    count: Kernel,
    scatter: Kernel,
    intersect: Kernel,
    composite: Kernel,
    args: IndirectArgs,
    scan: Scan,
    compact: Compact,
}

impl BlockSorted {
    /// Makes the pipelines for a cache of `slot_pages` pages.
    pub fn new(device: &wgpu::Device, slot_pages: u32, plan: BlockSortedPlan) -> Self {
        let [speculate, skip, advance, mark, count, scatter, intersect, composite] =
            Self::sources(slot_pages).map(|s| s.kernel(device));
        let kernels = Arc::new(Kernels {
            speculate,
            skip,
            advance,
            mark,
            count,
            scatter,
            intersect,
            composite,
            args: IndirectArgs::new(device),
            scan: Scan::new(device),
            compact: Compact::new(device),
        });
        Self { kernels, plan }
    }

    /// Texts and bindings of the kernels.
    pub fn sources(slot_pages: u32) -> [KernelSource; 8] {
        let pairs = Binding::StorageReadWrite { min_bytes: 4 * (PAIRS_HEADER_WORDS + 2) };
        let advance = vec![FRAME_PARAMS, RAYS, MASKS, pairs];
        let grouping = vec![FRAME_PARAMS, pairs, READ, WRITE];
        let mut intersect = vec![FRAME_PARAMS, READ, pairs, READ, READ, READ];
        intersect.extend(vec![SLOTS; slot_pages as usize]);
        let params = Binding::Uniform { bytes: SPECULATE_BYTES };
        let empty_space = [("EMPTY_SPACE_STEP", Constant::Bool(true))];
        let text = |label, module, bindings, constants| {
            source(label, module, bindings, SampleLayout::cached(slot_pages), constants, None)
        };
        [
            text("wavefront.speculate", SPECULATE, vec![params, RAYS, pairs], &[]),
            text("wavefront.skip", ADVANCE, advance.clone(), &empty_space),
            text("wavefront.advance", ADVANCE, advance, &[]),
            text("wavefront.mark", MARK, vec![FRAME_PARAMS, pairs, WRITE, WRITE], &[]),
            text("wavefront.count", COUNT, grouping.clone(), &[]),
            text("wavefront.scatter", SCATTER, grouping, &[]),
            text("wavefront.intersect", INTERSECT, intersect, &[]),
            text("wavefront.composite", COMPOSITE, vec![FRAME_PARAMS, RAYS, pairs], &[]),
        ]
    }
}

/// The strategy's memory and bind groups for one picture.
#[derive(Debug)]
struct BlockSortedRounds {
    kernels: Arc<Kernels>,
    pairs: Buffer,
    slot_counts: Buffer,
    visible: Buffer,
    visible_count_offset: u64,
    pair_args: Buffer,
    group_args: Buffer,
    pair_args_bind: IndirectArgsBuffers,
    group_args_bind: IndirectArgsBuffers,
    scan: ScanBuffers,
    compact: CompactBuffers,
    speculate: wgpu::BindGroup,
    mark: wgpu::BindGroup,
    count: wgpu::BindGroup,
    scatter: wgpu::BindGroup,
    skip: wgpu::BindGroup,
    advance: wgpu::BindGroup,
    intersect: wgpu::BindGroup,
    composite: wgpu::BindGroup,
    _constants: [Buffer; 3],
}

impl Strategy for BlockSorted {
    fn bind(
        &self,
        device: &wgpu::Device,
        ledger: &Ledger,
        scene: Scene<'_>,
    ) -> Result<Box<dyn Rounds>, Error> {
        let Samples::Cached(cache) = scene.samples else {
            return Err(Error::NeedsCache);
        };
        Ok(Box::new(BlockSortedRounds::new(device, ledger, self, scene, cache)))
    }
}

impl BlockSortedRounds {
    fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        stage: &BlockSorted,
        scene: Scene<'_>,
        cache: &CacheBuffers,
    ) -> Self {
        use wgpu::BufferUsages as Usage;
        let kernels = Arc::clone(&stage.kernels);
        let Scene { rays, masks, .. } = scene;
        let slots = cache.plan().slots();
        let buffer = |label, size, usage| {
            let label = Some(label);
            let desc = wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false };
            ledger.buffer(device, Category::Rays, &desc)
        };
        let storage = Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST;
        let pairs = buffer("wavefront.pairs", stage.plan.pair_bytes(), storage);
        let slot_counts = buffer("wavefront.slot_counts", 4 * slots, storage);
        let visible = buffer("wavefront.visible", 4 * slots + 4, storage);
        let visible_count_offset = 4 * slots;
        let args_usage = Usage::STORAGE | Usage::INDIRECT;
        let pair_args = buffer("wavefront.pair_args", ARGS_BYTES, args_usage);
        let group_args = buffer("wavefront.group_args", ARGS_BYTES, args_usage);
        let fixed = |label, usage, words: &[u32]| {
            let bytes = bytemuck::cast_slice(words);
            ledger.buffer_with(device, Category::Rays, label, usage, bytes)
        };
        let numbers: Vec<u32> = (0..slots as u32).collect();
        let slot_numbers = fixed("wavefront.slot_numbers", Usage::STORAGE, &numbers);
        let slot_count = fixed("wavefront.slot_count", Usage::STORAGE, &[slots as u32]);
        let speculate_params = fixed(
            "wavefront.speculate.params",
            Usage::UNIFORM,
            &[stage.plan.capacity as u32, stage.plan.most_ahead, 0, 0],
        );
        let pair_args_bind =
            kernels.args.bind(device, ledger, (&pairs, 4), PAIRS_PER_GROUP, (&pair_args, 0));
        let group_args_bind = kernels.args.bind(
            device,
            ledger,
            (&visible, visible_count_offset),
            1,
            (&group_args, 0),
        );
        let (scan_plan, compact_plan) = (Scan::plan(slots), Compact::plan(slots));
        let scan = ScanBuffers::new(
            device,
            ledger,
            &kernels.scan,
            &scan_plan,
            &slot_counts,
            &slot_count,
            0,
        );
        let compact = CompactBuffers::new(
            device,
            ledger,
            &kernels.compact,
            &compact_plan,
            &slot_counts,
            &slot_numbers,
            (&slot_count, 0),
            &visible,
            (&visible, visible_count_offset),
        );
        let bind = |kernel: &Kernel, buffers: &[&wgpu::Buffer]| {
            kernel.bind(device, "wavefront.block_sorted", &resources(buffers))
        };
        let (frame, states) = (rays.frame(), rays.rays());
        let (directory, state) = (cache.directory(), cache.state());
        let advance = [frame, states, masks, &*pairs];
        let mut intersect = resources(&[frame, states, &pairs, &visible, &slot_counts, directory]);
        intersect.extend(cache.slots().iter().map(|page| page.as_entire_binding()));
        Self {
            speculate: bind(&kernels.speculate, &[&speculate_params, states, &pairs]),
            mark: bind(&kernels.mark, &[frame, &pairs, directory, state]),
            count: bind(&kernels.count, &[frame, &pairs, directory, &slot_counts]),
            scatter: bind(&kernels.scatter, &[frame, &pairs, directory, &slot_counts]),
            skip: bind(&kernels.skip, &advance),
            advance: bind(&kernels.advance, &advance),
            intersect: kernels.intersect.bind(device, "wavefront.intersect", &intersect),
            composite: bind(&kernels.composite, &[frame, states, &pairs]),
            kernels,
            pairs,
            slot_counts,
            visible,
            visible_count_offset,
            pair_args,
            group_args,
            pair_args_bind,
            group_args_bind,
            scan,
            compact,
            _constants: [slot_numbers, slot_count, speculate_params],
        }
    }

    /// The next n active blocks of every active ray, and the requests for their samples.
    fn record_advance(&self, encoder: &mut wgpu::CommandEncoder, rays: &RayBuffers) {
        let _span = tracing::trace_span!("wavefront.advance").entered();
        let kernels = &self.kernels;
        {
            let mut pass = begin(encoder, "wavefront.advance");
            kernels.speculate.dispatch(&mut pass, &self.speculate, 1);
            kernels.advance.dispatch_indirect(&mut pass, &self.advance, rays.args(), 0);
        }
        kernels.args.record(encoder, &self.pair_args_bind);
        let mut pass = begin(encoder, "wavefront.mark");
        kernels.mark.dispatch_indirect(&mut pass, &self.mark, &self.pair_args, 0);
    }

    /// The ready pairs grouped by slot, and the list of visible slots.
    fn record_grouping(&self, encoder: &mut wgpu::CommandEncoder) {
        let _span = tracing::trace_span!("wavefront.grouping").entered();
        let kernels = &self.kernels;
        encoder.clear_buffer(&self.slot_counts, 0, None);
        {
            let mut pass = begin(encoder, "wavefront.count");
            kernels.count.dispatch_indirect(&mut pass, &self.count, &self.pair_args, 0);
        }
        kernels.compact.record(encoder, &self.compact);
        kernels.args.record(encoder, &self.group_args_bind);
        kernels.scan.record(encoder, &self.scan);
        let mut pass = begin(encoder, "wavefront.scatter");
        kernels.scatter.dispatch_indirect(&mut pass, &self.scatter, &self.pair_args, 0);
    }
}

impl Rounds for BlockSortedRounds {
    /// The empty-space step: every ray goes to its first active block, or is done.
    fn record_start(&self, encoder: &mut wgpu::CommandEncoder, stage: &Rays, rays: &RayBuffers) {
        {
            let mut pass = begin(encoder, "wavefront.skip");
            self.kernels.skip.dispatch_indirect(&mut pass, &self.skip, rays.args(), 0);
        }
        stage.record_resolve(encoder, rays);
    }

    fn record_round(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        stage: &Rays,
        rays: &RayBuffers,
        make_resident: MakeResident<'_>,
    ) {
        self.record_advance(encoder, rays);
        make_resident(encoder);
        self.record_grouping(encoder);
        {
            let _span = tracing::trace_span!("wavefront.intersect").entered();
            let mut pass = begin(encoder, "wavefront.intersect");
            let kernels = &self.kernels;
            kernels.intersect.dispatch_indirect(&mut pass, &self.intersect, &self.group_args, 0);
            kernels.composite.dispatch_indirect(&mut pass, &self.composite, rays.args(), 0);
        }
        stage.record_resolve(encoder, rays);
    }

    /// One more after the empty-space step.
    fn lists_at_start(&self) -> u32 {
        2
    }

    fn statistics(&self) -> Vec<(&wgpu::Buffer, u64, u64)> {
        vec![(&*self.pairs, 0, 8), (&*self.visible, self.visible_count_offset, 4)]
    }
}
