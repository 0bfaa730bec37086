//! The encoder against libzfp's algorithm (by `zfp-rs`), and its checks.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use proptest::prelude::*;
use volume_io::{BlockEncoder, Error, ZfpVolume, bits_per_block, encode, pad_block};
use zfp_rs::{
    ZfpBitStream, ZfpConfig, ZfpDimensionality, ZfpField, ZfpFieldMut, ZfpScalarType,
    ZfpStreamAlignment,
};

fn config(rate: f64) -> ZfpConfig {
    let (ty, rank) = (ZfpScalarType::F32, ZfpDimensionality::D3);
    ZfpConfig::fixed_rate(rate, ty, rank, ZfpStreamAlignment::Unaligned).unwrap()
}

/// Whole-array compression, which `zfp-rs` tests against libzfp.
fn oracle(samples: &[f32], dims: [u32; 3], rate: f64) -> Vec<u8> {
    let dims = dims.map(|n| n as usize);
    let field = ZfpField::new(samples, dims).unwrap();
    let config = config(rate);
    let capacity = config.maximum_size(ZfpScalarType::F32, field.dims()).unwrap();
    let mut stream = ZfpBitStream::new(capacity).unwrap();
    stream.compress(&config, &field).unwrap();
    stream.as_bytes().to_vec()
}

fn oracle_decode(bytes: &[u8], dims: [u32; 3], rate: f64) -> Vec<f32> {
    let mut samples = vec![f32::NAN; dims.iter().map(|&n| n as usize).product()];
    let mut field = ZfpFieldMut::new(&mut samples, dims.map(|n| n as usize)).unwrap();
    let mut stream = ZfpBitStream::from_bytes(bytes).unwrap();
    stream.decompress(&config(rate), &mut field).unwrap();
    samples
}

fn bits(samples: &[f32]) -> Vec<u32> {
    samples.iter().map(|v| v.to_bits()).collect()
}

fn case() -> impl Strategy<Value = ([u32; 3], f64, Vec<f32>)> {
    let dims = [1..10u32, 1..10u32, 1..10u32];
    let rate = prop_oneof![0.1..33.0f64, Just(1.0), Just(4.0), Just(32.0), Just(34.5)];
    (dims, rate).prop_flat_map(|(dims, rate)| {
        let count = dims.iter().product::<u32>() as usize;
        let value = prop_oneof![
            4 => -1.0e3..1.0e3f32,
            1 => Just(0.0f32),
            1 => Just(-0.0f32),
            1 => -1.0e30..1.0e30f32,
        ];
        (Just(dims), Just(rate), prop::collection::vec(value, count))
    })
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 128,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn stream_and_decoded_samples_are_those_of_libzfp((dims, rate, samples) in case()) {
        let volume = encode(&samples, dims, rate).unwrap();
        let expected = oracle(&samples, dims, rate);
        prop_assert_eq!(&volume.bytes[..], &expected[..]);
        prop_assert_eq!(bits(&volume.decode()), bits(&oracle_decode(&expected, dims, rate)));
        prop_assert_eq!(volume.source.tiny_blocks, 0);
    }

    #[test]
    fn blocks_are_found_at_any_first_bit((dims, rate, samples) in case(), shift in 0u64..200) {
        let volume = encode(&samples, dims, rate).unwrap();
        let mut shifted = vec![0u8; volume.bytes.len() + 32];
        for bit in 0..volume.bytes.len() as u64 * 8 {
            let (from, to) = (bit as usize, (bit + shift) as usize);
            shifted[to / 8] |= (volume.bytes[from / 8] >> (from % 8) & 1) << (to % 8);
        }
        let moved = ZfpVolume::from_stream(dims, volume.bits_per_block, shift, shifted).unwrap();
        prop_assert_eq!(bits(&moved.decode()), bits(&volume.decode()));
    }

    #[test]
    fn measured_distortion_is_that_of_the_decoded_volume((dims, rate, samples) in case()) {
        let mut encoder = BlockEncoder::new(dims, rate).unwrap().measured();
        for _ in 0..encoder.block_count() {
            let mut block = [0.0; 64];
            let (origin, valid) = (encoder.next_origin(), encoder.next_valid());
            for i in 0..64u32 {
                let local = [i & 3, i >> 2 & 3, i >> 4];
                if (0..3).all(|a| local[a] < valid[a]) {
                    let [x, y, z] = [0, 1, 2].map(|a| origin[a] + local[a]);
                    block[i as usize] = samples[(x + dims[0] * (y + dims[1] * z)) as usize];
                }
            }
            pad_block(&mut block, valid);
            encoder.push(&block).unwrap();
        }
        let volume = encoder.finish().unwrap();
        let decoded = volume.decode();
        let errors = || samples.iter().zip(&decoded).map(|(a, b)| (f64::from(*a) - f64::from(*b)).abs());
        let found = volume.source.distortion.unwrap();
        let rms = (errors().map(|e| e * e).sum::<f64>() / samples.len() as f64).sqrt();
        prop_assert_eq!(found.max, errors().fold(0.0, f64::max));
        prop_assert!((found.rms - rms).abs() <= 1e-9 * rms);
        prop_assert!(found.rms <= found.max);
    }
}

