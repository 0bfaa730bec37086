//! What comes back from the GPU after every pass, and the report made from it.

use bytemuck::{Pod, Zeroable};
use gpu_primitives::memory::Ledger;
use gpu_primitives::readback::{Lost, ReadbackRing};
use wavefront::Statistics;
use web_time::Instant;

use crate::budget::{Budget, Choice, Setting};
use crate::schedule::Schedule;
use crate::timing::Timer;
use crate::{BudgetMode, PassReport, Residency, ScenePlan, wgpu};

/// Passes that may be in flight.
pub(crate) const PASSES_IN_FLIGHT: usize = 2;

/// What is read back after a pass.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
struct PassRecord {
    /// GPU clock ticks at the pass's begin and end, two words each; 0 without timestamps.
    ticks: [u32; 4],
    /// What follows is there after loading only.
    rays: wavefront::Counters,
    /// What follows is there with a cache only.
    cache: lru_cache_gpu::Counters,
    /// The cache's counters when the frame started.
    cache_before: lru_cache_gpu::Counters,
    statistics: Statistics,
}

/// Bytes of the number of filled pixels.
const FILLED_BYTES: u64 = size_of::<u32>() as u64;

/// Bytes that are read back after a pass: a [`PassRecord`] and, with in-fill, the number of filled pixels.
pub(crate) fn readback_bytes(infill: bool) -> u64 {
    let filled = if infill { FILLED_BYTES } else { 0 };
    size_of::<PassRecord>() as u64 + filled + PROFILE_BYTES
}

/// Bytes of the timestamps that are read back with a pass, and of the buffer that they come from.
#[cfg(feature = "wgpu-profiler")]
const PROFILE_BYTES: u64 = gpu_primitives::profile::Profiler::BYTES;
#[cfg(not(feature = "wgpu-profiler"))]
const PROFILE_BYTES: u64 = 0;

/// Bytes of the resolved timestamps and, with a cache, of the counters since the frame's start.
pub(crate) const CONTROL_BYTES: u64 =
    lru_cache_gpu::Counters::BYTES.1 + Timer::BYTES + PROFILE_BYTES;

/// What the host knows of a pass when it is recorded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PassInfo {
    pub(crate) frame: u64,
    /// Number within the frame; 0 for a pass that loads.
    pub(crate) pass: u32,
    /// Rounds recorded for the frame up to the pass, which may go on after the frame is complete.
    pub(crate) rounds: u32,
    /// Lists of active rays made before the first round of each pass.
    pub(crate) lists_at_start: u32,
    pub(crate) pixels: u32,
    /// Rays that the pass has, of every `step`-th pixel in both directions.
    pub(crate) rays: u32,
    pub(crate) step: u32,
    /// Whether unfinished pixels show what a preview had.
    pub(crate) is_resumed: bool,
    /// Whether in-fill works at a lower resolution, so that it does not count pixels.
    pub(crate) is_reduced: bool,
    /// Whether only the rays of a sampling mask are cast.
    pub(crate) foveated: bool,
    /// What its setting was chosen by.
    pub(crate) choice: Option<Choice>,
    pub(crate) look_ahead: u32,
    /// Cells that its walks may visit each, and the time that the pass should take.
    pub(crate) most_cells: u32,
    pub(crate) pass_ms: f32,
    /// Share of the rays that enter the volume that is enough.
    pub(crate) stop_at: Option<f32>,
    pub(crate) dispatches: u32,
    /// Length of the volume's diagonal.
    pub(crate) diagonal_voxels: f32,
    /// When recording began.
    pub(crate) begin: Instant,
    pub(crate) cpu_ms: f64,
}

impl PassInfo {
    /// Whether the frame is as complete as it has to be to be filled, as `gate.wgsl` of in-fill decides it.
    fn is_enough(&self, rays: &wavefront::Counters) -> bool {
        let finished = (rays.entered - rays.active.min(rays.entered)) as f32;
        finished >= self.stop_at.unwrap_or(0.0) * rays.entered as f32
    }
}

