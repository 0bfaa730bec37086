//! A cache on the GPU and its twin, driven by the same uses.

use std::sync::OnceLock;

use gpu_primitives::kernel::{Binding, Kernel, KernelSource};
use gpu_primitives::memory::Ledger;
use gpu_primitives::wgsl::{Module, compose_fixed};
use gpu_testkit::gpu;
use lru_cache_gpu::cpu::Cache;
use lru_cache_gpu::{CacheBuffers, CachePlan, LruParams, Service, wgpu};

use crate::invariants;

/// What outputs hold before a kernel writes them.
pub(crate) const SENTINEL: u32 = 0xDEAD_BEEF;

/// Jobs per workgroup of the decode dispatch.
pub(crate) const JOBS_PER_GROUP: u32 = 4;

/// One use of the cache by a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Op {
    /// Touches the block's slot, or asks for the block.
    Use(u32),
    /// Asks for the block if it is absent.
    Request(u32),
    /// Touches the block's slot, if it has one.
    Touch(u32),
    /// Looks the block up, no more.
    Look(u32),
    /// Asks for the block even if it is there, which no ray should.
    RequestBlindly(u32),
}

impl Op {
    pub(crate) fn block(self) -> u32 {
        let (Op::Use(block)
        | Op::Request(block)
        | Op::Touch(block)
        | Op::Look(block)
        | Op::RequestBlindly(block)) = self;
        block
    }

    /// Whether it touches a resident block's slot.
    pub(crate) fn touches(self) -> bool {
        matches!(self, Op::Use(_) | Op::Touch(_))
    }

    /// Whether it asks for an absent block.
    pub(crate) fn asks(self) -> bool {
        matches!(self, Op::Use(_) | Op::Request(_) | Op::RequestBlindly(_))
    }

    /// As `script.wgsl` reads it.
    fn word(self) -> u32 {
        let kind = match self {
            Op::Use(_) => 0,
            Op::Request(_) => 1,
            Op::Touch(_) => 2,
            Op::Look(_) => 3,
            Op::RequestBlindly(_) => 4,
        };
        (kind << 29) | self.block()
    }
}

/// What happens before one service.
#[derive(Clone, Debug, Default)]
pub(crate) struct Round {
    pub(crate) new_frame: bool,
    pub(crate) ops: Vec<Op>,
    pub(crate) leader: Vec<u32>,
}

impl Round {
    pub(crate) fn uses(blocks: impl IntoIterator<Item = u32>) -> Self {
        Self { ops: blocks.into_iter().map(Op::Use).collect(), ..Self::default() }
    }

    pub(crate) fn leads(self, blocks: impl IntoIterator<Item = u32>) -> Self {
        Self { leader: blocks.into_iter().collect(), ..self }
    }

    pub(crate) fn in_new_frame(self) -> Self {
        Self { new_frame: true, ..self }
    }
}

/// What a round found and did.
#[derive(Debug)]
pub(crate) struct Served {
    /// The cache before the service.
    pub(crate) before: Cache,
    /// Slot of every use's block when it was looked up.
    pub(crate) found: Vec<Option<u32>>,
    pub(crate) jobs: Vec<[u32; 2]>,
}

/// The largest cache of `slots` slots for `blocks` blocks.
pub(crate) fn plan(blocks: u64, slots: u64, limits: &wgpu::Limits) -> CachePlan {
    let (mut low, mut high) = (CachePlan::minimum_bytes(blocks), 1 << 32);
    while low < high {
        let middle = low + (high - low) / 2;
        if CachePlan::fit(blocks, middle, limits).unwrap().slots() < slots {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    let plan = CachePlan::fit(blocks, low, limits).unwrap();
    assert_eq!(plan.slots(), slots, "{blocks} blocks");
    assert_eq!(plan.bytes(), low, "the plan takes the bytes that it needs");
    plan
}

/// The twin alone.
pub(crate) fn play(cache: &mut Cache, round: &Round) -> Served {
    if round.new_frame {
        cache.begin_frame();
    }
    let mut found = Vec::new();
    for &op in &round.ops {
        let slot = cache.lookup(op.block());
        found.push(slot);
        match slot {
            Some(slot) if op.touches() => cache.touch(slot),
            None if op.asks() => cache.request(op.block()),
            Some(_) if matches!(op, Op::RequestBlindly(_)) => cache.request(op.block()),
            _ => {}
        }
    }
    cache.lead(&round.leader);
    let before = cache.clone();
    let jobs = cache.serve();
    Served { before, found, jobs }
}

pub(crate) struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) service: Service,
    script: Kernel,
}

