//! Conversion that streams: the same bytes as reading and writing, without the volume in memory.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::io::{self, Write};

use common::{data, options, path};
use proptest::prelude::*;
use volume_io::{
    BlockEncoder, Error, Format, Headerless, ReadOptions, StreamEncoder, ZfpVolume, convert_bytes,
    convert_file, encode, raw_file_name, read_bytes, read_file, write_npy, write_nrrd, write_raw,
    write_zfp,
};

fn convert(name: &str, options: &ReadOptions) -> (Vec<u8>, volume_io::Conversion) {
    let (mut bytes, mut calls) = (Vec::new(), Vec::new());
    let conversion =
        convert_file(path(name), &mut bytes, options, |done, total| calls.push((done, total)))
            .unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!(conversion.bytes, bytes.len() as u64, "{name}");
    let total = conversion.dims.iter().map(|n| u64::from(n.div_ceil(4))).product();
    assert_eq!(calls.last(), Some(&(total, total)), "{name}");
    let mut again = Vec::new();
    if !name.ends_with("hdr") {
        convert_bytes(name, &data(name), &mut again, options, |_, _| ()).unwrap();
        assert_eq!(again, bytes, "{name}");
    }
    assert!(calls.is_sorted() && calls.iter().all(|call| call.1 == total), "{name}: {calls:?}");
    (bytes, conversion)
}

#[test]
fn conversion_writes_what_reading_and_writing_would() {
    for name in [
        "raw/ramp_7x5x6_int16.raw",
        "raw/ramp_7x5x6_float64.raw",
        "npy/fortran.npy",
        "npy/float16.npy",
        "nrrd/int8.nrrd",
        "mrc/order_213.mrc",
        "mrc/order_312.mrc",
        "accuracy.zfp",
        "f64_rate.zfp",
        "rank_2.zfp",
        #[cfg(feature = "vti")]
        "vti/appended_base64_zlib_64.vti",
        #[cfg(feature = "vti")]
        "vti/uint16.vti",
        #[cfg(feature = "gzip")]
        "nrrd/gzip.nrrd",
        #[cfg(all(feature = "nifti", feature = "gzip"))]
        "big_endian.nii.gz",
        #[cfg(feature = "nifti")]
        "pair/plain.hdr",
    ] {
        for rate in [3.3, 36.0] {
            let options = ReadOptions { rate, ..ReadOptions::default() };
            let (found, conversion) = convert(name, &options);
            let volume = read_file(path(name), &options).unwrap();
            let mut expected = Vec::new();
            write_zfp(&volume, &mut expected).unwrap();
            assert_eq!(found, expected, "{name} {rate}");
            assert_eq!(conversion.source, volume.source, "{name}");
            assert_eq!(conversion.geometry, volume.geometry, "{name}");
            assert_eq!(conversion.bits_per_block, volume.bits_per_block, "{name}");
            assert_eq!(conversion.dims, volume.dims, "{name}");
        }
    }
}

#[test]
fn fixed_rate_streams_are_kept_or_get_the_rate_asked_for() {
    let rate = |rate| ReadOptions { rate, ..ReadOptions::default() };
    let (kept, conversion) = convert("rate_4.zfp", &rate(4.0));
    // Only zeros that fill the last word may follow.
    let (file, rest) = kept.split_at(data("rate_4.zfp").len());
    assert_eq!(file, data("rate_4.zfp"));
    assert!(rest.len() < 8 && rest.iter().all(|&byte| byte == 0));
    assert!(!conversion.source.encoded && conversion.source.distortion.is_none());

    let (changed, conversion) = convert("rate_4.zfp", &rate(9.0));
    let original = read_file(path("rate_4.zfp"), &rate(4.0)).unwrap();
    let expected = encode(&original.decode(), original.dims, 9.0).unwrap();
    let changed = read_bytes("x", changed, &ReadOptions::default()).unwrap();
    assert_eq!(changed.decode(), expected.decode());
    assert_eq!(conversion.bits_per_block, 576);
    assert!(conversion.source.encoded && conversion.source.distortion.is_some());

    let headerless = Some(Headerless { dims: [9, 7, 6], rate: 4.3 });
    for rate in [4.3, 20.0] {
        let options = ReadOptions { rate, headerless, ..ReadOptions::default() };
        let (bytes, conversion) = convert("headerless_4_3.zfp", &options);
        assert_eq!(conversion.source.format, Format::ZfpHeaderless);
        let volume = read_bytes("x", bytes, &ReadOptions::default()).unwrap();
        assert_eq!((volume.rate() * 64.0).round(), (rate * 64.0).round());
    }
}

