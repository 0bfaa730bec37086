//! Large, small and mixed magnitudes.

use super::shapes::{distance, gyroid, hash};
use crate::suite::case::Case;

const GROUP: &str = "scale";
const DIMS: [u32; 3] = [22, 19, 24];

pub fn cases() -> Vec<Case> {
    let mut cases: Vec<Case> = [-80, -40, 40, 80].map(power).into();
    cases.extend([
        Case::new(GROUP, "a signal of 1 on 1e6", DIMS, |p| 1e6 + gyroid(p)).at(&[
            1e6,
            1_000_000.5,
            1_000_000.06,
        ]),
        Case::new(GROUP, "whole numbers around 30000, as in CT", DIMS, |p| {
            (30_000.0 + 40.0 * gyroid(p)).round()
        })
        .at(&[30_000.0, 30_010.5, 29_999.998]),
        Case::new(GROUP, "magnitudes from 2^-20 to 2^20 in a block", DIMS, |p| {
            let sign = if hash(p, 19) < 0.5 { -1.0 } else { 1.0 };
            sign * 2f64.powf(40.0 * hash(p, 23) - 20.0)
        })
        .at(&[0.0, 1.0, -1e-4, 1e5]),
        Case::new(GROUP, "blocks of magnitudes from 2^-90 to 2^90 side by side", DIMS, |p| {
            let block = p.map(|v| (v / 4.0).floor());
            gyroid(p) * 2f64.powf((180.0 * hash(block, 29)).floor() - 90.0)
        })
        .at(&[0.0, 1.0, 1e-20, -1e20]),
        Case::new(GROUP, "subnormal samples, which decode as zeros", DIMS, |p| {
            gyroid(p) * 2f64.powi(-130)
        })
        .at(&[0.0, 1e-30, -1e-30])
        .none_hit(),
        Case::new(GROUP, "subnormal blocks beside ordinary ones", DIMS, |p| {
            let tiny = (p[0] / 4.0).floor() % 2.0 == 0.0;
            gyroid(p) * if tiny { 2f64.powi(-130) } else { 1.0 }
        })
        .at(&[0.0, 1e-30, 0.25]),
        Case::new(GROUP, "sentinels of 1e30 beside ordinary values", DIMS, |p| {
            if hash(p, 31) < 0.02 { 1e30 } else { gyroid(p) }
        })
        .at(&[0.0, 1.0, 1e29]),
        Case::new(GROUP, "a ball in sentinels of -1e30", DIMS, |p| {
            let inside = 8.0 - distance(p, [10.4, 9.3, 11.7]);
            if inside > 0.0 { inside } else { -1e30 }
        })
        .at(&[0.5, 4.0, -1e10]),
        limits("unsigned bytes at their limits", 0.0, 255.0, &[0.0, 1.0, 254.5, 255.0]),
        limits("16-bit integers at their limits", -32_768.0, 32_767.0, &[-32_768.0, 0.5, 32_767.0]),
        limits(
            "32-bit integers at their limits",
            -2_147_483_648.0,
            2_147_483_647.0,
            &[0.0, 2_147_483_648.0, -2_147_483_648.0],
        ),
        limits(
            "around 2^24, where f32 skips integers",
            16_777_214.0,
            16_777_218.0,
            &[16_777_215.0, 16_777_216.0, 16_777_218.0],
        ),
    ]);
    cases
}

fn power(exponent: i32) -> Case {
    let factor = 2f64.powi(exponent);
    Case::new(GROUP, format!("a gyroid times 2^{exponent}"), DIMS, move |p| factor * gyroid(p))
        .at(&[0.0, (0.3 * factor) as f32, (-0.7 * factor) as f32])
}

/// Random runs of the least, the largest and numbers between.
fn limits(name: &str, low: f64, high: f64, isovalues: &[f32]) -> Case {
    Case::new(GROUP, name, DIMS, move |p| match (4.0 * hash(p, 37)) as u32 {
        0 => low,
        1 => high,
        _ => (low + (high - low) * hash(p, 41)).round(),
    })
    .at(isovalues)
}
