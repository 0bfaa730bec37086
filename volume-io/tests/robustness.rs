//! No sequence of bytes makes a reader panic, and every volume that is read can be used.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use proptest::prelude::*;
use volume_io::{
    Headerless, Histogram, RawLayout, ReadOptions, SampleType, ZfpVolume, read_bytes, write_zfp,
};

const FILES: [&str; 17] = [
    "accuracy.zfp",
    "big_endian.nii.gz",
    "expert.zfp",
    "f64_reversible.zfp",
    "float32.nii",
    "float64.nii",
    "i32_reversible.zfp",
    "i64_precision.zfp",
    "int8.nii",
    "rank_1.zfp",
    "rank_2.zfp",
    "rate_0_15.zfp",
    "rate_34_5.zfp",
    "rate_4_3.zfp",
    "reversible.zfp",
    "scaled.nii.gz",
    "series.nii.gz",
];

const RAW: [&str; 2] = ["raw/ramp_7x5x6_float64.raw", "raw/zipped_7x5x6_uint16.raw.gz"];

const NPY: [&str; 6] = [
    "npy/fortran.npy",
    "npy/record.npy",
    "npy/series.npy",
    "npy/slice_fortran.npy",
    "npy/version_3.npy",
    "npy/zipped.npy.gz",
];

const NRRD: [&str; 6] = [
    "nrrd/big_endian.nrrd",
    "nrrd/detached_raw.nhdr",
    "nrrd/gzip.nrrd",
    "nrrd/spacings.nrrd",
    "nrrd/turned.nrrd",
    "nrrd/vectors.nrrd",
];

const VTI: [&str; 9] = [
    "vti/appended_32.vti",
    "vti/appended_base64_zlib_64.vti",
    "vti/appended_zlib_32.vti",
    "vti/ascii_float64.vti",
    "vti/ascii_int8.vti",
    "vti/big_endian.vti",
    "vti/binary_zlib_32.vti",
    "vti/cells_binary.vti",
    "vti/several.vti",
];

const MRC: [&str; 6] = [
    "mrc/big_endian.mrc",
    "mrc/extended.mrc",
    "mrc/float16.mrc",
    "mrc/order_312.mrc",
    "mrc/stack.mrc",
    "mrc/zipped.mrc.gz",
];

/// Names and contents of some files.
fn files(names: &[&'static str]) -> Vec<(&'static str, Vec<u8>)> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data");
    names.iter().map(|name| (*name, std::fs::read(format!("{folder}/{name}")).unwrap())).collect()
}

fn options() -> impl Strategy<Value = ReadOptions> {
    let headerless = prop::option::of((any::<[u32; 3]>(), any::<f64>(), [1..20u32, 1..20, 1..20]));
    (headerless, any::<bool>(), prop::option::of(0..3u32)).prop_map(|(layout, replace, index)| {
        ReadOptions {
            rate: 1.5,
            replace_non_finite: replace.then_some(0.0),
            headerless: layout.map(|(wild, rate, small)| Headerless {
                dims: if rate.is_nan() { wild } else { small },
                rate: if rate.abs() > 100.0 { 2.0 } else { rate },
            }),
            time_index: index,
            big_endian: replace,
            array: index.map(|index| ["density", "last", ""][index as usize % 3].into()),
            ..ReadOptions::default()
        }
    })
}

/// Reads, and where that succeeds uses what was read. Mutated headers may claim volumes that a
/// zero block of one bit can really back: those are read but not decoded here.
fn exercise(name: &str, bytes: &[u8], options: &ReadOptions) {
    let Ok(volume) = read_bytes(name, bytes, options) else { return };
    check(&volume);
}

fn check(volume: &ZfpVolume) {
    let end = volume.first_bit + volume.block_count() * u64::from(volume.bits_per_block);
    assert!(volume.bytes.len() as u64 * 8 >= end, "the stream is complete: {volume:?}");
    assert!(volume.dims.iter().all(|&n| (1..=65536).contains(&n)));
    assert!(volume.geometry.spacing.iter().all(|&s| s > 0.0 && s.is_finite()));
    assert!(volume.geometry.origin.iter().all(|o| o.is_finite()));
    if volume.voxel_count() > 1 << 16 {
        return;
    }
    assert!(volume.decode().iter().all(|v| v.is_finite()));
    let [min, max] = volume.value_range();
    let isovalue = volume.histogram(16).suggested_isovalue();
    assert!(min <= isovalue && isovalue <= max, "{min} {isovalue} {max}");
    write_zfp(volume, std::io::sink()).unwrap();
}

