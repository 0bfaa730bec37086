//! Files written by the `zfp` program (see `data/make_files.py`), and what is wrong with broken
//! ones.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use proptest::prelude::*;
use volume_io::{
    Error, Format, Headerless, Note, ReadOptions, SampleType, ZfpVolume, encode, read_bytes,
    read_file, write_zfp,
};

const DIMS: [u32; 3] = [9, 7, 6];

fn path(name: &str) -> String {
    format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn data(name: &str) -> Vec<u8> {
    std::fs::read(path(name)).unwrap()
}

fn read(name: &str, options: &ReadOptions) -> ZfpVolume {
    read_file(path(name), options).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// What the `zfp` program decodes.
fn decoded_by_zfp(name: &str, ty: SampleType) -> Vec<f64> {
    let bytes = data(&format!("{name}.raw"));
    match ty {
        SampleType::F32 => samples(&bytes, |b| f64::from(f32::from_le_bytes(b))),
        SampleType::F64 => samples(&bytes, f64::from_le_bytes),
        SampleType::I32 => samples(&bytes, |b| f64::from(i32::from_le_bytes(b))),
        SampleType::I64 => samples(&bytes, |b| i64::from_le_bytes(b) as f64),
        other => panic!("zfp has no type {other}"),
    }
}

fn samples<const N: usize>(bytes: &[u8], value: impl Fn([u8; N]) -> f64) -> Vec<f64> {
    bytes.as_chunks::<N>().0.iter().map(|&sample| value(sample)).collect()
}

fn to_f32(samples: &[f64]) -> Vec<f32> {
    samples.iter().map(|&v| v as f32).collect()
}

fn bits(samples: &[f32]) -> Vec<u32> {
    samples.iter().map(|v| v.to_bits()).collect()
}

#[test]
fn fixed_rate_floats_are_kept_and_decode_bit_for_bit() {
    for (name, first_bit, bits_per_block) in [
        ("rate_4", 96, 256),
        ("rate_4_3", 96, 275),
        ("rate_0_15", 96, 10),
        ("rate_34_5", 148, 2208),
    ] {
        let volume = read(&format!("{name}.zfp"), &ReadOptions::default());
        assert_eq!(volume.dims, DIMS, "{name}");
        assert_eq!((volume.first_bit, volume.bits_per_block), (first_bit, bits_per_block));
        assert_eq!(&volume.bytes[..], &data(&format!("{name}.zfp"))[..], "{name}: kept");
        let expected = to_f32(&decoded_by_zfp(name, SampleType::F32));
        assert_eq!(bits(&volume.decode()), bits(&expected), "{name}");
        assert_eq!((volume.source.format, volume.source.encoded), (Format::Zfp, false));
        assert_eq!(volume.source.notes, []);
    }
}

#[test]
fn headerless_streams_are_read_where_their_length_fits() {
    let options = |dims, rate| ReadOptions {
        headerless: Some(Headerless { dims, rate }),
        ..ReadOptions::default()
    };
    let volume = read("headerless_4_3.zfp", &options(DIMS, 4.3));
    let expected = to_f32(&decoded_by_zfp("headerless_4_3", SampleType::F32));
    assert_eq!(bits(&volume.decode()), bits(&expected));
    assert_eq!((volume.source.format, volume.first_bit), (Format::ZfpHeaderless, 0));

    let bytes = data("headerless_4_3.zfp");
    for (dims, rate) in [([9, 7, 9], 4.3), (DIMS, 4.5), (DIMS, 4.2), ([4, 4, 4], 4.3)] {
        let error = read_bytes("x.zfp", bytes.clone(), &options(dims, rate)).unwrap_err();
        assert!(matches!(error, Error::LengthMismatch { found: 413, .. }), "{error}");
    }
    let error = read_bytes("x.zfp", &bytes[..412], &options(DIMS, 4.3)).unwrap_err();
    let expected = "headerless stream: [9, 7, 6] voxels at 275 bits per block take 416 bytes, \
                    found 412; dims or rate may be wrong";
    assert_eq!(error.to_string(), expected);

    let error = read_bytes("x.ZFP", bytes.clone(), &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, Error::HeaderlessNeedsLayout { .. }), "{error}");
    let error = read_bytes("x.bin", bytes, &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, Error::UnknownFormat { .. }), "{error}");
}

