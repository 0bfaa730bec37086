//! Twin of the network's kernels: dense convolutions over a whole picture, with the same roundings to f16.

use half::f16;

use crate::weights::{LAYERS, Weights};

/// Channels that the network reads at every pixel; [`super::features`] says what they are.
pub const FEATURES: usize = 16;

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

    /// Bilinear interpolation at twice the size, clamped at the edges.
    fn enlarged(&self) -> Self {
        let mut map = Self::zero(self.size.map(|s| 2 * s), self.channels);
        for y in 0..map.size[1] {
            for x in 0..map.size[0] {
                let place: [[(usize, f32); 2]; 2] = std::array::from_fn(|a| {
                    let finer = [x, y][a];
                    let upper = finer.div_ceil(2);
                    let share = if finer.is_multiple_of(2) { 0.75 } else { 0.25 };
                    let last = self.size[a] - 1;
                    [(upper.saturating_sub(1), 1.0 - share), (upper.min(last), share)]
                });
                for c in 0..self.channels {
                    let row = |y: usize| {
                        let [(x0, w0), (x1, w1)] = place[0];
                        self.texel(x0, y)[c] * w0 + self.texel(x1, y)[c] * w1
                    };
                    let [(y0, w0), (y1, w1)] = place[1];
                    map.texel_mut(x, y)[c] = half(row(y0) * w0 + row(y1) * w1);
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

/// The network on a picture's features, whose width and height are multiples of 4.
pub fn network(weights: &Weights, features: &Map) -> Map {
    let layer = |map: &Map, index: usize| map.convolved(weights, index).activated();
    let mut rounded = features.clone();
    rounded.values.iter_mut().for_each(|v| *v = half(*v));
    let e0 = layer(&rounded, 0);
    let e1 = layer(&layer(&e0.pooled(), 1), 2);
    let e2 = layer(&layer(&e1.pooled(), 3), 4);
    let d1 = layer(&e1.joined(&e2.enlarged()), 5);
    let d0 = layer(&e0.joined(&d1.enlarged()), 6);
    d0.convolved(weights, 7)
}
