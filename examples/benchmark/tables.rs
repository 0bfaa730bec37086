//! The tables of `benchmark.md`.

use crate::measure::{Results, Skipped};
use crate::rows::Row;
use crate::scaling::Ratio;
use crate::summary::{Share, Summary};
use crate::support::{Origin, Table};

/// A number without digits that mean nothing.
pub fn number(value: f64) -> String {
    if !value.is_finite() {
        "".into()
    } else if value.fract() == 0.0 || value.abs() >= 100.0 {
        format!("{value:.0}")
    } else {
        format!("{value:.1}")
    }
}

fn ratio(value: Option<f64>) -> String {
    value.map_or_else(String::new, |ratio| format!("{ratio:.2}"))
}

fn megabytes(bytes: u64) -> String {
    format!("{:.1}", bytes as f64 / 1e6)
}

/// Volume and picture, then the setting.
fn head(row: &Row) -> Vec<String> {
    let [width, height] = row.key.size;
    vec![row.key.volume.clone(), format!("{width}x{height}"), row.key.setting.clone()]
}

/// The row of the same setting in another state.
fn other<'a>(rows: &'a [Row], row: &Row, state: &str) -> Option<&'a Row> {
    rows.iter().find(|r| {
        r.key.state == state && {
            let (a, b) = (&r.key, &row.key);
            (&a.volume, a.rate, a.size, &a.setting) == (&b.volume, b.rate, b.size, &b.setting)
        }
    })
}

pub fn all(origin: &Origin, summary: &Summary, rows: &[Row], results: &Results) -> String {
    let Origin { adapter, commit, date, command } = origin;
    let mut text = format!(
        "`benchmark {command}`, {adapter}, commit {commit}, {date}. Medians over the views; \
         percentages count all pixels.\n\n"
    );
    text += &scaling(&results.scaling);
    text += &comparisons(summary);
    text += &shares(summary);
    text += &strategies(rows);
    text += &moved(rows);
    text += &needed(rows);
    text += &cpu(rows);
    text += &memory(rows);
    let mut table = Table::new("Not measured", &["volume", "picture", "setting", "reason"], 4);
    for Skipped { volume, size, setting, reason } in &results.skipped {
        let size = format!("{}x{}", size[0], size[1]);
        table.line(&[volume.clone(), size, setting.clone(), reason.clone()]);
    }
    text + &table.finish()
}

fn scaling(ratios: &[Ratio]) -> String {
    let heads =
        ["setting", "state", "ms in the smallest", "ms in the largest", "largest / smallest"];
    let mut table = Table::new("A patch of 256^3 voxels in volumes that grow", &heads, 2);
    for Ratio { setting, state, ms_smallest, ms_largest, ratio } in ratios {
        table.line(&[
            setting.clone(),
            (*state).into(),
            format!("{ms_smallest:.0}"),
            format!("{ms_largest:.0}"),
            format!("{ratio:.2}"),
        ]);
    }
    table.finish()
}

fn comparisons(summary: &Summary) -> String {
    let heads = [
        "volume",
        "picture",
        "RunAhead, ms to 85 %",
        "BlockSorted",
        "faster",
        "RunAhead, ms to 100 %",
        "BlockSorted",
        "faster",
    ];
    let mut table =
        Table::new("RunAhead against BlockSorted, cold, best setting of each", &heads, 2);
    for c in &summary.comparisons {
        table.line(&[
            c.volume.clone(),
            format!("{}x{}", c.size[0], c.size[1]),
            format!("{:.0}", c.run_ahead_ms_85),
            format!("{:.0}", c.block_sorted_ms_85),
            format!("{:.2}", c.faster_85),
            format!("{:.0}", c.run_ahead_ms_100),
            format!("{:.0}", c.block_sorted_ms_100),
            format!("{:.2}", c.faster_100),
        ]);
    }
    if !summary.comparisons.is_empty() {
        let [faster_85, faster_100] =
            [summary.faster_85, summary.faster_100].map(|faster| format!("{faster:.2}"));
        let empty = String::new;
        table.line(&[
            "median".into(),
            empty(),
            empty(),
            empty(),
            faster_85,
            empty(),
            empty(),
            faster_100,
        ]);
    }
    table.finish()
}

fn shares(summary: &Summary) -> String {
    let mut table = Table::new("Frames of RunAhead", &["what", "frames", "of", "share"], 1);
    for (what, Share { frames, of }) in [
        ("warm, in one round without a decode", summary.warm_in_one_round),
        ("moved, in at most three rounds", summary.moved_in_three_rounds),
        ("moved, in one pass", summary.moved_in_one_pass),
    ] {
        if of > 0 {
            let share = format!("{:.1} %", 100.0 * frames as f64 / of as f64);
            table.line(&[what.into(), frames.to_string(), of.to_string(), share]);
        }
    }
    table.finish()
}

