//! `exercise::nifti` on what libFuzzer finds.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| exercise::nifti(bytes));