pub(crate) fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(|| {
        let (device, queue) = gpu::device();
        let service = Service::new(&device);
        let script = script_source().kernel(&device);
        Gpu { device, queue, service, script }
    })
}

impl Gpu {
    pub(crate) fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    pub(crate) fn read(&self, buffer: &wgpu::Buffer) -> Vec<u32> {
        gpu::read_u32s(&self.device, &self.queue, buffer)
    }

    pub(crate) fn submit(&self, encoder: wgpu::CommandEncoder) {
        gpu::submit_and_wait(&self.device, &self.queue, encoder);
    }
}

pub(crate) fn script_source() -> KernelSource {
    let module = Module { name: "script", source: include_str!("script.wgsl") };
    let write = |min_bytes| Binding::StorageReadWrite { min_bytes };
    KernelSource {
        label: "test.script",
        wgsl: compose_fixed(module, &lru_cache_gpu::wgsl::MODULES, &[]),
        entry_point: "main",
        bindings: vec![
            Binding::Uniform { bytes: 32 },
            write(4),
            write(100),
            Binding::StorageRead { min_bytes: 4 },
            write(4),
        ],
    }
}

/// The cache on the GPU.
pub(crate) struct OnGpu {
    pub(crate) buffers: CacheBuffers,
    pub(crate) ledger: Ledger,
    params: LruParams,
}

impl OnGpu {
    pub(crate) fn new(plan: &CachePlan) -> Self {
        let ledger = Ledger::new();
        let gpu = gpu();
        let buffers = CacheBuffers::new(&gpu.device, &ledger, &gpu.service, plan, JOBS_PER_GROUP);
        Self { buffers, ledger, params: plan.params() }
    }

    /// The cache's words in `twin`'s place.
    pub(crate) fn read(&self, twin: &Cache) -> Cache {
        let mut copy = twin.clone();
        copy.directory = gpu().read(self.buffers.directory());
        copy.state = gpu().read(self.buffers.state());
        copy
    }

    /// Plays the uses, in order or in parallel; the slots that they found.
    pub(crate) fn play(&self, round: &Round, in_order: bool) -> Vec<Option<u32>> {
        let gpu = gpu();
        let mut script = round.leader.clone();
        script.resize(8, u32::MAX);
        script.extend(round.ops.iter().map(|op| op.word()));
        let (count, lru) = (round.ops.len() as u32, self.params);
        let params = [
            lru.slots,
            lru.slots_per_page,
            lru.request_capacity,
            lru.heads,
            count,
            u32::from(in_order),
            round.leader.len() as u32,
            0,
        ];
        let buffer = |words: &[u32], usage| {
            gpu::buffer_with(&gpu.device, bytemuck::cast_slice(words), usage)
        };
        let params = buffer(&params, wgpu::BufferUsages::UNIFORM);
        let script = buffer(&script, wgpu::BufferUsages::STORAGE);
        let found = gpu::sentinel_buffer(&gpu.device, 4 * u64::from(count.max(1)), SENTINEL);
        let resources = [&params, self.buffers.directory(), self.buffers.state(), &script, &found]
            .map(wgpu::Buffer::as_entire_binding);
        let bind = gpu.script.bind(&gpu.device, "test.script", &resources);
        let mut encoder = gpu.encoder();
        if round.new_frame {
            gpu.service.record_begin_frame(&mut encoder, &self.buffers);
        }
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            gpu.script.dispatch(&mut pass, &bind, u64::from(count.div_ceil(64).max(1)));
        }
        gpu.submit(encoder);
        let slots = gpu.read(&found).into_iter().take(count as usize);
        slots.map(|slot| (slot != u32::MAX).then_some(slot)).collect()
    }

    /// Serves the round's requests; the jobs.
    pub(crate) fn serve(&self) -> Vec<[u32; 2]> {
        let gpu = gpu();
        let mut encoder = gpu.encoder();
        gpu.service.record(&mut encoder, &self.buffers);
        gpu.submit(encoder);
        let (buffer, offset) = self.buffers.job_count();
        let count = gpu.read(buffer)[offset as usize / 4] as usize;
        let args = gpu.read(self.buffers.decode_args());
        let groups = (count as u32).div_ceil(JOBS_PER_GROUP);
        assert_eq!(args[..3], [groups, 1, 1], "{count} jobs");
        gpu.read(self.buffers.jobs()).chunks_exact(2).take(count).map(|j| [j[0], j[1]]).collect()
    }
}

