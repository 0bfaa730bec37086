//! The renderer: schedule and state.

mod change;
mod frame_passes;
mod frame_state;
#[cfg(test)]
mod slots_tests;

use gpu_primitives::kernel::dispatches_recorded;
use gpu_primitives::memory::{Category, Ledger};
use gpu_primitives::upload::UploadRing;
use wavefront::{FrameView, OutputTextures};
use web_time::Instant;

use frame_state::{FrameState, ShownHits};

use crate::capture::PendingCapture;
use crate::faults::{Faults, Scopes, Task, is_lost};
use crate::load::{LoadStages, Loader};
use crate::plan::PARAMS_CHUNK;
use crate::records::{PassInfo, PassRecords};
use crate::samples::SampleBuffers;
use crate::stages::{Pictures, Rendering, Stages, VolumeBuffers};
use crate::{CompressedVolume, Error, Frame, Infill, PassReport, RendererOptions, ScenePlan, wgpu};

/// Largest size of an isovalue or a sample.
const LARGEST_VALUE: f32 = 2.126_764_8e37; // 2^124

/// Rounds that count as missed when a frame starts with the last one's blocks in the cache: few are
/// missing then, and those few are worth finding in two rounds.
const WARM_MISSES: u32 = 3;

/// Renders one volume's isosurfaces progressively.
///
/// The caller owns device and queue and decides when to submit. Nothing here blocks: counts come
/// back some calls late. Dropping it frees all its memory.
///
/// # When the device fails
/// What goes wrong with this library's own work goes through error scopes, not to the caller's handler of
/// uncaptured errors, and comes back as a typed [`Error`] from this or a later call. The renderer then
/// returns that error for ever and never reports a frame as complete that is not. Make another one, on a
/// new device where the old one is lost, with `renderer.volume().clone()`, which shares the stream.
#[derive(Debug)]
pub struct ProgressiveIsoRenderer {
    faults: Faults,
    volume: CompressedVolume,
    options: RendererOptions,
    plan: ScenePlan,
    limits: wgpu::Limits,
    ledger: Ledger,
    stages: Stages,
    upload: UploadRing,
    records: PassRecords,
    buffers: VolumeBuffers,
    pictures: Pictures,
    phase: Phase,
    frame: Option<FrameState>,
    frame_count: u64,
    active_isovalue: Option<f32>,
    shown: ShownHits,
    clear_cache: bool,
}

