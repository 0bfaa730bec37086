//! The CPU decoder against an independent implementation of zfp, bit for bit.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::{
    KINDS, Kind, Random, assert_same_bits, behind_header, bits, encode, field, oracle_block,
    oracle_stream, set_bit, used_bits,
};
use proptest::prelude::*;
use zfp_gpu::StreamLayout;
use zfp_gpu::cpu::decode::{decode_block, decode_volume, decode_words};

/// Irregular steps from the smallest block to one that loses nothing.
fn bit_counts() -> impl Iterator<Item = u32> {
    let steps = [1, 2, 3, 5, 11, 17, 31, 64, 97, 131].into_iter().cycle();
    let walk = steps.scan(9, |bits, step| {
        let now = *bits;
        *bits += step;
        Some(now)
    });
    walk.take_while(|&b| b < 2120).chain([32, 64, 96, 128, 160, 1024, 2048, 2119, 2120, 2125])
}

fn check(samples: &[f32], dims: [u32; 3], bits_per_block: u32, first_bit: u64, context: &str) {
    let layout = StreamLayout::new(dims, bits_per_block, first_bit).unwrap();
    let mut random = Random::new(first_bit + 7);
    let stream = behind_header(&encode(samples, dims, bits_per_block), &layout, &mut random);
    let mut oracle = oracle_stream(&stream);
    for block in 0..layout.block_count() {
        let expected = oracle_block(&mut oracle, &layout, block);
        let context = format!("{context}, {bits_per_block} bits from {first_bit}, block {block}");
        assert_same_bits(&decode_block(&stream, &layout, block), &expected, &context);
    }
}

#[test]
fn every_kind_at_many_rates_equals_the_oracle() {
    for bits_per_block in bit_counts() {
        for kind in KINDS {
            let samples = field(kind, [9, 6, 7], u64::from(bits_per_block));
            check(&samples, [9, 6, 7], bits_per_block, 0, &format!("{kind:?}"));
        }
    }
}

#[test]
fn every_shape_modulo_four_equals_the_oracle() {
    for shape in 0..64 {
        let dims = [shape % 4 + 1, shape / 4 % 4 + 4, shape / 16 + 5];
        let samples = field(Kind::Mixed, dims, u64::from(shape));
        for (bits_per_block, first_bit) in [(77, 0), (413, 148)] {
            check(&samples, dims, bits_per_block, first_bit, &format!("{dims:?}"));
        }
    }
}

#[test]
fn volumes_drop_the_padding() {
    for dims in [[1, 1, 1], [5, 3, 9], [8, 4, 6], [7, 10, 2]] {
        let samples = field(Kind::Smooth, dims, 3);
        let layout = StreamLayout::new(dims, 2120, 0).unwrap();
        let stream = encode(&samples, dims, 2120);
        let decoded = decode_volume(&stream, &layout);
        assert_eq!(decoded.len(), samples.len());
        for (i, (a, b)) in decoded.iter().zip(&samples).enumerate() {
            assert!((a - b).abs() < 1e-6, "{dims:?}: sample {i} is {a}, expected {b}");
        }
    }
}

#[test]
fn blocks_below_two_to_the_minus_96_are_zero() {
    for exponent in 0..40_u64 {
        let mut random = Random::new(exponent);
        let mut stream: Vec<u8> = (0..64).map(|_| random.next() as u8).collect();
        stream[0] = (exponent << 1 | 1) as u8;
        set_bit(&mut stream, 8, (exponent >> 7) as u8);
        let layout = StreamLayout::new([4; 3], 512, 0).unwrap();
        let values = decode_block(&stream, &layout, 0);
        if exponent <= 30 {
            assert_eq!(bits(&values), [0; 64], "exponent {exponent}");
        } else {
            let expected = oracle_block(&mut oracle_stream(&stream), &layout, 0);
            assert_same_bits(&values, &expected, &format!("exponent {exponent}"));
            assert!(values.iter().all(|v| *v == 0.0 || v.is_normal()), "exponent {exponent}");
        }
    }
}

#[test]
fn a_cut_stream_reads_zeros() {
    let samples = field(Kind::Noise, [8, 4, 4], 1);
    let stream = encode(&samples, [8, 4, 4], 700);
    let layout = StreamLayout::new([8, 4, 4], 700, 0).unwrap();
    let mut padded = stream[..100].to_vec();
    padded.resize(400, 0);
    let cut = &stream[..100];
    for block in 0..2 {
        let expected = decode_block(&padded, &layout, block);
        assert_same_bits(&decode_block(cut, &layout, block), &expected, "cut stream");
    }
    assert_eq!(bits(&decode_block(cut, &layout, u64::MAX)), [0; 64]);
}

