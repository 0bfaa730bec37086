//! NRRD files written by pynrrd (see `data/make_reader_files.py`), and broken variants of them.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use common::{
    DIMS, ORIGIN, SPACING, assert_ramp, assert_samples, assert_truncations_fail,
    assert_unsupported, data, error_of, field_of, options, path, ramp, read, replaced,
};
use volume_io::{Error, Format, Note, ReadOptions, SampleType, read_bytes, read_file};

#[test]
fn every_sample_type_is_read() {
    for &ty in SampleType::ALL.iter().filter(|&&ty| ty != SampleType::F16) {
        let volume = assert_ramp(&format!("nrrd/{}.nrrd", ty.raw_name()), Format::Nrrd, ty, true);
        assert_eq!(volume.source.notes, []);
    }
    // Other names of the same types.
    for (name, other) in [("uint8", "unsigned char"), ("int16", "signed short int")] {
        let file = replaced(
            &format!("nrrd/{name}.nrrd"),
            &format!("type: {name}"),
            &format!("type: {other}"),
        );
        let volume = read_bytes("x", file, &options()).unwrap();
        assert_eq!(volume.bytes, read(&format!("nrrd/{name}.nrrd"), &options()).bytes);
    }
}

#[test]
fn encodings_and_byte_orders_are_read() {
    assert_ramp("nrrd/big_endian.nrrd", Format::Nrrd, SampleType::F64, true);
    #[cfg(feature = "gzip")]
    assert_ramp("nrrd/gzip.nrrd", Format::Nrrd, SampleType::I16, true);
    assert_unsupported(data("nrrd/text.nrrd"), Format::Nrrd);
}

#[test]
fn data_in_another_file_are_found_beside_the_header() {
    let names = if cfg!(feature = "gzip") { &["raw", "gzip"][..] } else { &["raw"] };
    for name in names {
        let name = format!("nrrd/detached_{name}.nhdr");
        let volume = read_file(path(&name), &options()).unwrap();
        assert_samples(&volume, DIMS, &ramp(SampleType::U16), &name);
        assert_eq!((volume.geometry.spacing, volume.geometry.origin), (SPACING, ORIGIN));
        let error = read_bytes("x.nhdr", data(&name), &options()).unwrap_err();
        assert!(matches!(error, Error::SecondFile { .. }), "{error}");
    }
}

/// A detached header in a folder of its own, with other text instead of the data file's name.
fn detached(case: &str, data_file: &str) -> Result<volume_io::ZfpVolume, Error> {
    let folder = format!("{}/nrrd_{case}", env!("CARGO_TARGET_TMPDIR"));
    std::fs::create_dir_all(&folder).unwrap();
    let header = replaced("nrrd/detached_raw.nhdr", "detached_raw.raw", data_file);
    std::fs::write(format!("{folder}/header.nhdr"), header).unwrap();
    std::fs::write(format!("{folder}/data.raw"), data("nrrd/detached_raw.raw")).unwrap();
    read_file(format!("{folder}/header.nhdr"), &options())
}

#[test]
fn data_files_elsewhere_are_not_opened() {
    assert_eq!(detached("same", "./data.raw").unwrap().dims, DIMS);
    let error = detached("missing", "none.raw").unwrap_err();
    assert!(matches!(error, Error::Io { .. }), "{error}");
    let elsewhere = path("nrrd/detached_raw.raw");
    for name in ["../nrrd_same/data.raw", "/etc/passwd", elsewhere.as_str()] {
        let error = detached("elsewhere", name).unwrap_err();
        assert!(matches!(error, Error::SecondFile { .. }), "{name}: {error}");
        assert!(error.to_string().contains("beside or below"), "{error}");
    }
    for name in ["LIST", "data%03d.raw 1 2 1"] {
        let error = detached("list", name).unwrap_err();
        assert!(matches!(error, Error::Unsupported { .. }), "{name}: {error}");
    }
}

#[test]
fn bytes_and_lines_before_the_data_are_skipped() {
    let skipped = |field: &str, before: &[u8]| {
        let file = replaced("nrrd/int16.nrrd", "encoding:", &format!("{field}\nencoding:"));
        let at = file.len() - 420;
        let file = [&file[..at], before, &file[at..]].concat();
        let volume = read_bytes("x", file, &options()).unwrap();
        assert_samples(&volume, DIMS, &ramp(SampleType::I16), field);
        volume.source.notes
    };
    assert_eq!(skipped("byte skip: 3", b"abc"), []);
    assert_eq!(skipped("byteskip: -1", b"abcdefg"), []);
    assert_eq!(skipped("line skip: 2", b"a\nbc\n"), []);
    assert_eq!(skipped("key:=value", b""), []);
    assert_eq!(skipped("# comment: -", b""), []);
    #[cfg(feature = "gzip")]
    {
        let file = replaced("nrrd/gzip.nrrd", "encoding:", "byte skip: -1\nencoding:");
        assert_unsupported(file, Format::Nrrd);
    }
}

