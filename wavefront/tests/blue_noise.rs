//! The tiles are what their program makes, blue in space and in time, toroidal, and give masks of the promised density.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]
#![allow(clippy::print_stdout, reason = "measured numbers, shown with --nocapture")]

#[path = "../examples/blue_noise/spectrum.rs"]
mod spectrum;
#[path = "../examples/blue_noise/void_and_cluster.rs"]
mod void_and_cluster;

use gpu_testkit::property;
use proptest::prelude::*;
use spectrum::{SPACE_BINS, TIME_BINS, in_space, in_time};
use void_and_cluster::{SEED, Shape, ranks};
use wavefront::cpu::sampling_mask::{margin, not_drawn};
use wavefront::{BlueNoise, Foveation, SamplingParams};

const EDGE: usize = BlueNoise::EDGE as usize;
const SLICE: usize = BlueNoise::RANKS as usize;
const SLICES: usize = BlueNoise::SLICES as usize;

#[test]
fn the_tiles_are_what_the_program_makes() {
    let made = ranks(Shape { edge: EDGE, slices: SLICES }, SEED);
    assert_eq!(made.len(), BlueNoise::tiles().ranks().len());
    assert!(made == BlueNoise::tiles().ranks(), "other tiles");
    assert!(ranks(Shape { edge: EDGE, slices: SLICES }, SEED + 1) != made, "the seed is unused");
}

#[test]
fn every_slice_has_every_rank_once() {
    for slice in BlueNoise::tiles().ranks().chunks_exact(SLICE) {
        let mut seen = vec![0; SLICE];
        slice.iter().for_each(|&rank| seen[usize::from(rank)] += 1);
        assert!(seen.iter().all(|&n| n == 1));
    }
}

/// The largest power of frequencies below an eighth of the sampling rate, in space and in time; white noise has 1.
fn low_power(ranks: &[u16]) -> [f64; 2] {
    let low = |power: &[f64]| power[..power.len() / 4 - 1].iter().copied().fold(0.0, f64::max);
    [low(&in_space(ranks, EDGE)), low(&in_time(ranks, SLICES))]
}

#[test]
fn low_frequencies_are_suppressed_in_space_and_in_time() {
    let tiles = BlueNoise::tiles().ranks();
    let [space, time] = low_power(tiles);
    println!("largest power of low frequencies: {space:.4} in space, {time:.4} in time");
    assert!(space < 0.01 && time < 0.1, "{space} {time}");
    // The same ranks where they do not belong: other pixels, another order of the slices.
    let mut moved = tiles.to_vec();
    moved
        .chunks_exact_mut(SLICE)
        .enumerate()
        .for_each(|(z, slice)| slice.rotate_left(97 * z % SLICE));
    let [space, time] = low_power(&moved);
    assert!(space < 0.01 && time > 0.5, "{space} {time}");
    let mut mixed = tiles.to_vec();
    for slice in mixed.chunks_exact_mut(SLICE) {
        let old = slice.to_vec();
        (0..SLICE).for_each(|i| slice[i] = old[i * 397 % SLICE]);
    }
    let [space, time] = low_power(&mixed);
    assert!(space > 0.5 && time < 0.1, "{space} {time}");
    assert_eq!((SPACE_BINS, TIME_BINS), (EDGE / 2, SLICES / 2));
}

/// Pixels of a mask keep as far from each other over the edges of a tile as within it.
#[test]
fn tiles_are_toroidal() {
    let tiles = BlueNoise::tiles();
    for pixel in [[0, 0], [5, 31], [17, 2]] {
        let [x, y] = pixel;
        for other in [[x + 32, y], [x, y + 64], [x + 320, y + 32]] {
            assert_eq!(tiles.rank(pixel, 3), tiles.rank(other, 3 + 64));
        }
    }
    // Of the 5 % with the lowest ranks: the mean square distance to the nearest one, in the picture of repeated tiles,
    // of pixels at an edge and of the others.
    let (mut sums, mut counts) = ([0.0; 2], [0.0; 2]);
    for slice in 0..BlueNoise::SLICES.into() {
        let sampled = |x: i32, y: i32| {
            let pixel = [x, y].map(|v| v.rem_euclid(BlueNoise::EDGE as i32) as u32);
            tiles.rank(pixel, slice) < BlueNoise::RANKS / 20
        };
        for (x, y) in
            (0..32).flat_map(|y| (0..32).map(move |x| (x, y))).filter(|&(x, y)| sampled(x, y))
        {
            let others = (-9..=9).flat_map(|dy| (-9..=9).map(move |dx| (dx, dy)));
            let others = others.filter(|&(dx, dy)| (dx, dy) != (0, 0) && sampled(x + dx, y + dy));
            let nearest = others.map(|(dx, dy)| dx * dx + dy * dy).min().unwrap_or(162);
            let edge = usize::from(x.min(y) >= 2 && x.max(y) < 30);
            sums[edge] += f64::from(nearest);
            counts[edge] += 1.0;
        }
    }
    let [edge, inside] = [0, 1].map(|i: usize| sums[i] / counts[i]);
    println!("mean square distance {edge:.2} at edges, {inside:.2} inside");
    assert!((edge / inside - 1.0).abs() < 0.1, "{edge} {inside}");
}

