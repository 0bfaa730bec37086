//! Deterministic noise from an integer hash: no state, no tables, the same on every platform.

use crate::math::Real;

/// Scrambles 32 bits (two multiply-xorshift rounds; the constants are those that C. Wellons' search
/// for low-bias integer hashes published as `lowbias32`).
fn scramble(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// A number in [-1, 1] for every point of the integer lattice.
pub(crate) fn lattice_value(position: [u32; 3], seed: u32) -> f64 {
    let keys = [0, 1, 2].map(|axis| position[axis].wrapping_mul(MULTIPLIERS[axis]));
    f64::from(scramble(keys[0] ^ keys[1] ^ keys[2] ^ scramble(seed))) * (2.0 / 4_294_967_295.0)
        - 1.0
}

/// What the coordinates of a lattice point are multiplied with before they are mixed.
const MULTIPLIERS: [u32; 3] = [0x9e37_79b1, 0x85eb_ca77, 0xc2b2_ae3d];

/// The cube of the integer lattice that holds a position.
struct Cell<T> {
    /// Position in the cube, each coordinate in [0, 1).
    fraction: [T; 3],
    /// Contribution of the lower and the upper lattice coordinate of each axis to a corner's hash.
    keys: [[u32; 2]; 3],
}

impl<T: Real> Cell<T> {
    fn new(p: [T; 3], seed: u32) -> Self {
        let mut fraction = p;
        let mut keys = [[0; 2]; 3];
        for axis in 0..3 {
            let floor = p[axis].value().floor();
            fraction[axis] = p[axis].plus(-floor);
            // Wraps for coordinates beyond 32 bits: the noise then repeats.
            let key = (floor as i64 as u32).wrapping_mul(MULTIPLIERS[axis]);
            keys[axis] = [key, key.wrapping_add(MULTIPLIERS[axis])];
        }
        keys[0] = keys[0].map(|key| key ^ scramble(seed));
        Cell { fraction, keys }
    }

    fn hash(&self, corner: [usize; 3]) -> u32 {
        scramble(self.keys[0][corner[0]] ^ self.keys[1][corner[1]] ^ self.keys[2][corner[2]])
    }

    /// Corner values blended with the smooth step along each axis.
    fn blend(&self, at: impl Fn([usize; 3]) -> T) -> T {
        let weight = self.fraction.map(T::smoothstep);
        let mix = |a: T, b: T, w: T| a + (b - a) * w;
        let row = |y, z| mix(at([0, y, z]), at([1, y, z]), weight[0]);
        let face = |z| mix(row(0, z), row(1, z), weight[1]);
        mix(face(0), face(1), weight[2])
    }
}

/// Gradient noise on the integer lattice (K. Perlin, "Improving noise", SIGGRAPH 2002, with
/// gradients of independent components in [-1, 1] instead of twelve directions): zero on the
/// lattice, root mean square about 0.192, within +-1.5.
pub(crate) fn gradient_noise<T: Real>(p: [T; 3], seed: u32) -> T {
    let cell = Cell::new(p, seed);
    cell.blend(|corner| {
        let hash = cell.hash(corner);
        let mut sum = T::from(0.0);
        for axis in 0..3 {
            let component = f64::from((hash >> (10 * axis)) & 1023) * (2.0 / 1023.0) - 1.0;
            sum = sum + cell.fraction[axis].plus(-(corner[axis] as f64)).scale(component);
        }
        sum
    })
}

/// Value noise on the integer lattice, nearly normal (the sum of four uniform bytes): mean 0,
/// standard deviation 1 on the lattice, at most 3.46 in magnitude. Samples at voxel positions are
/// independent of each other, like sensor noise.
pub(crate) fn voxel_noise<T: Real>(p: [T; 3], seed: u32) -> T {
    let cell = Cell::new(p, seed);
    let at = |corner| {
        let sum: u32 = cell.hash(corner).to_le_bytes().into_iter().map(u32::from).sum();
        T::from((f64::from(sum) - 510.0) * (1.0 / 147.8))
    };
    // On the lattice the blend and its slopes reduce to one corner: eight times faster for the
    // samples of a volume.
    if cell.fraction.iter().all(|f| f.value() == 0.0) { at([0; 3]) } else { cell.blend(at) }
}

/// Sum of octaves of gradient noise.
#[derive(Clone, Debug)]
pub(crate) struct Octaves {
    /// Per octave: lattice cells per voxel, amplitude, seed.
    octaves: Vec<(f64, f64, u32)>,
}

impl Octaves {
    /// Octaves from the lattice spacing `coarsest` (voxels), halved while it is at least `finest`;
    /// each octave's amplitude is `gain` times the one before. The sum has a root mean square of
    /// about 1.
    pub(crate) fn new(coarsest: f64, finest: f64, gain: f64, seed: u32) -> Self {
        let mut octaves = Vec::new();
        let (mut spacing, mut amplitude, mut power) = (coarsest.max(finest), 1.0, 0.0);
        while spacing >= finest {
            let seed =
                scramble(seed.wrapping_add(0x9e37_79b9_u32.wrapping_mul(octaves.len() as u32 + 1)));
            octaves.push((1.0 / spacing, amplitude, seed));
            power += amplitude * amplitude;
            spacing *= 0.5;
            amplitude *= gain;
        }
        let unit = 1.0 / (0.192 * f64::sqrt(power));
        octaves.iter_mut().for_each(|octave| octave.1 *= unit);
        Octaves { octaves }
    }

    pub(crate) fn len(&self) -> usize {
        self.octaves.len()
    }

    pub(crate) fn at<T: Real>(&self, p: [T; 3]) -> T {
        let mut sum = T::from(0.0);
        for &(frequency, amplitude, seed) in &self.octaves {
            // Off the voxel grid: gradient noise vanishes on its own lattice.
            let q = p.map(|x| x.scale(frequency).plus(0.381_966));
            sum = sum + gradient_noise(q, seed).scale(amplitude);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments(values: impl Iterator<Item = f64>) -> (f64, f64, f64) {
        let (mut n, mut sum, mut squares, mut peak) = (0.0, 0.0, 0.0, 0.0_f64);
        for v in values {
            n += 1.0;
            sum += v;
            squares += v * v;
            peak = peak.max(v.abs());
        }
        (sum / n, (squares / n).sqrt(), peak)
    }

    fn lattice(n: i32) -> impl Iterator<Item = [f64; 3]> {
        (0..n * n * n).map(move |i| [i % n, i / n % n, i / n / n].map(f64::from))
    }

    #[test]
    fn noise_has_the_stated_moments() {
        let (mean, rms, peak) = moments(lattice(40).map(|p| voxel_noise(p, 3)));
        assert!(
            mean.abs() < 0.01 && (rms - 1.0).abs() < 0.01 && peak <= 3.46,
            "{mean} {rms} {peak}"
        );
        let (mean, rms, peak) =
            moments(lattice(48).map(|p| gradient_noise(p.map(|x| x * 0.37 + 0.1), 3)));
        assert!(
            mean.abs() < 0.02 && (rms - 0.192).abs() < 0.01 && peak < 1.5,
            "{mean} {rms} {peak}"
        );
        let octaves = Octaves::new(16.0, 2.0, 0.7, 9);
        assert_eq!(octaves.len(), 4);
        let (mean, rms, _) = moments(lattice(64).map(|p| octaves.at(p)));
        assert!(mean.abs() < 0.1 && (rms - 1.0).abs() < 0.1, "{mean} {rms}");
    }

    #[test]
    fn noise_is_fixed_by_its_seed_and_differs_between_seeds() {
        let p = [1.3, -7.6, 40.2];
        assert_eq!(gradient_noise(p, 1).to_bits(), gradient_noise(p, 1).to_bits());
        assert!(gradient_noise(p, 1) != gradient_noise(p, 2));
        assert!(voxel_noise(p, 1) != voxel_noise(p, 2));
        // Checked-in bits: a change of platform or of the hash must not go unnoticed.
        assert_eq!(scramble(1), SCRAMBLED_ONE);
    }

    const SCRAMBLED_ONE: u32 = 1_753_845_952;

    #[test]
    fn noise_is_continuous_across_lattice_planes() {
        for noise in [gradient_noise::<f64>, voxel_noise::<f64>] {
            let below = noise([2.0 - 1e-9, 0.4, 0.7], 5);
            let above = noise([2.0 + 1e-9, 0.4, 0.7], 5);
            assert!((below - above).abs() < 1e-7);
            // The shortcut on the lattice is the limit of the blend.
            assert!((noise([2.0, 3.0, 4.0], 5) - noise([2.0 + 1e-7, 3.0, 4.0], 5)).abs() < 1e-6);
        }
    }
}
