//! Memory of one cache.

use gpu_primitives::kernel::Kernel;
use gpu_primitives::memory::{Buffer, Category, Ledger};
use gpu_primitives::wgpu;

use crate::plan::{ARGS_BYTES, CONTROL_BYTES, CachePlan, LruParams, SLOT_BYTES};
use crate::service::{FinishParams, Service};

/// Slots, directory, requests and scratch memory of one cache.
#[derive(Debug)]
pub struct CacheBuffers {
    pub(crate) plan: CachePlan,
    pub(crate) slots: Vec<Buffer>,
    pub(crate) directory: Buffer,
    pub(crate) state: Buffer,
    pub(crate) jobs: Buffer,
    pub(crate) control: Buffer,
    pub(crate) decode_args: Buffer,
    pub(crate) binds: Binds,
    _scratch: Vec<Buffer>,
}

/// One bind group per kernel.
#[derive(Debug)]
pub(crate) struct Binds {
    pub(crate) begin_frame: wgpu::BindGroup,
    pub(crate) lead: wgpu::BindGroup,
    pub(crate) search: wgpu::BindGroup,
    pub(crate) assign: wgpu::BindGroup,
    pub(crate) unlink: wgpu::BindGroup,
    pub(crate) insert: wgpu::BindGroup,
    pub(crate) finish: wgpu::BindGroup,
}

impl CacheBuffers {
    /// Allocates an empty cache. `jobs_per_group` is how many jobs one workgroup of the decode
    /// dispatch takes.
    pub fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        service: &Service,
        plan: &CachePlan,
        jobs_per_group: u32,
    ) -> Self {
        use wgpu::BufferUsages as Usage;
        let buffer = |category, label, size, usage| {
            let label = Some(label);
            let desc = wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false };
            ledger.buffer(device, category, &desc)
        };
        let storage = Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST;
        let scratch = |label, size| buffer(Category::Scratch, label, size, storage);
        let slots = plan
            .pages()
            .map(|count| buffer(Category::Slots, "lru.slots", count * SLOT_BYTES, storage))
            .collect();
        let directory = buffer(Category::Directory, "lru.directory", plan.table_bytes(), storage);
        let state = buffer(Category::Directory, "lru.state", plan.state_bytes(), storage);
        let jobs = scratch("lru.jobs", plan.job_bytes());
        let victims = scratch("lru.victims", plan.victim_bytes());
        let args_usage = storage | Usage::INDIRECT;
        let control = buffer(Category::Scratch, "lru.control", CONTROL_BYTES, args_usage);
        let decode_args = buffer(Category::Scratch, "lru.decode_args", ARGS_BYTES, args_usage);
        let uniform = |label, bytes: &[u8]| {
            ledger.buffer_with(device, Category::Params, label, Usage::UNIFORM, bytes)
        };
        let lru = plan.params();
        let params = uniform("lru.params", bytemuck::bytes_of::<LruParams>(&lru));
        let finish_params = FinishParams::new(lru, jobs_per_group);
        let finish_params = uniform("lru.finish_params", bytemuck::bytes_of(&finish_params));
        let bind = |kernel: &Kernel, buffers: &[&Buffer]| {
            let resources: Vec<_> = buffers.iter().map(|b| b.as_entire_binding()).collect();
            kernel.bind(device, "lru", &resources)
        };
        let kernels = &service.kernels;
        let (d, s) = (&directory, &state);
        let binds = Binds {
            begin_frame: bind(&kernels.begin_frame, &[&params, d, s]),
            lead: bind(&kernels.lead, &[&params, d, s, &jobs, &control]),
            search: bind(&kernels.search, &[&params, d, s, &victims]),
            assign: bind(&kernels.assign, &[&params, d, s, &victims, &jobs]),
            unlink: bind(&kernels.unlink, &[&params, d, s, &victims]),
            insert: bind(&kernels.insert, &[&params, d, s, &victims, &jobs]),
            finish: bind(&kernels.finish, &[&finish_params, d, s, &decode_args]),
        };
        let _scratch = vec![victims, params, finish_params];
        let plan = plan.clone();
        Self { plan, slots, directory, state, jobs, control, decode_args, binds, _scratch }
    }

    /// The plan these buffers were made from.
    pub fn plan(&self) -> &CachePlan {
        &self.plan
    }

    /// Pages of slots: sample `x + 4y + 16z` of slot `s` of a page at `64 s + ..`.
    pub fn slots(&self) -> &[Buffer] {
        &self.slots
    }

    /// Hash table from block to slot, as laid out in `shader/lib/lru_directory.wgsl`.
    pub fn directory(&self) -> &wgpu::Buffer {
        &self.directory
    }

    /// Header, stamps and requests, as laid out in `shader/lib/lru_state.wgsl`.
    pub fn state(&self) -> &wgpu::Buffer {
        &self.state
    }

    /// (block, slot) pairs to decode after a service.
    pub fn jobs(&self) -> &wgpu::Buffer {
        &self.jobs
    }

    /// Where the number of jobs is: a u32 at this byte offset of [`CacheBuffers::state`].
    pub fn job_count(&self) -> (&wgpu::Buffer, u64) {
        (&self.state, 4 * crate::layout::JOB_COUNT as u64)
    }

    /// Arguments of the decode dispatch, three u32 at offset 0.
    pub fn decode_args(&self) -> &wgpu::Buffer {
        &self.decode_args
    }
}
