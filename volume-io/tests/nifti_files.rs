//! NIfTI files written by nibabel (see `data/make_files.py`), and broken variants of them.

#![cfg(all(feature = "nifti", feature = "gzip"))]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use volume_io::{Error, Format, Note, ReadOptions, SampleType, encode, read_bytes, read_file};

const DIMS: [u32; 3] = [9, 7, 6];

fn path(name: &str) -> String {
    format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn data(name: &str) -> Vec<u8> {
    std::fs::read(path(name)).unwrap()
}

/// A rate that leaves small integers almost untouched.
fn options() -> ReadOptions {
    ReadOptions { rate: 30.0, ..ReadOptions::default() }
}

fn edited(name: &str, offset: usize, bytes: &[u8]) -> Vec<u8> {
    let mut file = data(name);
    file[offset..offset + bytes.len()].copy_from_slice(bytes);
    file
}

fn ramp(step: i64, first: i64) -> Vec<f32> {
    (0..9 * 7 * 6).map(|i| (first + step * i) as f32).collect()
}

#[test]
fn every_sample_type_is_read() {
    use SampleType::{F32, F64, I8, I16, I32, I64, U8, U16, U32, U64};
    for (name, ty) in [
        ("uint8", U8),
        ("int8", I8),
        ("uint16", U16),
        ("int16", I16),
        ("uint32", U32),
        ("int32", I32),
        ("uint64", U64),
        ("int64", I64),
        ("float32", F32),
        ("float64", F64),
    ] {
        let volume = read_file(path(&format!("{name}.nii")), &options()).unwrap();
        let shift = if name.starts_with('u') { 0.0 } else { 60.0 };
        let expected: Vec<f32> = (0..378).map(|i| (i % 120) as f32 - shift).collect();
        assert_eq!(volume.bytes, encode(&expected, DIMS, 30.0).unwrap().bytes, "{name}");
        let source = &volume.source;
        assert_eq!((source.format, source.sample_type), (Format::Nifti, ty), "{name}");
        assert!(source.encoded && source.distortion.unwrap().max < 1e-3, "{name}");
        assert_eq!(source.notes, []);
        assert_eq!(volume.geometry.origin, [-10.0, 20.5, 3.0]);
        assert_eq!(volume.geometry.spacing.map(|s| s as f32), [0.7, 1.0, 2.5]);
    }
}

#[test]
fn big_endian_and_gzip_are_read() {
    let volume = read_file(path("big_endian.nii.gz"), &options()).unwrap();
    assert_eq!(volume.bytes, encode(&ramp(50, -9000), DIMS, 30.0).unwrap().bytes);
    assert_eq!(volume.geometry.origin, [-10.0, 20.5, 3.0]);
}

#[test]
fn scaling_is_applied() {
    let volume = read_file(path("scaled.nii.gz"), &options()).unwrap();
    let expected = data("scaled.raw");
    let expected = expected.as_chunks::<8>().0.iter().map(|&b| f64::from_le_bytes(b));
    for (found, expected) in volume.decode().into_iter().zip(expected) {
        assert!((f64::from(found) - expected).abs() < 1e-5, "{found} {expected}");
    }
    assert_eq!(volume.source.sample_type, SampleType::I16);

    // A slope of zero means no scaling at all.
    let file = edited("int16.nii", 112, &[0.0f32.to_le_bytes(), 100.0f32.to_le_bytes()].concat());
    let unscaled = read_bytes("x", file, &options()).unwrap();
    assert_eq!(unscaled.bytes, read_file(path("int16.nii"), &options()).unwrap().bytes);
    let file = edited("int16.nii", 112, &[2.0f32.to_le_bytes(), 100.0f32.to_le_bytes()].concat());
    let scaled = read_bytes("x", file, &options()).unwrap();
    assert!((scaled.decode()[3] - (2.0 * (3.0 - 60.0) + 100.0)).abs() < 1e-3);
}

#[test]
fn mirrored_axes_leave_the_origin_out() {
    let volume = read_file(path("mirrored.nii.gz"), &options()).unwrap();
    assert_eq!(volume.geometry.origin, [0.0; 3]);
    assert_eq!(volume.source.notes, [Note::OriginIgnored]);
    assert_eq!(volume.geometry.spacing.map(|s| s as f32), [0.7, 1.0, 2.5]);
}

#[test]
fn the_quaternion_places_a_volume_without_sform() {
    // sform_code is at 254; qform_code at 252 with offsets from 268; quaternion from 256.
    let mut file = edited("int16.nii", 252, &[1, 0, 0, 0]);
    for (i, value) in [0.0f32, 0.0, 0.0, 4.0, 5.0, 6.0].into_iter().enumerate() {
        file[256 + 4 * i..][..4].copy_from_slice(&value.to_le_bytes());
    }
    let volume = read_bytes("x", file.clone(), &options()).unwrap();
    assert_eq!((volume.geometry.origin, volume.source.notes), ([4.0, 5.0, 6.0], vec![]));

    file[256..260].copy_from_slice(&1.0f32.to_le_bytes());
    let turned = read_bytes("x", file.clone(), &options()).unwrap();
    assert_eq!(turned.source.notes, [Note::OriginIgnored], "half a turn about x");

    file[252] = 0;
    let unplaced = read_bytes("x", file, &options()).unwrap();
    assert_eq!((unplaced.geometry.origin, unplaced.source.notes), ([0.0; 3], vec![]));
}

#[test]
fn one_volume_of_a_series_is_chosen() {
    let read = |time_index| {
        let options = ReadOptions { time_index, ..options() };
        read_file(path("series.nii.gz"), &options)
    };
    assert!(matches!(read(None), Err(Error::SeveralVolumes { count: 3 })));
    assert!(matches!(read(Some(3)), Err(Error::TimeIndex { index: 3, count: 3 })));
    for index in 0..3 {
        let volume = read(Some(index)).unwrap();
        assert_eq!(volume.value_range(), [5.0 + index as f32; 2]);
        assert_eq!(volume.source.notes, [Note::VolumeChosen { index, count: 3 }]);
    }
}

#[test]
fn broken_headers_say_which_field() {
    let field = |offset, bytes: &[u8]| match read_bytes(
        "x",
        edited("int16.nii", offset, bytes),
        &options(),
    )
    .unwrap_err()
    {
        Error::InvalidHeader { format: Format::Nifti, field, .. } => field,
        other => panic!("{other}"),
    };
    assert_eq!(field(0, &[0, 0, 0, 0]), "sizeof_hdr");
    assert_eq!(field(40, &[0, 0]), "dim[0]");
    assert_eq!(field(42, &[0, 0]), "dim");
    assert_eq!(field(44, &[0xff, 0xff]), "dim");
    assert_eq!(field(70, &[3, 0]), "header");
    assert_eq!(field(108, &100.0f32.to_le_bytes()), "vox_offset");
    assert_eq!(field(108, &f32::NAN.to_le_bytes()), "vox_offset");

    let error = read_bytes("x", edited("int16.nii", 70, &[128, 0]), &options()).unwrap_err();
    assert!(matches!(error, Error::Unsupported { format: Format::Nifti, .. }), "{error}");
    let error = read_bytes("x", edited("int16.nii", 344, b"ni1\0"), &options()).unwrap_err();
    assert!(matches!(error, Error::Unsupported { format: Format::Nifti, .. }), "{error}");
}

#[test]
fn short_files_and_trailing_bytes_are_counted() {
    let mut file = data("int16.nii");
    let whole = file.len() as u64;
    let error = read_bytes("x", &file[..file.len() - 1], &options()).unwrap_err();
    let expected = matches!(error, Error::TooShort { expected, found } if expected == whole && found == whole - 1);
    assert!(expected, "{error}");
    file.extend([0; 5]);
    let volume = read_bytes("x", file, &options()).unwrap();
    assert_eq!(volume.source.notes, [Note::TrailingBytes(5)]);

    let zipped = data("big_endian.nii.gz");
    let error = read_bytes("x", &zipped[..zipped.len() - 30], &options()).unwrap_err();
    assert!(matches!(error, Error::Io { .. } | Error::TooShort { .. }), "{error}");
}

#[test]
fn huge_claims_in_tiny_files_are_refused() {
    let sizes = [0xff, 0x7f].repeat(3);
    let error = read_bytes("x", edited("float64.nii", 42, &sizes), &options()).unwrap_err();
    assert!(matches!(error, Error::TooShort { .. }), "{error}");
    // In a gzip stream the true length shows only at its end.
    let mut zipped = Vec::new();
    let mut encoder = flate2::read::GzEncoder::new(
        std::io::Cursor::new(edited("float64.nii", 42, &sizes)),
        flate2::Compression::fast(),
    );
    std::io::Read::read_to_end(&mut encoder, &mut zipped).unwrap();
    let error = read_bytes("x", zipped, &options()).unwrap_err();
    assert!(matches!(error, Error::TooShort { .. }), "{error}");
}

#[test]
fn non_finite_voxels_are_named_or_replaced() {
    let at = 352 + 4 * (8 + 9 * (6 + 7 * 5));
    let mut file = edited("float32.nii", at, &f32::INFINITY.to_le_bytes());
    file[352 + 4 * 3..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let error = read_bytes("x", file.clone(), &options()).unwrap_err();
    assert!(matches!(error, Error::NonFinite { voxel: [3, 0, 0], .. }), "{error}");

    let replacing = ReadOptions { replace_non_finite: Some(-1.0), ..options() };
    let volume = read_bytes("x", file, &replacing).unwrap();
    assert_eq!(volume.source.replaced, 2);
    let decoded = volume.decode();
    assert!((decoded[3] + 1.0).abs() < 1e-3 && (decoded[377] + 1.0).abs() < 1e-3);

    let file = edited("float32.nii", at, &1.0e38f32.to_le_bytes());
    let error = read_bytes("x", file, &replacing).unwrap_err();
    assert!(matches!(error, Error::TooLarge { voxel: [8, 6, 5], .. }), "{error}");
    let file = edited("float64.nii", 352 + 8 * 9, &(-1.0e300f64).to_le_bytes());
    let error = read_bytes("x", file, &options()).unwrap_err();
    assert!(matches!(error, Error::TooLarge { voxel: [0, 1, 0], .. }), "{error}");
}
