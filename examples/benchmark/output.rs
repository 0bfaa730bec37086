//! Writes `benchmark.json`, `benchmark.md` and the plots.

use std::path::Path;

use serde::Serialize;

use crate::frame::FrameRow;
use crate::measure::{Results, Skipped};
use crate::rows::{Row, medians};
use crate::scaling::Ratio;
use crate::summary::Summary;
use crate::support::{Failure, Origin, write_file, write_json};
use crate::{figures, tables};

#[derive(Serialize)]
struct File<'a> {
    #[serde(flatten)]
    origin: &'a Origin,
    summary: &'a Summary,
    rows: &'a [Row],
    skipped: &'a [Skipped],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    scaling: &'a [Ratio],
    frames: &'a [FrameRow],
}

/// Writes everything, and the tables to the terminal.
pub fn write(folder: &Path, origin: &Origin, results: &Results) -> Result<(), Failure> {
    let rows = medians(&results.frames);
    let summary = Summary::new(&rows, &results.frames);
    let text = tables::all(origin, &summary, &rows, results);
    println!("\n{text}");
    write_file(&folder.join("benchmark.md"), text.as_bytes())?;
    let Results { frames, skipped, scaling } = results;
    let file = File { origin, summary: &summary, rows: &rows, skipped, scaling, frames };
    write_json(folder, "benchmark.json", &file)?;
    figures::write(folder, &rows, frames)
}
