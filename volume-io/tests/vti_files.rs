//! Images written by VTK (see `data/make_reader_files.py`), and broken variants of them.

#![cfg(feature = "vti")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use common::{
    DIMS, ORIGIN, SPACING, assert_ramp, assert_samples, assert_unsupported, data, error_of,
    field_of, options, ramp, read, replaced,
};
use volume_io::{Error, Format, Note, ReadOptions, SampleType, read_bytes};

fn array(name: &str) -> Note {
    Note::Array { name: name.into() }
}

#[test]
fn every_sample_type_is_read() {
    for &ty in SampleType::ALL.iter().filter(|&&ty| ty != SampleType::F16) {
        let volume = assert_ramp(&format!("vti/{}.vti", ty.raw_name()), Format::Vti, ty, true);
        assert_eq!(volume.source.notes, [array("density")]);
    }
}

#[test]
fn every_encoding_is_read() {
    for encoding in ["appended", "appended_base64", "binary"] {
        for zlib in ["", "_zlib"] {
            for bits in [32, 64] {
                let name = format!("vti/{encoding}{zlib}_{bits}.vti");
                let volume = assert_ramp(&name, Format::Vti, SampleType::F32, true);
                assert_eq!(volume.source.notes, [array("density")], "{name}");
            }
        }
    }
    assert_ramp("vti/big_endian.vti", Format::Vti, SampleType::I16, true);
    for ty in [SampleType::I8, SampleType::U8, SampleType::F64, SampleType::I64] {
        assert_ramp(&format!("vti/ascii_{}.vti", ty.raw_name()), Format::Vti, ty, true);
    }
}

#[test]
fn cells_become_voxels_at_their_centres() {
    for name in ["vti/cells_appended.vti", "vti/cells_binary.vti"] {
        let volume = assert_ramp(name, Format::Vti, SampleType::U16, true);
        assert_eq!(volume.source.notes, [array("density"), Note::CellData], "{name}");
    }
}

#[test]
fn one_array_of_several_is_chosen() {
    for name in ["vti/several.vti", "vti/several_inline.vti"] {
        assert_ramp(name, Format::Vti, SampleType::F32, true);
        for (wanted, ty) in [("first", SampleType::U8), ("last", SampleType::I16)] {
            let options = ReadOptions { array: Some(wanted.into()), ..options() };
            let volume = read(name, &options);
            assert_samples(&volume, DIMS, &ramp(ty), wanted);
            assert_eq!(volume.source.notes, [array(wanted)]);
        }
        let ask = |wanted: &str| {
            let options = ReadOptions { array: Some(wanted.into()), ..options() };
            read_bytes("x", data(name), &options).unwrap_err()
        };
        let error = ask("none");
        assert!(matches!(&error, Error::NoSuchArray { found, .. } if found.len() == 4), "{error}");
        let error = ask("vectors");
        assert!(matches!(error, Error::Unsupported { .. }), "{error}");
    }
    // Without a mark, the first array of scalars.
    let unmarked = replaced("vti/several.vti", "Scalars=\"density\"", "");
    assert_eq!(read_bytes("x", unmarked, &options()).unwrap().source.notes, [array("density")]);
}

#[test]
fn turned_images_leave_the_origin_out() {
    let volume = read("vti/turned.vti", &options());
    assert_eq!((volume.geometry.spacing, volume.geometry.origin), (SPACING, [0.0; 3]));
    assert_eq!(volume.source.notes, [Note::OriginIgnored, array("density")]);
}

#[test]
fn part_of_an_image_lies_where_its_extent_says() {
    let file = replaced("vti/float32.vti", "<Piece Extent=\"2 8", "<Piece Extent=\"4 10");
    let volume = read_bytes("x", file, &options()).unwrap();
    assert_eq!(volume.geometry.origin, [ORIGIN[0] + 2.0 * SPACING[0], ORIGIN[1], ORIGIN[2]]);
}

#[test]
fn broken_headers_say_which_field() {
    let field = |from, to| field_of(replaced("vti/int16.vti", from, to), Format::Vti);
    assert_eq!(field("LittleEndian", "MiddleEndian"), "byte_order");
    assert_eq!(field("\"UInt32\"", "\"UInt16\""), "header_type");
    assert_eq!(field("<VTKFile", "<?xml ?><VTKFolder"), "document");
    assert_eq!(field("WholeExtent=\"2 8", "WholeExtent=\"2 x"), "WholeExtent");
    assert_eq!(field("WholeExtent=\"2 8", "WholeExtent=\"8"), "WholeExtent");
    assert_eq!(field("Piece Extent=\"2 8", "Piece Extent=\"9 8"), "Extent");
    assert_eq!(field("Spacing=\"0.5 ", "Spacing=\""), "Spacing");
    assert_eq!(field("Origin=\"", "Origin=\"1 "), "Origin");
    assert_eq!(field("Direction=\"", "Direction=\"1 "), "Direction");
    assert_eq!(field("type=\"Int16\"", "type=\"String\""), "type");
    assert_eq!(field("type=\"Int16\"", "type=\"Int32\""), "size of the array");
    assert_eq!(field("Piece Extent=\"2 8", "Piece Extent=\"2 9"), "size of the array");
    assert_eq!(field("offset=\"0\"", "offset=\"x\""), "offset");
    assert_eq!(field("encoding=\"raw\"", "encoding=\"hex\""), "encoding");
    assert_eq!(field("   _", "   x"), "AppendedData");
    assert_eq!(field("<PointData", "<PointData Scalars"), "tag");
    let format = |to| field_of(replaced("vti/binary_32.vti", "format=\"binary\"", to), Format::Vti);
    assert_eq!(format("format=\"hex\""), "format");
    assert_eq!(format("format=\"ascii\""), "data");
}

