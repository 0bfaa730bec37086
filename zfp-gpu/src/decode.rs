//! Stage: decodes blocks into slots.

use gpu_primitives::indirect;
use gpu_primitives::kernel::{Binding, Kernel, KernelSource, window};
use gpu_primitives::memory::{Buffer, Category, Ledger};
use gpu_primitives::wgsl::{Module, compose_fixed};

use crate::plan::PAGE_PARAM_BYTES;
use crate::{Error, Payload, wgsl};

const DECODE: Module = Module { name: "decode", source: include_str!("../shader/decode.wgsl") };

/// Most cache pages that one dispatch can bind beside its inputs.
pub(crate) const MAX_CACHE_PAGES: u32 = 4;

/// Bytes of a slot: 64 samples.
pub const SLOT_BYTES: u64 = 256;

/// Stage: decodes (block, slot) jobs into slots of 64 f32.
///
/// Sample (x, y, z) of a block goes to `slot * 64 + x + 4y + 16z`, counted over the cache pages.
/// Padding samples of partial blocks are written too. Immutable: a pipeline and its layout.
#[derive(Debug)]
pub struct Decode {
    kernel: Kernel,
    cache_pages: u32,
}

/// What a [`Decode`] stage reads and writes: a bind group per payload page.
#[derive(Debug)]
pub struct DecodeBuffers {
    binds: Vec<wgpu::BindGroup>,
    _params: Buffer,
}

impl Decode {
    /// Jobs per workgroup, for the arguments of an indirect dispatch.
    pub const JOBS_PER_GROUP: u32 = 32;

    /// Makes the pipeline for a cache of 1 to 4 pages.
    ///
    /// # Errors
    /// [`Error::CachePages`] for any other number of pages.
    pub fn new(device: &wgpu::Device, cache_pages: u32) -> Result<Self, Error> {
        let kernel = Self::source(cache_pages)?.kernel(device);
        Ok(Self { kernel, cache_pages })
    }

    /// Text and bindings of the kernel.
    ///
    /// # Errors
    /// As [`Decode::new`].
    pub fn source(cache_pages: u32) -> Result<KernelSource, Error> {
        if !(1..=MAX_CACHE_PAGES).contains(&cache_pages) {
            let expected = format!("1 to {MAX_CACHE_PAGES}");
            return Err(Error::CachePages { expected, found: cache_pages as usize });
        }
        let mut bindings = vec![
            Binding::Uniform { bytes: PAGE_PARAM_BYTES },
            Binding::Uniform { bytes: DecodeBuffers::BYTES },
            Binding::StorageRead { min_bytes: 4 },
            Binding::StorageRead { min_bytes: 8 },
            Binding::StorageRead { min_bytes: 4 },
        ];
        bindings.extend((0..cache_pages).map(|_| Binding::StorageReadWrite { min_bytes: 16 }));
        Ok(KernelSource {
            label: "zfp-gpu.decode",
            wgsl: compose_fixed(
                DECODE,
                &[indirect::MODULE, wgsl::BLOCK, wgsl::GROUP, wgsl::STORE],
                &wgsl::slot_page_constants(cache_pages),
            ),
            entry_point: "decode",
            bindings,
        })
    }

    /// Cache pages that the pipeline writes.
    pub fn cache_pages(&self) -> u32 {
        self.cache_pages
    }

    /// Records one dispatch per payload page for at most `max_jobs` jobs. The number of jobs
    /// itself is read on the GPU; jobs beyond it or beyond the job buffer are not run.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        buffers: &DecodeBuffers,
        max_jobs: u32,
    ) {
        let groups = u64::from(max_jobs.div_ceil(Self::JOBS_PER_GROUP));
        let mut pass = begin_pass(encoder);
        for bind in &buffers.binds {
            self.kernel.dispatch(&mut pass, bind, groups);
        }
    }

    /// Records one indirect dispatch per payload page; the three u32 at byte `offset` of `args`
    /// are the folded number of groups of [`Decode::JOBS_PER_GROUP`] jobs.
    pub fn record_indirect(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        buffers: &DecodeBuffers,
        args: &wgpu::Buffer,
        offset: u64,
    ) {
        let mut pass = begin_pass(encoder);
        for bind in &buffers.binds {
            self.kernel.dispatch_indirect(&mut pass, bind, args, offset);
        }
    }
}

