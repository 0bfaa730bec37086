//! The example `infill_eval` on a tiny volume: what its numbers must agree on.

#![allow(clippy::unwrap_used, reason = "a failing test says where")]

mod cli;

use cli::number;
use serde_json::Value;

const WEIGHTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/infill/weights/infill.safetensors");

/// Of every motion a row for each method; only what fills takes memory, and everything is better than
/// leaving holes.
fn check_rows(rows: &[Value]) {
    let methods = [
        "unfinished",
        "push-pull",
        "coarse",
        "classical",
        "network",
        "network-no-history",
        "nearest",
        "more-passes",
    ];
    for motion in ["orbit", "isovalue-jump"] {
        let own: Vec<&Value> = rows.iter().filter(|row| row["motion"] == motion).collect();
        let found: Vec<&str> = own.iter().map(|row| row["method"].as_str().unwrap()).collect();
        assert_eq!(found, methods, "{motion}");
        let unfinished = number(own[0], "psnr_holes");
        for row in own {
            let method = row["method"].as_str().unwrap();
            assert_eq!(row["frames"], 2);
            assert!((0.85..1.0).contains(&number(row, "completeness_pixels")), "{row}");
            let fills = !["unfinished", "nearest", "more-passes"].contains(&method);
            assert_eq!(number(row, "bytes") > 0.0, fills, "{row}");
            if method == "more-passes" {
                assert!(number(row, "ssim") >= number(&rows[0], "ssim"), "{row}");
            } else {
                assert_eq!(number(row, "exact"), 0.0, "no guess is exact everywhere: {row}");
                assert!(method == "unfinished" || number(row, "psnr_holes") > unfinished + 3.0);
            }
        }
    }
}

/// Time and completeness go one way, pixels are filled from the pass that is enough on, and the last
/// picture is the finished one.
fn check_curve(curve: &Value) {
    let points = curve["points"].as_array().unwrap();
    for pair in points.windows(2) {
        for key in ["pass", "ms", "completeness"] {
            assert!(number(&pair[1], key) >= number(&pair[0], key), "{key}: {curve}");
        }
    }
    for point in points {
        let enough = number(point, "completeness") >= 0.85;
        assert_eq!(point["stopped"], enough, "{curve}");
        let holes = number(point, "completeness") < 1.0;
        let fills = curve["method"] != "unfinished" && enough && holes;
        assert_eq!(number(point, "filled_pixels") > 0.0, fills, "{curve}");
    }
    let last = points.last().unwrap();
    assert_eq!((number(last, "completeness"), &last["psnr"]), (1.0, &Value::Null), "{curve}");
}

#[test]
fn rows_and_curves_are_those_of_one_picture() {
    let folder = cli::folder("infill_eval_cli", "test");
    let out = folder.to_str().unwrap();
    let arguments = ["--set", "test", "--size", "96x64", "--weights", WEIGHTS, "--out", out];
    let printed = cli::succeed("infill_eval", &arguments);
    let file = cli::read_json(&cli::path(&folder, "infill_eval.json"));
    check_rows(file["rows"].as_array().unwrap());
    let curves = file["curves"].as_array().unwrap();
    let kinds: Vec<_> = curves.iter().map(|c| (&c["strategy"], &c["method"])).collect();
    assert_eq!(kinds.len(), 6, "{kinds:?}");
    curves.iter().for_each(check_curve);
    for name in ["infill_eval.md", "curve-turbulence-48-run-ahead.svg"] {
        let text = std::fs::read_to_string(cli::path(&folder, name)).unwrap();
        assert!(text.contains("network"), "{name}: {text}");
    }
    assert!(printed.contains("Time to 85 % of the rays"), "{printed}");
}

#[test]
fn wrong_weights_are_refused() {
    let folder = cli::folder("infill_eval_cli", "weights");
    let weights = cli::path(&folder, "weights.safetensors");
    std::fs::write(&weights, b"no weights").unwrap();
    let output =
        cli::run("infill_eval", &["--weights", &weights, "--out", folder.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(cli::text(&output.stderr).contains("infill_eval: "), "{output:?}");
}