#[test]
fn other_types_ranks_and_modes_are_encoded_anew_and_the_error_is_known() {
    use SampleType::{F32, F64, I32, I64};
    for (name, ty, dims, rank) in [
        ("precision", F32, DIMS, 3),
        ("accuracy", F32, DIMS, 3),
        ("reversible", F32, DIMS, 3),
        ("expert", F32, DIMS, 3),
        ("f64_rate", F64, DIMS, 3),
        ("f64_reversible", F64, DIMS, 3),
        ("i32_reversible", I32, DIMS, 3),
        ("i64_precision", I64, DIMS, 3),
        ("rank_1", F32, [37, 1, 1], 1),
        ("rank_2", F32, [13, 10, 1], 2),
    ] {
        let options = ReadOptions { rate: 9.7, ..ReadOptions::default() };
        let volume = read(&format!("{name}.zfp"), &options);
        let exact = decoded_by_zfp(name, ty);
        let expected = encode(&to_f32(&exact), dims, 9.7).unwrap();
        assert_eq!(volume.dims, dims, "{name}");
        assert_eq!(volume.bytes, expected.bytes, "{name}");
        let source = &volume.source;
        assert_eq!((source.format, source.sample_type, source.rank), (Format::Zfp, ty, rank));
        assert!(source.encoded, "{name}");
        let errors = exact.iter().zip(volume.decode()).map(|(a, b)| (a - f64::from(b)).abs());
        let found = source.distortion.unwrap();
        assert_eq!(found.max, errors.fold(0.0, f64::max), "{name}");
        assert!(found.psnr_db > 40.0, "{name}: {found:?}");
    }
}

#[test]
fn four_dimensions_are_refused() {
    let error = read_file(path("rank_4.zfp"), &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, Error::Unsupported { format: Format::Zfp, .. }), "{error}");
}

#[test]
fn a_missing_file_is_named() {
    let error = read_file("no/such/file.zfp", &ReadOptions::default()).unwrap_err();
    assert!(matches!(&error, Error::Io { name, .. } if name == "no/such/file.zfp"), "{error}");
}

#[test]
fn every_truncation_is_an_error_that_counts_bytes() {
    for name in ["rate_4_3", "rate_34_5", "accuracy", "reversible", "rank_2", "i64_precision"] {
        let bytes = data(&format!("{name}.zfp"));
        for length in 3..bytes.len() {
            let result = read_bytes(name, &bytes[..length], &ReadOptions::default());
            let error = match result {
                Err(error) => error,
                // A variable-rate stream may end in padding up to the last byte or word.
                Ok(_) if length + 8 > bytes.len() && !name.starts_with("rate") => continue,
                Ok(_) => panic!("{name}: {length} bytes are enough"),
            };
            let expected = matches!(
                error,
                Error::TooShort { .. } | Error::StreamEnds { .. } | Error::InvalidHeader { .. }
            );
            assert!(expected, "{name}, {length} bytes: {error}");
        }
    }
}

#[test]
fn trailing_bytes_and_needless_layouts_are_noted() {
    for name in ["rate_4_3", "accuracy"] {
        let mut bytes = data(&format!("{name}.zfp"));
        let whole = bytes.len().next_multiple_of(8);
        bytes.resize(whole + 100, 0xaa);
        let headerless = Some(Headerless { dims: [1, 2, 3], rate: 1.0 });
        let options = ReadOptions { headerless, ..ReadOptions::default() };
        let volume = read_bytes(name, bytes, &options).unwrap();
        assert_eq!(volume.source.notes, [Note::TrailingBytes(100), Note::HeaderUsed], "{name}");
        assert_eq!(volume.dims, DIMS);
    }
}

#[test]
fn other_codec_versions_are_refused() {
    let mut bytes = data("rate_4.zfp");
    bytes[3] = 4;
    let error = read_bytes("x", bytes, &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, Error::InvalidHeader { field: "magic", .. }), "{error}");
}

/// A header that claims `dims` of `ty` (0: i32 to 3: f64) and `mode`, followed by nothing.
fn header(dims: [u64; 3], ty: u64, mode: u64) -> Vec<u8> {
    let meta = ty | 2 << 2 | (dims[0] - 1) << 4 | (dims[1] - 1) << 20 | (dims[2] - 1) << 36;
    let bits = 0x0570_667a_u128 | u128::from(meta) << 32 | u128::from(mode) << 84;
    bits.to_le_bytes().to_vec()
}

#[test]
fn huge_claims_in_tiny_files_are_refused_before_anything_is_allocated() {
    let precision = 2048 + 15;
    for ty in 0..4 {
        for mode in [0, 63, 1023, 2047, precision, 2048 + 128, 3000] {
            let bytes = header([65536; 3], ty, mode);
            let error = read_bytes("x", bytes, &ReadOptions::default()).unwrap_err();
            let expected = matches!(error, Error::TooShort { .. } | Error::BitsPerBlock { .. });
            assert!(expected, "type {ty}, mode {mode}: {error}");
        }
    }
    // One axis: 2^20 voxels are fine for zfp, not here.
    let bits = 0x0570_667a_u128 | u128::from(2 | 0xf_ffff_u64 << 4) << 32 | 63 << 84;
    let error = read_bytes("x", bits.to_le_bytes().to_vec(), &ReadOptions::default()).unwrap_err();
    assert!(matches!(&error, Error::Dims { dims } if dims == &[1 << 20]), "{error}");
}

