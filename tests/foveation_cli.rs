//! The example `foveation` on a tiny volume: what its numbers must agree on.

#![allow(clippy::unwrap_used, reason = "a failing test says where")]

mod cli;

use cli::number;
use serde_json::Value;

/// Fovea and periphery make up the picture, so its error is between theirs.
fn check_quality(row: &Value) {
    for (key, better) in [("psnr", 1.0), ("flip", -1.0)] {
        let [all, fovea, periphery] =
            ["all", "fovea", "periphery"].map(|region| better * number(&row[region], key));
        assert!(fovea > periphery, "{key}: the fovea has more samples: {row}");
        assert!(periphery <= all && all <= fovea, "{key}: {row}");
    }
    let sampled = number(row, "sampled");
    assert!(number(row, "base_density") < sampled && sampled < 1.0, "{row}");
    assert!(number(row, "finished") > 0.0 && number(row, "finished") < 1.0, "{row}");
}

/// More pixels finish from pass to pass, and the last picture is the exact one.
fn check_rest(rows: &[Value]) {
    for pair in rows.windows(2) {
        assert!(number(&pair[1], "pass") > number(&pair[0], "pass"));
        assert!(number(&pair[1], "finished") >= number(&pair[0], "finished"));
    }
    let last = rows.last().unwrap();
    assert_eq!(number(last, "finished"), 1.0);
    assert!(last["psnr"].is_null(), "the last picture differs from the exact one: {last}");
    assert!(rows[0]["psnr"].is_number(), "the first picture is exact already: {rows:?}");
}

fn check_speed(row: &Value) {
    let sampled = number(row, "sampled");
    let c_max = number(row, "c_max");
    assert!((sampled / c_max - 1.0).abs() < 0.2, "{sampled} of {c_max}");
    let ratio = number(row, "full_ms") / number(row, "traced_ms");
    assert!((number(row, "traced_speedup") / ratio - 1.0).abs() < 1e-9);
    assert!(!row["fills"].as_array().unwrap().is_empty());
}

#[test]
fn the_numbers_of_a_run_agree_with_each_other() {
    let folder = cli::folder("foveation_cli", "agree");
    let out = folder.to_str().unwrap();
    cli::succeed("foveation", &["--set", "test", "--out", out]);
    let file = cli::path(&folder, "foveation.json");
    let written = cli::read_json(&file);
    let rows = |key: &str| written[key].as_array().unwrap().clone();
    assert_eq!(rows("quality").len(), 10, "9 ways and the nearest pixel");
    rows("quality").iter().filter(|row| row["method"] != "unfinished").for_each(check_quality);
    check_rest(&rows("rest"));
    rows("speed").iter().for_each(check_speed);
    for name in ["foveation.md", "foveation-speed.svg"] {
        assert!(folder.join(name).is_file(), "{name}");
    }
    // Rows that were written are read again as they are.
    cli::succeed("foveation", &["--nothing", "--add", &file, "--out", out]);
    let again = cli::read_json(&file);
    for key in ["quality", "rest", "speed"] {
        assert_eq!(again[key], written[key], "{key}");
    }
}
