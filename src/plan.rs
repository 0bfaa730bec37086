//! The plan: what a scene needs, part by part, before anything is allocated.

use std::fmt;

use gpu_primitives::memory::Ledger;
use gpu_primitives::readback::ReadbackRing;
use infill::InfillPlan;
use lru_cache_gpu::{CachePlan, CacheRoom, ResidentPlan};
use macrocell::{MacrocellPlan, Masks, RangeScratch};
use wavefront::{DrawBuffers, PreviewBinds, WavefrontPlan};
use zfp_gpu::{DecodeBuffers, ExtremaBuffers, PayloadPlan, StreamLayout};

use crate::budget::Budget;
use crate::load::{BLOCKS_PER_REGION, LoadPlan};
use crate::records::{CONTROL_BYTES, PASSES_IN_FLIGHT, readback_bytes};
use crate::samples::SamplePlan;
use crate::schedule::FIRST_CELLS;
use crate::strategy::StrategyPlan;
use crate::{
    BudgetMode, CompressedVolume, Error, InfillOptions, RendererOptions, Residency, capture, wgpu,
};

/// Largest upload chunk of a frame's parameters.
pub(crate) const PARAMS_CHUNK: u64 = 1024;

/// Staging memory of parameters: chunks of at most [`PARAMS_CHUNK`] bytes, two passes in flight.
const PARAMS_STAGING: u64 = 128 << 10;

/// When a part of a scene has its memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum When {
    /// As long as the renderer lives.
    Always,
    /// Until the GPU has loaded the volume.
    Loading,
    /// From then on.
    Rendering,
}

/// One part of a scene.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Part {
    /// What it is.
    pub name: &'static str,
    /// When its memory is allocated.
    pub when: When,
    /// Bytes of GPU memory; 0 for a part that is left out.
    pub bytes: u64,
    /// Why it is in or left out.
    pub why: String,
    /// Whether the scene has it. What it does not have costs no byte, pipeline or dispatch.
    pub included: bool,
}

/// Most work of a dispatch, for any input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Work {
    /// `RunAhead`: cells that all rays of a walk visit together, until times are known; from then on
    /// [`crate::PassReport::cells_bound`].
    pub first_cells: u32,
    /// Blocks that a round decodes; 0 where all samples are resident.
    pub blocks_decoded: u64,
    /// Blocks that a dispatch decodes while loading.
    pub blocks_loaded: u64,
}

/// Pixels from one of a preview's to the next that a frame's first pass may have.
const PREVIEW_STEPS: [u32; 2] = [2, 4];

/// What previews of one size need.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PreviewPlan {
    pub(crate) step: u32,
    pub(crate) wavefront: WavefrontPlan,
    pub(crate) infill: InfillPlan,
}

impl PreviewPlan {
    fn bytes(&self) -> u64 {
        self.wavefront.bytes() + self.infill.bytes()
    }
}