#[cfg(feature = "nifti")]
#[test]
fn nifti_pairs_are_read_from_either_file() {
    use common::{DIMS, ORIGIN, SPACING};
    use volume_io::SampleType;
    let types = if cfg!(feature = "gzip") {
        &[("plain", SampleType::I16), ("zipped", SampleType::F32)][..]
    } else {
        &[("plain", SampleType::I16)]
    };
    for &(name, ty) in types {
        let ending = if name == "zipped" { ".gz" } else { "" };
        let volume = read_file(path(&format!("pair/{name}.hdr{ending}")), &options()).unwrap();
        common::assert_samples(&volume, DIMS, &common::ramp(ty), name);
        assert_eq!((volume.geometry.spacing, volume.geometry.origin), (SPACING, ORIGIN));
        assert_eq!((volume.source.format, volume.source.notes), (Format::Nifti, vec![]));
    }
    let image = read_file(path("pair/plain.img"), &options()).unwrap();
    assert_eq!(image.dims, DIMS);

    let folder = common::folder("pair");
    let header = format!("{folder}/alone.hdr");
    std::fs::write(&header, data("pair/plain.hdr")).unwrap();
    let error = read_file(&header, &options()).unwrap_err();
    let named = matches!(&error, Error::Io { name, .. } if name.ends_with("alone.img"));
    assert!(named, "{error}");
    std::fs::write(format!("{folder}/alone.img"), &data("pair/plain.img")[..400]).unwrap();
    let error = read_file(&header, &options()).unwrap_err();
    assert!(matches!(error, Error::TooShort { expected: 420, found: 400 }), "{error}");
    let other = format!("{folder}/header.x");
    std::fs::write(&other, data("pair/plain.hdr")).unwrap();
    let error = read_file(&other, &options()).unwrap_err();
    assert!(matches!(error, Error::SecondFile { .. }), "{error}");
}

#[cfg(feature = "gzip")]
#[test]
fn zfp_streams_may_be_compressed() {
    let zipped = |bytes: &[u8]| {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    };
    for name in ["rate_4.zfp", "rate_34_5.zfp", "accuracy.zfp", "i64_precision.zfp"] {
        let plain = read_file(path(name), &options()).unwrap();
        let file = zipped(&data(name));
        let volume = read_bytes(&format!("{name}.gz"), file, &options()).unwrap();
        assert_eq!((volume.bytes, volume.source), (plain.bytes, plain.source), "{name}");
    }
    let headerless = Some(Headerless { dims: [9, 7, 6], rate: 4.3 });
    let options = ReadOptions { headerless, ..options() };
    let file = zipped(&data("headerless_4_3.zfp"));
    assert_eq!(read_bytes("x.zfp.gz", file, &options).unwrap().dims, [9, 7, 6]);
    let error = read_bytes("x", zipped(&zipped(b"zfp")), &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, Error::UnknownFormat { .. }), "{error}");
    use volume_io::Note;
    // A stream followed by far more than it can need.
    let long = [data("rate_4.zfp"), vec![0; 1 << 20]].concat();
    let volume = read_bytes("x", zipped(&long), &ReadOptions::default()).unwrap();
    assert!(volume.bytes.len() < 1000, "{}", volume.bytes.len());
    assert!(matches!(volume.source.notes[..], [Note::TrailingBytes(_)]));
}

/// Fails after some bytes.
struct Full(usize);

