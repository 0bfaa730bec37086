//! A field that is cheap enough for billions of samples.

use crate::field::{Field, Formula, centre, extent, longest};
use crate::math::Real;
use crate::noise::lattice_value;

/// Two pure fluids, 0 below and 255 above, and a layer between them in which they mix, after half of
/// the volume: as in a late step of a simulation of the Richtmyer-Meshkov instability, stored in bytes.
///
/// With u the height above the middle over a quarter of the volume's height, n octaves of value noise
/// within [-1, 1], and S the quintic smooth step:
///
/// `f = 255 S(1/2 + 2 u + 3/2 n)`
///
/// The octaves' lattices have powers of two voxels, from a sixteenth of the longest extent down to 8,
/// so that a block lies in one cell of each: a block needs 8 hashes per octave instead of 512.
#[derive(Clone, Debug)]
pub struct MixingLayer {
    centre_z: f64,
    per_half: f64,
    octaves: Vec<Octave>,
}

/// One lattice of values.
#[derive(Clone, Debug)]
struct Octave {
    per_spacing: f64,
    amplitude: f64,
    seed: u32,
}

/// Smallest lattice spacing in voxels.
const FINEST: u32 = 8;
/// Amplitude of an octave over that of the next coarser one.
const GAIN: f64 = 0.6;
const HEIGHT_FACTOR: f64 = 2.0;
const NOISE_FACTOR: f64 = 1.5;
const HIGHEST: f64 = 255.0;

impl MixingLayer {
    /// Seed 1.
    #[must_use]
    pub fn new(dims: [u32; 3]) -> Self {
        Self::with_seed(dims, 1)
    }

    /// As [`MixingLayer::new`] with another seed.
    #[must_use]
    pub fn with_seed(dims: [u32; 3], seed: u32) -> Self {
        let coarsest = ((longest(dims) as u32 + 1) / 16).next_power_of_two().max(FINEST);
        let count = (coarsest / FINEST).ilog2() + 1;
        let amplitudes: Vec<f64> =
            std::iter::successors(Some(1.0), |a| Some(a * GAIN)).take(count as usize).collect();
        let total: f64 = amplitudes.iter().sum();
        let octaves = (0..count)
            .zip(amplitudes)
            .map(|(k, amplitude)| Octave {
                per_spacing: 1.0 / f64::from(coarsest >> k),
                amplitude: amplitude / total,
                seed: seed.wrapping_mul(64).wrapping_add(k),
            })
            .collect();
        let quarter = extent(dims)[2].max(1.0) / 4.0;
        Self { centre_z: centre(dims)[2], per_half: 1.0 / quarter, octaves }
    }

    /// The height above the middle, -1 to 1 in the layer.
    fn height<T: Real>(&self, z: T) -> T {
        z.plus(-self.centre_z).scale(self.per_half)
    }

    fn fluid<T: Real>(height: T, noise: T) -> T {
        let mixture = height.scale(HEIGHT_FACTOR) + noise.scale(NOISE_FACTOR);
        mixture.plus(0.5).smoothstep().scale(HIGHEST)
    }
}

impl Octave {
    /// Values at the corners of a lattice cell, at x + 2y + 4z.
    fn corners(&self, cell: [f64; 3]) -> [f64; 8] {
        let cell = cell.map(|c| c as i64 as u32);
        std::array::from_fn(|corner| {
            let offset = [corner & 1, corner >> 1 & 1, corner >> 2];
            let position = [0, 1, 2].map(|a| cell[a].wrapping_add(offset[a] as u32));
            self.amplitude * lattice_value(position, self.seed)
        })
    }

    /// Lattice cell of a coordinate, and the weight of the cell's upper side.
    fn weight<T: Real>(&self, x: T) -> (f64, T) {
        let scaled = x.scale(self.per_spacing);
        let cell = scaled.value().floor();
        (cell, scaled.plus(-cell).smoothstep())
    }
}

fn mix<T: Real>(a: T, b: T, weight: T) -> T {
    a + (b - a) * weight
}

/// Values on the four edges along z.
fn along_z<T: Real>(corners: &[f64; 8], weight: T) -> [T; 4] {
    std::array::from_fn(|i| mix(T::from(corners[i]), T::from(corners[i + 4]), weight))
}

fn along_y<T: Real>(edges: [T; 4], weight: T) -> [T; 2] {
    [mix(edges[0], edges[2], weight), mix(edges[1], edges[3], weight)]
}

impl Formula for MixingLayer {
    fn at<T: Real>(&self, p: [T; 3]) -> T {
        let mut noise = T::from(0.0);
        for octave in &self.octaves {
            let [(x, wx), (y, wy), (z, wz)] = p.map(|v| octave.weight(v));
            let [a, b] = along_y(along_z(&octave.corners([x, y, z]), wz), wy);
            noise = noise + mix(a, b, wx);
        }
        Self::fluid(self.height(p[2]), noise)
    }
}

impl Field for MixingLayer {
    fn value(&self, p: [f64; 3]) -> f64 {
        self.at(p)
    }

    fn gradient(&self, p: [f64; 3]) -> Option<[f64; 3]> {
        Some(self.gradient_at(p))
    }

    fn name(&self) -> &'static str {
        "mixing-layer"
    }

    /// Equal parts of both fluids.
    fn suggested_isovalue(&self) -> f64 {
        HIGHEST / 2.0
    }

    fn block(&self, origin: [u32; 3]) -> [f32; 64] {
        let position = |axis: usize| [0, 1, 2, 3].map(|i| f64::from(origin[axis] + i));
        let (xs, ys, zs) = (position(0), position(1), position(2));
        let mut noise = [0.0; 64];
        for octave in &self.octaves {
            let [wx, wy, wz] = [xs, ys, zs].map(|v| v.map(|v| octave.weight(v).1));
            let corners = octave.corners([xs, ys, zs].map(|v| octave.weight(v[0]).0));
            for z in 0..4 {
                let edges = along_z(&corners, wz[z]);
                for y in 0..4 {
                    let [a, b] = along_y(edges, wy[y]);
                    for x in 0..4 {
                        noise[x + 4 * y + 16 * z] += mix(a, b, wx[x]);
                    }
                }
            }
        }
        let heights = zs.map(|z| self.height(z));
        std::array::from_fn(|i| Self::fluid(heights[i / 16], noise[i]) as f32)
    }

    fn constant(&self, low: [f64; 3], high: [f64; 3]) -> Option<f64> {
        // A little beyond the layer, where no rounding of the noise matters.
        if self.height(high[2]) < -1.01 {
            Some(0.0)
        } else {
            (self.height(low[2]) > 1.01).then_some(HIGHEST)
        }
    }
}