impl DecodeBuffers {
    /// Bytes that [`DecodeBuffers::new`] allocates.
    pub const BYTES: u64 = 16;

    /// Binds a payload, a list of jobs and a cache.
    ///
    /// - `jobs`: `array<vec2<u32>>` of (block, slot). Slots of one recording must differ. Jobs with
    ///   a block outside the volume or a slot outside the cache are skipped.
    /// - `job_count`: one u32 at a byte offset, a multiple of 4.
    /// - `cache`: as many buffers as the stage has cache pages. Slot `s` lies in page
    ///   `s / slots_per_page`; the last page may be shorter, and its size limits the slots.
    ///
    /// # Errors
    /// [`Error::CachePages`], [`Error::BufferTooSmall`] or [`Error::Unaligned`] when these rules
    /// are broken.
    pub fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        decode: &Decode,
        payload: &Payload,
        jobs: &wgpu::Buffer,
        job_count: (&wgpu::Buffer, u64),
        cache: &[&wgpu::Buffer],
        slots_per_page: u32,
    ) -> Result<Self, Error> {
        let slots = slot_count(decode, cache, slots_per_page)?;
        check_count(job_count)?;
        let (count, count_word) = window(job_count.0, job_count.1, 4);
        let params = ledger.buffer_with(
            device,
            Category::Params,
            "zfp-gpu.decode.params",
            wgpu::BufferUsages::UNIFORM,
            bytemuck::bytes_of(&[slots_per_page, slots, count_word, 0]),
        );
        let bind = |page: &crate::payload::Page| {
            let mut resources = vec![
                page.params.as_entire_binding(),
                params.as_entire_binding(),
                page.words.as_entire_binding(),
                jobs.as_entire_binding(),
                count.clone(),
            ];
            resources.extend(cache.iter().map(|buffer| buffer.as_entire_binding()));
            decode.kernel.bind(device, "zfp-gpu.decode", &resources)
        };
        Ok(Self { binds: payload.pages().iter().map(bind).collect(), _params: params })
    }
}

fn begin_pass(encoder: &mut wgpu::CommandEncoder) -> wgpu::ComputePass<'_> {
    gpu_primitives::profile::begin_pass(encoder, "zfp-gpu.decode")
}

fn check_count((buffer, offset): (&wgpu::Buffer, u64)) -> Result<(), Error> {
    if !offset.is_multiple_of(4) {
        return Err(Error::Unaligned { what: "the offset of the job count", found: offset });
    }
    let expected = offset.saturating_add(4);
    if buffer.size() < expected {
        return Err(too_small("the buffer of the job count", expected, buffer));
    }
    Ok(())
}

/// Slots of all cache pages.
fn slot_count(decode: &Decode, cache: &[&wgpu::Buffer], slots_per_page: u32) -> Result<u32, Error> {
    if cache.len() != decode.cache_pages as usize || slots_per_page == 0 {
        let expected = format!("{} with at least one slot each", decode.cache_pages);
        return Err(Error::CachePages { expected, found: cache.len() });
    }
    let full = u64::from(slots_per_page) * SLOT_BYTES;
    let mut slots = 0;
    for (index, buffer) in cache.iter().enumerate() {
        let expected = if index + 1 < cache.len() { full } else { SLOT_BYTES };
        if buffer.size() < expected {
            return Err(too_small("a cache page", expected, buffer));
        }
        slots += (buffer.size() / SLOT_BYTES).min(u64::from(slots_per_page));
    }
    Ok(u32::try_from(slots).unwrap_or(u32::MAX))
}

fn too_small(what: &'static str, expected: u64, buffer: &wgpu::Buffer) -> Error {
    Error::BufferTooSmall { what, expected, found: buffer.size() }
}
