//! Power spectra of tiles: of every slice by the length of the frequency, and of every pixel over time. White noise has 1.

use std::f64::consts::TAU;

/// Frequencies in space that are told apart, the first one cycle per tile.
pub(crate) const SPACE_BINS: usize = 16;
/// Frequencies in time, the first one cycle in all slices.
pub(crate) const TIME_BINS: usize = 32;

/// Values with mean 0 and variance 1.
fn standardized(ranks: &[u16]) -> Vec<f64> {
    let count = ranks.len() as f64;
    let mean = ranks.iter().map(|&r| f64::from(r)).sum::<f64>() / count;
    let variance = ranks.iter().map(|&r| (f64::from(r) - mean).powi(2)).sum::<f64>() / count;
    ranks.iter().map(|&r| (f64::from(r) - mean) / variance.sqrt()).collect()
}

/// Complex spectrum of numbers (re, im), by the definition.
fn transform(numbers: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let n = numbers.len();
    let turns: Vec<[f64; 2]> = (0..n)
        .map(|i| {
            let (sin, cos) = (TAU * i as f64 / n as f64).sin_cos();
            [cos, -sin]
        })
        .collect();
    let frequency = |f: usize| {
        numbers.iter().enumerate().fold([0.0; 2], |sum: [f64; 2], (i, number)| {
            let turn = turns[f * i % n];
            let re = number[0] * turn[0] - number[1] * turn[1];
            let im = number[0] * turn[1] + number[1] * turn[0];
            [sum[0] + re, sum[1] + im]
        })
    };
    (0..n).map(frequency).collect()
}

fn power([re, im]: [f64; 2]) -> f64 {
    re * re + im * im
}

/// Mean power of a slice's frequencies, row by row from frequency 0 on.
pub(crate) fn plane(ranks: &[u16], edge: usize) -> Vec<f64> {
    let (values, slice) = (standardized(ranks), edge * edge);
    let mut sums = vec![0.0; slice];
    for slice in values.chunks_exact(slice) {
        let rows: Vec<_> = slice
            .chunks_exact(edge)
            .map(|row| transform(&row.iter().map(|&v| [v, 0.0]).collect::<Vec<_>>()))
            .collect();
        for x in 0..edge {
            let column = transform(&rows.iter().map(|row| row[x]).collect::<Vec<_>>());
            column.iter().enumerate().for_each(|(y, &v)| sums[x + edge * y] += power(v));
        }
    }
    let count = (values.len() / slice * slice) as f64;
    sums.iter().map(|sum| sum / count).collect()
}

/// Mean power of a slice by the length of the frequency in cycles per tile: 1, 2, .. [`SPACE_BINS`].
pub(crate) fn in_space(ranks: &[u16], edge: usize) -> Vec<f64> {
    let (mut sums, mut counts) = ([0.0; SPACE_BINS], [0.0; SPACE_BINS]);
    for (i, power) in plane(ranks, edge).into_iter().enumerate() {
        let [x, y] = [i % edge, i / edge].map(|f| f.min(edge - f) as f64);
        let bin = x.hypot(y).round() as usize;
        if (1..=SPACE_BINS).contains(&bin) {
            sums[bin - 1] += power;
            counts[bin - 1] += 1.0;
        }
    }
    (0..SPACE_BINS).map(|bin| sums[bin] / counts[bin]).collect()
}

/// Mean power of a pixel over time by the frequency in cycles per series: 1, 2, .. [`TIME_BINS`].
pub(crate) fn in_time(ranks: &[u16], slices: usize) -> Vec<f64> {
    let values = standardized(ranks);
    let slice = values.len() / slices;
    let mut sums = vec![0.0; TIME_BINS];
    for pixel in 0..slice {
        let series: Vec<_> = (0..slices).map(|z| [values[pixel + slice * z], 0.0]).collect();
        let spectrum = transform(&series);
        sums.iter_mut().zip(&spectrum[1..]).for_each(|(sum, &v)| *sum += power(v));
    }
    sums.iter().map(|sum| sum / values.len() as f64).collect()
}
