//! The renderer: schedule, state and reports.

use bytemuck::{Pod, Zeroable};
use gpu_primitives::kernel::dispatches_recorded;
use gpu_primitives::memory::{Category, Ledger};
use gpu_primitives::readback::ReadbackRing;
use gpu_primitives::upload::UploadRing;
use macrocell::{Masks, RangeBuffers};
use wavefront::{FrameView, LookAhead, OutputTextures, ShadingParams, Statistics};
use web_time::Instant;
use zfp_gpu::Payload;

use crate::capture::PendingCapture;
use crate::load::Loader;
use crate::plan::{PARAMS_CHUNK, PASSES_IN_FLIGHT};
use crate::samples::SampleBuffers;
use crate::schedule::Schedule;
use crate::stages::{Picture, Stages};
use crate::timing::Timer;
use crate::{
    CompressedVolume, Error, Frame, PassReport, RendererOptions, Residency, ScenePlan, wgpu,
};

/// Largest size of an isovalue or a sample.
const LARGEST_VALUE: f32 = 2.126_764_8e37; // 2^124

/// Rounds that count as missed when a frame starts with the last one's blocks in the cache: few are missing
/// then, and those few are worth finding in two rounds.
const WARM_MISSES: u32 = 3;

/// What is read back after a pass.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
struct PassRecord {
    rays: wavefront::Counters,
    /// GPU clock ticks at the pass's begin and end, two words each; 0 without timestamps.
    ticks: [u32; 4],
    /// What follows is there with a cache only.
    cache: lru_cache_gpu::Counters,
    /// The cache's counters when the frame started.
    cache_before: lru_cache_gpu::Counters,
    statistics: Statistics,
}

/// Bytes of a [`PassRecord`].
pub(crate) const READBACK_BYTES: u64 = size_of::<PassRecord>() as u64 + PROFILE_BYTES;

/// Bytes of the timestamps that are read back with a pass, and of the buffer that they come from.
#[cfg(feature = "wgpu-profiler")]
const PROFILE_BYTES: u64 = gpu_primitives::profile::Profiler::BYTES;
#[cfg(not(feature = "wgpu-profiler"))]
const PROFILE_BYTES: u64 = 0;

/// Bytes of the resolved timestamps and, with a cache, of the counters since the frame's start.
pub(crate) const CONTROL_BYTES: u64 =
    lru_cache_gpu::Counters::BYTES.1 + Timer::BYTES + PROFILE_BYTES;

/// Renders one volume's isosurfaces progressively.
///
/// The caller owns device and queue and decides when to submit. Nothing here blocks: counts come
/// back some calls late. Dropping it frees all its memory.
#[derive(Debug)]
pub struct ProgressiveIsoRenderer {
    volume: CompressedVolume,
    options: RendererOptions,
    plan: ScenePlan,
    limits: wgpu::Limits,
    ledger: Ledger,
    stages: Stages,
    upload: UploadRing,
    readback: ReadbackRing,
    timer: Timer,
    #[cfg(feature = "wgpu-profiler")]
    profile: crate::timing::Profile,
    payload: Payload,
    ranges: RangeBuffers,
    masks: Masks,
    loader: Option<Loader>,
    samples: SampleBuffers,
    picture: Picture,
    frame: Option<FrameState>,
    frame_count: u64,
    active_isovalue: Option<f32>,
    clear_cache: bool,
    submitted: Vec<Submitted>,
    schedule: Schedule,
    last_report_at: Instant,
    report: PassReport,
}

#[derive(Debug)]
struct FrameState {
    frame: Frame,
    view: FrameView,
    number: u64,
    started: bool,
    passes: u32,
    rounds: u32,
}

/// A pass whose counters have not come back yet.
#[derive(Debug, Clone, Copy)]
struct Submitted {
    tag: u64,
    frame: u64,
    pass: u32,
    rounds: u32,
    dispatches: u32,
    begin: Instant,
    cpu_ms: f64,
    /// Bytes of the pass's [`PassRecord`] in what is read back.
    record_bytes: usize,
}