/// What a pass's rays have done, as a report tells it.
#[derive(Debug, Clone, Copy)]
struct RayCounts {
    sampled: u32,
    entered: u32,
    active: u32,
    /// Pixels that are final.
    exact: u32,
    filled: u32,
    open_depth_voxels: f32,
}

impl RayCounts {
    fn new(info: &PassInfo, rays: &wavefront::Counters, filled: u32) -> Self {
        let sampled = if info.foveated { rays.sampled } else { info.rays };
        let exact = info.rays - rays.active.min(info.rays);
        let shows_all = info.is_resumed || (info.is_reduced && info.is_enough(rays));
        let filled = if shows_all { rays.active } else { filled };
        if info.step <= 1 {
            return Self {
                sampled,
                entered: rays.entered,
                active: rays.active,
                exact,
                filled,
                open_depth_voxels: rays.open_depth_voxels(),
            };
        }
        // Each stands for as many as the picture has for one of the preview's; of what the others meet, nothing is known.
        let entered = rays.entered.saturating_mul(info.step * info.step).min(info.pixels);
        let finished = rays.entered - rays.active.min(rays.entered);
        let active = entered.saturating_sub(finished).max(1);
        let filled = active - rays.active.saturating_sub(filled).min(active);
        let open_depth_voxels = info.diagonal_voxels;
        Self { sampled, entered, active, exact, filled, open_depth_voxels }
    }
}

/// A pass whose counters have not come back yet.
#[derive(Debug, Clone, Copy)]
struct Submitted {
    tag: u64,
    info: PassInfo,
    /// Bytes of the pass's [`PassRecord`] in what is read back.
    record_bytes: usize,
    /// Bytes of the number of filled pixels behind it; 0 where there is none.
    filled_bytes: usize,
}

/// The passes in flight and the newest report.
#[derive(Debug)]
pub(crate) struct PassRecords {
    readback: ReadbackRing,
    timer: Timer,
    #[cfg(feature = "wgpu-profiler")]
    profile: crate::timing::Profile,
    submitted: Vec<Submitted>,
    pub(crate) schedule: Schedule,
    pub(crate) budget: Option<Budget>,
    last_report_at: Instant,
    pub(crate) report: PassReport,
    lost: Option<Lost>,
    /// The newest frame when an encoder was found to be dropped: what was recorded after it, up to that
    /// frame, stands on a pass that did not run.
    broken_frame: u64,
}