/// Plays every round on both, requires equal words before each service and agreement after it, and
/// checks the invariants.
pub(crate) struct Lockstep {
    pub(crate) twin: Cache,
    pub(crate) gpu: OnGpu,
}

impl Lockstep {
    pub(crate) fn new(plan: &CachePlan) -> Self {
        let (twin, gpu) = (Cache::new(plan), OnGpu::new(plan));
        let mut encoder = crate::harness::gpu().encoder();
        crate::harness::gpu().service.record_begin_frame(&mut encoder, &gpu.buffers);
        crate::harness::gpu().submit(encoder);
        let mut lockstep = Self { twin, gpu };
        lockstep.twin.begin_frame();
        lockstep
    }

    pub(crate) fn round(&mut self, round: &Round) -> Served {
        let found = self.gpu.play(round, true);
        let before = self.gpu.read(&self.twin);
        let jobs = self.gpu.serve();
        let after = self.gpu.read(&self.twin);
        let expected = play(&mut self.twin, round);
        assert_eq!(found, expected.found, "slots found");
        assert_same(&before, &expected.before, "before the service");
        invariants::check(&expected, &self.twin).unwrap();
        let served = Served { before, found, jobs };
        assert_agree(&served, &after, &expected, &self.twin);
        invariants::check(&served, &after).unwrap();
        // Goes on with what the GPU chose where the choice is open.
        self.twin = after;
        served
    }
}

/// Two services of the same round that may differ in which of several possible victims went, and
/// in who got which slot.
#[track_caller]
pub(crate) fn assert_agree(served: &Served, after: &Cache, twin: &Served, twin_after: &Cache) {
    assert_eq!(after.header(), twin_after.header(), "headers: GPU, twin");
    assert_eq!(after.request_table(), twin_after.request_table(), "request tables");
    let led = |served: &Served| -> Vec<[u32; 2]> {
        let leads = |job: &&[u32; 2]| served.before.leader().contains(&job[0]);
        served.jobs.iter().filter(leads).copied().collect()
    };
    assert_eq!(led(served), led(twin), "the leader's jobs");
    let first = &served.jobs[..led(served).len()];
    assert_eq!(first, led(served), "the leader's jobs come first");
    let blocks = |jobs: &[[u32; 2]]| sorted(jobs.iter().map(|job| job[0]).collect());
    if twin_after.counters().deferred == twin.before.counters().deferred {
        assert_eq!(blocks(&served.jobs), blocks(&twin.jobs), "blocks of the jobs");
    }
}

pub(crate) fn sorted<T: Ord>(mut list: Vec<T>) -> Vec<T> {
    list.sort();
    list
}

/// First differing word of two caches: which array, index, both values.
pub(crate) fn difference(a: &Cache, b: &Cache) -> Option<(&'static str, usize, u32, u32)> {
    [("directory", &a.directory, &b.directory), ("state", &a.state, &b.state)].into_iter().find_map(
        |(name, a, b)| {
            assert_eq!(a.len(), b.len(), "{name}");
            let index = a.iter().zip(b).position(|(a, b)| a != b)?;
            Some((name, index, a[index], b[index]))
        },
    )
}

#[track_caller]
fn assert_same(gpu: &Cache, twin: &Cache, when: &str) {
    assert_eq!(difference(gpu, twin), None, "{when}: array, word, GPU, twin");
}

#[test]
fn differences_are_found() {
    let a = Cache::new(&plan(20, 8, &wgpu::Limits::default()));
    assert_eq!(difference(&a, &a), None);
    let mut b = a.clone();
    b.state[5] = 3;
    assert_eq!(difference(&a, &b), Some(("state", 5, 0, 3)));
    b.directory[19] = 1;
    assert_eq!(difference(&a, &b), Some(("directory", 19, 0, 1)));
}
