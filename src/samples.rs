//! How samples come to the rays: decoded into a cache when rays ask for them, or all of them at load.

use gpu_primitives::memory::{Buffer, Category, Ledger};
use lru_cache_gpu::{CacheBuffers, CachePlan, Counters, ResidentBuffers, ResidentPlan, Service};
use wavefront::{SampleLayout, Samples};
use zfp_gpu::{Decode, DecodeBuffers, KeptSamples, Payload};

use crate::{Error, wgpu};

/// What a scene keeps of its samples.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum SamplePlan {
    Cached(CachePlan),
    Resident(ResidentPlan),
}

/// Pipelines that make samples resident after loading.
#[derive(Debug)]
pub(crate) enum SampleStages {
    Cached(Box<CacheStages>),
    Resident,
}

/// Pipelines of a cache.
#[derive(Debug)]
pub(crate) struct CacheStages {
    service: Service,
    decode: Decode,
}

/// Memory of samples.
#[derive(Debug)]
pub(crate) enum SampleBuffers {
    Cached(Box<CacheMemory>),
    Resident(ResidentBuffers),
}

/// Memory of a cache.
#[derive(Debug)]
pub(crate) struct CacheMemory {
    cache: CacheBuffers,
    decode: DecodeBuffers,
    /// The cache's counters when the frame started.
    counters_before: Buffer,
}

impl SamplePlan {
    pub(crate) fn layout(&self) -> SampleLayout {
        match self {
            Self::Cached(plan) => SampleLayout::cached(plan.page_count()),
            Self::Resident(plan) => SampleLayout::resident(plan.page_count()),
        }
    }

    pub(crate) fn slots(&self) -> u64 {
        match self {
            Self::Cached(plan) => plan.slots(),
            Self::Resident(plan) => plan.blocks(),
        }
    }

    pub(crate) fn params(&self) -> lru_cache_gpu::LruParams {
        match self {
            Self::Cached(plan) => plan.params(),
            Self::Resident(plan) => plan.params(),
        }
    }
}

impl SampleStages {
    pub(crate) fn new(device: &wgpu::Device, plan: &SamplePlan) -> Result<Self, Error> {
        Ok(match plan {
            SamplePlan::Cached(cache) => Self::Cached(Box::new(CacheStages {
                service: Service::new(device),
                decode: Decode::new(device, cache.page_count())?,
            })),
            SamplePlan::Resident(_) => Self::Resident,
        })
    }
}

impl SampleBuffers {
    /// Memory for `plan`, which `stages` were made from.
    pub(crate) fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        stages: &SampleStages,
        plan: &SamplePlan,
        payload: &Payload,
    ) -> Result<Self, Error> {
        match (plan, stages) {
            (SamplePlan::Cached(plan), SampleStages::Cached(stages)) => {
                let memory = CacheMemory::new(device, ledger, stages, plan, payload)?;
                Ok(Self::Cached(Box::new(memory)))
            }
            (SamplePlan::Resident(plan), _) => Ok(Self::resident(device, ledger, plan)),
            (SamplePlan::Cached(_), SampleStages::Resident) => {
                Err(Error::Wavefront(wavefront::Error::NeedsCache))
            }
        }
    }

    /// Memory for every block.
    pub(crate) fn resident(device: &wgpu::Device, ledger: &Ledger, plan: &ResidentPlan) -> Self {
        Self::Resident(ResidentBuffers::new(device, ledger, plan))
    }

    /// What rays read.
    pub(crate) fn samples(&self) -> Samples<'_> {
        match self {
            Self::Cached(memory) => Samples::Cached(&memory.cache),
            Self::Resident(resident) => Samples::Resident(resident),
        }
    }

    /// Where loading keeps samples.
    pub(crate) fn kept(&self) -> Option<KeptSamples<'_>> {
        match self {
            Self::Cached(_) => None,
            Self::Resident(resident) => Some(KeptSamples {
                pages: resident.slots(),
                slots_per_page: resident.plan().slots_per_page(),
            }),
        }
    }

    /// Records the start of a frame. `clear` forgets what is decoded.
    pub(crate) fn record_begin_frame(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        stages: &SampleStages,
        clear: bool,
    ) {
        if let (Self::Cached(memory), SampleStages::Cached(stages)) = (self, stages) {
            let CacheMemory { cache, counters_before, .. } = &**memory;
            if clear {
                stages.service.record_clear(encoder, cache);
            }
            let (offset, bytes) = Counters::BYTES;
            encoder.copy_buffer_to_buffer(cache.state(), offset, counters_before, 0, bytes);
            stages.service.record_begin_frame(encoder, cache);
        }
    }

    /// Records serving a round's requests; nothing where all samples are resident.
    pub(crate) fn record_service(&self, encoder: &mut wgpu::CommandEncoder, stages: &SampleStages) {
        if let (Self::Cached(memory), SampleStages::Cached(stages)) = (self, stages) {
            let CacheMemory { cache, decode, .. } = &**memory;
            {
                let _span = tracing::trace_span!("lru_cache_gpu.service").entered();
                stages.service.record(encoder, cache);
            }
            let _span = tracing::trace_span!("zfp_gpu.decode").entered();
            stages.decode.record_indirect(encoder, decode, cache.decode_args(), 0);
        }
    }

    /// Where the cache's counters are, now and at the frame's start, if there is a cache.
    pub(crate) fn counters(&self) -> Option<[(&wgpu::Buffer, u64, u64); 2]> {
        match self {
            Self::Cached(memory) => {
                let CacheMemory { cache, counters_before, .. } = &**memory;
                let (offset, bytes) = Counters::BYTES;
                Some([(cache.state(), offset, bytes), (&**counters_before, 0, bytes)])
            }
            Self::Resident(_) => None,
        }
    }
}

impl CacheMemory {
    fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        stages: &CacheStages,
        plan: &CachePlan,
        payload: &Payload,
    ) -> Result<Self, Error> {
        let CacheStages { service, decode } = stages;
        let cache = CacheBuffers::new(device, ledger, service, plan, Decode::JOBS_PER_GROUP);
        let pages: Vec<&wgpu::Buffer> = cache.slots().iter().map(|page| &**page).collect();
        let decode = DecodeBuffers::new(
            device,
            ledger,
            decode,
            payload,
            cache.jobs(),
            cache.job_count(),
            &pages,
            plan.params().slots_per_page,
        )?;
        let desc = wgpu::BufferDescriptor {
            label: Some("progressive-iso.counters_before"),
            size: Counters::BYTES.1,
            usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        };
        let counters_before = ledger.buffer(device, Category::Readback, &desc);
        Ok(Self { cache, decode, counters_before })
    }
}
