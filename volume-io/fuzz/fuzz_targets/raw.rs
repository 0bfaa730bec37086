//! Samples with a layout from the input.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Some((options, rest)) = exercise::with_layout(bytes, true) {
        exercise::exercise("fuzz.raw", rest, &options);
    }
});