impl Write for Full {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0 = self.0.checked_sub(bytes.len()).ok_or(io::ErrorKind::StorageFull)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn failing_writers_and_broken_inputs_are_errors() {
    let volume = encode(&[1.0; 64 * 512], [32, 32, 32], 36.0).unwrap();
    for room in [0, 20, 100_000] {
        let mut encoder = StreamEncoder::new([32, 32, 32], 36.0, Full(room)).unwrap();
        let pushed = (0..512).try_for_each(|_| encoder.push(&[1.0; 64]));
        let error = pushed.and_then(|()| encoder.finish().map(drop)).unwrap_err();
        assert!(matches!(error, Error::Io { .. }), "{error}");
        for write in [write_raw, write_npy, write_nrrd, write_zfp] {
            let error = write(&volume, Full(room)).unwrap_err();
            assert!(matches!(error, Error::Io { .. }), "{error}");
        }
    }
    let error = convert_file(path("npy/nan.npy"), io::sink(), &options(), |_, _| ()).unwrap_err();
    assert!(matches!(error, Error::NonFinite { voxel: [2, 3, 4], .. }), "{error}");
    let options = ReadOptions { rate: -1.0, ..options() };
    for name in ["npy/int16.npy", "rate_4.zfp"] {
        let error = convert_file(path(name), io::sink(), &options, |_, _| ()).unwrap_err();
        assert!(matches!(error, Error::Rate { .. }), "{error}");
    }
    let mut encoder = StreamEncoder::new([5, 4, 4], 8.0, io::sink()).unwrap();
    encoder.push(&[0.0; 64]).unwrap();
    let error = encoder.push(&[f32::NAN; 64]).unwrap_err();
    assert!(matches!(error, Error::NonFinite { voxel: [4, 0, 0], .. }), "{error}");
    let error = encoder.finish().unwrap_err();
    assert!(matches!(error, Error::BlockCount { expected: 2, found: 1 }), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 200,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn both_encoders_write_the_same_file(
        dims in [1..14u32, 1..14u32, 1..14u32],
        bits in prop_oneof![9..200u32, 2000..2200u32, Just(16658)],
        seed in any::<u32>(),
    ) {
        let rate = f64::from(bits) / 64.0;
        let mut file = Vec::new();
        let mut stream = StreamEncoder::new(dims, rate, &mut file).unwrap().measured();
        let mut memory = BlockEncoder::new(dims, rate).unwrap().measured();
        let mut state = seed;
        while stream.next_origin()[2] < dims[2] {
            let block = std::array::from_fn(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 8) as f32 / 1000.0 - 5000.0
            });
            prop_assert_eq!(stream.next_origin(), memory.next_origin());
            prop_assert_eq!(stream.next_valid(), memory.next_valid());
            stream.push(&block).unwrap();
            memory.push(&block).unwrap();
        }
        let conversion = stream.finish().unwrap();
        let volume = memory.finish().unwrap();
        let mut expected = Vec::new();
        write_zfp(&volume, &mut expected).unwrap();
        prop_assert_eq!(conversion.source, volume.source);
        prop_assert!(file == expected);
    }

