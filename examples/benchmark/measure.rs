//! Renders the frames and takes the times.

use std::time::Instant;

use progressive_iso::{
    Frame, FrameOptions, ProgressiveIsoRenderer, RendererOptions, ScenePlan, Shading,
};
use serde::Serialize;

use crate::cpu_renderer::{self, difference};
use crate::cpu_volume::Masks;
use crate::cpu_walk::Surface;
use crate::frame::{CpuExtra, FrameRow, Key, Memory, Progress, Times};
use crate::library::{ROUNDS_OF_MOVED, Wanted, residency, with_residency};
use crate::needed::Needed;
use crate::scaling::Ratio;
use crate::scene::{Scene, View};
use crate::sets::{Case, STEP_DEGREES, Setting, run_ahead};
use crate::support::{Failure, Gpu, read_texture};

/// Most bytes of all renderers that live at the same time.
const MOST_BYTES: u64 = 12 << 30;

/// A setting that was not measured, and why.
#[derive(Clone, Debug, Serialize)]
pub struct Skipped {
    pub volume: String,
    pub size: [u32; 2],
    pub setting: String,
    pub reason: String,
}

/// All that was measured.
#[derive(Default)]
pub struct Results {
    pub frames: Vec<FrameRow>,
    pub skipped: Vec<Skipped>,
    /// Only of the set "scaling".
    pub scaling: Vec<Ratio>,
}

/// The options of a setting's renderer.
pub fn options(setting: &Setting, size: [u32; 2], budget_bytes: u64) -> RendererOptions {
    let options =
        RendererOptions { size, budget_bytes, strategy: setting.strategy, ..Default::default() };
    with_residency(options, setting.residency)
}

/// Measures a case with these settings. They take turns at every view, so that all of them see the same
/// machine; where their memory together is too much, in groups.
pub fn case(
    gpu: &Gpu,
    settings: Vec<Setting>,
    case: &Case,
    scene: &mut Scene,
    results: &mut Results,
) -> Result<(), Failure> {
    let mut with_cpu = scene.decoded.is_some();
    for group in groups(gpu, settings, case, scene, results) {
        let mut renderers = Vec::new();
        for setting in group {
            renderers.push(Measured::new(gpu, scene, setting, case.size, case.budget_bytes)?);
        }
        views(gpu, case, scene, &mut renderers, with_cpu, results)?;
        with_cpu = false;
    }
    Ok(())
}

/// The settings that can be measured, in groups whose memory is affordable.
fn groups(
    gpu: &Gpu,
    settings: Vec<Setting>,
    case: &Case,
    scene: &Scene,
    results: &mut Results,
) -> Vec<Vec<Setting>> {
    let (mut groups, mut bytes): (Vec<Vec<Setting>>, u64) = (Vec::new(), u64::MAX);
    for setting in settings {
        let options = options(&setting, case.size, case.budget_bytes);
        match planned_bytes(gpu, scene, &setting, &options) {
            Ok(planned) => {
                bytes = bytes.saturating_add(planned);
                if bytes > MOST_BYTES {
                    groups.push(Vec::new());
                    bytes = planned;
                }
                groups.last_mut().into_iter().for_each(|group| group.push(setting.clone()));
            }
            Err(reason) => {
                println!("  {} is skipped: {reason}", setting.label);
                results.skipped.push(Skipped {
                    volume: case.subject.name(),
                    size: case.size,
                    setting: setting.label,
                    reason,
                });
            }
        }
    }
    groups
}

fn planned_bytes(
    gpu: &Gpu,
    scene: &Scene,
    setting: &Setting,
    options: &RendererOptions,
) -> Result<u64, String> {
    let plan = ScenePlan::new(&scene.volume, options, &gpu.device.limits())
        .map_err(|error| error.to_string())?;
    let found = residency(&plan);
    if found == setting.residency {
        Ok(plan.bytes())
    } else {
        let (wanted, found) = (setting.residency.name(), found.name());
        Err(format!("the plan came to residency {found} instead of {wanted}"))
    }
}