#[test]
fn non_finite_values_in_a_lossless_stream_are_named_or_replaced() {
    use zfp_rs::{ZfpBitStream, ZfpConfig, ZfpField, ZfpHeaderMask};
    let mut samples = vec![1.5f64; 6 * 5 * 4];
    samples[5 + 6 * (3 + 5 * 2)] = f64::NAN;
    samples[0] = -2.0;
    let field = ZfpField::new(&samples, [6usize, 5, 4]).unwrap();
    let mut stream = ZfpBitStream::new(1 << 16).unwrap();
    let config = ZfpConfig::reversible();
    stream.write_header(&config, &field.metadata(), ZfpHeaderMask::FULL).unwrap();
    stream.compress(&config, &field).unwrap();
    let bytes = stream.as_bytes();

    let error = read_bytes("x", bytes, &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, Error::NonFinite { voxel: [5, 3, 2], .. }), "{error}");

    let options = ReadOptions { replace_non_finite: Some(0.5), ..ReadOptions::default() };
    let volume = read_bytes("x", bytes, &options).unwrap();
    assert_eq!(volume.source.replaced, 1);
    assert!((volume.decode()[5 + 6 * (3 + 5 * 2)] - 0.5).abs() < 0.05);

    let options = ReadOptions { replace_non_finite: Some(f32::NAN), ..ReadOptions::default() };
    assert!(matches!(read_bytes("x", bytes, &options), Err(Error::Replacement { .. })));
}

#[test]
fn the_header_written_is_that_of_the_zfp_program() {
    let headerless = Some(Headerless { dims: DIMS, rate: 4.3 });
    let options = ReadOptions { headerless, ..ReadOptions::default() };
    for (input, expected) in [
        ("rate_4.zfp", "rate_4.zfp"),
        ("rate_4_3.zfp", "rate_4_3.zfp"),
        ("headerless_4_3.zfp", "rate_4_3.zfp"),
        ("rate_0_15.zfp", "rate_0_15.zfp"),
        ("rate_34_5.zfp", "rate_34_5.zfp"),
    ] {
        let mut written = Vec::new();
        let count = write_zfp(&read(input, &options), &mut written).unwrap();
        assert_eq!(count, written.len() as u64);
        // That program may end a stream at a byte; here it ends at a 64-bit word.
        let mut expected = data(expected);
        expected.resize(expected.len().next_multiple_of(8), 0);
        assert_eq!(written, expected, "{input}");
    }
}

#[test]
fn volumes_that_contradict_themselves_are_not_written() {
    let mut volume = encode(&[1.0; 64], [4, 4, 4], 4.0).unwrap();
    volume.dims = [5, 4, 4];
    assert!(matches!(write_zfp(&volume, Vec::new()), Err(Error::TooShort { .. })));
    volume.dims = [0, 4, 4];
    assert!(matches!(write_zfp(&volume, Vec::new()), Err(Error::Dims { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 64,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn written_files_are_read_back(
        dims in [1..11u32, 1..11u32, 1..11u32],
        rate in 0.1..36.0f64,
        seed in 0..1000u32,
    ) {
        let count = dims.iter().product::<u32>();
        let samples: Vec<f32> =
            (0..count).map(|i| (i.wrapping_mul(seed * 2 + 1) % 97) as f32 - 40.0).collect();
        let volume = encode(&samples, dims, rate).unwrap();
        let mut file = Vec::new();
        write_zfp(&volume, &mut file).unwrap();
        prop_assert_eq!(file.len() % 8, 0);
        let read = read_bytes("x.zfp", file.clone(), &ReadOptions::default()).unwrap();
        prop_assert_eq!(read.dims, dims);
        prop_assert_eq!(read.bits_per_block, volume.bits_per_block);
        prop_assert_eq!(read.first_bit, if read.bits_per_block > 2048 { 148 } else { 96 });
        prop_assert_eq!(bits(&read.decode()), bits(&volume.decode()));
        prop_assert_eq!(&read.source.notes[..], &[]);
        let mut again = Vec::new();
        write_zfp(&read, &mut again).unwrap();
        prop_assert_eq!(again, file);
    }
}
