//! Conversion needs memory for a few slices, however long the volume is.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use volume_io::{ReadOptions, StreamEncoder, convert_file};

/// The most memory that this process ever had, in bytes.
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse::<u64>().unwrap() * 1024
}

// The only test of this process, so that nothing else moves the peak.
#[test]
fn peak_memory_is_that_of_a_few_slices() {
    // A file with a hole: it takes no space on most file systems.
    let dims = [256, 256, 1200u32];
    let bytes: u64 = dims.iter().map(|&n| u64::from(n)).product();
    let name = format!("{}/hole_256x256x1200_uint8.raw", env!("CARGO_TARGET_TMPDIR"));
    std::fs::File::create(&name).unwrap().set_len(bytes).unwrap();

    // What the program needs at any size.
    StreamEncoder::new([4, 4, 4], 24.0, std::io::sink()).unwrap().push(&[1.0; 64]).unwrap();
    let before = peak();
    let options = ReadOptions { rate: 24.0, ..ReadOptions::default() };
    let conversion = convert_file(&name, std::io::sink(), &options, |_, _| ()).unwrap();
    let growth = peak() - before;
    std::fs::remove_file(&name).unwrap();
    assert!(conversion.bytes > 3 * bytes, "the stream is longer than the volume");
    let slab = 4 * 256 * 256;
    assert!(growth < 4 * slab, "{growth} bytes for slabs of {slab}");
}
