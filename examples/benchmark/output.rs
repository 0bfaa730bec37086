//! Medians, `benchmark.json` and `benchmark.md`.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use serde::Serialize;

use crate::measure::FrameRow;
use crate::support::{Failure, write_file};

/// Medians over the views of one setting on one volume.
#[derive(Clone, Debug, Serialize)]
struct Row {
    volume: String,
    rate: f64,
    size: [u32; 2],
    setting: String,
    strategy: String,
    start_factor: u32,
    look_ahead: u32,
    residency: String,
    state: String,
    views: usize,
    ms_85: f64,
    ms_100: f64,
    /// Smallest and largest time of the views.
    ms_100_spread: [f64; 2],
    passes_100: f64,
    waits: f64,
    submissions: f64,
    decoded_unique: Option<f64>,
    decoded_total: f64,
    overhead_bytes: u64,
    compressed_bytes: u64,
    peak_bytes: u64,
    setup_ms: f64,
}

#[derive(Serialize)]
struct File {
    adapter: String,
    commit: String,
    rows: Vec<Row>,
    frames: Vec<FrameRow>,
}

/// Writes both files.
pub fn write(folder: &Path, adapter: &str, frames: Vec<FrameRow>) -> Result<(), Failure> {
    let rows = medians(&frames);
    let commit = commit();
    let table = markdown(adapter, &commit, &rows);
    println!("\n{table}");
    write_file(&folder.join("benchmark.md"), table.as_bytes())?;
    let file = File { adapter: adapter.into(), commit, rows, frames };
    write_file(&folder.join("benchmark.json"), serde_json::to_string_pretty(&file)?.as_bytes())
}

fn commit() -> String {
    Command::new("git")
        .args(["describe", "--always", "--dirty"])
        .output()
        .ok()
        .filter(|output| output.status.success())
        .map_or_else(|| "unknown".into(), |o| String::from_utf8_lossy(&o.stdout).trim().into())
}

/// Middle value; the mean of the two middle ones for an even count.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => values[n / 2],
        n => (values[n / 2 - 1] + values[n / 2]) / 2.0,
    }
}

fn medians(frames: &[FrameRow]) -> Vec<Row> {
    let mut groups: Vec<Vec<&FrameRow>> = Vec::new();
    let key = |f: &FrameRow| (f.volume.clone(), f.size, f.setting.clone(), f.state.clone());
    for frame in frames {
        match groups.iter_mut().find(|group| key(group[0]) == key(frame)) {
            Some(group) => group.push(frame),
            None => groups.push(vec![frame]),
        }
    }
    groups.iter().map(|group| row(group)).collect()
}

fn row(group: &[&FrameRow]) -> Row {
    let first = group[0];
    let of = |value: fn(&FrameRow) -> f64| median(group.iter().map(|f| value(f)));
    let ends = group.iter().map(|f| f.ms_100);
    let unique = group.iter().all(|f| f.decoded_unique.is_some());
    Row {
        volume: first.volume.clone(),
        rate: first.rate,
        size: first.size,
        setting: first.setting.clone(),
        strategy: first.strategy.clone(),
        start_factor: first.start_factor,
        look_ahead: first.look_ahead,
        residency: first.residency.clone(),
        state: first.state.clone(),
        views: group.len(),
        ms_85: of(|f| f.ms_85),
        ms_100: of(|f| f.ms_100),
        ms_100_spread: [
            ends.clone().fold(f64::INFINITY, f64::min),
            ends.fold(f64::NEG_INFINITY, f64::max),
        ],
        passes_100: of(|f| f64::from(f.passes_100)),
        waits: of(|f| f64::from(f.waits)),
        submissions: of(|f| f64::from(f.submissions)),
        decoded_unique: unique.then(|| of(|f| f64::from(f.decoded_total))),
        decoded_total: of(|f| f64::from(f.decoded_total)),
        overhead_bytes: group.iter().map(|f| f.overhead_bytes).max().unwrap_or(0),
        compressed_bytes: first.compressed_bytes,
        peak_bytes: group.iter().map(|f| f.peak_bytes).max().unwrap_or(0),
        setup_ms: first.setup_ms,
    }
}

fn markdown(adapter: &str, commit: &str, rows: &[Row]) -> String {
    let mut text = format!("Adapter: {adapter}. Commit: {commit}. Medians over the views.\n\n");
    text += "| volume | picture | setting | passes cold | ms to 85 % | ms to 100 % | blocks decoded | passes warm | ms warm |\n";
    text += "| --- | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |\n";
    for cold in rows.iter().filter(|row| row.state == "cold") {
        let same = |row: &&Row| {
            row.state == "warm"
                && row.volume == cold.volume
                && row.size == cold.size
                && row.setting == cold.setting
        };
        let (passes, ms) =
            rows.iter().find(same).map_or((f64::NAN, f64::NAN), |w| (w.passes_100, w.ms_100));
        // Writing to a String does not fail.
        writeln!(
            text,
            "| {} | {}x{} | {} | {} | {:.0} | {:.0} | {} | {} | {:.0} |",
            cold.volume,
            cold.size[0],
            cold.size[1],
            cold.setting,
            cold.passes_100,
            cold.ms_85,
            cold.ms_100,
            cold.decoded_total,
            passes,
            ms,
        )
        .unwrap_or_default();
    }
    text
}
