//! CPU twin of `shader/lib/zfp_block.wgsl` and `shader/decode.wgsl`.

use crate::stream::{BLOCK_SAMPLES, StreamLayout};

/// Largest biased block exponent that decodes as zeros. zfp's own scale would be subnormal there,
/// and GPUs flush subnormal numbers.
pub const ZERO_EXPONENT: u32 = 30;

/// Bit planes of a coefficient.
const PLANES: u32 = 32;
/// Negabinary digits with odd exponent.
const NEGABINARY: u32 = 0xaaaa_aaaa;

/// Position of coefficient `i`, as `x + 4y + 16z`: by total sequency, then by energy.
const PERMUTATION: [u8; BLOCK_SAMPLES] = [
    0, 1, 4, 16, 20, 17, 5, 2, 8, 32, 21, 6, 18, 24, 9, 33, //
    36, 3, 12, 48, 22, 25, 37, 40, 34, 10, 7, 19, 28, 13, 49, 52, //
    41, 38, 26, 23, 29, 53, 11, 35, 44, 14, 50, 56, 42, 27, 39, 45, //
    30, 54, 57, 60, 51, 15, 43, 46, 58, 61, 55, 31, 62, 59, 47, 63,
];

/// Decodes block `block` of `stream`, padding samples included; sample (x, y, z) is at
/// `x + 4y + 16z`.
///
/// Bits past the end of `stream` read as zero, so that a cut stream decodes to something rather
/// than failing. A block whose biased exponent is at most [`ZERO_EXPONENT`] decodes as zeros.
pub fn decode_block(stream: &[u8], layout: &StreamLayout, block: u64) -> [f32; BLOCK_SAMPLES] {
    let first_bit = layout.block_bit(block);
    decode_words(|index| stream_word(stream, index), first_bit, layout.bits_per_block)
}

/// Decodes the block at bit `first_bit` of an array of 32-bit words given as a function of the
/// word's index.
pub fn decode_words(
    word: impl Fn(u64) -> u32,
    first_bit: u64,
    bits_per_block: u32,
) -> [f32; BLOCK_SAMPLES] {
    let mut reader = Reader::new(word, first_bit, bits_per_block);
    let exponent = reader.read_exponent();
    if exponent <= ZERO_EXPONENT {
        return [0.0; BLOCK_SAMPLES];
    }
    let mut integers = read_integers(&mut reader);
    invert_transform(&mut integers);
    let scale = f32::from_bits((exponent - ZERO_EXPONENT) << 23);
    integers.map(|i| round_to_f32(i) * scale)
}

/// Decodes a whole volume: `dims` samples, x fastest, padding dropped.
pub fn decode_volume(stream: &[u8], layout: &StreamLayout) -> Vec<f32> {
    let [nx, ny, nz] = layout.dims.map(|d| d as usize);
    let [bx, by, bz] = layout.blocks().map(|b| b as usize);
    let mut samples = vec![0.0; nx * ny * nz];
    for block in 0..bx * by * bz {
        let [x0, y0, z0] = [block % bx * 4, block / bx % by * 4, block / (bx * by) * 4];
        let values = decode_block(stream, layout, block as u64);
        for z in 0..(nz - z0).min(4) {
            for y in 0..(ny - y0).min(4) {
                let width = (nx - x0).min(4);
                let from = 4 * y + 16 * z;
                let to = x0 + nx * (y0 + y + ny * (z0 + z));
                samples[to..to + width].copy_from_slice(&values[from..from + width]);
            }
        }
    }
    samples
}

/// Little-endian word `index` of `stream`, zero past the end.
fn stream_word(stream: &[u8], index: u64) -> u32 {
    let byte = |i: u64| {
        let position = index.checked_mul(4).and_then(|first| usize::try_from(first + i).ok());
        position.and_then(|p| stream.get(p)).copied().unwrap_or(0)
    };
    u32::from_le_bytes([byte(0), byte(1), byte(2), byte(3)])
}

/// Position inside a block: a window of 64 bits, the bits left to the block, and the number of
/// coefficients found significant so far.
struct Reader<W> {
    word: W,
    next: u64,
    window: u64,
    bit: u32,
    budget: u32,
    significant: u32,
}

impl<W: Fn(u64) -> u32> Reader<W> {
    fn new(word: W, first_bit: u64, budget: u32) -> Self {
        let first = first_bit / 32;
        let window = u64::from(word(first)) | u64::from(word(first + 1)) << 32;
        let bit = (first_bit % 32) as u32;
        Self { word, next: first + 2, window, bit, budget, significant: 0 }
    }

    /// The next 32 bits, whether or not they belong to the block.
    fn peek(&self) -> u32 {
        (self.window >> self.bit) as u32
    }

    /// Consumes `count <= 32` bits of the budget.
    fn skip(&mut self, count: u32) {
        self.budget -= count;
        self.bit += count;
        if self.bit >= 32 {
            self.bit -= 32;
            self.window = self.window >> 32 | u64::from((self.word)(self.next)) << 32;
            self.next += 1;
        }
    }

    /// Reads `count <= 32` bits.
    fn read(&mut self, count: u32) -> u32 {
        let bits = self.peek() & low_mask(count);
        self.skip(count);
        bits
    }

    /// Reads the header: the biased exponent of a block, 0 for a block of zeros.
    fn read_exponent(&mut self) -> u32 {
        if self.read(1) == 0 { 0 } else { self.read(8) }
    }