/// What a scene needs, computed from the volume's layout, the options and the device's limits alone.
#[derive(Debug, Clone, PartialEq)]
pub struct ScenePlan {
    pub(crate) payload: PayloadPlan,
    pub(crate) macrocell: MacrocellPlan,
    pub(crate) load: LoadPlan,
    pub(crate) samples: SamplePlan,
    pub(crate) wavefront: WavefrontPlan,
    pub(crate) strategy: StrategyPlan,
    pub(crate) infill: Option<InfillPlan>,
    /// Those asked for, unless in-fill does not pay.
    pub(crate) infill_options: Option<InfillOptions>,
    pub(crate) previews: Vec<PreviewPlan>,
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
        Self::with_load(layout, options, limits, None)
    }

    /// Plans a scene whose volume is being loaded with `load` already, if that is given.
    pub(crate) fn with_load(
        layout: &StreamLayout,
        options: &RendererOptions,
        limits: &wgpu::Limits,
        load: Option<LoadPlan>,
    ) -> Result<Self, Error> {
        check_limits(limits)?;
        let scene = |resident| Scene::new(layout, options, limits, load, resident);
        match options.residency {
            Residency::Cached => scene(false)?.cached(),
            Residency::Full => scene(true)?.resident(),
            Residency::Auto => {
                let auto = scene(true)?;
                let resident = auto.may_be_resident().then(|| auto.resident());
                match resident {
                    Some(Ok(plan)) => Ok(plan),
                    _ => scene(false)?.cached(),
                }
            }
        }
    }

    /// The parts, in or left out, by the time when they are needed.
    #[must_use]
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// Most bytes that the scene ever takes: those of loading or of rendering.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.loading_bytes().max(self.rendering_bytes())
    }

    /// Most bytes until the volume is loaded.
    #[must_use]
    pub fn loading_bytes(&self) -> u64 {
        bytes(&self.parts, When::Loading)
    }

    /// Most bytes from then on.
    #[must_use]
    pub fn rendering_bytes(&self) -> u64 {
        bytes(&self.parts, When::Rendering)
    }

    /// [`ScenePlan::bytes`] without the compressed stream's.
    #[must_use]
    pub fn overhead_bytes(&self) -> u64 {
        self.bytes() - self.payload.bytes()
    }

    /// The budget that was given.
    #[must_use]
    pub fn budget_bytes(&self) -> u64 {
        self.budget_bytes
    }

    /// Pixels of the picture for one that in-fill works on in both directions.
    pub(crate) fn infill_step(&self) -> u32 {
        self.infill.as_ref().map_or(1, InfillPlan::step)
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

    /// Most work of a dispatch.
    #[must_use]
    pub fn work(&self) -> Work {
        let blocks_decoded = match &self.samples {
            SamplePlan::Cached(cache) => cache.job_capacity(),
            SamplePlan::Resident(_) => 0,
        };
        Work { first_cells: FIRST_CELLS, blocks_decoded, blocks_loaded: BLOCKS_PER_REGION }
    }

    /// A table of the parts for people.
    #[must_use]
    pub fn explain(&self) -> String {
        let dims = self.macrocell.grid().dims();
        let [width, height] = self.wavefront.size();
        let line = |name: &str, bytes: &str, when: &str, why: &str| {
            format!("{name:<16} {bytes:>12}  {when:<9}  {why}\n")
        };
        let scene = format!("{dims:?} voxels, {width}x{height} pixels");
        let mut text = line("part", "bytes", "when", &scene);
        for part in &self.parts {
            let (bytes, when) = if part.included {
                (part.bytes.to_string(), part.when.to_string())
            } else {
                ("left out".into(), String::new())
            };
            text += &line(part.name, &bytes, &when, &part.why);
        }
        for (when, bytes) in
            [(When::Loading, self.loading_bytes()), (When::Rendering, self.rendering_bytes())]
        {
            text +=
                &line("sum", &bytes.to_string(), &when.to_string(), "with what is always there");
        }
        let budget = format!("the larger sum, of a budget of {}", self.budget_bytes);
        text += &line("total", &self.bytes().to_string(), "", &budget);
        text
    }
}

/// What a scene consists of, whatever is kept of its samples.
struct Scene<'a> {
    options: &'a RendererOptions,
    limits: &'a wgpu::Limits,
    payload: PayloadPlan,
    macrocell: MacrocellPlan,
    /// How the volume is being loaded already.
    load: Option<LoadPlan>,
    wavefront: WavefrontPlan,
    strategy: StrategyPlan,
    infill: Option<InfillPlan>,
    /// What of the options' in-fill pays.
    infill_options: Option<InfillOptions>,
    previews: Vec<PreviewPlan>,
}

impl<'a> Scene<'a> {
    fn new(
        layout: &StreamLayout,
        options: &'a RendererOptions,
        limits: &'a wgpu::Limits,
        load: Option<LoadPlan>,
        resident: bool,
    ) -> Result<Self, Error> {
        let payload = PayloadPlan::new(layout, limits)?;
        let macrocell = MacrocellPlan::new(layout.dims, limits)?;
        let infill_options = options.infill_in(resident);
        let outputs = options.all_outputs(infill_options.is_some());
        let wavefront =
            WavefrontPlan::new(options.size, outputs, limits)?.with_foveation(options.blue_noise());
        let strategy = StrategyPlan::new(options.strategy, wavefront.rays(), limits)?;
        let infill_plan = |infill: InfillOptions, size| {
            let network = infill.network.is_some();
            InfillPlan::new(size, infill.sources, network, &macrocell, limits)
        };
        let infill = infill_options
            .map(|asked| {
                let plan = infill_plan(asked, options.size)?;
                let half = plan.halved().filter(|_| asked.half_resolution);
                Ok::<_, Error>(half.unwrap_or(plan))
            })
            .transpose()?;
        let mut previews = Vec::new();
        let has_previews = options.budget.is_some_and(BudgetMode::has_previews)
            && matches!(strategy, StrategyPlan::RunAhead)
            // Which draws no pixel without a depth.
            && options.draw_target.is_none();
        if let (Some(asked), true) = (infill_options, has_previews) {
            for step in PREVIEW_STEPS {
                let Some(wavefront) = wavefront.preview(step) else { continue };
                let infill = infill_plan(asked, wavefront.size())?;
                previews.push(PreviewPlan { step, wavefront, infill });
            }
        }
        Ok(Self {
            options,
            limits,
            payload,
            macrocell,
            load,
            wavefront,
            strategy,
            infill,
            infill_options,
            previews,
        })
    }

