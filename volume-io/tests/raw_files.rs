//! Raw files written by NumPy (see `data/make_reader_files.py`), and layouts that do not fit.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use common::{DIMS, assert_ramp, assert_samples, data, options, ramp, read};
use volume_io::{Error, Format, RawLayout, ReadOptions, SampleType, read_bytes};

#[test]
fn names_say_what_is_in_a_file() {
    for &ty in SampleType::ALL {
        let name = format!("raw/ramp_7x5x6_{}.raw", ty.raw_name());
        let volume = assert_ramp(&name, Format::Raw, ty, false);
        assert_eq!(volume.source.notes, []);
    }
}

#[test]
fn options_say_what_names_do_not() {
    let layout = RawLayout { dims: DIMS, sample_type: SampleType::I16 };
    let options = ReadOptions { raw: Some(layout), big_endian: true, ..options() };
    let volume = read("raw/big_endian.dat", &options);
    assert_samples(&volume, DIMS, &ramp(SampleType::I16), "big-endian");

    // What is given counts more than the name.
    let layout = RawLayout { dims: [5, 7, 6], sample_type: SampleType::I8 };
    let options = ReadOptions { raw: Some(layout), ..options };
    let volume = read("raw/ramp_7x5x6_uint8.raw", &options);
    let expected: Vec<f32> = (0..210u8).map(|n| f32::from(n.cast_signed())).collect();
    assert_samples(&volume, [5, 7, 6], &expected, "int8");
}

#[cfg(feature = "gzip")]
#[test]
fn compressed_files_are_read_under_the_same_names() {
    let name = "raw/zipped_7x5x6_uint16.raw.gz";
    assert_ramp(name, Format::Raw, SampleType::U16, false);
    let layout = |dims| {
        let raw = Some(RawLayout { dims, sample_type: SampleType::U16 });
        volume_io::read_file(common::path(name), &ReadOptions { raw, ..options() })
    };
    let error = layout([7, 5, 5]).unwrap_err();
    assert!(matches!(error, Error::RawLength { expected: 350, found: 420, .. }), "{error}");
    let error = layout([7, 5, 7]).unwrap_err();
    assert!(matches!(error, Error::TooShort { expected: 490, found: 420 }), "{error}");
    // A checksum that does not fit.
    let mut file = data(name);
    let end = file.len();
    file[end - 6] ^= 1;
    let error = read_bytes(name, file, &options()).unwrap_err();
    assert!(matches!(error, Error::Io { .. }), "{error}");
}

#[test]
fn samples_that_look_like_a_header_are_samples() {
    for start in [&b"zfp\x05"[..], b"\x1f\x8b\x08\0", b"\x93NUMPY", b"NRRD0004\n", b"<?xml "] {
        let mut file = data("raw/ramp_7x5x6_uint8.raw");
        file[..start.len()].copy_from_slice(start);
        let volume = read_bytes("a/x_7x5x6_uint8.raw", file, &options()).unwrap();
        assert_eq!(volume.source.format, Format::Raw);
    }
}

#[test]
fn lengths_and_names_that_do_not_fit_are_refused() {
    let file = data("raw/ramp_7x5x6_uint8.raw");
    let read = |name: &str| read_bytes(name, &file[..], &options()).unwrap_err();
    for (name, expected) in [("x_7x5x6_uint16.raw", 420), ("x_7x5x5_uint8.raw", 175)] {
        let error = read(name);
        let counted =
            matches!(error, Error::RawLength { expected: e, found: 210, .. } if e == expected);
        assert!(counted, "{error}");
        assert!(error.to_string().contains("found 210"), "{error}");
    }
    for name in ["x.raw", "x_7x5x6_byte.raw", "x_7x5_uint8.raw"] {
        let error = read(name);
        assert!(matches!(error, Error::RawNeedsLayout { .. }), "{name}: {error}");
        assert!(error.to_string().contains("NAME_XxYxZ_TYPE.raw"), "{error}");
    }
    for name in ["x_0x5x6_uint8.raw", "x_70000x5x6_uint8.raw", "x_65536x65536x65536_float64.raw"] {
        let error = read(name);
        assert!(matches!(error, Error::Dims { .. } | Error::RawLength { .. }), "{name}: {error}");
    }
    let error = read_bytes("x_7x5x6_uint8.raw", &[][..], &options()).unwrap_err();
    assert!(matches!(error, Error::RawLength { found: 0, .. }), "{error}");
}

#[test]
fn non_finite_samples_are_named_or_replaced() {
    let name = "x_7x5x6_float32.raw";
    let mut file = data("raw/ramp_7x5x6_float32.raw");
    let at = 4 * (3 + 7 * (2 + 5 * 4));
    file[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let error = read_bytes(name, file.clone(), &options()).unwrap_err();
    assert!(matches!(error, Error::NonFinite { voxel: [3, 2, 4], .. }), "{error}");
    let replacing = ReadOptions { replace_non_finite: Some(0.5), ..options() };
    let volume = read_bytes(name, file, &replacing).unwrap();
    let mut expected = ramp(SampleType::F32);
    expected[at / 4] = 0.5;
    assert_samples(&volume, DIMS, &expected, "replaced");
    assert_eq!(volume.source.replaced, 1);
}
