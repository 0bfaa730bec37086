//! One measured frame, as it is written to `benchmark.json`. `docs/benchmark.md` explains the keys.

use std::collections::BTreeMap;

use progressive_iso::{Category, PassReport, ProgressiveIsoRenderer};
use serde::Serialize;

use crate::library::Wanted;
use crate::needed::Needed;
use crate::scene::View;
use crate::sets::Setting;
use crate::support::subject::Subject;

/// What frames have in common whose median is taken.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Key {
    pub volume: String,
    pub rate: f64,
    pub size: [u32; 2],
    pub setting: String,
    pub strategy: &'static str,
    pub start_factor: u32,
    pub look_ahead: u32,
    pub residency: Wanted,
    /// "cold", "warm" or "moved".
    pub state: &'static str,
}

impl Key {
    pub fn new(subject: &Subject, size: [u32; 2], setting: &Setting, state: &'static str) -> Self {
        Self {
            volume: subject.name(),
            rate: subject.rate,
            size,
            setting: setting.label.clone(),
            strategy: setting.strategy_name(),
            start_factor: setting.start_factor,
            look_ahead: setting.look_ahead,
            residency: setting.residency,
            state,
        }
    }
}

/// Milliseconds to a share of finished pixels, and passes.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Times {
    pub ms_85: f64,
    pub ms_90: f64,
    pub ms_95: f64,
    pub ms_100: f64,
    pub passes_85: u32,
    pub passes_100: u32,
    pub rounds: u32,
}

#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Work {
    pub waits: u32,
    pub submissions: u32,
    pub dispatches: u32,
    pub hits: u32,
    pub requested: u32,
    /// Unknown where blocks were evicted.
    pub decoded_unique: Option<u32>,
    pub decoded_total: u32,
    pub evicted: u32,
    /// Counted on the CPU; unknown for large volumes and moved frames.
    pub needed: Option<u64>,
    pub intersections: Option<u64>,
}

#[derive(Clone, Debug, Default, Serialize)]
pub struct Memory {
    /// Most bytes at any time without the compressed stream.
    pub overhead_bytes: u64,
    pub compressed_bytes: u64,
    pub peak_bytes: u64,
    /// Bytes when the frame is finished: staging for loading is gone.
    pub loaded_bytes: u64,
    /// Decoded blocks and the tables that find them.
    pub cache_bytes: u64,
    pub bytes_by_category: BTreeMap<String, u64>,
}

impl Memory {
    pub fn of(renderer: &ProgressiveIsoRenderer, report: &PassReport) -> Self {
        let categories = renderer.bytes_by_category();
        let sum = |wanted: &[Category]| {
            let found = categories.iter().filter(|(category, _)| wanted.contains(category));
            found.map(|(_, bytes)| bytes).sum::<u64>()
        };
        let compressed = sum(&[Category::Payload]);
        Self {
            overhead_bytes: report.peak_bytes.saturating_sub(compressed),
            compressed_bytes: compressed,
            peak_bytes: report.peak_bytes,
            loaded_bytes: report.bytes,
            cache_bytes: sum(&[Category::Slots, Category::Directory]),
            bytes_by_category: categories
                .iter()
                .map(|(category, bytes)| (format!("{category:?}").to_lowercase(), *bytes))
                .collect(),
        }
    }
}

/// What only the CPU renderer has.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct CpuExtra {
    /// Finding the active blocks of the isovalue, which is not in the times of the frame.
    pub mask_ms: f64,
    pub ms_with_masks: f64,
    /// Share of the pixels that show the surface in this picture or in the GPU's, not in both.
    pub difference: f64,
}

/// Finished share of the pixels after a pass.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Progress {
    pub ms: f64,
    pub pixels: f64,
    pub active_rays: u32,
    pub decoded: u32,
    /// Resident blocks that rays used so far and blocks that they asked for, once per round each.
    pub used: u32,
    pub requested: u32,
    pub speculation: u32,
    pub visible_blocks: u32,
}

#[derive(Clone, Debug, Serialize)]
pub struct FrameRow {
    #[serde(flatten)]
    pub key: Key,
    pub isovalue: f32,
    pub position: [f64; 2],
    #[serde(flatten)]
    pub times: Times,
    #[serde(flatten)]
    pub work: Work,
    #[serde(flatten)]
    pub memory: Memory,
    /// Pipelines, allocation and loading of this setting's renderer, once per volume.
    pub setup_ms: f64,
    /// After every pass.
    pub progress: Vec<Progress>,
    /// GPU milliseconds by stage; empty without the feature `wgpu-profiler`.
    pub stage_ms: BTreeMap<String, f64>,
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub cpu: Option<CpuExtra>,
}

impl FrameRow {
    pub fn new(key: Key, view: &View) -> Self {
        Self {
            key,
            isovalue: view.isovalue,
            position: view.position,
            times: Times::default(),
            work: Work::default(),
            memory: Memory::default(),
            setup_ms: 0.0,
            progress: Vec::new(),
            stage_ms: BTreeMap::new(),
            cpu: None,
        }
    }

    pub fn set_needed(&mut self, needed: Option<Needed>) {
        self.work.needed = needed.map(|n| n.blocks);
        self.work.intersections = needed.map(|n| n.intersections);
    }

    /// The times at which shares of the pixels were finished.
    pub fn set_times(&mut self, rounds: u32) {
        let progress = &self.progress;
        let reach = |share: f64| progress.iter().position(|p| p.pixels >= share).unwrap_or(0);
        let ms = |share: f64| progress.get(reach(share)).map_or(f64::NAN, |p| p.ms);
        self.times = Times {
            ms_85: ms(0.85),
            ms_90: ms(0.9),
            ms_95: ms(0.95),
            ms_100: ms(1.0),
            passes_85: reach(0.85) as u32 + 1,
            passes_100: reach(1.0) as u32 + 1,
            rounds,
        };
    }
}
