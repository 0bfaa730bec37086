//! The example `budget` on a tiny volume: what its numbers must agree on.

#![allow(clippy::unwrap_used, reason = "a failing test says where")]

mod cli;

use cli::number;
#[test]
fn every_mode_shows_the_same_recording() {
    let folder = cli::folder("budget_cli", "test");
    let out = folder.to_str().unwrap();
    let printed = cli::succeed("budget", &["--set", "test", "--out", out]);
    let file = cli::read_json(&cli::path(&folder, "budget.json"));
    let rows = file["rows"].as_array().unwrap();
    let modes: Vec<&str> = rows.iter().map(|row| row["mode"].as_str().unwrap()).collect();
    assert_eq!(modes, ["no adaptation", "last frame", "two pass", "predicted"]);
    for row in rows {
        assert_eq!((&row["frames"], &row["seconds"]), (&30.into(), &5.into()), "{row}");
        assert_eq!(row["target_ms"], rows[0]["target_ms"], "{row}");
        let [rmse, above, below] =
            ["rmse_ms", "rmse_above_ms", "rmse_below_ms"].map(|key| number(row, key));
        assert!(rmse <= above.max(below) + 1e-9, "{row}");
        let share = number(row, "frames_above") / number(row, "frames");
        let excess = above * share.sqrt();
        assert!((number(row, "excess_ms") - excess).abs() < 1e-6 * (1.0 + excess), "{row}");
        assert!(number(row, "largest_above_ms") >= above - 1e-9, "{row}");
        assert!(number(row, "largest_below_ms") >= below - 1e-9, "{row}");
        assert!(number(row, "most_budget_ms") >= number(row, "budget_ms"), "{row}");
        let error = number(row, "prediction_error");
        assert!(error.is_finite() && error >= 0.0, "{row}");
        let adapts = row["mode"] != "no adaptation";
        assert_eq!(number(row, "quality") < 1.0, adapts, "{row}");
    }
    let plot = std::fs::read_to_string(cli::path(&folder, "budget-turbulence-48-5s.svg")).unwrap();
    assert!(plot.contains("two pass") && printed.contains("Against the last frame"), "{printed}");
}
