//! The plan: what a scene needs, part by part, before anything is allocated.

use gpu_primitives::memory::Ledger;
use gpu_primitives::readback::ReadbackRing;
use lru_cache_gpu::{CachePlan, ResidentPlan};
use macrocell::{MacrocellPlan, Masks, RangeScratch};
use wavefront::{DrawBuffers, WavefrontPlan};
use zfp_gpu::{DecodeBuffers, ExtremaBuffers, PayloadPlan, StreamLayout};

use crate::load::LoadPlan;
use crate::renderer::READBACK_BYTES;
use crate::samples::SamplePlan;
use crate::{
    CompressedVolume, Error, RendererOptions, Residency, TraversalStrategy, capture, wgpu,
};

/// Passes that may be in flight.
pub(crate) const PASSES_IN_FLIGHT: usize = 2;

/// Largest upload chunk of a frame's parameters.
pub(crate) const PARAMS_CHUNK: u64 = 1024;

/// Staging memory of parameters: chunks of at most [`PARAMS_CHUNK`] bytes, two passes in flight.
const PARAMS_STAGING: u64 = 128 << 10;

/// One part of a scene.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Part {
    /// What it is.
    pub name: &'static str,
    /// Bytes of GPU memory; 0 for a part that is left out.
    pub bytes: u64,
    /// Why it is in or left out.
    pub why: String,
    /// Whether the scene has it. What it does not have costs no byte, pipeline or dispatch.
    pub included: bool,
}

/// What a scene needs, computed from the volume, the options and the device's limits alone.
#[derive(Debug, Clone, PartialEq)]
pub struct ScenePlan {
    pub(crate) payload: PayloadPlan,
    pub(crate) macrocell: MacrocellPlan,
    pub(crate) load: LoadPlan,
    pub(crate) samples: SamplePlan,
    pub(crate) wavefront: WavefrontPlan,
    pub(crate) strategy: StrategyPlan,
    parts: Vec<Part>,
    budget_bytes: u64,
}

impl ScenePlan {
    /// Plans a scene.
    ///
    /// # Errors
    /// As [`ScenePlan::for_layout`].
    pub fn new(
        volume: &CompressedVolume,
        options: &RendererOptions,
        limits: &wgpu::Limits,
    ) -> Result<Self, Error> {
        Self::for_layout(volume.layout(), options, limits)
    }

    /// Plans a scene before its stream is at hand.
    ///
    /// # Errors
    /// If the volume or picture exceeds the device's limits, or the budget is below the minimum,
    /// which the error names.
    pub fn for_layout(
        layout: &StreamLayout,
        options: &RendererOptions,
        limits: &wgpu::Limits,
    ) -> Result<Self, Error> {
        check_limits(limits)?;
        let payload = PayloadPlan::new(layout, limits)?;
        let macrocell = MacrocellPlan::new(layout.dims, limits)?;
        let outputs = options.all_outputs();
        let wavefront = WavefrontPlan::new(options.size, outputs, limits)?;
        let strategy = StrategyPlan::new(options.strategy, wavefront.rays(), limits)?;
        let scene = Scene { options, payload, macrocell, wavefront, strategy, limits };
        match options.residency {
            Residency::Cached => scene.cached(),
            Residency::Full => scene.resident(),
            Residency::Auto if strategy.can_be_resident() => {
                scene.resident().or_else(|_| scene.cached())
            }
            Residency::Auto => scene.cached(),
        }
    }

    /// The same scene with one pixel and the smallest cache, for the time of a change of size.
    pub(crate) fn shrunk(&self, limits: &wgpu::Limits) -> Result<Self, Error> {
        let blocks = self.blocks();
        let cache = CachePlan::fit(blocks, CachePlan::minimum_bytes(blocks), limits)?;
        let samples = SamplePlan::Cached(cache);
        let wavefront = WavefrontPlan::new([1, 1], self.wavefront.outputs(), limits)?;
        let strategy = self.strategy.shrunk(limits)?;
        Ok(Self { samples, wavefront, strategy, ..self.clone() })
    }

