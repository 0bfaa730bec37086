//! NIfTI-1 in one file.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    exercise::exercise_magic("fuzz.nii", bytes, 344, b"n+1\0");
});