    #[test]
    fn written_samples_are_the_decoded_ones(
        dims in [1..11u32, 1..11u32, 1..11u32],
        spacing in prop::array::uniform3(1e-9..1e9f64),
        origin in prop::array::uniform3(-1e9..1e9f64),
    ) {
        let count = dims.iter().product::<u32>();
        let samples: Vec<f32> = (0..count).map(|i| (i as f32 * 0.37).sin()).collect();
        let mut volume = encode(&samples, dims, 12.0).unwrap();
        volume.geometry.spacing = spacing;
        volume.geometry.origin = origin;
        let written = |write: fn(&ZfpVolume, &mut Vec<u8>) -> volume_io::Result<u64>| {
            let mut bytes = Vec::new();
            assert_eq!(write(&volume, &mut bytes).unwrap(), bytes.len() as u64);
            bytes
        };
        let expected = encode(&volume.decode(), dims, 30.0).unwrap().bytes;

        let raw = written(|volume, bytes| write_raw(volume, bytes));
        let floats: Vec<u8> = volume.decode().iter().flat_map(|v| v.to_le_bytes()).collect();
        prop_assert_eq!(&raw, &floats);
        let again = read_bytes(&raw_file_name("a", &volume), raw, &options()).unwrap();
        prop_assert_eq!((again.dims, &again.bytes), (dims, &expected));

        let npy = written(|volume, bytes| write_npy(volume, bytes));
        prop_assert_eq!((npy.len() - floats.len()) % 64, 0);
        let again = read_bytes("x", npy, &options()).unwrap();
        prop_assert_eq!((again.dims, &again.bytes, &again.source.notes[..]), (dims, &expected, &[][..]));

        let nrrd = written(|volume, bytes| write_nrrd(volume, bytes));
        let again = read_bytes("x", nrrd, &options()).unwrap();
        prop_assert_eq!((again.dims, &again.bytes, &again.source.notes[..]), (dims, &expected, &[][..]));
        prop_assert_eq!(again.geometry.origin, origin);
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-15 * b;
        prop_assert!((0..3).all(|i| close(again.geometry.spacing[i], spacing[i])));
    }
}

#[cfg(feature = "convert")]
mod program {
    use std::process::{Command, Output};

    use super::*;
    use common::folder;

    fn run(arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_convert")).args(arguments).output().unwrap()
    }

    #[test]
    fn the_program_converts_and_reports() {
        let output = format!("{}/out.zfp", folder("reports"));
        let done = run(&[&path("mrc/float32.mrc"), &output, "--rate", "12"]);
        assert!(done.status.success(), "{done:?}");
        let text = String::from_utf8(done.stdout).unwrap();
        for part in ["7 x 5 x 6", "MRC", "f32", "spacing [0.5, 1.25, 2.0]", "max", "RMS", "PSNR"] {
            assert!(text.contains(part), "{part}: {text}");
        }
        let (expected, _) =
            convert("mrc/float32.mrc", &ReadOptions { rate: 12.0, ..ReadOptions::default() });
        assert_eq!(std::fs::read(&output).unwrap(), expected);

        // Its own output in another form, and options for raw files.
        let raw = output.replace(".zfp", ".raw");
        assert!(run(&[&output, &raw, "-q"]).status.success());
        let again = output.replace(".zfp", "_again.zfp");
        let options = ["--dims", "7,5,6", "--type", "float32", "--rate", "12"];
        let done = run(&[&[&raw[..], &again, "--quiet"], &options[..]].concat());
        assert!(done.status.success() && done.stdout.is_empty(), "{done:?}");
        let [first, second] = [&output, &again]
            .map(|name| read_file(name, &ReadOptions::default()).unwrap().decode());
        for (a, b) in first.iter().zip(&second) {
            assert!((a - b).abs() < 0.1, "{a} {b}");
        }
    }

    #[test]
    fn failures_leave_no_file() {
        let folder = folder("fails");
        let output = format!("{folder}/out.zfp");
        let nan = path("npy/nan.npy");
        let failed = run(&[&nan, &output]);
        let text = String::from_utf8(failed.stderr).unwrap();
        assert!(failed.status.code() == Some(1) && text.contains("voxel [2, 3, 4]"), "{text}");
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
        let replaced = run(&[&nan, &output, "--replace-nan", "-3"]);
        assert!(replaced.status.success(), "{replaced:?}");
        assert!(String::from_utf8(replaced.stdout).unwrap().contains("1 voxels that were NaN"));
        // In place of its own input.
        let before = std::fs::read(&output).unwrap();
        assert!(run(&[&output, &output, "--rate", "2"]).status.success());
        assert!(std::fs::read(&output).unwrap().len() < before.len());
        for wrong in [&[&nan[..], "out.png"][..], &[&nan, &output, "--dims", "1,2,3"], &[&nan]] {
            assert_eq!(run(wrong).status.code(), Some(2), "{wrong:?}");
        }
    }
}
