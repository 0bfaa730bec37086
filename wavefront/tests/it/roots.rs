//! The root search on the twin: what it returns is where the sides change, also where the field is exactly 0
//! at an end of the bracket.

use proptest::prelude::*;
use wavefront::cpu::cell::{Bracket, first_crossing, root_and_steps};

/// The polynomial in f64.
fn value(b: [f32; 4], s: f64) -> f64 {
    let [b0, b1, b2, b3] = b.map(f64::from);
    let r = 1.0 - s;
    r * r * r * b0 + 3.0 * r * r * s * b1 + 3.0 * r * s * s * b2 + s * s * s * b3
}

/// Whether the side is `inside_low` up to `root` and the other one from there on, within the bracket and
/// but for values that f32 cannot tell from 0.
fn is_crossing(b: [f32; 4], bracket: Bracket, inside_low: bool, root: f32) -> Result<(), String> {
    const WIDTH: f64 = 1.0 / 2_097_152.0;
    let rounding =
        32.0 * gpu_testkit::bounds::U * f64::from(b.iter().fold(0.0f32, |m, v| m.max(v.abs())));
    let [low, high, root] = [bracket.low, bracket.high, root].map(f64::from);
    for n in 0..=256 {
        let s = low + (high - low) * f64::from(n) / 256.0;
        let v = value(b, s);
        let before = s < root;
        let near = (s - root).abs() <= WIDTH || v.abs() <= rounding;
        if !near && ((v >= 0.0) == inside_low) != before {
            return Err(format!("{b:?} in {bracket:?}: root {root}, but {v} at {s}"));
        }
    }
    Ok(())
}

fn check(b: [f32; 4]) -> Result<u32, String> {
    let [inside_low, inside_high] = [b[0] >= 0.0, b[3] >= 0.0];
    let Some(bracket) = first_crossing(b, inside_low, inside_high) else { return Ok(0) };
    let (root, steps) = root_and_steps(b, bracket, inside_low);
    is_crossing(b, bracket, inside_low, root)?;
    Ok(steps)
}

#[test]
fn a_zero_at_an_end_is_not_taken_for_the_crossing() {
    for b in [
        [-0.687, 0.347, 0.056, 0.0],
        [0.0, 0.3, 0.2, -0.7],
        [0.0, 1.0, -3.0, -1.0],
        [-1.0, 3.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, -1.0],
        [-1.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, -1.0],
    ] {
        check(b).unwrap();
    }
}

#[test]
fn a_wrong_root_is_noticed() {
    let b = [-1.0, 3.0, 1.0, 0.0];
    let bracket = first_crossing(b, false, true).unwrap();
    let (root, _) = root_and_steps(b, bracket, false);
    is_crossing(b, bracket, false, root).unwrap();
    assert!(is_crossing(b, bracket, false, 1.0).is_err());
    assert!(is_crossing(b, bracket, false, 0.0).is_err());
}

proptest! {
    #![proptest_config(gpu_testkit::property(20_000))]

    #[test]
    fn the_root_is_where_the_sides_change(
        b in prop::array::uniform4(prop_oneof![
            (-4i32..5).prop_map(|v| v as f32 * 0.25),
            -1.0f32..1.0,
            Just(0.0f32),
            Just(1e-6f32),
            Just(-1e-6f32),
        ]),
    ) {
        let steps = check(b).map_err(TestCaseError::fail)?;
        prop_assert!(steps < 48, "{steps} steps for {b:?}");
    }
}
