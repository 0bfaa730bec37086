//! Medians over the views.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::frame::{FrameRow, Key};
use crate::support::median;

/// Medians over the frames that share a key. `docs/benchmark.md` explains the keys.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    #[serde(flatten)]
    pub key: Key,
    pub frames: usize,
    pub ms_85: f64,
    pub ms_90: f64,
    pub ms_95: f64,
    pub ms_100: f64,
    /// Smallest and largest.
    pub ms_85_spread: [f64; 2],
    pub ms_100_spread: [f64; 2],
    pub passes_85: f64,
    pub passes_100: f64,
    pub passes_100_p95: f64,
    pub rounds: f64,
    pub rounds_p95: f64,
    pub waits: f64,
    pub submissions: f64,
    pub dispatches: f64,
    pub hits: f64,
    pub decoded_unique: Option<f64>,
    pub decoded_total: f64,
    pub decoded_p95: f64,
    pub evicted: f64,
    pub needed: Option<f64>,
    pub decoded_per_needed: Option<f64>,
    pub intersections: Option<f64>,
    pub overhead_bytes: u64,
    pub compressed_bytes: u64,
    pub peak_bytes: u64,
    pub loaded_bytes: u64,
    pub cache_bytes: u64,
    pub bytes_by_category: BTreeMap<String, u64>,
    pub setup_ms: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mask_ms: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ms_with_masks: Option<f64>,
    /// The largest one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub difference: Option<f64>,
}

/// One row for every key, in the order in which keys first appear.
pub fn medians(frames: &[FrameRow]) -> Vec<Row> {
    let mut groups: Vec<Vec<&FrameRow>> = Vec::new();
    for frame in frames {
        match groups.iter_mut().find(|group| group[0].key == frame.key) {
            Some(group) => group.push(frame),
            None => groups.push(vec![frame]),
        }
    }
    groups.iter().map(|group| row(group)).collect()
}

/// The smallest value that 95 % of the values do not exceed.
fn percentile_95(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let rank = (values.len() as f64 * 0.95).ceil() as usize;
    values.get(rank.saturating_sub(1)).copied().unwrap_or(f64::NAN)
}

fn spread(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
}

fn row(group: &[&FrameRow]) -> Row {
    let first = group[0];
    let all = |value: fn(&FrameRow) -> f64| group.iter().map(move |frame| value(frame));
    let of = |value: fn(&FrameRow) -> f64| median(all(value));
    // Only where every frame knows it.
    let known = |value: &dyn Fn(&FrameRow) -> Option<f64>| {
        let values: Option<Vec<f64>> = group.iter().map(|frame| value(frame)).collect();
        values.map(|values| median(values.into_iter()))
    };
    let most = |value: fn(&FrameRow) -> u64| group.iter().map(|f| value(f)).max().unwrap_or(0);
    let differences = group.iter().filter_map(|f| f.cpu.map(|cpu| cpu.difference));
    Row {
        key: first.key.clone(),
        frames: group.len(),
        ms_85: of(|f| f.times.ms_85),
        ms_90: of(|f| f.times.ms_90),
        ms_95: of(|f| f.times.ms_95),
        ms_100: of(|f| f.times.ms_100),
        ms_85_spread: spread(all(|f| f.times.ms_85)),
        ms_100_spread: spread(all(|f| f.times.ms_100)),
        passes_85: of(|f| f64::from(f.times.passes_85)),
        passes_100: of(|f| f64::from(f.times.passes_100)),
        passes_100_p95: percentile_95(all(|f| f64::from(f.times.passes_100))),
        rounds: of(|f| f64::from(f.times.rounds)),
        rounds_p95: percentile_95(all(|f| f64::from(f.times.rounds))),
        waits: of(|f| f64::from(f.work.waits)),
        submissions: of(|f| f64::from(f.work.submissions)),
        dispatches: of(|f| f64::from(f.work.dispatches)),
        hits: of(|f| f64::from(f.work.hits)),
        decoded_unique: known(&|f| f.work.decoded_unique.map(f64::from)),
        decoded_total: of(|f| f64::from(f.work.decoded_total)),
        decoded_p95: percentile_95(all(|f| f64::from(f.work.decoded_total))),
        evicted: of(|f| f64::from(f.work.evicted)),
        needed: known(&|f| f.work.needed.map(|n| n as f64)),
        decoded_per_needed: known(&|f| {
            f.work.needed.map(|needed| f64::from(f.work.decoded_total) / needed.max(1) as f64)
        }),
        intersections: known(&|f| f.work.intersections.map(|n| n as f64)),
        overhead_bytes: most(|f| f.memory.overhead_bytes),
        compressed_bytes: first.memory.compressed_bytes,
        peak_bytes: most(|f| f.memory.peak_bytes),
        loaded_bytes: most(|f| f.memory.loaded_bytes),
        cache_bytes: most(|f| f.memory.cache_bytes),
        bytes_by_category: first.memory.bytes_by_category.clone(),
        setup_ms: first.setup_ms,
        mask_ms: known(&|f| f.cpu.map(|cpu| cpu.mask_ms)),
        ms_with_masks: known(&|f| f.cpu.map(|cpu| cpu.ms_with_masks)),
        difference: differences.reduce(f64::max),
    }
}
