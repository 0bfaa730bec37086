//! Makes the tiles of `wavefront::BlueNoise` from their definition, and shows their spectrum.
//!
//! `cargo run -p wavefront --example blue_noise -- DIR` writes `blue_noise.u16`, the file that the crate has in `data`, and
//! `blue_noise.png`: a slice, the pixels of it that a density of 0.1 draws, the mean power of the slices' frequencies with
//! frequency 0 in the middle, and the power over time, from one cycle in all slices on the left to one in two slices;
//! the line is white noise.

#![allow(clippy::print_stdout, reason = "a program")]

mod spectrum;
mod void_and_cluster;

use std::error::Error;
use std::path::PathBuf;

use image::{GrayImage, Luma};
use void_and_cluster::{SEED, Shape, ranks};
use wavefront::BlueNoise;

const EDGE: usize = BlueNoise::EDGE as usize;
const SLICES: usize = BlueNoise::SLICES as usize;

/// Pixels of the picture for a pixel of a tile, and between its parts.
const ZOOM: u32 = 6;
const GAP: u32 = 8;

/// Powers are shown from 0 to this.
const MOST_POWER: f64 = 2.0;

fn main() -> Result<(), Box<dyn Error>> {
    let dir = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".into()));
    let ranks = ranks(Shape { edge: EDGE, slices: SLICES }, SEED);
    let bytes: Vec<u8> = ranks.iter().flat_map(|rank| rank.to_le_bytes()).collect();
    std::fs::write(dir.join("blue_noise.u16"), &bytes)?;
    picture(&ranks).save(dir.join("blue_noise.png"))?;
    for (name, power) in
        [("space", spectrum::in_space(&ranks, EDGE)), ("time", spectrum::in_time(&ranks, SLICES))]
    {
        let power: Vec<_> = power.iter().map(|p| format!("{p:.3}")).collect();
        println!("{name}: {}", power.join(" "));
    }
    Ok(())
}

fn picture(ranks: &[u16]) -> GrayImage {
    let part = EDGE as u32 * ZOOM;
    let mut picture = GrayImage::from_pixel(4 * part + 3 * GAP, part, Luma([255]));
    let share = |i: usize| f64::from(ranks[i]) / f64::from(BlueNoise::RANKS);
    let plane = spectrum::plane(ranks, EDGE);
    let middle = |i: usize| (i % EDGE + EDGE / 2) % EDGE + EDGE * ((i / EDGE + EDGE / 2) % EDGE);
    let time = spectrum::in_time(ranks, SLICES);
    let bar = |i: usize| {
        let height = (1.0 - (i / EDGE) as f64 / EDGE as f64) * MOST_POWER;
        let line = i / EDGE == EDGE / 2;
        let under = height <= time[i % EDGE];
        if under { 0.25 } else { f64::from(u8::from(!line)) }
    };
    let parts: [&dyn Fn(usize) -> f64; 4] = [
        &share,
        &|i| if share(i) < 0.1 { 0.0 } else { 1.0 },
        &|i| plane[middle(i)] / MOST_POWER,
        &bar,
    ];
    for (n, value) in (0..).zip(parts) {
        let left = n * (part + GAP);
        for (x, y) in (0..part).flat_map(|y| (0..part).map(move |x| (x, y))) {
            let i = (x / ZOOM) as usize + EDGE * (y / ZOOM) as usize;
            let level = (255.0 * value(i).clamp(0.0, 1.0)).round() as u8;
            picture.put_pixel(left + x, y, Luma([level]));
        }
    }
    picture
}