impl PassRecords {
    pub(crate) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        ledger: &Ledger,
        infill: bool,
    ) -> Self {
        let (label, bytes) = ("progressive-iso.readback", readback_bytes(infill));
        Self {
            readback: ReadbackRing::new(ledger, label, bytes, PASSES_IN_FLIGHT),
            timer: Timer::new(device, queue, ledger),
            #[cfg(feature = "wgpu-profiler")]
            profile: crate::timing::Profile::new(device, queue, ledger),
            submitted: Vec::new(),
            schedule: Schedule::default(),
            budget: None,
            last_report_at: Instant::now(),
            report: PassReport::default(),
            lost: None,
            broken_frame: 0,
        }
    }

    /// Reads back what in-fill has to tell, too, or no longer.
    pub(crate) fn set_infill(&mut self, infill: bool) {
        self.readback.set_bytes(readback_bytes(infill));
    }

    /// Holds frames to a time, or no longer; what was learned stays while the mode and the kind of residency do.
    pub(crate) fn set_budget(
        &mut self,
        mode: Option<BudgetMode>,
        ledger: &Ledger,
        plan: &ScenePlan,
    ) {
        let cached = plan.residency() == Residency::Cached;
        let kind = mode.map(|mode| (mode, cached));
        if self.budget.as_ref().map(Budget::kind) != kind {
            let grid = plan.macrocell.grid();
            self.budget = mode.map(|mode| Budget::new(mode, ledger, grid, cached));
        }
    }

    /// What became of a pass that cannot be made up for, if there was one.
    pub(crate) fn lost(&self) -> Option<Lost> {
        self.lost
    }

    /// Whether the newest frame must start again, because an encoder was dropped.
    pub(crate) fn is_broken(&self) -> bool {
        self.broken_frame > 0 && self.broken_frame == self.report.newest_frame
    }

    /// Whether another pass may be recorded.
    pub(crate) fn has_room(&self) -> bool {
        self.readback.has_room()
    }

    /// Whether the GPU has finished every pass that was recorded.
    pub(crate) fn is_idle(&self) -> bool {
        self.readback.in_flight() == 0
    }

    /// Records the begin of a pass.
    pub(crate) fn record_begin(&self, encoder: &mut wgpu::CommandEncoder) {
        self.timer.record_begin(encoder);
        #[cfg(feature = "wgpu-profiler")]
        self.profile.begin();
    }

    /// Records the end of a pass, up to its read-back.
    pub(crate) fn record_end(&mut self, encoder: &mut wgpu::CommandEncoder) {
        #[cfg(feature = "wgpu-profiler")]
        self.profile.end(encoder);
        self.timer.record_end(encoder);
    }

    /// Records reading a pass's counters back: parts (buffer, byte offset, bytes) in the order of a
    /// [`PassRecord`]'s fields; then, if pixels were filled, their number.
    pub(crate) fn record_readback(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        counters: &[(&wgpu::Buffer, u64, u64)],
        filled: Option<(&wgpu::Buffer, u64, u64)>,
        info: PassInfo,
    ) {
        let mut parts = vec![self.timer.part()];
        parts.extend(counters);
        let record_bytes = parts.iter().map(|part| part.2 as usize).sum();
        let filled_bytes = filled.map_or(0, |part| part.2 as usize);
        parts.extend(filled);
        let tag = self.submitted.last().map_or(1, |s| s.tag + 1);
        #[cfg(feature = "wgpu-profiler")]
        parts.extend(self.profile.part());
        if self.readback.record(device, encoder, &parts, tag) {
            self.submitted.push(Submitted { tag, info, record_bytes, filled_bytes });
        }
    }

    /// Takes in what the GPU has finished.
    pub(crate) fn collect(&mut self) {
        if let Some(budget) = &mut self.budget {
            budget.collect();
        }
        while let Some((tag, bytes)) = self.readback.take() {
            let Some(position) = self.submitted.iter().position(|s| s.tag == tag) else {
                continue;
            };
            let submitted = self.submitted[position];
            // Tags count on from the last one, so that one always stays.
            self.submitted.drain(..position);
            match bytes {
                Ok(bytes) => self.take_bytes(&submitted, &bytes),
                Err(Lost::Dropped) if submitted.info.pass > 0 => self.take_dropped(),
                Err(lost) => self.lost = self.lost.or(Some(lost)),
            }
        }
    }

    fn take_bytes(&mut self, submitted: &Submitted, bytes: &[u8]) {
        let mut record = PassRecord::zeroed();
        let length = submitted.record_bytes.min(bytes.len()).min(size_of::<PassRecord>());
        bytemuck::bytes_of_mut(&mut record)[..length].copy_from_slice(&bytes[..length]);
        let (filled, _profile) = bytes[length..].split_at(submitted.filled_bytes);
        #[cfg(feature = "wgpu-profiler")]
        self.profile.take(_profile);
        let filled = filled.try_into().map_or(0, u32::from_le_bytes);
        let info = submitted.info;
        if info.pass > 0 && record.rays.lists == 0 {
            // The start of a frame lists its rays: no shader has run.
            self.lost = self.lost.or(Some(Lost::NotRun));
        } else if info.pass > 0 && info.frame > self.broken_frame {
            self.take(info, &record, filled);
        }
    }

    /// After the frame is complete, a pass changes nothing.
    fn take_dropped(&mut self) {
        #[cfg(feature = "wgpu-profiler")]
        self.profile.drop_oldest();
        if !self.report.complete() {
            self.broken_frame = self.report.newest_frame;
        }
    }

    /// Tells the schedule what a pass took that brought the frame to `rounds` rounds: by the GPU's clock
    /// or, without one, from its recording or the report before on.
    fn take_time(&mut self, info: PassInfo, rounds: u32, cut: u32, gpu_ms: Option<f64>) {
        let now = Instant::now();
        let elapsed = now.duration_since(info.begin.max(self.last_report_at));
        self.last_report_at = now;
        let ms = gpu_ms.unwrap_or(1e3 * elapsed.as_secs_f64());
        if let (Some(budget), Some(choice), 1) = (&mut self.budget, &info.choice, info.pass) {
            budget.learn(choice, ms);
        }
        let same_frame = self.report.frame == info.frame;
        let rounds_before = if same_frame { self.report.rounds } else { 0 };
        let cut_before = if same_frame { self.report.cut_walks } else { 0 };
        let rounds = rounds.saturating_sub(rounds_before);
        let setting = info.choice.filter(|_| info.pass == 1).map_or(Setting::ALL, |c| c.setting);
        self.schedule.take(setting, info.pass == 1, rounds, ms);
        let in_force = info.most_cells == self.schedule.most_cells();
        if rounds > 0 && cut != cut_before && in_force {
            self.schedule.calibrate(ms / f64::from(rounds), info.pass_ms);
        }
    }

    fn take(&mut self, info: PassInfo, record: &PassRecord, filled: u32) {
        let gpu_ms = self.timer.milliseconds(record.ticks);
        let rounds = record.rays.lists.saturating_sub(info.lists_at_start);
        self.take_time(info, rounds, record.rays.cut, gpu_ms);
        let counts = RayCounts::new(&info, &record.rays, filled);
        let since = |now: u32, before: u32| now.wrapping_sub(before);
        let report = &mut self.report;
        report.frame = info.frame;
        report.pass = info.pass;
        report.rounds = rounds.min(info.rounds);
        report.dispatches = info.dispatches;
        report.cpu_ms = info.cpu_ms;
        report.gpu_ms = gpu_ms;
        report.look_ahead = info.look_ahead;
        report.step = info.step;
        report.density = info.choice.map_or(1.0, |choice| choice.setting.share as f32);
        report.predicted_ms = info.choice.and_then(|choice| choice.predicted_ms);
        report.budget_ms = info.choice.map_or(0.0, |choice| choice.cpu_ms);
        report.rays = info.pixels;
        report.sampled_rays = counts.sampled;
        report.entered_rays = counts.entered;
        report.active_rays = counts.active;
        report.exact = counts.exact;
        report.most_cells = record.rays.most_cells;
        report.cells_bound = info.most_cells;
        report.cut_walks = record.rays.cut;
        report.hits = record.rays.hits;
        report.open_depth_voxels = counts.open_depth_voxels;
        report.filled_pixels = counts.filled;
        report.stopped = info.stop_at.is_some() && info.is_enough(&record.rays);
        report.blocks_used = since(record.cache.used, record.cache_before.used);
        report.blocks_requested = since(record.cache.requested, record.cache_before.requested);
        report.blocks_decoded = since(record.cache.decoded, record.cache_before.decoded);
        report.blocks_evicted = since(record.cache.evicted, record.cache_before.evicted);
        report.speculation = record.statistics.speculation;
        report.ray_block_pairs = record.statistics.pairs;
        report.visible_blocks = record.statistics.visible_blocks;
    }

    /// GPU times of the stages in the newest pass that came back.
    #[cfg(feature = "wgpu-profiler")]
    pub(crate) fn stage_times(&self) -> &[gpu_primitives::profile::StageTime] {
        self.profile.newest()
    }
}
