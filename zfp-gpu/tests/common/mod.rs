//! Fields that exercise every path of the codec, and an independent encoder and decoder.

#![allow(dead_code, reason = "every test binary uses its own part")]
#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

pub(crate) mod gpu;

use zfp_gpu::StreamLayout;
use zfp_rs::codec::block::{decode_block, encode_block};
use zfp_rs::{
    ZfpBitStream, ZfpConfig, ZfpDimensionality, ZfpField, ZfpScalarType, ZfpStreamAlignment,
};

/// Small deterministic generator (xorshift), enough for test data.
#[derive(Clone)]
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    pub(crate) fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 24) as u32
    }

    /// Uniform in -1..1.
    pub(crate) fn signed(&mut self) -> f32 {
        self.next() as f32 / 2_147_483_648.0 - 1.0
    }

    pub(crate) fn below(&mut self, end: u32) -> u32 {
        self.next() % end
    }

    pub(crate) fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i as u32 + 1) as usize);
        }
    }
}

/// What a field's samples look like. No block's largest magnitude is in (0, 2^-97) or beyond 2^123.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    Smooth,
    Noise,
    Zero,
    Spike,
    Huge,
    NegativeZero,
    MixedExponents,
    Tiny,
    Integers,
    Mixed,
}

pub(crate) const KINDS: [Kind; 10] = [
    Kind::Smooth,
    Kind::Noise,
    Kind::Zero,
    Kind::Spike,
    Kind::Huge,
    Kind::NegativeZero,
    Kind::MixedExponents,
    Kind::Tiny,
    Kind::Integers,
    Kind::Mixed,
];

/// Samples of a field, x fastest.
pub(crate) fn field(kind: Kind, dims: [u32; 3], seed: u64) -> Vec<f32> {
    let mut random = Random::new(seed);
    let phase = random.signed() * 3.0;
    let mut samples = Vec::new();
    for z in 0..dims[2] {
        for y in 0..dims[1] {
            for x in 0..dims[0] {
                let block = [x / 4, y / 4, z / 4].iter().sum::<u32>() as usize;
                let kind =
                    if kind == Kind::Mixed { KINDS[(block + seed as usize) % 9] } else { kind };
                let corner = x % 4 == 0 && y % 4 == 0 && z % 4 == 0;
                samples.push(sample(kind, [x, y, z].map(|i| i as f32), phase, corner, &mut random));
            }
        }
    }
    samples
}

fn sample(kind: Kind, p: [f32; 3], phase: f32, corner: bool, random: &mut Random) -> f32 {
    match kind {
        Kind::Smooth => (0.31 * p[0] + phase).sin() * (0.17 * p[1]).cos() + 0.05 * p[2] * phase,
        Kind::Noise => random.signed() * 1000.0,
        Kind::Zero => 0.0,
        Kind::Spike if random.below(100) == 0 => 1.0e30,
        Kind::Spike => 1.0e-3 * random.signed(),
        Kind::Huge if random.below(2) == 0 => 1.0e36 * (1.0 + 0.01 * p[0]),
        Kind::Huge => -5.0e36 + 1.0e34 * p[1],
        Kind::NegativeZero => [-0.0, 0.0, -1.0e-20, 3.0][random.below(4) as usize],
        Kind::MixedExponents if corner => random.signed().signum(),
        Kind::MixedExponents => random.signed() * 2.0_f32.powi(random.below(126) as i32 - 100),
        // The corner keeps the block's exponent at the smallest that is not taken for zero.
        Kind::Tiny if corner => 2.0_f32.powi(-97),
        Kind::Tiny => random.signed() * 2.0_f32.powi(-97),
        Kind::Integers => (random.below(256) as f32) + (p[2] * 100.0).floor(),
        Kind::Mixed => unreachable!("resolved per block"),
    }
}

pub(crate) fn config(bits_per_block: u32) -> ZfpConfig {
    let config = ZfpConfig::fixed_rate(
        f64::from(bits_per_block) / 64.0,
        ZfpScalarType::F32,
        ZfpDimensionality::D3,
        ZfpStreamAlignment::Unaligned,
    )
    .unwrap();
    assert_eq!(config.max_bits(), bits_per_block);
    config
}

/// The field's stream as an independent encoder writes it, padded to 8 bytes.
pub(crate) fn encode(samples: &[f32], dims: [u32; 3], bits_per_block: u32) -> Vec<u8> {
    let field = ZfpField::new(samples, dims.map(|d| d as usize)).unwrap();
    let layout = StreamLayout::new(dims, bits_per_block, 0).unwrap();
    let mut stream = ZfpBitStream::new(layout.stream_bytes() as usize + 4096).unwrap();
    stream.compress(&config(bits_per_block), &field).unwrap();
    stream.as_bytes().to_vec()
}

/// The same stream behind `first_bit` bits of garbage, and garbage after its end.
pub(crate) fn behind_header(stream: &[u8], layout: &StreamLayout, random: &mut Random) -> Vec<u8> {
    let end = layout.stream_bytes() * 8;
    let bits = layout.block_bit(layout.block_count()) - layout.first_bit;
    let mut out: Vec<u8> = (0..end / 8 + 5).map(|_| random.next() as u8).collect();
    for bit in 0..bits {
        let value = stream[(bit / 8) as usize] >> (bit % 8) & 1;
        set_bit(&mut out, layout.first_bit + bit, value);
    }
    out
}

pub(crate) fn set_bit(bytes: &mut [u8], bit: u64, value: u8) {
    let byte = &mut bytes[(bit / 8) as usize];
    *byte = *byte & !(1 << (bit % 8)) | value << (bit % 8);
}

/// Block `block` as the independent decoder sees it.
pub(crate) fn oracle_block(
    stream: &mut ZfpBitStream,
    layout: &StreamLayout,
    block: u64,
) -> [f32; 64] {
    let mut values = [0.0_f32; 64];
    stream.seek_read(layout.block_bit(block));
    decode_block(stream, &config(layout.bits_per_block), &mut values, ZfpDimensionality::D3)
        .unwrap();
    values
}

pub(crate) fn oracle_stream(bytes: &[u8]) -> ZfpBitStream {
    ZfpBitStream::from_bytes(bytes).unwrap()
}

/// Bits of a block before any padding.
pub(crate) fn used_bits(block: &[f32; 64], bits_per_block: u32) -> usize {
    let config = ZfpConfig::expert(1, bits_per_block, 64, -1074).unwrap();
    let mut stream = ZfpBitStream::new(4096).unwrap();
    encode_block(&mut stream, &config, block, ZfpDimensionality::D3).unwrap()
}

pub(crate) fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|v| v.to_bits()).collect()
}

/// Fails unless both slices are equal bit for bit, and says where they first differ.
#[track_caller]
pub(crate) fn assert_same_bits(found: &[f32], expected: &[f32], context: &str) {
    assert_eq!(found.len(), expected.len(), "{context}: lengths differ");
    let differs = |(a, b): (&f32, &f32)| a.to_bits() != b.to_bits();
    if let Some(i) = found.iter().zip(expected).position(differs) {
        panic!("{context}: sample {i} is {:e}, expected {:e}", found[i], expected[i]);
    }
}