impl ProgressiveIsoRenderer {
    /// Plans the scene, makes its pipelines and allocates its memory. The volume's stream is
    /// uploaded piece by piece during the first passes; `queue` is asked for the period of its
    /// timestamps only.
    ///
    /// Needs nothing beyond WebGPU's default limits; uses timestamp queries where the device has
    /// them.
    ///
    /// # Errors
    /// As [`ScenePlan::new`].
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        volume: CompressedVolume,
        options: RendererOptions,
    ) -> Result<Self, Error> {
        let _span = tracing::info_span!("progressive_iso.new").entered();
        let limits = device.limits();
        let plan = ScenePlan::new(&volume, &options, &limits)?;
        let ledger = Ledger::new();
        let stages = Stages::new(device, &plan, &options)?;
        let payload = Payload::new(device, &ledger, &plan.payload);
        let ranges = RangeBuffers::new(device, &ledger, &plan.macrocell);
        let masks = Masks::new(device, &ledger, &stages.activate, &ranges);
        let samples =
            SampleBuffers::new(device, &ledger, &stages.samples, &plan.samples, &payload)?;
        let kept = samples.kept();
        let loader = Loader::new(device, &ledger, plan.load, &payload, &ranges, kept)?;
        let picture = Picture::new(device, &ledger, &stages, &plan, &masks, &samples)?;
        let (upload, readback) = (
            UploadRing::new(&ledger, "progressive-iso.upload", PARAMS_CHUNK),
            ReadbackRing::new(
                &ledger,
                "progressive-iso.readback",
                READBACK_BYTES,
                PASSES_IN_FLIGHT,
            ),
        );
        let timer = Timer::new(device, queue, &ledger);
        #[cfg(feature = "wgpu-profiler")]
        let profile = crate::timing::Profile::new(device, queue, &ledger);
        Ok(Self {
            volume,
            options,
            plan,
            limits,
            ledger,
            stages,
            upload,
            readback,
            timer,
            #[cfg(feature = "wgpu-profiler")]
            profile,
            payload,
            ranges,
            masks,
            loader: Some(loader),
            samples,
            picture,
            frame: None,
            frame_count: 0,
            active_isovalue: None,
            clear_cache: false,
            submitted: Vec::new(),
            schedule: Schedule::default(),
            last_report_at: Instant::now(),
            report: PassReport::default(),
        })
    }

    /// Starts a new frame: the next pass begins with its first rays. Decoded blocks are kept.
    ///
    /// # Errors
    /// If the isovalue or the camera is unusable; the frame before stays.
    pub fn set_frame(&mut self, frame: &Frame) -> Result<(), Error> {
        let [isovalue] = frame.isovalues[..] else {
            return Err(Error::IsovalueCount { found: frame.isovalues.len() });
        };
        if !isovalue.is_finite() || isovalue.abs() > LARGEST_VALUE {
            return Err(Error::Isovalue { found: isovalue });
        }
        let view = self.view(frame)?;
        self.frame_count += 1;
        self.frame = Some(FrameState {
            frame: frame.clone(),
            view,
            number: self.frame_count,
            started: false,
            passes: 0,
            rounds: 0,
        });
        self.report.newest_frame = self.frame_count;
        Ok(())
    }

    fn view(&self, frame: &Frame) -> Result<FrameView, Error> {
        let world = self.volume.world_from_index;
        Ok(FrameView::new(&frame.camera, self.options.size, world, self.volume.dims())?)
    }

    /// Records one pass and submits it. Does not block; see [`PassReport`] for what the numbers
    /// describe. While two passes are in flight, and once the frame is complete, nothing is recorded
    /// and `submitted` is false.
    ///
    /// # Errors
    /// If no frame is set.
    pub fn render_pass(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
    ) -> Result<PassReport, Error> {
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
            label: Some("progressive-iso.pass"),
        });
        let report = self.encode_pass(device, &mut encoder)?;
        if report.submitted {
            #[expect(
                clippy::disallowed_methods,
                reason = "the facade submits on behalf of the caller"
            )]
            queue.submit([encoder.finish()]);
        }
        Ok(report)
    }

    /// Like [`Self::render_pass`], into the caller's encoder, which the caller submits.
    ///
    /// Submit encoders in the order in which they were recorded. After an encoder that is dropped
    /// instead, set the frame again; a volume that was still loading must be made again.
    ///
    /// # Errors
    /// If no frame is set.
    pub fn encode_pass(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<PassReport, Error> {
        self.collect_reports();
        if self.frame.is_none() {
            return Err(Error::NoFrame);
        }
        if self.report.complete() || !self.readback.has_room() {
            return Ok(self.report(false));
        }
        let (begin, dispatches) = (Instant::now(), dispatches_recorded());
        let span = tracing::debug_span!("progressive_iso.pass", frame = self.frame_count);
        let _entered = span.enter();
        self.timer.record_begin(encoder);
        #[cfg(feature = "wgpu-profiler")]
        self.profile.begin();
        if self.record_load(device, encoder)? {
            self.record_frame(device, encoder);
        }
        #[cfg(feature = "wgpu-profiler")]
        self.profile.end(encoder);
        self.timer.record_end(encoder);
        let dispatches = dispatches_recorded().wrapping_sub(dispatches) as u32;
        self.record_counters(device, encoder, begin, dispatches);
        Ok(self.report(true))
    }

    /// Records the next piece of loading; true when the volume is complete.
    fn record_load(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<bool, Error> {
        let Some(loader) = &mut self.loader else {
            return Ok(true);
        };
        let _span = tracing::debug_span!("progressive_iso.load").entered();
        let complete = loader.record(
            device,
            encoder,
            &mut self.upload,
            &self.volume,
            &mut self.payload,
            &self.ranges,
        )?;
        self.report.loaded = loader.share(&self.volume, self.ranges.plan());
        Ok(complete)
    }

    /// Records the rounds of one pass of the current frame.
    fn record_frame(&mut self, device: &wgpu::Device, encoder: &mut wgpu::CommandEncoder) {
        let Some(mut state) = self.frame.take() else {
            return;
        };
        if !state.started {
            self.record_start(device, encoder, &state);
            state.started = true;
        }
        state.passes += 1;
        let options = &state.frame.options;
        for _ in 0..self.schedule.rounds(options.rounds_per_pass, options.pass_ms) {
            state.rounds += 1;
            let _span =
                tracing::debug_span!("progressive_iso.round", round = state.rounds).entered();
            let (stages, samples) = (&self.stages, &self.samples);
            let Picture { rays, rounds, .. } = &self.picture;
            rounds.record_round(encoder, &stages.rays, rays, &mut |encoder| {
                samples.record_service(encoder, &stages.samples);
            });
        }
        self.frame = Some(state);
    }

    fn record_start(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        state: &FrameState,
    ) {
        let _span = tracing::debug_span!("progressive_iso.start").entered();
        let (stages, frame) = (&self.stages, &state.frame);
        let isovalue = frame.isovalues[0];
        let clear = std::mem::take(&mut self.clear_cache);
        let warm = !clear && self.active_isovalue == Some(isovalue);
        self.samples.record_begin_frame(encoder, &stages.samples, clear);
        if self.active_isovalue != Some(isovalue) {
            let (ranges, masks) = (&self.ranges, &self.masks);
            stages.activate.record(device, encoder, &mut self.upload, ranges, masks, isovalue);
            self.active_isovalue = Some(isovalue);
        }
        let grid = self.plan.macrocell.grid();
        let lru = self.plan.samples.params();
        let look_ahead = LookAhead {
            blocks: frame.options.look_ahead,
            first_misses: if warm { WARM_MISSES } else { 0 },
        };
        let params = state.view.params(grid, lru, isovalue, look_ahead);
        let shading = ShadingParams::new(&frame.options.shading, self.volume.world_from_index);
        let Picture { rays, rounds, .. } = &self.picture;
        stages.rays.record_start(device, encoder, &mut self.upload, rays, &params, &shading);
        rounds.record_start(encoder, &stages.rays, rays);
        if let (Some(draw), Some(buffers)) = (&stages.draw, &self.picture.draw) {
            draw.record_params(device, encoder, &mut self.upload, buffers, &state.view);
        }
    }

    /// Records reading the counters back.
    fn record_counters(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        begin: Instant,
        dispatches: u32,
    ) {
        let (ray_offset, ray_bytes) = wavefront::Counters::BYTES;
        let mut parts = vec![(self.picture.rays.rays(), ray_offset, ray_bytes), self.timer.part()];
        if let Some(counters) = self.samples.counters() {
            parts.extend(counters);
            parts.extend(self.picture.rounds.statistics());
        }
        let record_bytes = parts.iter().map(|part| part.2 as usize).sum();
        let tag = self.submitted.last().map_or(1, |s| s.tag + 1);
        #[cfg(feature = "wgpu-profiler")]
        parts.extend(self.profile.part());
        if self.readback.record(device, encoder, &parts, tag) {
            let (frame, pass, rounds) = match &self.frame {
                Some(state) if state.started => (state.number, state.passes, state.rounds),
                _ => (0, 0, 0),
            };
            let cpu_ms = begin.elapsed().as_secs_f64() * 1e3;
            let submitted =
                Submitted { tag, frame, pass, rounds, dispatches, begin, cpu_ms, record_bytes };
            self.submitted.push(submitted);
        }
    }

    /// Takes in what the GPU has finished.
    fn collect_reports(&mut self) {
        while let Some((tag, bytes)) = self.readback.take() {
            let Some(position) = self.submitted.iter().position(|s| s.tag == tag) else {
                continue;
            };
            let submitted = self.submitted[position];
            // Tags count on from the last one, so that one always stays.
            self.submitted.drain(..position);
            let mut record = PassRecord::zeroed();
            let length = submitted.record_bytes.min(bytes.len()).min(size_of::<PassRecord>());
            bytemuck::bytes_of_mut(&mut record)[..length].copy_from_slice(&bytes[..length]);
            #[cfg(feature = "wgpu-profiler")]
            self.profile.take(&bytes[length..]);
            self.take_record(submitted, &record);
        }
    }

    fn take_record(&mut self, submitted: Submitted, record: &PassRecord) {
        if submitted.pass == 0 {
            return;
        }
        self.loader = None;
        self.take_time(submitted, record);
        let since = |now: u32, before: u32| now.wrapping_sub(before);
        let report = &mut self.report;
        report.loaded = 1.0;
        report.frame = submitted.frame;
        report.pass = submitted.pass;
        report.rounds = submitted.rounds;
        report.dispatches = submitted.dispatches;
        report.cpu_ms = submitted.cpu_ms;
        report.gpu_ms = self.timer.milliseconds(record.ticks);
        report.rays = self.options.size[0] * self.options.size[1];
        report.entered_rays = record.rays.entered;
        report.active_rays = record.rays.active;
        report.hits = record.rays.hits;
        report.blocks_used = since(record.cache.used, record.cache_before.used);
        report.blocks_requested = since(record.cache.requested, record.cache_before.requested);
        report.blocks_decoded = since(record.cache.decoded, record.cache_before.decoded);
        report.speculation = record.statistics.speculation;
        report.ray_block_pairs = record.statistics.pairs;
        report.visible_blocks = record.statistics.visible_blocks;
        report.blocks_evicted = since(record.cache.evicted, record.cache_before.evicted);
    }

    /// What a pass took, by the GPU's clock or, without one, from its recording or the report before on.
    fn take_time(&mut self, submitted: Submitted, record: &PassRecord) {
        let now = Instant::now();
        let elapsed = now.duration_since(submitted.begin.max(self.last_report_at));
        self.last_report_at = now;
        let gpu_ms = self.timer.milliseconds(record.ticks);
        let ms = gpu_ms.unwrap_or(1e3 * elapsed.as_secs_f64());
        let same_frame = self.report.frame == submitted.frame;
        let rounds_before = if same_frame { self.report.rounds } else { 0 };
        self.schedule.take(submitted.rounds.saturating_sub(rounds_before), ms);
    }

    fn report(&self, submitted: bool) -> PassReport {
        PassReport {
            submitted,
            bytes: self.ledger.total(),
            peak_bytes: self.ledger.peak(),
            ..self.report
        }
    }

    /// The newest report, after taking in what the GPU has finished. Records nothing.
    pub fn poll_report(&mut self) -> PassReport {
        self.collect_reports();
        self.report(false)
    }

    /// Renders passes until the frame is complete, blocking on the device: for offline use.
    /// `each` sees every report; returning false stops early.
    ///
    /// # Errors
    /// If no frame is set, the device fails, or passes stop making progress.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn render_to_completion(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        mut each: impl FnMut(&Self, &PassReport) -> bool,
    ) -> Result<PassReport, Error> {
        const PATIENCE: u32 = 256;
        let mut idle_passes = 0;
        let mut last = self.report(false);
        loop {
            self.render_pass(device, queue)?;
            wait(device)?;
            let report = self.poll_report();
            let progressed = report.frame != last.frame
                || report.active_rays != last.active_rays
                || report.blocks_decoded != last.blocks_decoded
                || report.pass == 0;
            idle_passes = if progressed { 0 } else { idle_passes + 1 };
            if !each(self, &report) || report.complete() {
                return Ok(report);
            }
            if idle_passes >= PATIENCE {
                let active_rays = report.active_rays;
                return Err(Error::Stalled { passes: idle_passes, active_rays });
            }
            last = report;
        }
    }

    /// Draws the surface pixels known so far into the caller's pass, with depth, so that they and
    /// the caller's meshes occlude each other.
    ///
    /// # Errors
    /// Without [`RendererOptions::draw_target`].
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) -> Result<(), Error> {
        match (&self.stages.draw, &self.picture.draw) {
            (Some(draw), Some(buffers)) => {
                draw.draw(pass, buffers);
                Ok(())
            }
            _ => Err(Error::DrawNotPlanned),
        }
    }

    /// Records reading the pictures back as they are at this point of the encoder, which the caller
    /// submits. One capture at a time is within the budget.
    ///
    /// # Errors
    /// Without [`RendererOptions::capture`].
    pub fn capture(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<PendingCapture, Error> {
        if !self.options.capture {
            return Err(Error::CaptureNotPlanned);
        }
        Ok(PendingCapture::record(device, &self.ledger, encoder, &self.picture.textures))
    }

    /// Reads the pictures back, blocking on the device: for offline use.
    ///
    /// # Errors
    /// Without [`RendererOptions::capture`], or if the device fails.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn capture_blocking(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
    ) -> Result<crate::Capture, Error> {
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
            label: Some("progressive-iso.capture"),
        });
        let mut pending = self.capture(device, &mut encoder)?;
        #[expect(
            clippy::disallowed_methods,
            reason = "the facade submits on behalf of the caller"
        )]
        queue.submit([encoder.finish()]);
        wait(device)?;
        pending.try_take().ok_or_else(|| Error::Device("the pictures could not be mapped".into()))
    }

    /// Forgets all decoded blocks when the next frame starts, as if the volume had just been loaded:
    /// for measuring.
    pub fn clear_cache(&mut self) {
        self.clear_cache = true;
    }

    /// Changes the picture's size. The current frame starts again, with decoded blocks kept where
    /// the budget still holds them all.
    ///
    /// # Errors
    /// If the new size does not fit the limits or the budget; nothing changes then.
    pub fn resize(&mut self, device: &wgpu::Device, size: [u32; 2]) -> Result<(), Error> {
        let options = RendererOptions { size, ..self.options };
        let plan = self.replan(&options)?;
        // The old memory goes before the new one comes, or both together would exceed the budget.
        let smallest = self.plan.shrunk(&self.limits)?;
        self.rebuild_picture(device, &smallest)?;
        if plan.samples != self.plan.samples {
            self.rebuild_samples(device, &smallest, &options)?;
            self.rebuild_samples(device, &plan, &options)?;
        }
        self.options = options;
        self.rebuild_picture(device, &plan)?;
        self.plan = plan;
        if let Some(state) = self.frame.take() {
            self.set_frame(&state.frame)?;
        }
        Ok(())
    }

    /// A plan for other options with the same volume. What is resident stays so while the budget
    /// allows it; what is cached stays cached, because loading is over.
    fn replan(&self, options: &RendererOptions) -> Result<ScenePlan, Error> {
        let plan = |residency| {
            let options = RendererOptions { residency, ..*options };
            ScenePlan::new(&self.volume, &options, &self.limits)
        };
        match (self.plan.residency(), options.residency) {
            (Residency::Full, Residency::Auto) => {
                plan(Residency::Full).or_else(|_| plan(Residency::Cached))
            }
            (residency, _) => plan(residency),
        }
    }

    fn rebuild_picture(&mut self, device: &wgpu::Device, plan: &ScenePlan) -> Result<(), Error> {
        let (ledger, stages) = (&self.ledger, &self.stages);
        self.picture = Picture::new(device, ledger, stages, plan, &self.masks, &self.samples)?;
        Ok(())
    }

    fn rebuild_samples(
        &mut self,
        device: &wgpu::Device,
        plan: &ScenePlan,
        options: &RendererOptions,
    ) -> Result<(), Error> {
        let stages = Stages::new(device, plan, options)?;
        let (ledger, payload) = (&self.ledger, &self.payload);
        let samples = SampleBuffers::new(device, ledger, &stages.samples, &plan.samples, payload)?;
        (self.stages, self.samples) = (stages, samples);
        Ok(())
    }

    /// Colour as known so far: `Rgba8Unorm` with display-referred values.
    pub fn color_view(&self) -> &wgpu::TextureView {
        self.picture.textures.color_view()
    }

    /// The pictures' textures.
    pub fn textures(&self) -> &OutputTextures {
        &self.picture.textures
    }

    /// What the scene consists of.
    pub fn plan(&self) -> &ScenePlan {
        &self.plan
    }

    /// Bytes of GPU memory by purpose, now.
    pub fn bytes_by_category(&self) -> Vec<(Category, u64)> {
        self.ledger.by_category()
    }

    /// GPU times of the stages in the newest pass that was reported; empty where the device has no
    /// timestamp queries.
    #[cfg(feature = "wgpu-profiler")]
    pub fn stage_times(&self) -> &[gpu_primitives::profile::StageTime] {
        self.profile.newest()
    }

    /// The volume.
    pub fn volume(&self) -> &CompressedVolume {
        &self.volume
    }
}

#[cfg(not(target_arch = "wasm32"))]
fn wait(device: &wgpu::Device) -> Result<(), Error> {
    #[expect(clippy::disallowed_methods, reason = "offline use blocks by request")]
    let result = device.poll(wgpu::PollType::wait_indefinitely());
    result.map(|_| ()).map_err(|error| Error::Device(error.to_string()))
}