#[derive(Clone, Debug)]
struct Case {
    size: [u32; 2],
    frame: u64,
    foveation: Foveation,
    pass: u32,
}

fn cases() -> impl Strategy<Value = Case> {
    let foveation = (
        [-0.2..1.2f32, -0.2..1.2f32],
        prop_oneof![Just(0.0), 0.001..0.1f32],
        prop_oneof![Just(0.0), 0.003..0.2f32],
        1..65u32,
    )
        .prop_map(|(gaze, sigma, base_density, passes)| Foveation {
            gaze,
            sigma,
            base_density,
            passes,
        });
    ([1..400u32, 1..300u32], 0..1000u64, foveation, 0..70u32)
        .prop_map(|(size, frame, foveation, pass)| Case { size, frame, foveation, pass })
}

proptest! {
    #![proptest_config(property(200))]

    /// The number of rays of a mask is the sum of their probabilities, within four standard deviations of
    /// independent draws (blue noise is better) and half a rank per pixel for the rounding to ranks.
    #[test]
    fn masks_have_the_promised_density(case in cases()) {
        let Case { size, frame, foveation, pass } = case;
        let params = SamplingParams::new(&foveation, size, frame, pass);
        let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
        let (mut drawn, mut expected, mut variance, mut first) = (0.0, 0.0, 0.0, 0.0);
        for pixel in pixels {
            let left = f64::from(not_drawn(&params, pixel));
            let all = pass + 1 >= foveation.passes;
            let tau = if all { 1.0 } else { 1.0 - left.powi(pass as i32 + 1) };
            drawn += f64::from(u8::from(margin(BlueNoise::tiles(), &params, pixel) > 0.0));
            expected += tau;
            variance += tau * (1.0 - tau);
            first += 1.0 - left;
        }
        let count = f64::from(size[0] * size[1]);
        let bound = 4.0 * variance.sqrt() + 0.5 * count / f64::from(BlueNoise::RANKS) + 1.0;
        prop_assert!((drawn - expected).abs() <= bound, "{drawn} {expected} +- {bound}");
        let mean = foveation.mean_density(size);
        prop_assert!((first / count - mean).abs() < 1e-4, "{} {mean}", first / count);
    }

    /// A frame's masks grow, and the last has every ray.
    #[test]
    fn masks_grow_until_they_have_every_ray(case in cases()) {
        let Case { size, frame, foveation, .. } = case;
        let size = size.map(|s| s.min(64));
        let mask = |pass| -> Vec<bool> {
            let params = SamplingParams::new(&foveation, size, frame, pass);
            let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
            pixels.map(|pixel| margin(BlueNoise::tiles(), &params, pixel) > 0.0).collect()
        };
        let mut last = mask(0);
        for pass in 1..foveation.passes {
            let next = mask(pass);
            // Where rounding may turn the order of two passes, the kernel keeps what the first one drew.
            let lost = last.iter().zip(&next).filter(|&(&a, &b)| a && !b).count();
            prop_assert!(lost * 1000 <= last.len(), "pass {pass}: {lost} lost");
            last = next;
        }
        prop_assert!(last.iter().all(|&drawn| drawn));
    }
}

/// Whole tiles of one density have it to half a rank.
#[test]
fn tiles_have_the_density_to_half_a_rank() {
    for base_density in [0.0, 0.01, 0.03, 0.07, 0.1, 0.5, 0.9997, 1.0] {
        for frame in 0..64 {
            let foveation = Foveation { sigma: 0.0, base_density, ..Foveation::default() };
            let params = SamplingParams::new(&foveation, [32, 32], frame, 0);
            let pixels = (0..32).flat_map(|y| (0..32).map(move |x| [x, y]));
            let drawn = pixels.filter(|&p| margin(BlueNoise::tiles(), &params, p) > 0.0).count();
            let expected = f64::from(base_density) * SLICE as f64;
            assert!((drawn as f64 - expected).abs() <= 0.501, "{drawn} {expected}");
        }
    }
}
