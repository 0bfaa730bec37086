//! How a picture differs from the exact one, where the eye looks and elsewhere.

use gpu_testkit::image::{flip_map, mean_square_error, ssim_map};
use serde::{Deserialize, Serialize};

use crate::support::shown::Shown;

/// Parts of a picture.
pub const REGIONS: [&str; 3] = ["all", "fovea", "periphery"];

/// Means over a part of one picture.
#[derive(Clone, Copy, Debug)]
pub struct Sums {
    square_error: f64,
    ssim: f64,
    flip: f64,
}

/// One picture by one method.
#[derive(Clone, Debug)]
pub struct Picture {
    pub method: &'static str,
    /// In the order of [`REGIONS`].
    regions: [Sums; 3],
    /// Of the change since the frame before, if there was one.
    change_square_error: Option<f64>,
}

/// Means over frames. JSON: null for an infinite PSNR.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Measures {
    /// Of the mean squared error of all frames, in dB.
    pub psnr: Option<f64>,
    pub ssim: f64,
    pub flip: f64,
}

pub fn decibels(square_error: f64) -> Option<f64> {
    (square_error > 0.0).then(|| -10.0 * square_error.log10())
}

/// Mean over the pixels that `chosen` names; 0 without any.
fn mean(map: &[f64], chosen: impl Fn(usize) -> bool) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (_, value) in map.iter().enumerate().filter(|(i, _)| chosen(*i)) {
        (sum, count) = (sum + value, count + 1.0);
    }
    if count > 0.0 { sum / count } else { 0.0 }
}

fn square_errors(a: &[[f32; 3]], b: &[[f32; 3]]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| mean_square_error(a, b)).collect()
}

fn change(now: &[[f32; 3]], before: &[[f32; 3]]) -> Vec<f32> {
    now.as_flattened().iter().zip(before.as_flattened()).map(|(a, b)| a - b).collect()
}

impl Picture {
    /// `before`: this method's and the exact picture of the frame before.
    pub fn new(
        method: &'static str,
        (shown, exact): (&Shown, &Shown),
        before: Option<(&Shown, &Shown)>,
        fovea: &[bool],
        size: [u32; 2],
    ) -> Self {
        let size = size.map(|s| s as usize);
        let maps = [
            square_errors(&shown.colors, &exact.colors),
            ssim_map(&shown.luma(), &exact.luma(), size),
            flip_map(&shown.colors, &exact.colors, size),
        ];
        let sums = |chosen: &dyn Fn(usize) -> bool| Sums {
            square_error: mean(&maps[0], chosen),
            ssim: mean(&maps[1], chosen),
            flip: mean(&maps[2], chosen),
        };
        let change_square_error = before.map(|(old, old_exact)| {
            let changes = [(shown, old), (exact, old_exact)];
            let [a, b] = changes.map(|(now, before)| change(&now.colors, &before.colors));
            mean_square_error(&a, &b)
        });
        let regions = [sums(&|_| true), sums(&|i| fovea[i]), sums(&|i| !fovea[i])];
        Self { method, regions, change_square_error }
    }
}

/// Means over the pictures of one method, in the order of [`REGIONS`].
pub fn means(pictures: &[&Picture]) -> [Measures; 3] {
    let count = pictures.len() as f64;
    std::array::from_fn(|region| {
        let mean = |of: fn(&Sums) -> f64| {
            pictures.iter().map(|p| of(&p.regions[region])).sum::<f64>() / count
        };
        let psnr = decibels(mean(|s| s.square_error));
        Measures { psnr, ssim: mean(|s| s.ssim), flip: mean(|s| s.flip) }
    })
}

/// PSNR of the changes in dB; `None` for fewer than two frames, and where it is infinite.
pub fn tpsnr(pictures: &[&Picture]) -> Option<f64> {
    let changes: Vec<f64> = pictures.iter().filter_map(|p| p.change_square_error).collect();
    let mean = changes.iter().sum::<f64>() / changes.len().max(1) as f64;
    if changes.is_empty() { None } else { decibels(mean) }
}
