//! The example `error_time` on a tiny volume: what its numbers must agree on.

#![allow(clippy::unwrap_used, reason = "a failing test says where")]

mod cli;

use cli::number;
use serde_json::Value;

/// Relative error of numbers with five digits, of which four are added.
const ROUNDING: f64 = 1e-4;

/// The number of a key; `None` where JSON has null: infinity or nothing to compare.
fn number_or_null(value: &Value, key: &str) -> Option<f64> {
    let value = value.get(key).unwrap_or_else(|| panic!("no {key} in {value}"));
    assert!(value.is_number() || value.is_null(), "{key} is {value}");
    value.as_f64()
}

fn points(curve: &Value) -> &[Value] {
    curve["points"].as_array().unwrap()
}

fn measured(test: &str) -> (Value, std::path::PathBuf) {
    let folder = cli::folder("error_time_cli", test);
    cli::succeed("error_time", &["--set", "test", "--out", folder.to_str().unwrap()]);
    (cli::read_json(&cli::path(&folder, "error_time.json")), folder)
}

/// Completeness, time and the bound on the open depth go one way, and the last picture is the
/// finished one, exactly.
fn check_progress(curve: &Value) {
    let points = points(curve);
    for pair in points.windows(2) {
        for (key, sign) in
            [("completeness", 1.0), ("ms", 1.0), ("pass", 1.0), ("open_depth_voxels", -1.0)]
        {
            let [before, after] = [0, 1].map(|i| sign * number(&pair[i], key));
            assert!(after >= before, "{key} goes from {before} to {after}: {curve}");
        }
    }
    let (last, setup_ms) = (points.last().unwrap(), number(curve, "setup_ms"));
    assert!(
        setup_ms > 0.0 && number(&points[0], "ms") > setup_ms,
        "set-up is not counted: {curve}"
    );
    assert_eq!(number(last, "completeness"), 1.0);
    assert_eq!(number(last, "open_depth_voxels"), 0.0);
    assert_eq!(number(last, "pass"), number(curve, "passes"));
    let rest = &last["against_finished"];
    assert_eq!(
        number_or_null(rest, "psnr"),
        None,
        "the last picture is not the finished one: {rest}"
    );
    for key in ["color_rms", "mask_disagreement", "depth_max_voxels", "normal_max_degrees"] {
        assert_eq!(number_or_null(rest, key), Some(0.0), "{key}");
    }
}

/// Both metrics obey the triangle inequality, so what is shown is at most as wrong as the sources
/// together, and a source at most as wrong as the picture and the other sources together.
fn check_sources(curve: &Value) {
    for point in points(curve) {
        for key in ["color_rms", "mask_disagreement"] {
            let parts = [
                number(point, key),
                number(&point["against_finished"], key),
                number(&curve["arithmetic"], key),
                number(&curve["compression"], key),
            ];
            let sum: f64 = parts.iter().sum();
            for part in parts {
                assert!(part <= (sum - part) * (1.0 + ROUNDING), "{key}: {parts:?}");
            }
        }
    }
}

#[test]
fn the_numbers_of_a_run_agree_with_each_other() {
    let (file, folder) = measured("agree");
    for key in ["adapter", "commit", "date", "command"] {
        assert!(!file[key].as_str().unwrap().is_empty(), "{key}");
    }
    let curves = file["curves"].as_array().unwrap();
    assert_eq!(curves.len(), 10, "5 settings at 2 rates");
    for curve in curves {
        check_progress(curve);
        check_sources(curve);
        // The picture depends on the rate alone: compare with the first curve of the same rate.
        let same_rate = |other: &&Value| number(other, "rate") == number(curve, "rate");
        let first = curves.iter().find(same_rate).unwrap();
        for key in ["psnr", "ssim", "mask_disagreement", "depth_max_voxels"] {
            let [a, b] = [curve, first].map(|c| number_or_null(points(c).last().unwrap(), key));
            assert_eq!(a, b, "{key} of finished pictures");
        }
    }
    let all = || curves.iter().flat_map(points);
    let unfinished = all().filter(|p| number(&p["against_finished"], "mask_disagreement") > 0.0);
    assert!(unfinished.count() > 0, "no picture was looked at before it was finished");
    check_rates(curves);
    check_front(all());
    for name in ["error_time.md", "rates-gyroid-30x26x28-48x32-color.svg"] {
        assert!(folder.join(name).is_file(), "{name}");
    }
}

/// Compression costs more than arithmetic, and less at the higher rate.
fn check_rates(curves: &[Value]) {
    let rms = |source: &str, rate: f64| {
        let curve = curves.iter().find(|curve| number(curve, "rate") == rate).unwrap();
        number(&curve[source], "color_rms")
    };
    assert!(rms("compression", 2.0) > 10.0 * rms("compression", 8.0));
    assert!(rms("compression", 2.0) > 100.0 * rms("arithmetic", 2.0));
    // Half a step of 8 bits and what the f16 of the normal adds stay within one step.
    assert!(rms("arithmetic", 2.0).max(rms("arithmetic", 8.0)) <= 1.0);
}

/// No point has a better picture as early as one on the front.
fn check_front<'a>(points: impl Iterator<Item = &'a Value> + Clone) {
    let place = |p: &Value| (number(p, "ms"), number(p, "psnr"));
    let front: Vec<_> =
        points.clone().filter(|p| p["on_front"] == Value::Bool(true)).map(place).collect();
    assert!(!front.is_empty());
    for (ms, psnr) in front {
        let beaten = points.clone().map(place).find(|p| p.0 < ms && p.1 > psnr);
        assert_eq!(beaten, None, "beats {psnr} dB after {ms} ms");
    }
}

#[test]
fn an_unknown_volume_is_refused() {
    let folder = cli::folder("error_time_cli", "unknown");
    let out = folder.to_str().unwrap();
    let output = cli::run("error_time", &["--set", "test", "--volume", "nothing", "--out", out]);
    assert_eq!(output.status.code(), Some(1));
    assert!(cli::text(&output.stderr).contains("no volume"), "{}", cli::text(&output.stderr));
}
