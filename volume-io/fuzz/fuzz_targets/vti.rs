//! VTK images.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    exercise::exercise_magic("fuzz.vti", bytes, 0, b"<VTKFile");
});