    fn blocks(&self) -> u64 {
        self.macrocell.grid().block_count()
    }

    fn most_slots(&self) -> u64 {
        self.options.most_slots.unwrap_or(u64::MAX)
    }

    /// Whether [`Residency::Auto`] may choose full residency.
    fn may_be_resident(&self) -> bool {
        self.strategy.can_be_resident() && self.blocks() <= self.most_slots()
    }

    fn cached(&self) -> Result<ScenePlan, Error> {
        let blocks = self.blocks();
        let beside = |slots| self.strategy.bytes(slots);
        let smallest = CachePlan::minimum_bytes(blocks) + beside(CachePlan::least_slots(blocks));
        let mut parts = self.parts();
        let decode = Part::new("decode", When::Rendering, DecodeBuffers::BYTES, "parameters");
        self.check_budget(&parts, decode.bytes + smallest)?;
        let room = CacheRoom {
            bytes: self.options.budget_bytes - bytes(&parts, When::Rendering) - decode.bytes,
            most_pages: self.strategy.most_slot_pages(),
            most_slots: self.most_slots(),
        };
        let cache = CachePlan::fit_beside(blocks, room, self.limits, beside)?;
        parts.push(decode);
        parts.push(self.strategy.part(cache.slots()));
        parts.push(cache_part(&cache, blocks));
        parts.push(Part::left_out("resident volume", "decoded on demand"));
        Ok(self.plan(SamplePlan::Cached(cache), parts))
    }

    fn resident(&self) -> Result<ScenePlan, Error> {
        if !self.strategy.can_be_resident() {
            return Err(Error::Wavefront(wavefront::Error::NeedsCache));
        }
        let blocks = self.blocks();
        let resident = ResidentPlan::new(blocks, self.limits, self.strategy.most_slot_pages())?;
        let mut parts = self.parts();
        parts.push(self.strategy.part(blocks));
        parts.push(Part::left_out("decode", "every block is resident"));
        parts.push(Part::left_out("cache", "every block is resident"));
        let why = format!("{blocks} blocks, decoded at load");
        parts.push(Part::new("resident volume", When::Always, resident.bytes(), why));
        self.check_budget(&parts, 0)?;
        Ok(self.plan(SamplePlan::Resident(resident), parts))
    }

    /// Refuses a budget that does not hold `parts` with the least staging while loading, or with
    /// `more` bytes while rendering.
    fn check_budget(&self, parts: &[Part], more: u64) -> Result<(), Error> {
        let budget = self.options.budget_bytes;
        let loading = bytes(parts, When::Loading) + self.load_plan(0).staging_bytes();
        let minimum = loading.max(bytes(parts, When::Rendering) + more);
        if minimum > budget {
            return Err(Error::BudgetTooSmall { minimum, budget });
        }
        Ok(())
    }

    /// How the volume is loaded with about `room` bytes for staging.
    fn load_plan(&self, room: u64) -> LoadPlan {
        let stream_bytes = self.payload.layout().stream_bytes();
        self.load.unwrap_or_else(|| LoadPlan::new(stream_bytes, room))
    }

    /// The plan, once all parts but the staging memory of the stream are known: that takes what
    /// rendering needs more than loading.
    fn plan(&self, samples: SamplePlan, mut parts: Vec<Part>) -> ScenePlan {
        let room = bytes(&parts, When::Rendering).saturating_sub(bytes(&parts, When::Loading));
        let load = self.load_plan(room);
        parts.push(Part::new("upload", When::Loading, load.staging_bytes(), "stream, in pieces"));
        parts.sort_by_key(|part| part.when);
        ScenePlan {
            payload: self.payload.clone(),
            macrocell: self.macrocell.clone(),
            load,
            samples,
            wavefront: self.wavefront.clone(),
            strategy: self.strategy,
            infill: self.infill.clone(),
            infill_options: self.infill_options,
            previews: self.previews.clone(),
            parts,
            budget_bytes: self.options.budget_bytes,
        }
    }

    /// The parts that do not depend on what is kept of the samples.
    fn parts(&self) -> Vec<Part> {
        let mut parts = Vec::from(self.volume_parts());
        parts.extend(self.picture_parts());
        let bytes = readback_bytes(self.infill.is_some());
        let readback =
            ReadbackRing::new(&Ledger::new(), "plan", bytes, PASSES_IN_FLIGHT).bytes_limit();
        parts.extend([
            Part::new("parameters", When::Always, PARAMS_STAGING, "staging"),
            Part::new("readback", When::Always, readback + CONTROL_BYTES, "counters of two passes"),
        ]);
        parts
    }