    /// The parts, in or left out.
    #[must_use]
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// Most bytes that the scene ever takes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.parts.iter().map(|part| part.bytes).sum()
    }

    /// The budget that was given.
    #[must_use]
    pub fn budget_bytes(&self) -> u64 {
        self.budget_bytes
    }

    /// Blocks that can be resident at a time.
    #[must_use]
    pub fn slots(&self) -> u64 {
        self.samples.slots()
    }

    /// [`Residency::Cached`] or [`Residency::Full`].
    #[must_use]
    pub fn residency(&self) -> Residency {
        match self.samples {
            SamplePlan::Cached(_) => Residency::Cached,
            SamplePlan::Resident(_) => Residency::Full,
        }
    }

    /// Blocks of the volume.
    #[must_use]
    pub fn blocks(&self) -> u64 {
        self.macrocell.grid().block_count()
    }

    /// A table of the parts for people.
    #[must_use]
    pub fn explain(&self) -> String {
        let dims = self.macrocell.grid().dims();
        let [width, height] = self.wavefront.size();
        let line = |name: &str, bytes: &str, why: &str| format!("{name:<16} {bytes:>12}  {why}\n");
        let mut text = line("part", "bytes", &format!("{dims:?} voxels, {width}x{height} pixels"));
        for part in &self.parts {
            let bytes = if part.included { part.bytes.to_string() } else { "left out".into() };
            text += &line(part.name, &bytes, &part.why);
        }
        let budget = format!("of a budget of {}", self.budget_bytes);
        text += &line("total", &self.bytes().to_string(), &budget);
        text
    }
}

/// What a scene consists of, whatever is kept of its samples.
struct Scene<'a> {
    options: &'a RendererOptions,
    payload: PayloadPlan,
    macrocell: MacrocellPlan,
    wavefront: WavefrontPlan,
    strategy: StrategyPlan,
    limits: &'a wgpu::Limits,
}

impl Scene<'_> {
    /// The parts that do not depend on the samples, with their bytes. Staging grows with the budget
    /// unless that leaves less than `rest` bytes.
    fn fixed(&self, rest: u64) -> (LoadPlan, Vec<Part>, u64) {
        let stream_bytes = self.payload.layout().stream_bytes();
        let with = |load: LoadPlan| {
            let parts =
                fixed_parts(self.options, &self.payload, &self.macrocell, &load, &self.wavefront);
            let bytes = parts.iter().map(|part| part.bytes).sum();
            (load, parts, bytes)
        };
        let found = with(LoadPlan::new(stream_bytes, self.options.budget_bytes));
        if found.2 + rest > self.options.budget_bytes {
            return with(LoadPlan::smallest(stream_bytes));
        }
        found
    }

    fn cached(self) -> Result<ScenePlan, Error> {
        let budget = self.options.budget_bytes;
        let blocks = self.macrocell.grid().block_count();
        let strategy = self.strategy;
        let smallest =
            CachePlan::minimum_bytes(blocks) + strategy.bytes(CachePlan::least_slots(blocks));
        let (load, mut parts, fixed) = self.fixed(smallest);
        let minimum = fixed + smallest;
        if minimum > budget {
            return Err(Error::BudgetTooSmall { minimum, budget });
        }
        let beside = |slots| strategy.bytes(slots);
        let most_pages = strategy.most_slot_pages();
        let cache = CachePlan::fit_beside(blocks, budget - fixed, self.limits, most_pages, beside)?;
        parts.push(strategy.part(cache.slots()));
        parts.push(cache_part(&cache, blocks));
        parts.push(left_out("resident volume", "decoded on demand"));
        Ok(self.plan(SamplePlan::Cached(cache), load, parts))
    }

    fn resident(&self) -> Result<ScenePlan, Error> {
        let budget = self.options.budget_bytes;
        if !self.strategy.can_be_resident() {
            return Err(Error::Wavefront(wavefront::Error::NeedsCache));
        }
        let blocks = self.macrocell.grid().block_count();
        let resident = ResidentPlan::new(blocks, self.limits, self.strategy.most_slot_pages())?;
        let (load, mut parts, fixed) = self.fixed(resident.bytes());
        let minimum = fixed + resident.bytes();
        if minimum > budget {
            return Err(Error::BudgetTooSmall { minimum, budget });
        }
        parts.push(self.strategy.part(blocks));
        parts.push(left_out("cache", "every block is resident"));
        let why = format!("{blocks} blocks, decoded at load");
        parts.push(part("resident volume", resident.bytes(), why));
        Ok(self.plan(SamplePlan::Resident(resident), load, parts))
    }

    fn plan(&self, samples: SamplePlan, load: LoadPlan, parts: Vec<Part>) -> ScenePlan {
        ScenePlan {
            payload: self.payload.clone(),
            macrocell: self.macrocell.clone(),
            load,
            samples,
            wavefront: self.wavefront.clone(),
            strategy: self.strategy,
            parts,
            budget_bytes: self.options.budget_bytes,
        }
    }
}

