//! Anything in a gzip file.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    exercise::exercise_magic("fuzz.gz", bytes, 0, b"\x1f\x8b\x08");
});