#[test]
fn error_falls_with_rate_on_smooth_data() {
    let dims = [17, 14, 11];
    let samples: Vec<f32> = (0..17 * 14 * 11)
        .map(|i| {
            ((i % 17) as f32 * 0.3).sin()
                + ((i / 17 % 14) as f32 * 0.2).cos()
                + (i / 238) as f32 * 0.1
        })
        .collect();
    let error = |rate: f64| {
        let decoded = encode(&samples, dims, rate).unwrap().decode();
        samples.iter().zip(decoded).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    assert!(error(4.0) < 0.05, "{}", error(4.0));
    assert!(error(8.0) < 2e-3, "{}", error(8.0));
    assert!(error(16.0) < 1e-5, "{}", error(16.0));
    assert!(error(2.0) > error(16.0));
}

#[test]
fn values_that_cannot_be_encoded_are_named() {
    let mut samples = vec![1.0f32; 5 * 6 * 7];
    samples[4 + 5 * (5 + 6 * 6)] = f32::NAN;
    let error = encode(&samples, [5, 6, 7], 4.0).unwrap_err();
    assert!(matches!(error, Error::NonFinite { voxel: [4, 5, 6], .. }), "{error}");

    samples[4 + 5 * (5 + 6 * 6)] = -1.1e37;
    let error = encode(&samples, [5, 6, 7], 4.0).unwrap_err();
    assert!(matches!(error, Error::TooLarge { voxel: [4, 5, 6], .. }), "{error}");

    samples[4 + 5 * (5 + 6 * 6)] = 1.0e37;
    let volume = encode(&samples, [5, 6, 7], 4.0).unwrap();
    let again = ZfpVolume::from_stream([5, 6, 7], volume.bits_per_block, 0, volume.bytes.clone());
    assert!(again.is_ok(), "the load-time exponent test agrees with the encoder's");
}

#[test]
fn tiny_blocks_are_counted_alike_by_encoder_and_reader() {
    for (value, tiny) in [(0.0, 0), (1.0e-30, 1), (6.3e-30, 1), (6.4e-30, 0), (1.0, 0)] {
        let volume = encode(&[value; 64], [4, 4, 4], 8.0).unwrap();
        assert_eq!(volume.source.tiny_blocks, tiny, "{value}");
        let bytes = volume.bytes.clone();
        let read = ZfpVolume::from_stream([4, 4, 4], volume.bits_per_block, 0, bytes).unwrap();
        assert_eq!(read.source.tiny_blocks, tiny, "{value}");
    }
}

#[test]
fn block_count_is_checked() {
    let mut encoder = BlockEncoder::new([5, 4, 4], 4.0).unwrap();
    assert_eq!(encoder.block_count(), 2);
    encoder.push(&[1.0; 64]).unwrap();
    assert_eq!((encoder.next_origin(), encoder.next_valid()), ([4, 0, 0], [1, 4, 4]));
    encoder.push(&[1.0; 64]).unwrap();
    assert!(matches!(encoder.push(&[1.0; 64]), Err(Error::BlockCount { expected: 2, found: 3 })));
    assert!(encoder.finish().is_ok());

    let encoder = BlockEncoder::new([5, 4, 4], 4.0).unwrap();
    assert!(matches!(encoder.finish(), Err(Error::BlockCount { expected: 2, found: 0 })));
    assert!(matches!(
        encode(&[0.0; 63], [4, 4, 4], 4.0),
        Err(Error::SampleCount { expected: 64, found: 63 })
    ));
}

#[test]
fn sizes_and_rates_out_of_range_are_refused() {
    for dims in [[0, 4, 4], [4, 0, 4], [4, 4, 0], [65537, 1, 1], [u32::MAX; 3]] {
        assert!(matches!(BlockEncoder::new(dims, 4.0), Err(Error::Dims { .. })), "{dims:?}");
    }
    assert!(BlockEncoder::new([65536; 3], 32.0).is_ok(), "nothing is allocated in advance");
    for rate in [0.0, -1.0, f64::NAN, f64::INFINITY, 261.0] {
        assert!(matches!(bits_per_block(rate), Err(Error::Rate { .. })), "{rate}");
    }
    assert_eq!(bits_per_block(1e-9).unwrap(), 9);
    assert_eq!(bits_per_block(0.15).unwrap(), 10);
    assert_eq!(bits_per_block(4.3).unwrap(), 275);
    let stream = |bits| ZfpVolume::from_stream([4, 4, 4], bits, 0, vec![0; 4096]);
    assert!(matches!(stream(8), Err(Error::BitsPerBlock { found: 8 })));
    assert!(matches!(stream(16659), Err(Error::BitsPerBlock { found: 16659 })));
    assert!(stream(9).is_ok() && stream(16658).is_ok());
}

#[test]
fn overflowing_exponents_name_their_block() {
    let mut bytes = encode(&[1.0; 128], [8, 4, 4], 1.0).unwrap().bytes.to_vec();
    let read = |bytes: &[u8]| ZfpVolume::from_stream([8, 4, 4], 64, 0, bytes);
    assert!(read(&bytes).is_ok());
    bytes[8] |= 0xff;
    bytes[9] |= 1;
    let error = read(&bytes).unwrap_err();
    let expected =
        matches!(error, Error::BlockExponent { block: 1, voxel: [4, 0, 0], exponent: 255 });
    assert!(expected, "{error}");
    assert!(matches!(read(&bytes[..15]), Err(Error::TooShort { expected: 16, found: 15 })));
}