fn views(
    gpu: &Gpu,
    case: &Case,
    scene: &mut Scene,
    renderers: &mut [Measured],
    with_cpu: bool,
    results: &mut Results,
) -> Result<(), Failure> {
    for factor in case.isovalues {
        let isovalue = (f64::from(scene.isovalue) * factor) as f32;
        let begin = Instant::now();
        let masks = scene.decoded.as_ref().map(|volume| volume.masks(isovalue));
        let mask_ms = milliseconds(begin);
        for &position in case.positions {
            let view = View { isovalue, position, size: case.size };
            let needed = match &masks {
                Some(masks) => scene.needed(&view, masks)?,
                None => None,
            };
            for measured in &mut *renderers {
                measured.turn(gpu, scene, &view, case.steps, needed, &mut results.frames)?;
            }
            if let (true, Some(masks), Some(measured)) = (with_cpu, &masks, renderers.first_mut()) {
                let picture = measured.picture(gpu, scene, &view)?;
                results.frames.push(cpu_frame(scene, &view, masks, mask_ms, needed, &picture)?);
            }
        }
    }
    Ok(())
}

fn milliseconds(begin: Instant) -> f64 {
    begin.elapsed().as_secs_f64() * 1e3
}

/// The view drawn by the CPU renderer, compared with the GPU's `picture`.
fn cpu_frame(
    scene: &Scene,
    view: &View,
    masks: &Masks,
    mask_ms: f64,
    needed: Option<Needed>,
    picture: &[u8],
) -> Result<FrameRow, Failure> {
    let volume = scene.decoded.as_ref().ok_or("the volume is not decoded")?;
    let surface = Surface { volume, masks, isovalue: view.isovalue };
    let (frame, shading) = (scene.frame(view, 1, 1), Shading::default());
    let begin = Instant::now();
    let rays = scene.rays(&frame, view.size)?;
    let pixels = cpu_renderer::render(&surface, &rays, &shading);
    let ms = milliseconds(begin);
    let key = Key {
        setting: "CPU renderer, two threads".into(),
        strategy: "cpu",
        residency: Wanted::Full,
        ..Key::new(&scene.subject, view.size, &run_ahead(0), "warm")
    };
    let mut row = FrameRow::new(key, view);
    let (ms_85, ms_90, ms_95, ms_100) = (ms, ms, ms, ms);
    row.times = Times { ms_85, ms_90, ms_95, ms_100, passes_85: 1, passes_100: 1, rounds: 1 };
    row.work.hits = pixels.iter().filter(|pixel| pixel.hit).count() as u32;
    row.set_needed(needed);
    row.memory.peak_bytes = volume.bytes() + masks.bytes() + size_of_val(&pixels[..]) as u64;
    row.memory.overhead_bytes = row.memory.peak_bytes;
    row.memory.loaded_bytes = row.memory.peak_bytes;
    let difference = difference(&pixels, picture, &shading);
    row.cpu = Some(CpuExtra { mask_ms, ms_with_masks: ms + mask_ms, difference });
    Ok(row)
}

/// A renderer whose volume is loaded and whose pipelines have run once.
pub struct Measured {
    renderer: ProgressiveIsoRenderer,
    setting: Setting,
    setup_ms: f64,
}

impl Measured {
    pub fn new(
        gpu: &Gpu,
        scene: &Scene,
        setting: Setting,
        size: [u32; 2],
        budget_bytes: u64,
    ) -> Result<Self, Failure> {
        let begin = Instant::now();
        let options = options(&setting, size, budget_bytes);
        let volume = scene.volume.clone();
        let renderer = ProgressiveIsoRenderer::new(&gpu.device, &gpu.queue, volume, options)?;
        let mut measured = Self { renderer, setting, setup_ms: 0.0 };
        let view = View { isovalue: scene.isovalue, position: [20.0, 15.0], size };
        let frame = scene.frame(&view, measured.setting.look_ahead, 1);
        measured.renderer.set_frame(&frame)?;
        let (device, queue) = (&gpu.device, &gpu.queue);
        measured.renderer.render_to_completion(device, queue, |_, report| report.pass == 0)?;
        measured.setup_ms = milliseconds(begin);
        measured.renderer.render_to_completion(device, queue, |_, _| true)?;
        Ok(measured)
    }

