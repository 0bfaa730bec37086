//! What every target does with its bytes.

use volume_io::{Headerless, RawLayout, ReadOptions, SampleType, read_bytes, write_zfp};

/// Reads `bytes` as a file of this name and, where that succeeds, uses what was read.
pub fn exercise(name: &str, bytes: &[u8], options: &ReadOptions) {
    let Ok(volume) = read_bytes(name, bytes, options) else { return };
    let end = volume.first_bit + volume.block_count() * u64::from(volume.bits_per_block);
    assert!(volume.bytes.len() as u64 * 8 >= end, "the stream is complete");
    assert!(volume.geometry.spacing.iter().all(|&s| s > 0.0 && s.is_finite()));
    assert!(volume.geometry.origin.iter().all(|o| o.is_finite()));
    // Blocks of zeros take one bit in some streams: such volumes may be far larger than the input.
    if volume.voxel_count() <= 1 << 16 {
        assert!(volume.decode().iter().all(|v| v.is_finite()));
        write_zfp(&volume, std::io::sink()).expect("a sink takes everything");
    }
}

/// Reads `bytes` as a file of this name with `magic` put at byte `at`.
pub fn exercise_magic(name: &str, bytes: &[u8], at: usize, magic: &[u8]) {
    let mut bytes = bytes.to_vec();
    if let Some(place) = bytes.get_mut(at..at + magic.len()) {
        place.copy_from_slice(magic);
    }
    exercise(name, &bytes, &options(bytes.last().copied().unwrap_or(0)));
}

/// Options that follow from a byte of the input.
pub fn options(choice: u8) -> ReadOptions {
    ReadOptions {
        rate: 2.0,
        replace_non_finite: (choice & 1 != 0).then_some(0.0),
        time_index: (choice & 2 != 0).then_some(u32::from(choice >> 6)),
        big_endian: choice & 4 != 0,
        ..ReadOptions::default()
    }
}

/// Options with a layout from the first bytes of the input, and the rest of it.
pub fn with_layout(bytes: &[u8], raw: bool) -> Option<(ReadOptions, &[u8])> {
    let ([choice, ty, x, y, z], rest) = bytes.split_first_chunk::<5>()?;
    let dims = [x, y, z].map(|n| u32::from(*n));
    let sample_type = SampleType::ALL[usize::from(*ty) % SampleType::ALL.len()];
    let mut options = options(*choice);
    if raw {
        options.raw = Some(RawLayout { dims, sample_type });
    } else {
        options.headerless = Some(Headerless { dims, rate: f64::from(*ty) / 8.0 });
    }
    Some((options, rest))
}

/// Something that takes any bytes.
pub type Target = fn(&[u8]);

/// Every target, in the order of their names; a file of `fuzz_targets` each.
pub const TARGETS: [(&str, Target); 8] = [
    ("gzip", gzip),
    ("mrc", mrc),
    ("nifti", nifti),
    ("npy", npy),
    ("nrrd", nrrd),
    ("raw", raw),
    ("vti", vti),
    ("zfp", zfp),
];

/// Anything in a gzip file.
pub fn gzip(bytes: &[u8]) {
    exercise_magic("fuzz.gz", bytes, 0, b"\x1f\x8b\x08");
}

/// MRC maps.
pub fn mrc(bytes: &[u8]) {
    exercise_magic("fuzz.mrc", bytes, 208, b"MAP ");
}

/// NIfTI-1 in one file.
pub fn nifti(bytes: &[u8]) {
    exercise_magic("fuzz.nii", bytes, 344, b"n+1\0");
}

/// NumPy arrays.
pub fn npy(bytes: &[u8]) {
    exercise_magic("fuzz.npy", bytes, 0, b"\x93NUMPY");
}

/// NRRD with an attached header.
pub fn nrrd(bytes: &[u8]) {
    exercise_magic("fuzz.nrrd", bytes, 0, b"NRRD000");
}

/// Samples with a layout from the input.
pub fn raw(bytes: &[u8]) {
    if let Some((options, rest)) = with_layout(bytes, true) {
        exercise("fuzz.raw", rest, &options);
    }
}

/// VTK images.
pub fn vti(bytes: &[u8]) {
    exercise_magic("fuzz.vti", bytes, 0, b"<VTKFile");
}

/// Streams with zfp's header, and headerless ones.
pub fn zfp(bytes: &[u8]) {
    exercise_magic("fuzz.zfp", bytes, 0, b"zfp\x05");
    if let Some((options, rest)) = with_layout(bytes, false) {
        exercise("fuzz.zfp", rest, &options);
    }
}