fn strategies(rows: &[Row]) -> String {
    let heads = [
        "volume",
        "picture",
        "setting",
        "passes cold",
        "ms to 85 %",
        "ms to 100 %",
        "spread",
        "blocks decoded",
        "passes warm",
        "ms warm",
        "spread",
    ];
    let mut table = Table::new("Cold and warm frames", &heads, 3);
    let spread = |[low, high]: [f64; 2]| format!("{low:.0} to {high:.0}");
    for cold in rows.iter().filter(|row| row.key.state == "cold") {
        let Some(warm) = other(rows, cold, "warm") else { continue };
        let mut cells = head(cold);
        cells.extend([
            number(cold.passes_100),
            format!("{:.0}", cold.ms_85),
            format!("{:.0}", cold.ms_100),
            spread(cold.ms_100_spread),
            number(cold.decoded_total),
            number(warm.passes_100),
            format!("{:.0}", warm.ms_100),
            spread(warm.ms_100_spread),
        ]);
        table.line(&cells);
    }
    table.finish()
}

fn moved(rows: &[Row]) -> String {
    let heads = [
        "volume",
        "picture",
        "setting",
        "frames",
        "rounds",
        "rounds, 95 %",
        "passes",
        "passes, 95 %",
        "blocks decoded",
        "decoded, 95 %",
        "ms",
        "ms warm",
    ];
    let mut table = Table::new("The camera moved by 3.6 degrees", &heads, 3);
    for row in rows.iter().filter(|row| row.key.state == "moved") {
        let mut cells = head(row);
        let warm = other(rows, row, "warm").map_or(f64::NAN, |warm| warm.ms_100);
        cells.extend([
            row.frames.to_string(),
            number(row.rounds),
            number(row.rounds_p95),
            number(row.passes_100),
            number(row.passes_100_p95),
            number(row.decoded_total),
            number(row.decoded_p95),
            format!("{:.0}", row.ms_100),
            format!("{warm:.0}"),
        ]);
        table.line(&cells);
    }
    table.finish()
}

fn needed(rows: &[Row]) -> String {
    let heads =
        ["volume", "picture", "setting", "blocks needed", "blocks decoded", "decoded / needed"];
    let mut table = Table::new("Blocks decoded and needed, cold", &heads, 3);
    for row in rows.iter().filter(|row| row.key.state == "cold") {
        let Some(needed) = row.needed else { continue };
        let mut cells = head(row);
        let ratio = ratio(row.decoded_per_needed);
        cells.extend([number(needed), number(row.decoded_total), ratio]);
        table.line(&cells);
    }
    table.finish()
}

fn cpu(rows: &[Row]) -> String {
    let heads = [
        "volume",
        "picture",
        "setting",
        "ms warm",
        "CPU ms",
        "ours / CPU",
        "CPU ms with masks",
        "pixels that differ",
    ];
    let mut table = Table::new("Against the plain CPU renderer, warm", &heads, 3);
    for cpu in rows.iter().filter(|row| row.key.strategy == "cpu") {
        let ours = rows.iter().filter(|row| {
            row.key.strategy == "run-ahead"
                && row.key.state == "warm"
                && (&row.key.volume, row.key.size) == (&cpu.key.volume, cpu.key.size)
        });
        for row in ours {
            let mut cells = head(row);
            cells.extend([
                format!("{:.0}", row.ms_100),
                format!("{:.0}", cpu.ms_100),
                format!("{:.2}", row.ms_100 / cpu.ms_100),
                cpu.ms_with_masks.map_or_else(String::new, |ms| format!("{ms:.0}")),
                cpu.difference.map_or_else(String::new, |share| format!("{share:.1e}")),
            ]);
            table.line(&cells);
        }
    }
    table.finish()
}

fn memory(rows: &[Row]) -> String {
    let heads = [
        "volume",
        "picture",
        "setting",
        "compressed",
        "overhead, peak",
        "overhead, loaded",
        "cache",
    ];
    let mut table = Table::new("GPU memory in MB", &heads, 3);
    for row in rows.iter().filter(|row| row.key.state == "cold") {
        let mut cells = head(row);
        cells.extend([
            megabytes(row.compressed_bytes),
            megabytes(row.overhead_bytes),
            megabytes(row.loaded_bytes.saturating_sub(row.compressed_bytes)),
            megabytes(row.cache_bytes),
        ]);
        table.line(&cells);
    }
    table.finish()
}
