//! What a run says in a few numbers.

use serde::Serialize;

use crate::frame::FrameRow;
use crate::library::Wanted;
use crate::rows::Row;
use crate::support::median;

/// RunAhead against BlockSorted on one volume: the best setting of each, by the medians.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    pub volume: String,
    pub size: [u32; 2],
    pub run_ahead_ms_85: f64,
    pub block_sorted_ms_85: f64,
    pub faster_85: f64,
    pub run_ahead_ms_100: f64,
    pub block_sorted_ms_100: f64,
    pub faster_100: f64,
}

/// A share of frames.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Share {
    pub frames: usize,
    pub of: usize,
}

/// `docs/benchmark.md` explains the keys.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    pub comparisons: Vec<Comparison>,
    /// Medians over the comparisons.
    pub faster_85: f64,
    pub faster_100: f64,
    /// Warm frames of RunAhead in one round without a decode.
    pub warm_in_one_round: Share,
    /// Moved frames in at most three rounds, and in one pass.
    pub moved_in_three_rounds: Share,
    pub moved_in_one_pass: Share,
}

impl Summary {
    pub fn new(rows: &[Row], frames: &[FrameRow]) -> Self {
        let comparisons = comparisons(rows);
        let share = |state: &str, good: fn(&FrameRow) -> bool| {
            let all = || {
                let ours = |frame: &&FrameRow| frame.key.strategy == "run-ahead";
                frames.iter().filter(ours).filter(|frame| frame.key.state == state)
            };
            Share { frames: all().filter(|frame| good(frame)).count(), of: all().count() }
        };
        Self {
            faster_85: median(comparisons.iter().map(|c| c.faster_85)),
            faster_100: median(comparisons.iter().map(|c| c.faster_100)),
            comparisons,
            warm_in_one_round: share("warm", |f| f.times.rounds == 1 && f.work.decoded_total == 0),
            moved_in_three_rounds: share("moved", |f| f.times.rounds <= 3),
            moved_in_one_pass: share("moved", |f| f.times.passes_100 == 1),
        }
    }
}

fn comparisons(rows: &[Row]) -> Vec<Comparison> {
    let cold: Vec<&Row> = rows
        .iter()
        .filter(|row| row.key.state == "cold" && row.key.residency == Wanted::Cached)
        .collect();
    let mut cases: Vec<(&str, [u32; 2])> = Vec::new();
    for row in &cold {
        let case = (&*row.key.volume, row.key.size);
        if !cases.contains(&case) {
            cases.push(case);
        }
    }
    let comparison = |(volume, size): (&str, [u32; 2])| {
        let best = |strategy: &str, ms: fn(&Row) -> f64| {
            let of_case = |row: &&&Row| (&*row.key.volume, row.key.size) == (volume, size);
            let rows = cold.iter().filter(of_case).filter(|row| row.key.strategy == strategy);
            rows.map(|row| ms(row)).reduce(f64::min)
        };
        let run_ahead = (best("run-ahead", |r| r.ms_85)?, best("run-ahead", |r| r.ms_100)?);
        let sorted = (best("block-sorted", |r| r.ms_85)?, best("block-sorted", |r| r.ms_100)?);
        Some(Comparison {
            volume: volume.into(),
            size,
            run_ahead_ms_85: run_ahead.0,
            block_sorted_ms_85: sorted.0,
            faster_85: sorted.0 / run_ahead.0,
            run_ahead_ms_100: run_ahead.1,
            block_sorted_ms_100: sorted.1,
            faster_100: sorted.1 / run_ahead.1,
        })
    };
    cases.into_iter().filter_map(comparison).collect()
}