/// What the chosen strategy allocates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StrategyPlan {
    RunAhead,
    #[cfg(feature = "block-sorted")]
    BlockSorted(wavefront::BlockSortedOptions, wavefront::BlockSortedPlan),
}

impl StrategyPlan {
    #[cfg_attr(
        not(feature = "block-sorted"),
        expect(unused_variables, reason = "RunAhead needs no memory of its own")
    )]
    fn new(strategy: TraversalStrategy, rays: u64, limits: &wgpu::Limits) -> Result<Self, Error> {
        match strategy {
            TraversalStrategy::RunAhead => Ok(Self::RunAhead),
            #[cfg(feature = "block-sorted")]
            TraversalStrategy::BlockSorted(options) => {
                let plan = wavefront::BlockSortedPlan::new(rays, options, limits)?;
                Ok(Self::BlockSorted(options, plan))
            }
        }
    }

    /// Pages of slots that the strategy's kernels have bindings for beside their other buffers.
    fn most_slot_pages(self) -> u64 {
        match self {
            Self::RunAhead => 4,
            #[cfg(feature = "block-sorted")]
            Self::BlockSorted(..) => 3,
        }
    }

    /// Whether the strategy works on a volume that is resident as a whole.
    fn can_be_resident(self) -> bool {
        match self {
            Self::RunAhead => true,
            #[cfg(feature = "block-sorted")]
            Self::BlockSorted(..) => false,
        }
    }

    /// The same for one ray.
    fn shrunk(self, limits: &wgpu::Limits) -> Result<Self, Error> {
        match self {
            Self::RunAhead => Self::new(TraversalStrategy::RunAhead, 1, limits),
            #[cfg(feature = "block-sorted")]
            Self::BlockSorted(options, _) => {
                Self::new(TraversalStrategy::BlockSorted(options), 1, limits)
            }
        }
    }

    /// Bytes beside rays and pictures, with a cache of `slots` slots.
    #[cfg_attr(
        not(feature = "block-sorted"),
        expect(unused_variables, reason = "RunAhead needs nothing for a slot")
    )]
    fn bytes(&self, slots: u64) -> u64 {
        match self {
            Self::RunAhead => 0,
            #[cfg(feature = "block-sorted")]
            Self::BlockSorted(_, plan) => plan.bytes(slots),
        }
    }

    fn part(&self, slots: u64) -> Part {
        let bytes = self.bytes(slots);
        match self {
            Self::RunAhead => Part { bytes, ..left_out("block pairs", "strategy RunAhead") },
            #[cfg(feature = "block-sorted")]
            Self::BlockSorted(options, _) => part(
                "block pairs",
                bytes,
                format!("strategy BlockSorted, start factor {}", options.start_factor),
            ),
        }
    }
}

