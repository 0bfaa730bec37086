//! Formulas that several groups use.

use std::f64::consts::TAU;

/// Distance from a point.
pub fn distance(p: [f64; 3], center: [f64; 3]) -> f64 {
    (0..3).map(|a| (p[a] - center[a]).powi(2)).sum::<f64>().sqrt()
}

/// A smooth field of waves of about 9 voxels, from -1.5 to 1.5.
pub fn gyroid([x, y, z]: [f64; 3]) -> f64 {
    let wave = |v: f64| (v * TAU / 9.0).sin_cos();
    let [(sx, cx), (sy, cy), (sz, cz)] = [x, y, z].map(wave);
    sx * cy + sy * cz + sz * cx
}

/// A number in [0, 1) that looks random, the same for the same voxel and seed.
pub fn hash([x, y, z]: [f64; 3], seed: u32) -> f64 {
    let mut h = seed.wrapping_mul(0x9e37_79b9);
    for v in [x, y, z] {
        h = (h ^ v as u32).wrapping_mul(0x85eb_ca6b);
        h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
        h ^= h >> 16;
    }
    f64::from(h >> 8) / 16_777_216.0
}

/// +1 and -1 by turns.
pub fn checkerboard([x, y, z]: [f64; 3]) -> f64 {
    if (x + y + z) % 2.0 == 0.0 { 1.0 } else { -1.0 }
}
