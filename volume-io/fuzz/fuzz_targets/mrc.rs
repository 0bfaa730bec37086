//! MRC maps.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    exercise::exercise_magic("fuzz.mrc", bytes, 208, b"MAP ");
});
