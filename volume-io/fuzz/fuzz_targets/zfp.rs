//! Streams with zfp's header, and headerless ones.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    exercise::exercise_magic("fuzz.zfp", bytes, 0, b"zfp\x05");
    if let Some((options, rest)) = exercise::with_layout(bytes, false) {
        exercise::exercise("fuzz.zfp", rest, &options);
    }
});
