//! Twin of the network's kernels: dense convolutions over a whole picture, with the same roundings to f16, and the head of
//! a pixel.

use half::f16;

use crate::weights::{LAYERS, Weights};

/// Channels that the network reads at every quad of 2x2 pixels; [`super::features`] says what they are.
pub const FEATURES: usize = 16;

/// Numbers that the head reads of a pixel's own candidates: coverage and coverage N.V of each.
pub const OWN: usize = 8;

/// Numbers that the network gives for every pixel: logits of the candidates in the order of [`crate::Source`],
/// then residuals of coverage and N.V.
pub const OUTPUTS: usize = 6;

/// A map of channels, channel fastest, then x.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Width and height.
    pub size: [usize; 2],
    /// Channels of a texel.
    pub channels: usize,
    /// The numbers.
    pub values: Vec<f32>,
}

fn half(v: f32) -> f32 {
    f16::from_f32(v).to_f32()
}

impl Map {
    /// All zero.
    pub fn zero(size: [usize; 2], channels: usize) -> Self {
        Self { size, channels, values: vec![0.0; size[0] * size[1] * channels] }
    }

    /// The channels of a texel.
    pub fn texel(&self, x: usize, y: usize) -> &[f32] {
        let first = (x + self.size[0] * y) * self.channels;
        &self.values[first..first + self.channels]
    }

    fn texel_mut(&mut self, x: usize, y: usize) -> &mut [f32] {
        let first = (x + self.size[0] * y) * self.channels;
        &mut self.values[first..first + self.channels]
    }

    /// Averages of 2x2 texels; the size is even.
    fn pooled(&self) -> Self {
        let mut map = Self::zero(self.size.map(|s| s / 2), self.channels);
        for y in 0..map.size[1] {
            for x in 0..map.size[0] {
                for c in 0..self.channels {
                    let at = |dx: usize, dy: usize| self.texel(2 * x + dx, 2 * y + dy)[c];
                    let sum = (at(0, 0) + at(1, 0)) + (at(0, 1) + at(1, 1));
                    map.texel_mut(x, y)[c] = half(0.25 * sum);
                }
            }
        }
        map
    }

    /// Bilinear interpolation at a texel of twice the size, clamped at the edges: the channels.
    fn interpolated(&self, finer: [usize; 2]) -> impl Iterator<Item = f32> + '_ {
        let place: [[(usize, f32); 2]; 2] = std::array::from_fn(|a| {
            let upper = finer[a].div_ceil(2);
            let share = if finer[a].is_multiple_of(2) { 0.75 } else { 0.25 };
            let last = self.size[a] - 1;
            [(upper.saturating_sub(1), 1.0 - share), (upper.min(last), share)]
        });
        (0..self.channels).map(move |c| {
            let row = |y: usize| {
                let [(x0, w0), (x1, w1)] = place[0];
                self.texel(x0, y)[c] * w0 + self.texel(x1, y)[c] * w1
            };
            let [(y0, w0), (y1, w1)] = place[1];
            row(y0) * w0 + row(y1) * w1
        })
    }

    /// The map at twice the size.
    fn enlarged(&self) -> Self {
        let mut map = Self::zero(self.size.map(|s| 2 * s), self.channels);
        for y in 0..map.size[1] {
            for x in 0..map.size[0] {
                for (to, from) in map.texel_mut(x, y).iter_mut().zip(self.interpolated([x, y])) {
                    *to = half(from);
                }
            }
        }
        map
    }

    /// Both maps' channels.
    fn joined(&self, other: &Self) -> Self {
        let mut map = Self::zero(self.size, self.channels + other.channels);
        for y in 0..self.size[1] {
            for x in 0..self.size[0] {
                let texel = map.texel_mut(x, y);
                texel[..self.channels].copy_from_slice(self.texel(x, y));
                texel[self.channels..].copy_from_slice(other.texel(x, y));
            }
        }
        map
    }

    /// A layer's convolution, zero beyond the edges, before the activation.
    fn convolved(&self, weights: &Weights, index: usize) -> Self {
        let (layer, own) = (LAYERS[index], weights.layer(index));
        let mut map = Self::zero(self.size, layer.outputs);
        let reach = layer.taps / 2;
        let weight: Vec<f32> = own.weight.iter().map(|w| w.to_f32()).collect();
        for y in 0..self.size[1] {
            for x in 0..self.size[0] {
                let mut sums: Vec<f32> = own.bias.iter().map(|b| b.to_f32()).collect();
                for tap in 0..layer.taps * layer.taps {
                    let (dx, dy) = (tap % layer.taps, tap / layer.taps);
                    let (from_x, from_y) = (x + dx, y + dy);
                    let outside = |v: usize, size: usize| v < reach || v - reach >= size;
                    if outside(from_x, self.size[0]) || outside(from_y, self.size[1]) {
                        continue;
                    }
                    let texel = self.texel(from_x - reach, from_y - reach);
                    for (output, sum) in sums.iter_mut().enumerate() {
                        for (input, value) in texel.iter().enumerate() {
                            let place =
                                (output * layer.inputs + input) * layer.taps * layer.taps + tap;
                            *sum += weight[place] * value;
                        }
                    }
                }
                map.texel_mut(x, y).copy_from_slice(&sums);
            }
        }
        map
    }

    /// Negative numbers become 0, the others are rounded to f16.
    fn activated(mut self) -> Self {
        self.values.iter_mut().for_each(|v| *v = half(v.max(0.0)));
        self
    }
}

/// The convolutions on the features of a picture's quads, whose width and height are even: what the head reads at a half of
/// the picture's resolution.
pub fn network(weights: &Weights, features: &Map) -> Map {
    let layer = |map: &Map, index: usize| map.convolved(weights, index).activated();
    let mut rounded = features.clone();
    rounded.values.iter_mut().for_each(|v| *v = half(*v));
    let e0 = layer(&rounded, 0);
    let e1 = layer(&layer(&e0.pooled(), 1), 2);
    layer(&e0.joined(&e1.enlarged()), 3)
}

/// What the network says about a pixel: from the map of [`network`] and the pixel's own candidates.
pub fn head(weights: &Weights, map: &Map, pixel: [usize; 2], own: [f32; OWN]) -> [f32; OUTPUTS] {
    let read: Vec<f32> = map.interpolated(pixel).chain(own).collect();
    let mut hidden = dense(weights, 4, &read);
    hidden.iter_mut().for_each(|v| *v = v.max(0.0));
    let outputs = dense(weights, 5, &hidden);
    std::array::from_fn(|i| outputs[i])
}

/// A layer without neighbours at one pixel.
fn dense(weights: &Weights, index: usize, inputs: &[f32]) -> Vec<f32> {
    let own = weights.layer(index);
    let rows = own.weight.chunks_exact(inputs.len()).zip(&own.bias);
    rows.map(|(row, bias)| {
        let products = row.iter().zip(inputs).map(|(w, v)| w.to_f32() * v);
        bias.to_f32() + products.sum::<f32>()
    })
    .collect()
}