    fn volume_parts(&self) -> [Part; 5] {
        let Self { payload, macrocell, .. } = self;
        let masks = macrocell.mask_bytes() + Masks::params_bytes(macrocell);
        let scratch =
            macrocell.scratch_bytes() + RangeScratch::PARAMS_BYTES + ExtremaBuffers::BYTES;
        let stream = format!("compressed stream, {} page(s)", payload.page_count());
        [
            Part::new("payload", When::Always, payload.bytes(), stream),
            Part::new(
                "ranges",
                When::Always,
                macrocell.range_bytes(),
                "value ranges, 2 bytes a block",
            ),
            Part::new("masks", When::Always, masks, "active blocks of one isovalue"),
            if macrocell.grid().has_third_level() {
                Part::new("third level", When::Always, 0, "counted with the masks")
            } else {
                Part::left_out("third level", "fewer than 512 coarse cells")
            },
            Part::new("range scratch", When::Loading, scratch, "extrema of 33^3 blocks"),
        ]
    }

    fn picture_parts(&self) -> [Part; 8] {
        let Self { options, wavefront, .. } = self;
        [
            Part::new("pictures", When::Always, wavefront.output_bytes(), picture_names(wavefront)),
            match options.draw_target {
                Some(_) => {
                    Part::new("draw", When::Always, DrawBuffers::BYTES, "into the caller's targets")
                }
                None => Part::left_out("draw", "no draw target"),
            },
            if options.capture {
                Part::new("capture", When::Always, capture::bytes(wavefront), "pictures read back")
            } else {
                Part::left_out("capture", "not asked for")
            },
            Part::new("rays", When::Rendering, wavefront.ray_bytes(), "states and active lists"),
            match &self.infill {
                Some(plan) => {
                    Part::new("infill", When::Rendering, plan.bytes(), infill_names(plan))
                }
                None if options.infill.is_some() => {
                    Part::left_out("infill", "every block is resident: nothing to fill")
                }
                None => Part::left_out("infill", "not asked for"),
            },
            match wavefront.foveation() {
                Some(_) => {
                    let (bytes, why) = (wavefront.foveation_bytes(), "sampling mask, blue noise");
                    Part::new("foveation", When::Rendering, bytes, why)
                }
                None => Part::left_out("foveation", "not asked for"),
            },
            match options.budget {
                Some(_) => {
                    let bytes = Budget::bytes(self.macrocell.grid());
                    Part::new("frame budget", When::Rendering, bytes, "ranges read back once")
                }
                None => Part::left_out("frame budget", "not asked for"),
            },
            if self.previews.is_empty() {
                Part::left_out("previews", "no frames held to a time that may begin with them")
            } else {
                // Bound for the picture and for the next finer preview, if there is one.
                let binds = 2 * self.previews.len() as u64 - 1;
                let bytes: u64 = self.previews.iter().map(PreviewPlan::bytes).sum();
                let bytes = bytes + binds * PreviewBinds::BYTES;
                let why = "first passes of every second or fourth pixel in both directions";
                Part::new("previews", When::Rendering, bytes, why)
            },
        ]
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

impl Part {
    pub(crate) fn new(name: &'static str, when: When, bytes: u64, why: impl Into<String>) -> Self {
        Self { name, when, bytes, why: why.into(), included: true }
    }

    pub(crate) fn left_out(name: &'static str, why: &'static str) -> Self {
        Self { name, when: When::Rendering, bytes: 0, why: why.into(), included: false }
    }
}

impl fmt::Display for When {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Always => "always",
            Self::Loading => "loading",
            Self::Rendering => "rendering",
        })
    }
}

/// Bytes of the parts that are there at a time: those of `when` and what is always there.
fn bytes(parts: &[Part], when: When) -> u64 {
    let there = |part: &&Part| part.when == when || part.when == When::Always;
    parts.iter().filter(there).map(|part| part.bytes).sum()
}

fn picture_names(wavefront: &WavefrontPlan) -> String {
    let outputs = wavefront.outputs();
    let mut names = vec!["colour"];
    names.extend(outputs.depth.then_some("depth"));
    names.extend(outputs.normal.then_some("normal"));
    names.extend(outputs.status.then_some("status"));
    names.join(", ")
}

fn infill_names(plan: &InfillPlan) -> String {
    let sources = plan.sources();
    let mut names = Vec::new();
    names.extend(sources.neighbours.then_some("neighbours"));
    names.extend(sources.coarse_field.then_some("coarse field"));
    names.extend(sources.history.then_some("history"));
    names.extend(plan.network().then_some("network"));
    names.join(", ")
}

fn cache_part(cache: &CachePlan, blocks: u64) -> Part {
    let share = 100.0 * cache.slots() as f64 / blocks as f64;
    let why = format!("{} slots for {blocks} blocks ({share:.1} %)", cache.slots());
    Part::new("cache", When::Rendering, cache.bytes(), why)
}