#[test]
fn spacings_without_directions_are_read() {
    let volume = assert_ramp_without_origin("nrrd/spacings.nrrd");
    assert_eq!(volume.geometry.spacing, SPACING);
    let unknown = replaced("nrrd/spacings.nrrd", "spacings: 0.5", "spacings: nan");
    let volume = read_bytes("x", unknown, &options()).unwrap();
    assert_eq!(volume.geometry.spacing, [1.0, 1.25, 2.0]);
    let mirrored = replaced("nrrd/int16.nrrd", "(0.5,0,0)", "(-0.5,0,0)");
    let volume = read_bytes("x", mirrored, &options()).unwrap();
    assert_eq!((volume.geometry.spacing, volume.geometry.origin), (SPACING, [0.0; 3]));
    assert_eq!(volume.source.notes, [Note::OriginIgnored]);
}

fn assert_ramp_without_origin(name: &str) -> volume_io::ZfpVolume {
    let volume = read(name, &options());
    assert_samples(&volume, DIMS, &ramp(SampleType::U8), name);
    assert_eq!((volume.geometry.origin, &volume.source.notes), ([0.0; 3], &vec![]));
    volume
}

#[test]
fn turned_axes_leave_the_origin_out() {
    let volume = read("nrrd/turned.nrrd", &options());
    assert_eq!(volume.geometry.spacing, [1.25, 0.5, 2.0], "along the axes of the file");
    assert_eq!(volume.geometry.origin, [0.0; 3]);
    assert_eq!(volume.source.notes, [Note::OriginIgnored]);
}

#[test]
fn two_and_four_dimensions_are_read() {
    let slice = read("nrrd/slice.nrrd", &options());
    assert_samples(&slice, [7, 5, 1], &ramp(SampleType::F32)[70..105], "slice");
    assert_eq!(slice.source.rank, 2);
    assert_unsupported(data("nrrd/vectors.nrrd"), Format::Nrrd);

    // The last of four axes is time.
    let mut file = replaced("nrrd/uint8.nrrd", "sizes: 7 5 6", "sizes: 7 5 2 3");
    let text = String::from_utf8_lossy(&file[..file.len() - 210]).into_owned();
    let header = text
        .replace("dimension: 3\nspace", "dimension: 4\nspace")
        .replace("(0,0,2)", "(0,0,2) none");
    file = [header.as_bytes(), &file[file.len() - 210..]].concat();
    let read = |time_index| read_bytes("x", file.clone(), &ReadOptions { time_index, ..options() });
    assert!(matches!(read(None), Err(Error::SeveralVolumes { count: 3 })));
    let volume = read(Some(2)).unwrap();
    assert_samples(&volume, [7, 5, 2], &ramp(SampleType::U8)[140..], "time");
    assert_eq!(volume.geometry.spacing, SPACING);
}

#[test]
fn broken_headers_say_which_field() {
    let field = |from, to| field_of(replaced("nrrd/int16.nrrd", from, to), Format::Nrrd);
    assert_eq!(field("NRRD0005", "NRRD0"), "magic");
    assert_eq!(field("type: int16", "type: int15"), "type");
    assert_eq!(field("type: int16\n", ""), "type");
    assert_eq!(field("dimension: 3", "dimension: 0"), "dimension");
    assert_eq!(field("\ndimension: 3", "\ndimension: 2"), "sizes");
    assert_eq!(field("sizes: 7 5 6", "sizes: 7 5 -6"), "sizes");
    assert_eq!(field("sizes: 7 5 6", "sizes: 7 5"), "sizes");
    assert_eq!(field("sizes: 7 5 6\n", ""), "sizes");
    assert_eq!(field("endian: little", "endian: middle"), "endian");
    assert_eq!(field("endian: little\n", ""), "endian");
    assert_eq!(field("(0.5,0,0)", "(0.5,0,x)"), "space directions");
    assert_eq!(field("(0.5,0,0) ", ""), "space directions");
    assert_eq!(field("(-10,20.5,3)", "20.5"), "space origin");
    assert_eq!(field("encoding", "byte skip: -2\nencoding"), "byte skip");
    assert_eq!(field("encoding", "line skip: x\nencoding"), "line skip");
    assert_eq!(field("encoding", "nothing\nencoding"), "header");
    assert_unsupported(replaced("nrrd/int16.nrrd", "type: int16", "type: block"), Format::Nrrd);
    assert_unsupported(replaced("nrrd/int16.nrrd", "encoding: raw", "encoding: bz2"), Format::Nrrd);
    let error = error_of(replaced("nrrd/int16.nrrd", "sizes: 7 5 6", "sizes: 7 0 6"));
    assert!(matches!(error, Error::Dims { .. }), "{error}");
}

#[test]
fn wrong_sizes_are_counted() {
    assert_truncations_fail("nrrd/int16.nrrd", 420);
    let error = error_of(replaced("nrrd/int16.nrrd", "sizes: 7 5 6", "sizes: 7 5 7"));
    assert!(matches!(error, Error::TooShort { .. }), "{error}");
    let volume =
        read_bytes("x", replaced("nrrd/int16.nrrd", "sizes: 7 5 6", "sizes: 7 5 5"), &options());
    assert_eq!(volume.unwrap().source.notes, [Note::TrailingBytes(70)]);
    let mut file = data("nrrd/float32.nrrd");
    let at = file.len() - 4;
    file[at..].copy_from_slice(&f32::INFINITY.to_le_bytes());
    let error = error_of(file);
    assert!(matches!(error, Error::NonFinite { voxel: [6, 4, 5], .. }), "{error}");
}
