//! NRRD with an attached header.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    exercise::exercise_magic("fuzz.nrrd", bytes, 0, b"NRRD000");
});