/// One change to a file.
#[derive(Clone, Debug)]
enum Mutation {
    Set(prop::sample::Index, u8),
    Flip(prop::sample::Index, u8),
    Truncate(prop::sample::Index),
    Append(Vec<u8>),
    Copy(prop::sample::Index, prop::sample::Index, usize),
}

impl Mutation {
    fn apply(&self, bytes: &mut Vec<u8>) {
        if bytes.is_empty() {
            return;
        }
        let length = bytes.len();
        match self {
            Self::Set(at, value) => bytes[at.index(length)] = *value,
            Self::Flip(at, bit) => bytes[at.index(length)] ^= 1 << bit,
            Self::Truncate(at) => bytes.truncate(at.index(length)),
            Self::Append(more) => bytes.extend(more),
            Self::Copy(from, to, count) => {
                let (from, to) = (from.index(length), to.index(length));
                let count = (*count).min(length - from).min(length - to);
                bytes.copy_within(from..from + count, to);
            }
        }
    }
}

fn mutation() -> impl Strategy<Value = Mutation> {
    let index = any::<prop::sample::Index>;
    // Headers are short compared with the data; half of the changes aim at them.
    let value = prop_oneof![Just(0u8), Just(0xff), Just(0x7f), Just(0x80), any::<u8>()];
    prop_oneof![
        4 => (index(), value).prop_map(|(at, value)| Mutation::Set(at, value)),
        4 => (index(), 0..8u8).prop_map(|(at, bit)| Mutation::Flip(at, bit)),
        1 => index().prop_map(Mutation::Truncate),
        1 => prop::collection::vec(any::<u8>(), 0..64).prop_map(Mutation::Append),
        1 => (index(), index(), 0..64usize).prop_map(|(a, b, n)| Mutation::Copy(a, b, n)),
    ]
}

