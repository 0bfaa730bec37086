//! Renders the frames and takes the times.

use std::collections::BTreeMap;
use std::time::Instant;

use progressive_iso::{
    Camera, Category, CompressedVolume, Frame, FrameOptions, ProgressiveIsoRenderer,
    RendererOptions, TraversalStrategy,
};
use serde::Serialize;

use crate::sets::{Case, SETTINGS, Setting};
use crate::support::{Failure, Gpu};

/// One frame, cold or warm.
#[derive(Clone, Debug, Serialize)]
pub struct FrameRow {
    pub volume: String,
    pub rate: f64,
    pub size: [u32; 2],
    pub setting: String,
    pub strategy: String,
    pub start_factor: u32,
    pub look_ahead: u32,
    pub residency: String,
    /// "cold" or "warm".
    pub state: String,
    pub isovalue: f32,
    pub position: [f64; 2],
    /// Milliseconds to this percentage of finished pixels.
    pub ms_85: f64,
    pub ms_90: f64,
    pub ms_95: f64,
    pub ms_100: f64,
    pub passes_85: u32,
    pub passes_100: u32,
    pub rounds: u32,
    /// Times the host waited for the GPU, and submissions: one per pass here.
    pub waits: u32,
    pub submissions: u32,
    pub hits: u32,
    pub requested: u32,
    /// Unknown where blocks were evicted.
    pub decoded_unique: Option<u32>,
    pub decoded_total: u32,
    pub evicted: u32,
    /// Of every pass: pairs per active ray and visible blocks (`BlockSorted`), active rays after it.
    pub speculation: Vec<u32>,
    pub visible_blocks: Vec<u32>,
    /// Blocks that each pass needed: used ones and requested ones, neighbours included.
    pub active_blocks: Vec<u32>,
    pub active_rays: Vec<u32>,
    pub overhead_bytes: u64,
    pub compressed_bytes: u64,
    pub peak_bytes: u64,
    /// Pipelines, allocation and loading of this setting's renderer, once per volume.
    pub setup_ms: f64,
    /// GPU milliseconds by stage; empty without the feature `wgpu-profiler`.
    pub stage_ms: BTreeMap<String, f64>,
}

/// GPU memory of every renderer.
const BUDGET_BYTES: u64 = 1 << 30;

/// All frames of a case.
pub fn case(gpu: &Gpu, case: &Case) -> Result<Vec<FrameRow>, Failure> {
    let (volume, isovalue) = volume(case)?;
    let mut renderers = Vec::new();
    for setting in SETTINGS {
        renderers.push((setting, Measured::new(gpu, case, &volume, setting, isovalue)?));
    }
    let mut rows = Vec::new();
    for factor in case.isovalues {
        for &position in case.positions {
            let isovalue = (f64::from(isovalue) * factor) as f32;
            for (setting, measured) in &mut renderers {
                let frame = measured.frame(case, position, isovalue, setting.look_ahead);
                measured.renderer.clear_cache();
                for state in ["cold", "warm"] {
                    rows.push(measured.render(gpu, case, setting, &frame, position, state)?);
                }
            }
        }
    }
    Ok(rows)
}

fn volume(case: &Case) -> Result<(CompressedVolume, f32), Failure> {
    if case.volume == "brain" {
        return Ok((CompressedVolume::try_from(&volumes::brain())?, volumes::BRAIN_ISOVALUE));
    }
    let dims = [case.edge; 3];
    let field = volumes::by_name(case.volume, dims)?;
    let volume = volumes::generate(&*field, dims, case.rate)?;
    Ok((CompressedVolume::try_from(&volume)?, field.suggested_isovalue() as f32))
}

struct Measured {
    renderer: ProgressiveIsoRenderer,
    setup_ms: f64,
}

impl Measured {
    /// A renderer whose volume is loaded and whose pipelines have run once.
    fn new(
        gpu: &Gpu,
        case: &Case,
        volume: &CompressedVolume,
        setting: Setting,
        isovalue: f32,
    ) -> Result<Self, Failure> {
        let begin = Instant::now();
        let options = RendererOptions {
            size: case.size,
            budget_bytes: BUDGET_BYTES,
            strategy: setting.strategy,
            ..Default::default()
        };
        let renderer =
            ProgressiveIsoRenderer::new(&gpu.device, &gpu.queue, volume.clone(), options)?;
        let mut measured = Self { renderer, setup_ms: 0.0 };
        let frame = measured.frame(case, case.positions[0], isovalue, setting.look_ahead);
        measured.renderer.set_frame(&frame)?;
        measured
            .renderer
            .render_to_completion(&gpu.device, &gpu.queue, |_, report| report.pass == 0)?;
        measured.setup_ms = begin.elapsed().as_secs_f64() * 1e3;
        measured.renderer.render_to_completion(&gpu.device, &gpu.queue, |_, _| true)?;
        Ok(measured)
    }