/// Limits that every scene needs: WebGPU's defaults.
fn check_limits(limits: &wgpu::Limits) -> Result<(), Error> {
    let needed = wgpu::Limits::default();
    let checks = [
        (
            "storage buffers per shader stage",
            needed.max_storage_buffers_per_shader_stage,
            limits.max_storage_buffers_per_shader_stage,
        ),
        (
            "storage textures per shader stage",
            needed.max_storage_textures_per_shader_stage,
            limits.max_storage_textures_per_shader_stage,
        ),
        (
            "invocations per workgroup",
            needed.max_compute_invocations_per_workgroup,
            limits.max_compute_invocations_per_workgroup,
        ),
        (
            "workgroups per dimension",
            needed.max_compute_workgroups_per_dimension,
            limits.max_compute_workgroups_per_dimension,
        ),
        (
            "bytes of workgroup memory",
            needed.max_compute_workgroup_storage_size,
            limits.max_compute_workgroup_storage_size,
        ),
    ];
    for (what, needed, found) in checks {
        if found < needed {
            let (needed, found) = (u64::from(needed), u64::from(found));
            return Err(Error::UnsupportedDevice { what, needed, found });
        }
    }
    Ok(())
}

fn part(name: &'static str, bytes: u64, why: impl Into<String>) -> Part {
    Part { name, bytes, why: why.into(), included: true }
}

fn left_out(name: &'static str, why: &'static str) -> Part {
    Part { name, bytes: 0, why: why.into(), included: false }
}

fn fixed_parts(
    options: &RendererOptions,
    payload: &PayloadPlan,
    macrocell: &MacrocellPlan,
    load: &LoadPlan,
    wavefront: &WavefrontPlan,
) -> Vec<Part> {
    let grid = macrocell.grid();
    let readback = ReadbackRing::new(&Ledger::new(), "plan", READBACK_BYTES, PASSES_IN_FLIGHT);
    let scratch = macrocell.scratch_bytes() + RangeScratch::PARAMS_BYTES + ExtremaBuffers::BYTES;
    let mut parts = vec![
        part(
            "payload",
            payload.bytes(),
            format!("compressed stream, {} page(s)", payload.page_count()),
        ),
        part("ranges", macrocell.range_bytes(), "value ranges, 2 bytes a block"),
        part(
            "masks",
            macrocell.mask_bytes() + Masks::params_bytes(macrocell),
            "active blocks of one isovalue",
        ),
        part("range scratch", scratch, "while loading"),
        part("upload", load.staging_bytes() + PARAMS_STAGING, "staging"),
        part(
            "readback",
            readback.bytes_limit() + crate::renderer::CONTROL_BYTES,
            "counters of two passes",
        ),
        part("rays", wavefront.ray_bytes(), "states and active lists"),
        part("pictures", wavefront.output_bytes(), picture_names(wavefront)),
        part("decode", DecodeBuffers::BYTES, "parameters"),
    ];
    parts.push(if grid.has_third_level() {
        part("third level", 0, "counted with the masks")
    } else {
        left_out("third level", "fewer than 512 coarse cells")
    });
    parts.push(match options.draw_target {
        Some(_) => part("draw", DrawBuffers::BYTES, "into the caller's targets"),
        None => left_out("draw", "no draw target"),
    });
    parts.push(if options.capture {
        part("capture", capture::bytes(wavefront), "pictures read back")
    } else {
        left_out("capture", "not asked for")
    });
    parts
}

fn picture_names(wavefront: &WavefrontPlan) -> String {
    let outputs = wavefront.outputs();
    let mut names = vec!["colour"];
    names.extend(outputs.depth.then_some("depth"));
    names.extend(outputs.normal.then_some("normal"));
    names.extend(outputs.status.then_some("status"));
    names.join(", ")
}

fn cache_part(cache: &CachePlan, blocks: u64) -> Part {
    let share = 100.0 * cache.slots() as f64 / blocks as f64;
    let why = format!("{} slots for {blocks} blocks ({share:.1} %)", cache.slots());
    part("cache", cache.bytes(), why)
}