/// A file with some changes, of which some are digits, since headers are often text.
fn changed_file(names: &[&'static str]) -> impl Strategy<Value = (&'static str, Vec<u8>)> {
    let changes = prop::collection::vec(mutation(), 0..6);
    let header = prop::collection::vec((0..400usize, any::<u8>()), 0..3);
    let digits = prop::collection::vec((any::<prop::sample::Index>(), b'0'..=b'9'), 0..3);
    let file = prop::sample::select(files(names));
    (file, changes, header, digits).prop_map(|((name, mut bytes), changes, header, digits)| {
        for change in &changes {
            change.apply(&mut bytes);
        }
        for (at, value) in header {
            if let Some(byte) = bytes.get_mut(at) {
                *byte = value;
            }
        }
        let places: Vec<usize> = (0..bytes.len()).filter(|&i| bytes[i].is_ascii_digit()).collect();
        for (at, digit) in digits {
            if !places.is_empty() {
                bytes[places[at.index(places.len())]] = digit;
            }
        }
        (name, bytes)
    })
}

/// Something that an image may be made of.
fn tag_part() -> impl Strategy<Value = String> {
    let known = prop::sample::select(vec![
        "type=\"ImageData\" byte_order=\"BigEndian\">",
        "type=\"ImageData\" compressor=\"vtkZLibDataCompressor\">",
        "<ImageData WholeExtent=\"0 1 0 1 0 0\" Spacing=\"1 0 -1\">",
        "<Piece Extent=\"0 1 0 1 0 0\">",
        "<PointData>",
        "<CellData Scalars=\"a\">",
        "<DataArray type=\"UInt8\" format=\"ascii\">",
        "<DataArray type=\"Int16\" Name=\"a\" format=\"binary\">",
        "<DataArray type=\"Float32\" format=\"appended\" offset=\"0\">",
        "</PointData>",
        "<AppendedData encoding=\"raw\">_",
        "<AppendedData encoding=\"base64\"> _",
        "AAAAEAAAAAAAAA==",
        "1 2 3 4 ",
        "<!--",
        "-->",
        "</VTKFile>",
    ]);
    prop_oneof![4 => known.prop_map(String::from), 1 => "[ -~]{0,6}"]
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 2000,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn random_bytes(
        bytes in prop::collection::vec(any::<u8>(), 0..600),
        start in prop::sample::select(vec![&b""[..], b"zfp\x05", b"zfp", b"\x1f\x8b\x08\0"]),
        options in options(),
    ) {
        let mut file = start.to_vec();
        file.extend(bytes);
        exercise("fuzz.zfp", &file, &options);
    }

    #[test]
    fn random_bytes_behind_a_nifti_magic(
        mut bytes in prop::collection::vec(any::<u8>(), 348..600),
        dims in prop::collection::vec(0..9i16, 8),
        options in options(),
    ) {
        bytes[0..4].copy_from_slice(&348i32.to_le_bytes());
        for (i, n) in dims.iter().enumerate() {
            bytes[40 + 2 * i..][..2].copy_from_slice(&n.to_le_bytes());
        }
        bytes[344..348].copy_from_slice(b"n+1\0");
        bytes[108..112].copy_from_slice(&352.0f32.to_le_bytes());
        exercise("fuzz.nii", &bytes, &options);
    }

    #[test]
    fn mutated_files(changed in changed_file(&FILES), options in options()) {
        exercise(changed.0, &changed.1, &options);
    }

    #[test]
    fn mutated_raw_files(
        changed in changed_file(&RAW),
        options in options(),
        layout in prop::option::of(([0..9u32, 0..9, 0..9], prop::sample::select(SampleType::ALL))),
    ) {
        let raw = layout.map(|(dims, sample_type)| RawLayout { dims, sample_type });
        exercise(changed.0, &changed.1, &ReadOptions { raw, ..options });
    }

    #[test]
    fn mutated_npy_files(changed in changed_file(&NPY), options in options()) {
        exercise(changed.0, &changed.1, &options);
    }

    #[test]
    fn mutated_nrrd_files(changed in changed_file(&NRRD), options in options()) {
        exercise(changed.0, &changed.1, &options);
    }

    #[test]
    fn mutated_vti_files(changed in changed_file(&VTI), options in options()) {
        exercise(changed.0, &changed.1, &options);
    }

    #[test]
    fn mutated_mrc_files(changed in changed_file(&MRC), options in options()) {
        exercise(changed.0, &changed.1, &options);
    }

    #[test]
    fn text_between_tags(
        parts in prop::collection::vec(tag_part(), 0..30),
        options in options(),
    ) {
        exercise("fuzz.vti", format!("<VTKFile {}", parts.concat()).as_bytes(), &options);
    }

    #[test]
    fn any_stream_of_floats(
        bytes in prop::collection::vec(any::<u8>(), 0..400),
        dims in [1..9u32, 1..9u32, 1..9u32],
        bits in 0..300u32,
        first_bit in prop_oneof![0..200u64, any::<u64>()],
    ) {
        if let Ok(volume) = ZfpVolume::from_stream(dims, bits, first_bit, bytes) {
            check(&volume);
        }
    }
}

#[test]
fn a_volume_with_changed_fields_is_still_safe_to_use() {
    let mut volume = volume_io::encode(&[1.0; 64], [4, 4, 4], 4.0).unwrap();
    volume.dims = [9, 9, 9];
    volume.first_bit = u64::MAX - 3;
    volume.bits_per_block = u32::MAX;
    assert_eq!(volume.decode().len(), 729);
    volume.dims = [0, 4, u32::MAX];
    assert_eq!(volume.decoded_blocks().count(), 0);
    assert_eq!(volume.value_range(), [0.0; 2]);
    let block = volume.decode_block(u64::MAX);
    assert_eq!(block.voxels().count(), 0);
    let mut histogram = Histogram::new([f32::NAN, f32::INFINITY], 0);
    histogram.add(3.0);
    assert_eq!(histogram.counts(), [1]);
}