#[test]
fn other_files_of_vtk_are_refused() {
    let other = |from, to| assert_unsupported(replaced("vti/int16.vti", from, to), Format::Vti);
    other("type=\"ImageData\"", "type=\"PolyData\"");
    other("header_type", "compressor=\"vtkLZ4DataCompressor\" header_type");
    other("</Piece>", "<Piece Extent=\"0 1 0 1 0 1\"></Piece>");
    other("type=\"Int16\"", "type=\"Int16\" NumberOfComponents=\"2\"");
    assert_unsupported(data("vti/nothing.vti"), Format::Vti);
    let error = error_of(replaced("vti/int16.vti", "Piece Extent=\"2 8", "Piece Extent=\"2 99999"));
    assert!(matches!(error, Error::Dims { .. }), "{error}");
    let extremes = "Piece Extent=\"-9223372036854775808 9223372036854775807 0 0 0 0\" x=\"";
    let error = error_of(replaced("vti/int16.vti", "Piece Extent=\"", extremes));
    assert!(matches!(error, Error::Dims { .. }), "{error}");
}

#[test]
fn truncated_files_are_refused() {
    for name in [
        "vti/uint8.vti",
        "vti/binary_32.vti",
        "vti/binary_zlib_64.vti",
        "vti/appended_zlib_32.vti",
        "vti/appended_base64_zlib_32.vti",
        "vti/ascii_uint8.vti",
    ] {
        let file = data(name);
        // White space follows the data.
        let position = |text: &[u8]| file.windows(text.len()).rposition(|window| window == text);
        let end = position(b"</AppendedData>").or_else(|| position(b"</DataArray>")).unwrap() - 12;
        for length in (0..end).step_by(7).chain(end - 12..end) {
            let error = read_bytes("x", &file[..length], &options()).unwrap_err();
            let counted = matches!(error, Error::TooShort { expected, found } if found < expected);
            let other = matches!(error, Error::Io { .. } | Error::UnknownFormat { .. })
                || matches!(error, Error::InvalidHeader { field: "document" | "data", .. });
            assert!(counted || other, "{name} {length}: {error}");
        }
    }
}

#[test]
fn broken_data_are_refused() {
    let field = |name, from, to| field_of(replaced(name, from, to), Format::Vti);
    assert_eq!(field("vti/ascii_uint8.vti", " 7 8 ", " 7 x "), "data");
    assert_eq!(field("vti/ascii_uint8.vti", " 7 8 ", " 7 256 "), "data");
    let binary = data("vti/binary_32.vti");
    let at = binary.windows(4).position(|window| window == b"AAAA").unwrap_or(900);
    let mut file = binary.clone();
    file[at + 30] = b'!';
    assert_eq!(field_of(file, Format::Vti), "data");
    let error = error_of(replaced("vti/ascii_float64.vti", " 0 0.5 1 ", " nan 0.5 1 "));
    assert!(matches!(error, Error::NonFinite { voxel: [6, 0, 0], .. }), "{error}");
    // One number too few is short; one more is noted.
    let error = error_of(replaced("vti/ascii_uint8.vti", " 7 8 ", " 7 "));
    assert!(matches!(error, Error::TooShort { expected: 210, found: 209 }), "{error}");
    let more = replaced("vti/ascii_uint8.vti", " 7 8 ", " 7 7 8 ");
    let notes = read_bytes("x", more, &options()).unwrap().source.notes;
    assert_eq!(notes, [array("density"), Note::TrailingBytes(1)]);

    // Compressed blocks that are damaged, or whose sizes do not fit.
    let zlib = data("vti/appended_zlib_32.vti");
    let start = zlib.windows(4).position(|w| w == b"   _").unwrap() + 4;
    let int = |index: usize| {
        let at = start + 4 * index;
        u32::from_le_bytes(zlib[at..at + 4].try_into().unwrap())
    };
    assert_eq!((int(0), int(1), int(2)), (4, 256, 840 - 3 * 256), "several blocks");
    let edited = |index: usize, value: u32| {
        let mut file = zlib.clone();
        file[start + 4 * index..][..4].copy_from_slice(&value.to_le_bytes());
        error_of(file)
    };
    for (index, value) in [(0, 3), (0, u32::MAX), (1, 255), (2, 0), (2, 73)] {
        let error = edited(index, value);
        let named = matches!(error, Error::InvalidHeader { field: "size of the array", .. });
        assert!(named, "{index} {value}: {error}");
    }
    for (index, value) in [(3, 0), (3, int(3) - 1), (3, u32::MAX), (6, 5)] {
        let error = edited(index, value);
        assert!(matches!(error, Error::Io { .. } | Error::InvalidHeader { .. }), "{error}");
    }
    for at in [start + 28, start + 60, start + 28 + int(3) as usize - 1] {
        let mut file = zlib.clone();
        file[at] ^= 0xff;
        let error = error_of(file);
        assert!(matches!(error, Error::Io { .. } | Error::InvalidHeader { .. }), "{at}: {error}");
    }
}

#[test]
fn bytes_missing_at_the_end_are_counted() {
    let file = data("vti/uint8.vti");
    let data_end = file.windows(4).position(|w| w == b"   _").unwrap() + 4 + 4 + 210;
    let cut = &file[..data_end - 1];
    let error = read_bytes("x", cut, &options()).unwrap_err();
    let counted = matches!(error, Error::TooShort { expected, found }
        if expected == data_end as u64 && found == expected - 1);
    assert!(counted, "{error}");
    read_bytes("x", &file[..data_end], &options()).unwrap();
}