/// What has its memory beside that of the volume and the pictures.
#[derive(Debug)]
enum Phase {
    /// The volume is on its way to the GPU.
    Loading(Box<Loader>),
    /// It is there. The next pass makes what rays need, except for samples that are there already.
    Loaded(Option<SampleBuffers>),
    /// Rays are at work.
    Rendering(Box<Rendering>),
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
    /// As [`ScenePlan::new`], or if the device refuses a shader or has too little memory.
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
        let mut faults = Faults::default();
        let (stages, load_stages) = faults.guard(device, Task::Pipelines, || {
            Ok((Stages::new(device, &plan, &options)?, LoadStages::new(device, &plan)?))
        })?;
        let infill = plan.infill.is_some();
        let upload = UploadRing::new(&ledger, "progressive-iso.upload", PARAMS_CHUNK);
        let (buffers, pictures, loader, mut records) = faults.guard(device, Task::Other, || {
            let buffers = VolumeBuffers::new(device, &ledger, &stages, &plan);
            let pictures = Pictures::new(device, &ledger, &stages, &plan);
            let loader = Loader::new(device, &ledger, &plan, &buffers, load_stages)?;
            Ok((buffers, pictures, loader, PassRecords::new(device, queue, &ledger, infill)))
        })?;
        records.set_budget(options.budget, &ledger, &plan);
        Ok(Self {
            faults,
            volume,
            options,
            plan,
            limits,
            ledger,
            stages,
            upload,
            records,
            buffers,
            pictures,
            phase: Phase::Loading(Box::new(loader)),
            frame: None,
            frame_count: 0,
            active_isovalue: None,
            shown: ShownHits::default(),
            clear_cache: false,
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
        self.options.check_frame(&frame.options)?;
        let view = self.view(frame)?;
        self.frame_count += 1;
        self.frame = Some(FrameState {
            frame: frame.clone(),
            view,
            number: self.frame_count,
            cleared: false,
            started: false,
            clears_cache: false,
            most_cells: 0,
            first_misses: 0,
            passes: 0,
            rounds: 0,
            sampling: None,
            choice: None,
            step: 1,
            resumed_step: 1,
            lists: 0,
        });
        self.records.report.newest_frame = self.frame_count;
        Ok(())
    }

    fn view(&self, frame: &Frame) -> Result<FrameView, Error> {
        let world = self.volume.world_from_index;
        Ok(FrameView::new(&frame.camera, self.options.size, world, self.volume.dims())?)
    }

    /// Records one pass and submits it. Does not block; see [`PassReport`] for what the numbers
    /// describe. While two passes are in flight, until the GPU has finished the last pass that loads
    /// the volume, and once the frame is complete, nothing is recorded and `submitted` is false.
    ///
    /// # Errors
    /// If no frame is set, or what went wrong with the device.
    pub fn render_pass(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
    ) -> Result<PassReport, Error> {
        let scopes = Scopes::open(device, Task::Other);
        let report = self.submit_pass(device, queue);
        self.faults.close(scopes)?;
        report
    }

    fn submit_pass(
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
    /// Submit encoders in the order in which they were recorded, and none after an error. When one is
    /// dropped instead, the current frame starts again, under a new number, unless it is complete; while
    /// the volume is loading, that is an error.
    ///
    /// # Errors
    /// If no frame is set, or what went wrong with the device. Errors of the caller's `finish` and
    /// `submit` go to the caller; a pass that did not run because of them is an error of a later call.
    pub fn encode_pass(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<PassReport, Error> {
        self.check(device)?;
        if self.frame.is_none() {
            return Err(Error::NoFrame);
        }
        let scopes = Scopes::open(device, Task::Other);
        let report = self.record_pass(device, encoder);
        self.faults.close(scopes)?;
        report
    }

    /// Takes in what the GPU has finished.
    fn collect(&mut self) {
        // What a browser has not judged yet may be wrong.
        if self.faults.check().is_ok() && self.faults.all_known() {
            self.records.collect();
        }
        if self.records.is_broken() {
            self.start_again();
        }
    }

    /// [`Self::collect`], and what went wrong by then.
    pub(crate) fn check(&mut self, device: &wgpu::Device) -> Result<(), Error> {
        self.collect();
        self.faults.check()?;
        // A device that is lost says so in no other way than by what it does not do.
        if is_lost(device) {
            return self.faults.keep(Error::DeviceLost);
        }
        self.records.lost().map_or(Ok(()), |lost| self.faults.keep(lost.into()))
    }

    /// Starts the current frame again as if nothing had been recorded for it.
    fn start_again(&mut self) {
        self.active_isovalue = None;
        self.shown.clear();
        if let Some(state) = &mut self.frame {
            self.clear_cache |= state.clears_cache;
            self.frame_count += 1;
            state.number = self.frame_count;
            state.started = false;
            state.clears_cache = false;
            state.passes = 0;
            state.rounds = 0;
            (state.step, state.resumed_step, state.lists) = (1, 1, 0);
            self.records.report.newest_frame = self.frame_count;
        }
    }

    fn record_pass(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<PassReport, Error> {
        if self.records.report.complete() || !self.records.has_room() || !self.advance(device)? {
            return Ok(self.report(false));
        }
        let (begin, dispatches) = (Instant::now(), dispatches_recorded());
        let span = tracing::debug_span!("progressive_iso.pass", frame = self.frame_count);
        let _entered = span.enter();
        self.records.record_begin(encoder);
        self.record_load(device, encoder)?;
        self.record_frame(device, encoder);
        if let (Phase::Rendering(_), Some(budget)) = (&self.phase, &mut self.records.budget) {
            budget.record_ranges(device, encoder, &self.buffers.ranges);
        }
        self.records.record_end(encoder);
        let dispatches = dispatches_recorded().wrapping_sub(dispatches) as u32;
        self.record_readback(device, encoder, begin, dispatches);
        Ok(self.report(true))
    }

    /// Goes on to the next phase when it is time; true when there is something to record.
    ///
    /// What rays need is made only when the GPU has done with what loading needed, so that both
    /// never take memory at a time.
    fn advance(&mut self, device: &wgpu::Device) -> Result<bool, Error> {
        if let Phase::Loading(loader) = &self.phase {
            if !loader.is_recorded(&self.buffers) {
                return loader.can_go_on(&self.volume);
            }
            if !(self.records.is_idle() && loader.is_idle()) {
                return Ok(false);
            }
            if let Phase::Loading(loader) = std::mem::replace(&mut self.phase, Phase::Loaded(None))
            {
                self.phase = Phase::Loaded(loader.into_samples());
            }
        }
        if let Phase::Loaded(samples) = &mut self.phase {
            let samples = samples.take();
            let rendering = Rendering::new(
                device,
                &self.ledger,
                &self.stages,
                &self.plan,
                &self.buffers,
                &self.pictures.textures,
                samples,
            )?;
            self.phase = Phase::Rendering(Box::new(rendering));
            self.records.report.loaded = 1.0;
        }
        Ok(true)
    }

    /// Records the next piece of loading, if there is one.
    fn record_load(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<(), Error> {
        let (Phase::Loading(loader), Some(state)) = (&mut self.phase, &mut self.frame) else {
            return Ok(());
        };
        let _span = tracing::debug_span!("progressive_iso.load").entered();
        if !std::mem::replace(&mut state.cleared, true) {
            let unfinished = state.frame.options.shading.unfinished;
            self.pictures.textures.record_unfinished(encoder, unfinished);
        }
        loader.record(device, encoder, &mut self.upload, &self.volume, &mut self.buffers)?;
        self.records.report.loaded = loader.share(&self.buffers);
        Ok(())
    }

    /// Records reading the pass's counters back.
    fn record_readback(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        begin: Instant,
        dispatches: u32,
    ) {
        let state = self.frame.as_ref().filter(|state| state.started);
        let step = state.map_or(1, |state| state.step);
        let (counters, filled, lists_at_start, rays) = match &self.phase {
            Phase::Rendering(rendering) => {
                let casting = rendering.casting(step);
                let rays = casting.rays().plan().rays() as u32;
                let counters = rendering.counters(casting);
                (counters, casting.filled(), casting.lists_at_start(), rays)
            }
            _ => (Vec::new(), None, 0, 0),
        };
        let (frame, pass, rounds) = state.map_or((0, 0, 0), |s| (s.number, s.passes, s.rounds));
        let most_cells = state.map_or(0, |state| state.most_cells);
        let pass_ms = state.map_or(0.0, |state| state.frame.options.pass_ms);
        let stop_at = state.and_then(|state| state.frame.options.stop_at).map(|stop| stop.0);
        let fills = state.is_some_and(|state| state.frame.options.infill != Infill::Off);
        let lists_at_start =
            lists_at_start + state.map_or(0, |state| state.lists.saturating_sub(1));
        let foveated = state.is_some_and(|state| state.sampling.is_some());
        let choice = state.and_then(|state| state.choice);
        let look_ahead = state.map_or(0, |state| state.look_ahead().blocks);
        let is_reduced = fills && step == 1 && self.plan.infill_step() > 1;
        let [width, height] = self.options.size;
        let cpu_ms = begin.elapsed().as_secs_f64() * 1e3;
        let pixels = width * height;
        let cells = self.plan.macrocell.grid().last_cell().map(|cell| (cell + 1) as f32);
        let diagonal_voxels = cells.iter().map(|n| n * n).sum::<f32>().sqrt();
        let info = PassInfo {
            frame,
            pass,
            rounds,
            lists_at_start,
            pixels,
            rays,
            step,
            is_resumed: state.is_some_and(FrameState::is_resumed),
            is_reduced,
            foveated,
            choice,
            look_ahead,
            most_cells,
            pass_ms,
            stop_at,
            dispatches,
            diagonal_voxels,
            begin,
            cpu_ms,
        };
        let filled = filled.filter(|_| fills);
        self.records.record_readback(device, encoder, &counters, filled, info);
    }

    pub(crate) fn report(&self, submitted: bool) -> PassReport {
        PassReport {
            submitted,
            bytes: self.ledger.total(),
            peak_bytes: self.ledger.peak(),
            ..self.records.report
        }
    }

    /// The newest report, after taking in what the GPU has finished. Records nothing.
    pub fn poll_report(&mut self) -> PassReport {
        self.collect();
        self.report(false)
    }

    /// Draws the surface pixels known so far into the caller's pass, with depth, so that they and
    /// the caller's meshes occlude each other.
    ///
    /// # Errors
    /// Without [`RendererOptions::draw_target`].
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) -> Result<(), Error> {
        match (&self.stages.draw, &self.pictures.draw) {
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
    /// Without [`RendererOptions::capture`], or if the device has too little memory.
    pub fn capture(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<PendingCapture, Error> {
        if !self.options.capture {
            return Err(Error::CaptureNotPlanned);
        }
        Faults::default().guard(device, Task::Other, || {
            Ok(PendingCapture::record(device, &self.ledger, encoder, &self.pictures.textures))
        })
    }

    /// Forgets all decoded blocks when the next frame starts, as if the volume had just been loaded:
    /// for measuring.
    pub fn clear_cache(&mut self) {
        self.clear_cache = true;
    }

    /// Colour as known so far: `Rgba8Unorm` with display-referred values.
    pub fn color_view(&self) -> &wgpu::TextureView {
        self.pictures.textures.color_view()
    }

    /// The pictures' textures.
    pub fn textures(&self) -> &OutputTextures {
        &self.pictures.textures
    }

    /// States of the picture's rays, once the volume is loaded: for measuring. They are the current frame's, except after a first
    /// pass whose [`PassReport::step`] is above 1.
    pub fn rays(&self) -> Option<&wavefront::RayBuffers> {
        match &self.phase {
            Phase::Rendering(rendering) => Some(rendering.casting(1).rays()),
            _ => None,
        }
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
        self.records.stage_times()
    }

    /// The volume.
    pub fn volume(&self) -> &CompressedVolume {
        &self.volume
    }
}
