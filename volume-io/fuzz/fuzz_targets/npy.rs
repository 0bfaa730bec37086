//! NumPy arrays.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    exercise::exercise_magic("fuzz.npy", bytes, 0, b"\x93NUMPY");
});