    /// Reads one bit plane: bit `i` belongs to coefficient `i`.
    fn read_plane(&mut self) -> u64 {
        let verbatim = self.significant.min(self.budget);
        let low = self.read(verbatim.min(32));
        let high = self.read(verbatim - verbatim.min(32));
        let mut plane = u64::from(low) | u64::from(high) << 32;
        while self.budget > 0 && self.significant < 64 {
            if self.read(1) == 0 {
                break;
            }
            self.skip_to_one();
            plane |= 1 << self.significant;
            self.significant += 1;
        }
        plane
    }

    /// Scans a unary run up to its one bit, to the end of the budget, or to the last coefficient,
    /// whose one bit is implied.
    fn skip_to_one(&mut self) {
        while self.budget > 0 && self.significant < 63 {
            let limit = self.budget.min(63 - self.significant).min(32);
            let zeros = self.peek().trailing_zeros().min(limit);
            self.significant += zeros;
            if zeros < limit {
                self.skip(zeros + 1);
                return;
            }
            self.skip(zeros);
        }
    }
}

/// The lowest `count <= 32` bits set.
fn low_mask(count: u32) -> u32 {
    if count >= 32 { u32::MAX } else { (1 << count) - 1 }
}

/// Reads all bit planes of a block into signed coefficients at their positions.
fn read_integers(reader: &mut Reader<impl Fn(u64) -> u32>) -> [i32; BLOCK_SAMPLES] {
    let mut digits = [0_u32; BLOCK_SAMPLES];
    let mut plane_bit = PLANES;
    while reader.budget > 0 && plane_bit > 0 {
        plane_bit -= 1;
        let mut plane = reader.read_plane();
        while plane != 0 {
            let position = PERMUTATION[plane.trailing_zeros() as usize];
            digits[usize::from(position)] |= 1 << plane_bit;
            plane &= plane - 1;
        }
    }
    digits.map(|d| (d ^ NEGABINARY).wrapping_sub(NEGABINARY).cast_signed())
}

/// Undoes zfp's decorrelating transform along z, then y, then x.
fn invert_transform(integers: &mut [i32; BLOCK_SAMPLES]) {
    for (stride, across, along) in [(16, 1, 4), (4, 1, 16), (1, 4, 16)] {
        for line in 0..16 {
            let start = line % 4 * across + line / 4 * along;
            let index = |i: usize| start + i * stride;
            let lifted = invert_lift([0, 1, 2, 3].map(|i| integers[index(i)]));
            for i in 0..4 {
                integers[index(i)] = lifted[i];
            }
        }
    }
}

/// Undoes the transform of four values.
fn invert_lift([mut a, mut b, mut c, mut d]: [i32; 4]) -> [i32; 4] {
    b = b.wrapping_add(d >> 1);
    d = d.wrapping_sub(b >> 1);
    b = b.wrapping_add(d);
    d = (d << 1).wrapping_sub(b);
    c = c.wrapping_add(a);
    a = (a << 1).wrapping_sub(c);
    b = b.wrapping_add(c);
    c = (c << 1).wrapping_sub(b);
    d = d.wrapping_add(a);
    a = (a << 1).wrapping_sub(d);
    [a, b, c, d]
}

/// Nearest `f32`, ties to even, rounded in integers: shading languages leave the rounding of
/// integer conversions open.
fn round_to_f32(i: i32) -> f32 {
    let magnitude = i.unsigned_abs();
    let excess = 8_u32.saturating_sub(magnitude.leading_zeros());
    let rounded = if excess == 0 {
        magnitude
    } else {
        let odd = magnitude >> excess & 1;
        (magnitude + (1 << (excess - 1)) - 1 + odd) >> excess << excess
    };
    let value = rounded as f32;
    if i < 0 { -value } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn permutation_visits_every_position_by_sequency() {
        let mut seen = PERMUTATION;
        seen.sort_unstable();
        assert!(seen.iter().enumerate().all(|(i, &p)| i == usize::from(p)));
        let sequency = PERMUTATION.map(|p| p % 4 + p / 4 % 4 + p / 16);
        assert!(sequency.is_sorted());
    }

    #[test]
    fn words_past_the_end_are_zero() {
        let stream = [1, 2, 3, 4, 5];
        assert_eq!(stream_word(&stream, 0), 0x0403_0201);
        assert_eq!(stream_word(&stream, 1), 5);
        assert_eq!(stream_word(&stream, 2), 0);
        assert_eq!(stream_word(&stream, u64::MAX), 0);
    }

    #[test]
    fn integers_round_to_even_at_every_magnitude() {
        let edges = (0..32).flat_map(|s| [-3, -2, -1, 0, 1, 2, 3].map(|d| (1_i64 << s) + d));
        let halves = (25..31).flat_map(|s| {
            let half = 1_i64 << (s - 25);
            (0..4).flat_map(move |k| [-1, 0, 1].map(|d| (1 << s) + (2 * k + 1) * half + d))
        });
        for i in edges.chain(halves).flat_map(|i| [i, -i]) {
            if let Ok(i) = i32::try_from(i) {
                assert_eq!(round_to_f32(i).to_bits(), (i as f32).to_bits(), "{i}");
            }
        }
        assert_eq!(round_to_f32(i32::MIN), -2_147_483_648.0);
    }

    proptest! {
        #[test]
        fn integers_round_as_the_processor_does(i: i32, shift in 0_u32..32) {
            let i = i >> shift;
            prop_assert_eq!(round_to_f32(i).to_bits(), (i as f32).to_bits());
        }
    }
}