    /// A view cold and warm, and a short orbit from there.
    pub fn turn(
        &mut self,
        gpu: &Gpu,
        scene: &Scene,
        view: &View,
        steps: u32,
        needed: Option<Needed>,
        rows: &mut Vec<FrameRow>,
    ) -> Result<(), Failure> {
        self.renderer.clear_cache();
        for state in ["cold", "warm"] {
            let mut row = self.render(gpu, scene, view, state, 1)?;
            row.set_needed(needed);
            rows.push(row);
        }
        if self.setting.runs_ahead() {
            for step in 1..=steps {
                let azimuth = view.position[0] + f64::from(step) * STEP_DEGREES;
                let view = View { position: [azimuth, view.position[1]], ..*view };
                rows.push(self.render(gpu, scene, &view, "moved", ROUNDS_OF_MOVED)?);
            }
        }
        Ok(())
    }

    fn frame(&self, scene: &Scene, view: &View, rounds: u32) -> Frame {
        scene.frame(view, self.setting.look_ahead, rounds)
    }

    /// The finished picture of a view, four bytes a pixel.
    pub fn picture(&mut self, gpu: &Gpu, scene: &Scene, view: &View) -> Result<Vec<u8>, Failure> {
        let mut frame = self.frame(scene, view, 1);
        frame.options = FrameOptions { shading: Shading::default(), ..frame.options };
        self.renderer.set_frame(&frame)?;
        self.renderer.render_to_completion(&gpu.device, &gpu.queue, |_, _| true)?;
        read_texture(gpu, self.renderer.textures().color())
    }

    fn render(
        &mut self,
        gpu: &Gpu,
        scene: &Scene,
        view: &View,
        state: &'static str,
        rounds: u32,
    ) -> Result<FrameRow, Failure> {
        let frame = self.frame(scene, view, rounds);
        let key = Key::new(&scene.subject, view.size, &self.setting, state);
        let mut row = FrameRow::new(key, view);
        let mut described = 0;
        let begin = Instant::now();
        self.renderer.set_frame(&frame)?;
        let (device, queue) = (&gpu.device, &gpu.queue);
        let last = self.renderer.render_to_completion(device, queue, |_renderer, report| {
            row.progress.push(Progress {
                ms: milliseconds(begin),
                pixels: report.completeness_pixels(),
                active_rays: report.active_rays,
                decoded: report.blocks_decoded,
                used: report.blocks_used,
                requested: report.blocks_requested,
                speculation: report.speculation,
                visible_blocks: report.visible_blocks,
            });
            row.work.waits += 1;
            if report.pass != described {
                described = report.pass;
                row.work.submissions += 1;
                row.work.dispatches += report.dispatches;
                #[cfg(feature = "wgpu-profiler")]
                for stage in _renderer.stage_times() {
                    *row.stage_ms.entry(stage.label.clone()).or_default() += stage.ms;
                }
            }
            true
        })?;
        row.set_times(last.rounds);
        row.work.hits = last.hits;
        row.work.requested = last.blocks_requested;
        row.work.decoded_total = last.blocks_decoded;
        row.work.decoded_unique = (last.blocks_evicted == 0).then_some(last.blocks_decoded);
        row.work.evicted = last.blocks_evicted;
        row.memory = Memory::of(&self.renderer, &last);
        row.setup_ms = self.setup_ms;
        Ok(row)
    }
}
