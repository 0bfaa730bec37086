//! Tests of the crate through its public API; one binary, so that wgpu is linked once.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]
#![allow(clippy::print_stdout, reason = "measured numbers, shown with --nocapture")]

mod fields;
mod harness;
mod roots;
mod symmetry;
mod twin;
mod watertight;