#[test]
fn addresses_beyond_32_bits_are_exact() {
    let word = |index: u64| (index.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as u32;
    let layout = StreamLayout::new([1 << 13; 3], 2120, 148).unwrap();
    assert!(layout.block_count() * 2120 > 1 << 40);
    let block = layout.block_count() - 1;
    let first = layout.block_bit(block);
    let values = decode_words(word, first, 2120);
    let near = decode_words(|index| word(index + first / 32), first % 32, 2120);
    assert_same_bits(&values, &near, "moved window");
}

#[test]
#[should_panic(expected = "sample 1 is")]
fn the_comparison_can_fail() {
    assert_same_bits(&[1.0, 0.0], &[1.0, -0.0], "signs of zero");
}

#[test]
fn readers_stay_within_one_word_of_the_block() {
    for bits_per_block in bit_counts() {
        let layout = StreamLayout::new([12, 4, 4], bits_per_block, 17).unwrap();
        let plain = encode(&field(Kind::Noise, layout.dims, 8), layout.dims, bits_per_block);
        let stream = behind_header(&plain, &layout, &mut Random::new(2));
        let end = layout.block_bit(3).div_ceil(32);
        let word = |index: u64| {
            assert!(index <= end + 1, "word {index} of {end}");
            let bytes = (index * 4..index * 4 + 4).map(|i| stream.get(i as usize).unwrap_or(&0));
            bytes.rev().fold(0, |word, &byte| word << 8 | u32::from(byte))
        };
        let values = decode_words(word, layout.block_bit(2), bits_per_block);
        assert_same_bits(&values, &decode_block(&stream, &layout, 2), "last block");
    }
}

fn any_kind() -> impl Strategy<Value = Kind> {
    proptest::sample::select(KINDS.to_vec())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn any_stream_equals_the_oracle(
        kind in any_kind(), dims in [1_u32..14, 1_u32..10, 1_u32..10],
        bits_per_block in 9_u32..=2120, first_bit in 0_u64..200, seed: u64,
    ) {
        let samples = field(kind, dims, seed);
        check(&samples, dims, bits_per_block, first_bit, &format!("{kind:?} {dims:?}"));
    }

    #[test]
    fn random_bits_equal_the_oracle(
        stream in proptest::collection::vec(any::<u8>(), 800),
        bits_per_block in 9_u32..=2120, first_bit in 0_u64..64,
    ) {
        let layout = StreamLayout::new([12, 4, 4], bits_per_block, first_bit).unwrap();
        let mut oracle = oracle_stream(&stream);
        for block in 0..3 {
            let values = decode_block(&stream, &layout, block);
            let header = layout.block_bit(block);
            let bit = |i: u64| u32::from(stream[((header + i) / 8) as usize] >> ((header + i) % 8) & 1);
            let exponent = (1..9).map(|i| bit(i) << (i - 1)).sum::<u32>();
            if bit(0) == 1 && exponent > 30 {
                let expected = oracle_block(&mut oracle, &layout, block);
                assert_same_bits(&values, &expected, &format!("block {block}"));
            } else {
                prop_assert_eq!(bits(&values), [0; 64]);
            }
        }
    }

    #[test]
    fn bits_after_an_exhausted_block_are_ignored(
        kind in any_kind(), seed: u64, garbage: u64, bits_per_block in 1500_u32..=3000,
    ) {
        let samples: [f32; 64] = field(kind, [4; 3], seed).try_into().unwrap();
        let layout = StreamLayout::new([4; 3], bits_per_block, 0).unwrap();
        let mut stream = encode(&samples, [4; 3], bits_per_block);
        let expected = decode_block(&stream, &layout, 0);
        let mut random = Random::new(garbage);
        for bit in used_bits(&samples, bits_per_block)..stream.len() * 8 {
            set_bit(&mut stream, bit as u64, (random.next() & 1) as u8);
        }
        assert_same_bits(&decode_block(&stream, &layout, 0), &expected, "garbage in the padding");
    }

    #[test]
    fn bits_after_a_zero_block_are_ignored(
        mut stream in proptest::collection::vec(any::<u8>(), 300), bits_per_block in 9_u32..=2120,
    ) {
        stream[0] &= 0xfe;
        let layout = StreamLayout::new([4; 3], bits_per_block, 0).unwrap();
        prop_assert_eq!(bits(&decode_block(&stream, &layout, 0)), [0; 64]);
    }

    #[test]
    fn fewer_bits_are_a_prefix(
        kind in any_kind(), seed: u64, short in 9_u32..=1000, more in 1_u32..=1120,
    ) {
        let samples: [f32; 64] = field(kind, [4; 3], seed).try_into().unwrap();
        let coarse = encode(&samples, [4; 3], short);
        let fine = encode(&samples, [4; 3], short + more);
        let mut prefix = fine.clone();
        for bit in u64::from(short)..prefix.len() as u64 * 8 {
            set_bit(&mut prefix, bit, 0);
        }
        prop_assert_eq!(&prefix[..short.div_ceil(8) as usize], &coarse[..short.div_ceil(8) as usize]);
        let layout = StreamLayout::new([4; 3], short, 0).unwrap();
        let expected = decode_block(&coarse, &layout, 0);
        assert_same_bits(&decode_block(&fine, &layout, 0), &expected, "prefix of a finer stream");
    }
}
