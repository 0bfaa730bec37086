//! Arrays written by NumPy (see `data/make_reader_files.py`), and broken variants of them.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use common::{
    DIMS, assert_ramp, assert_samples, assert_truncations_fail, assert_unsupported, data, edited,
    error_of, field_of, options, path, ramp, read, replaced,
};
use volume_io::{Error, Format, Note, ReadOptions, SampleType, read_bytes, read_file};

#[test]
fn every_sample_type_is_read() {
    for &ty in SampleType::ALL {
        let volume = assert_ramp(&format!("npy/{}.npy", ty.raw_name()), Format::Npy, ty, false);
        assert_eq!((volume.source.rank, volume.source.notes), (3, vec![]));
    }
}

#[test]
fn versions_byte_orders_and_axis_orders_are_read() {
    assert_ramp("npy/version_2.npy", Format::Npy, SampleType::U16, false);
    assert_ramp("npy/version_3.npy", Format::Npy, SampleType::U16, false);
    assert_ramp("npy/big_endian.npy", Format::Npy, SampleType::F32, false);
    // The same array is the same volume in either order.
    assert_ramp("npy/fortran.npy", Format::Npy, SampleType::I16, false);
    #[cfg(feature = "gzip")]
    assert_ramp("npy/zipped.npy.gz", Format::Npy, SampleType::U8, false);
}

#[test]
fn two_dimensions_are_one_slice() {
    let expected = &ramp(SampleType::F32)[70..105];
    for name in ["npy/slice.npy", "npy/slice_fortran.npy"] {
        let volume = read(name, &options());
        assert_samples(&volume, [7, 5, 1], expected, name);
        assert_eq!(volume.source.rank, 2);
    }
}

#[test]
fn booleans_are_zero_and_one() {
    let volume = read("npy/bool.npy", &options());
    let expected: Vec<f32> = (0..210u8).map(|n| f32::from(n % 2)).collect();
    assert_samples(&volume, DIMS, &expected, "bool");
}

#[test]
fn one_volume_of_four_dimensions_is_chosen() {
    let read =
        |time_index| read_file(path("npy/series.npy"), &ReadOptions { time_index, ..options() });
    assert!(matches!(read(None), Err(Error::SeveralVolumes { count: 2 })));
    assert!(matches!(read(Some(2)), Err(Error::TimeIndex { index: 2, count: 2 })));
    for index in 0..2 {
        let volume = read(Some(index)).unwrap();
        let shift = 1000.0 * index as f32;
        let expected: Vec<f32> = ramp(SampleType::I16).iter().map(|v| v + shift).collect();
        assert_samples(&volume, DIMS, &expected, "series");
        assert_eq!(volume.source.notes, [Note::VolumeChosen { index, count: 2 }]);
    }
}

#[test]
fn broken_headers_say_which_field() {
    let name = "npy/int16.npy";
    assert_eq!(field_of(edited(name, 6, &[4, 0]), Format::Npy), "version");
    assert_eq!(field_of(edited(name, 6, &[0, 0]), Format::Npy), "version");
    assert_eq!(field_of(edited(name, 8, &[1, 0]), Format::Npy), "header");
    assert_eq!(field_of(edited("npy/version_2.npy", 8, &[0xff; 4]), Format::Npy), "header length");
    let broken = |from, to| field_of(replaced(name, from, to), Format::Npy);
    assert_eq!(broken("'descr'", "'descx'"), "header");
    assert_eq!(broken("False", "Falsy"), "header");
    assert_eq!(broken("(6, 5", "(6, x"), "header");
    assert_eq!(broken("(6, 5", "(6,-5"), "header");
    assert_eq!(broken("'descr': '<i2',", "               "), "descr");

    let error = error_of(replaced(name, "(6, 5", "(0, 5"));
    assert!(matches!(error, Error::Dims { .. }), "{error}");
    let error = error_of(replaced(name, "(6, 5, 7), }        ", "(6, 5, 99999999), } "));
    assert!(matches!(error, Error::Dims { .. }), "{error}");
    let error = read_bytes("x", edited(name, 0, b"\x92"), &options()).unwrap_err();
    assert!(matches!(error, Error::UnknownFormat { .. }), "{error}");
}

#[test]
fn types_and_shapes_that_are_no_volume_are_refused() {
    assert_unsupported(data("npy/complex.npy"), Format::Npy);
    assert_unsupported(data("npy/record.npy"), Format::Npy);
    assert_unsupported(replaced("npy/int16.npy", "<i2", "<U2"), Format::Npy);
    assert_unsupported(replaced("npy/int16.npy", "(6, 5, 7), }", "()}         "), Format::Npy);
    let five = replaced("npy/int16.npy", "(6, 5, 7), }        ", "(1, 1, 6, 5, 7), }  ");
    assert_unsupported(five, Format::Npy);
}

#[test]
fn wrong_sizes_are_counted() {
    assert_truncations_fail("npy/int16.npy", 420);
    assert_truncations_fail("npy/fortran.npy", 420);
    let error = error_of(replaced("npy/int16.npy", "(6, 5, 7), } ", "(60000,5,7)} "));
    let counted = matches!(error, Error::TooShort { expected: 4_200_128, found: 548 });
    assert!(counted, "{error}");
    let mut file = data("npy/int16.npy");
    file.extend([0; 9]);
    let volume = read_bytes("x", file, &options()).unwrap();
    assert_eq!(volume.source.notes, [Note::TrailingBytes(9)]);
}

#[test]
fn nan_is_named_by_its_voxel() {
    let error = error_of(data("npy/nan.npy"));
    assert!(matches!(error, Error::NonFinite { voxel: [2, 3, 4], .. }), "{error}");
    let replacing = ReadOptions { replace_non_finite: Some(-3.0), ..options() };
    assert_eq!(read("npy/nan.npy", &replacing).source.replaced, 1);
}
