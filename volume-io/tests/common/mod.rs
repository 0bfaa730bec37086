//! The volume that `data/make_reader_files.py` writes in every format, and ways to break files.

#![allow(dead_code, reason = "every test file uses some of it")]

use volume_io::{Error, Format, ReadOptions, SampleType, ZfpVolume, encode, read_bytes, read_file};

pub(crate) const DIMS: [u32; 3] = [7, 5, 6];
pub(crate) const SPACING: [f64; 3] = [0.5, 1.25, 2.0];
pub(crate) const ORIGIN: [f64; 3] = [-10.0, 20.5, 3.0];

/// A rate that leaves the values of the files almost untouched.
pub(crate) const RATE: f64 = 30.0;

pub(crate) fn path(name: &str) -> String {
    format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"))
}

pub(crate) fn data(name: &str) -> Vec<u8> {
    std::fs::read(path(name)).unwrap()
}

/// An empty folder to write to.
pub(crate) fn folder(name: &str) -> String {
    let folder = format!("{}/{name}", env!("CARGO_TARGET_TMPDIR"));
    if std::fs::exists(&folder).unwrap() {
        std::fs::remove_dir_all(&folder).unwrap();
    }
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

pub(crate) fn options() -> ReadOptions {
    ReadOptions { rate: RATE, ..ReadOptions::default() }
}

/// Reads through the file system, and checks that the bytes alone give the same.
pub(crate) fn read(name: &str, options: &ReadOptions) -> ZfpVolume {
    let volume = read_file(path(name), options).unwrap_or_else(|error| panic!("{name}: {error}"));
    let other = read_bytes(name, data(name), options).unwrap();
    assert_eq!(other.bytes, volume.bytes, "{name}");
    assert_eq!((other.geometry, &other.source), (volume.geometry, &volume.source), "{name}");
    volume
}

/// The values of the files for a type of samples.
pub(crate) fn ramp(ty: SampleType) -> Vec<f32> {
    use SampleType::{F16, F32, F64, I8, I16, I32, I64};
    let value = |n: u16| match ty {
        I8 | I16 | I32 | I64 => f32::from(n) - 100.0,
        F16 | F32 | F64 => f32::from(n) / 2.0 - 3.0,
        _ => f32::from(n),
    };
    (0..7 * 5 * 6).map(value).collect()
}

/// Whether a volume was encoded from exactly these samples.
pub(crate) fn assert_samples(volume: &ZfpVolume, dims: [u32; 3], expected: &[f32], name: &str) {
    assert_eq!(volume.dims, dims, "{name}");
    assert_eq!(volume.bytes, encode(expected, dims, RATE).unwrap().bytes, "{name}");
    assert!(volume.source.encoded && volume.source.distortion.unwrap().max < 1e-3, "{name}");
}

/// Reads a file with the whole ramp and checks all about it except the notes.
pub(crate) fn assert_ramp(name: &str, format: Format, ty: SampleType, placed: bool) -> ZfpVolume {
    let volume = read(name, &options());
    assert_samples(&volume, DIMS, &ramp(ty), name);
    assert_eq!((volume.source.format, volume.source.sample_type), (format, ty), "{name}");
    let (spacing, origin) = if placed { (SPACING, ORIGIN) } else { ([1.0; 3], [0.0; 3]) };
    assert_eq!(volume.geometry.spacing, spacing, "{name}");
    assert_eq!(volume.geometry.origin, origin, "{name}");
    volume
}

/// A file with some bytes replaced.
pub(crate) fn edited(name: &str, offset: usize, bytes: &[u8]) -> Vec<u8> {
    let mut file = data(name);
    file[offset..offset + bytes.len()].copy_from_slice(bytes);
    file
}

/// A file with the first occurrence of a text replaced.
pub(crate) fn replaced(name: &str, from: &str, to: &str) -> Vec<u8> {
    let file = data(name);
    let at = file.windows(from.len()).position(|window| window == from.as_bytes());
    let at = at.unwrap_or_else(|| panic!("{name} holds no {from:?}"));
    [&file[..at], to.as_bytes(), &file[at + from.len()..]].concat()
}

pub(crate) fn error_of(bytes: Vec<u8>) -> Error {
    read_bytes("x", bytes, &options()).unwrap_err()
}

/// The header field that an error complains about; checks that it says what was expected.
pub(crate) fn field_of(bytes: Vec<u8>, format: Format) -> &'static str {
    match error_of(bytes) {
        Error::InvalidHeader { format: found, field, expected, .. } if found == format => {
            assert!(!expected.is_empty());
            field
        }
        other => panic!("{other}"),
    }
}

/// Whether a file is valid but of a kind that cannot be read.
pub(crate) fn assert_unsupported(bytes: Vec<u8>, format: Format) {
    let error = error_of(bytes);
    let expected = matches!(error, Error::Unsupported { format: found, .. } if found == format);
    assert!(expected, "{error}");
}

/// Every proper prefix of a file is an error, and one inside the data counts its bytes.
pub(crate) fn assert_truncations_fail(name: &str, data_bytes: usize) {
    let file = data(name);
    for length in 0..file.len() {
        let error = read_bytes("x", &file[..length], &options()).unwrap_err();
        if length >= file.len() - data_bytes {
            let counted = matches!(error, Error::TooShort { expected, found }
                if found < expected && found == length as u64 && expected == file.len() as u64);
            assert!(counted, "{name} {length}: {error}");
        }
    }
}