    fn frame(&self, case: &Case, position: [f64; 2], isovalue: f32, look_ahead: u32) -> Frame {
        let (center, radius) = self.renderer.volume().bounding_ball();
        let aspect = f64::from(case.size[0]) / f64::from(case.size[1]);
        Frame {
            camera: Camera::orbit(center, radius * 0.8, position[0], position[1], 50.0, aspect),
            isovalues: vec![isovalue],
            options: FrameOptions { look_ahead, ..Default::default() },
        }
    }

    fn render(
        &mut self,
        gpu: &Gpu,
        case: &Case,
        setting: &Setting,
        frame: &Frame,
        position: [f64; 2],
        state: &str,
    ) -> Result<FrameRow, Failure> {
        let mut times = Vec::new();
        let mut row = FrameRow {
            volume: case.name(),
            rate: case.rate,
            size: case.size,
            setting: setting.label.into(),
            strategy: match setting.strategy {
                TraversalStrategy::RunAhead => "run-ahead".into(),
                _ => "block-sorted".into(),
            },
            start_factor: setting.start_factor,
            look_ahead: setting.look_ahead,
            residency: "cached".into(),
            state: state.into(),
            isovalue: frame.isovalues[0],
            position,
            ms_85: 0.0,
            ms_90: 0.0,
            ms_95: 0.0,
            ms_100: 0.0,
            passes_85: 0,
            passes_100: 0,
            rounds: 0,
            waits: 0,
            submissions: 0,
            hits: 0,
            requested: 0,
            decoded_unique: None,
            decoded_total: 0,
            evicted: 0,
            speculation: Vec::new(),
            visible_blocks: Vec::new(),
            active_blocks: Vec::new(),
            active_rays: Vec::new(),
            overhead_bytes: 0,
            compressed_bytes: 0,
            peak_bytes: 0,
            setup_ms: self.setup_ms,
            stage_ms: BTreeMap::new(),
        };
        let mut needed = 0;
        let begin = Instant::now();
        self.renderer.set_frame(frame)?;
        let last =
            self.renderer.render_to_completion(&gpu.device, &gpu.queue, |_renderer, report| {
                #[cfg(feature = "wgpu-profiler")]
                for stage in _renderer.stage_times() {
                    *row.stage_ms.entry(stage.label.clone()).or_default() += stage.ms;
                }
                times.push((report.completeness_pixels(), begin.elapsed().as_secs_f64() * 1e3));
                row.speculation.push(report.speculation);
                row.visible_blocks.push(report.visible_blocks);
                let needed_now = report.blocks_used + report.blocks_requested;
                row.active_blocks.push(needed_now - needed);
                needed = needed_now;
                row.active_rays.push(report.active_rays);
                true
            })?;
        let reach = |share: f64| times.iter().position(|(done, _)| *done >= share).unwrap_or(0);
        let ms = |share| times.get(reach(share)).map_or(f64::NAN, |(_, ms)| *ms);
        (row.ms_85, row.ms_90, row.ms_95, row.ms_100) = (ms(0.85), ms(0.9), ms(0.95), ms(1.0));
        row.passes_85 = reach(0.85) as u32 + 1;
        row.passes_100 = last.pass;
        row.rounds = last.rounds;
        (row.waits, row.submissions) = (last.pass, last.pass);
        row.hits = last.hits;
        row.requested = last.blocks_requested;
        row.decoded_total = last.blocks_decoded;
        row.evicted = last.blocks_evicted;
        row.decoded_unique = (last.blocks_evicted == 0).then_some(last.blocks_decoded);
        row.compressed_bytes = self
            .renderer
            .bytes_by_category()
            .iter()
            .filter(|(category, _)| *category == Category::Payload)
            .map(|(_, bytes)| bytes)
            .sum();
        row.peak_bytes = last.peak_bytes;
        row.overhead_bytes = last.peak_bytes - row.compressed_bytes;
        Ok(row)
    }
}
