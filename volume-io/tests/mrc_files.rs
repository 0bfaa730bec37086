//! Maps written by mrcfile (see `data/make_reader_files.py`), and broken variants of them.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use common::{
    DIMS, ORIGIN, SPACING, assert_ramp, assert_samples, assert_truncations_fail,
    assert_unsupported, data, edited, error_of, field_of, options, path, ramp,
};
use volume_io::{Error, Format, Note, ReadOptions, SampleType, read_bytes, read_file};

#[test]
fn every_sample_type_is_read() {
    use SampleType::{F16, F32, I8, I16, U16};
    for ty in [I8, I16, U16, F16, F32] {
        let volume = assert_ramp(&format!("mrc/{}.mrc", ty.raw_name()), Format::Mrc, ty, true);
        assert_eq!(volume.source.notes, []);
    }
}

#[test]
fn byte_order_and_extended_headers_are_read() {
    assert_ramp("mrc/big_endian.mrc", Format::Mrc, SampleType::I16, true);
    assert_ramp("mrc/extended.mrc", Format::Mrc, SampleType::F32, true);
    #[cfg(feature = "gzip")]
    assert_ramp("mrc/zipped.mrc.gz", Format::Mrc, SampleType::I16, true);
    // Without a machine stamp the mode tells the byte order.
    for name in ["mrc/big_endian.mrc", "mrc/int16.mrc"] {
        let volume = read_bytes("x", edited(name, 212, &[0; 4]), &options()).unwrap();
        assert_samples(&volume, DIMS, &ramp(SampleType::I16), name);
    }
}

#[test]
fn columns_rows_and_sections_may_run_along_any_axes() {
    assert_ramp("mrc/order_213.mrc", Format::Mrc, SampleType::I16, true);
    assert_ramp("mrc/order_312.mrc", Format::Mrc, SampleType::I16, true);
    // Old files leave the order out.
    let volume = read_bytes("x", edited("mrc/int16.mrc", 64, &[0; 12]), &options()).unwrap();
    assert_samples(&volume, DIMS, &ramp(SampleType::I16), "no order");
}

#[test]
fn maps_without_an_origin_start_at_their_first_voxel() {
    let volume = read_file(path("mrc/start.mrc"), &options()).unwrap();
    assert_eq!(volume.geometry.spacing, SPACING);
    assert_eq!(volume.geometry.origin, [-4.0 * 0.5, 2.0 * 1.25, 10.0 * 2.0]);
}

#[test]
fn cells_that_are_not_boxes_leave_the_origin_out() {
    let file = edited("mrc/int16.mrc", 60, &120.0f32.to_le_bytes());
    let volume = read_bytes("x", file, &options()).unwrap();
    assert_eq!((volume.geometry.spacing, volume.geometry.origin), (SPACING, [0.0; 3]));
    assert_eq!(volume.source.notes, [Note::OriginIgnored]);
    // No cell at all.
    let volume = read_bytes("x", edited("mrc/int16.mrc", 28, &[0; 24]), &options()).unwrap();
    assert_eq!((volume.geometry.spacing, volume.geometry.origin), ([1.0; 3], ORIGIN));
    assert_eq!(volume.source.notes, [Note::SpacingIgnored]);
}

#[test]
fn one_volume_of_a_stack_is_chosen() {
    let read =
        |time_index| read_file(path("mrc/stack.mrc"), &ReadOptions { time_index, ..options() });
    assert!(matches!(read(None), Err(Error::SeveralVolumes { count: 2 })));
    let volume = read(Some(1)).unwrap();
    let expected: Vec<f32> = ramp(SampleType::I16).iter().map(|v| v + 1000.0).collect();
    assert_samples(&volume, DIMS, &expected, "stack");
    assert_eq!(volume.source.notes, [Note::VolumeChosen { index: 1, count: 2 }]);
    // mz that does not divide the number of sections.
    let file = edited("mrc/stack.mrc", 36, &[5, 0, 0, 0]);
    assert_unsupported(file, Format::Mrc);
}

#[test]
fn broken_headers_say_which_field() {
    let field = |offset, value: i32| {
        field_of(edited("mrc/int16.mrc", offset, &value.to_le_bytes()), Format::Mrc)
    };
    assert_eq!(field(0, 0), "nx, ny, nz");
    assert_eq!(field(4, -3), "nx, ny, nz");
    assert_eq!(field(12, 5), "mode");
    assert_eq!(field(64, 2), "mapc, mapr, maps");
    assert_eq!(field(64, 7), "mapc, mapr, maps");
    assert_eq!(field(92, -1), "nsymbt");
    assert_eq!(field(212, 0x2222), "machine stamp");
    assert_unsupported(data("mrc/complex.mrc"), Format::Mrc);
    assert_unsupported(edited("mrc/int16.mrc", 12, &101i32.to_le_bytes()), Format::Mrc);
    let error = error_of(edited("mrc/int16.mrc", 0, &70_000i32.to_le_bytes()));
    assert!(matches!(error, Error::Dims { .. }), "{error}");
    let error = error_of(edited("mrc/int16.mrc", 208, b"MAPS"));
    assert!(matches!(error, Error::UnknownFormat { .. }), "{error}");
}

#[test]
fn wrong_sizes_are_counted() {
    assert_truncations_fail("mrc/int16.mrc", 420);
    assert_truncations_fail("mrc/order_312.mrc", 420);
    let error = error_of(edited("mrc/int16.mrc", 92, &100i32.to_le_bytes()));
    assert!(matches!(error, Error::TooShort { expected: 1544, found: 1444 }), "{error}");
    let mut file = data("mrc/float32.mrc");
    file.push(0);
    let volume = read_bytes("x", file, &options()).unwrap();
    assert_eq!(volume.source.notes, [Note::TrailingBytes(1)]);
    let error = error_of(edited("mrc/float32.mrc", 1024, &f32::NAN.to_le_bytes()));
    assert!(matches!(error, Error::NonFinite { voxel: [0, 0, 0], .. }), "{error}");
}
