//! Tests of the crate through its public API; one binary, so that wgpu is linked once.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]
#![allow(clippy::print_stdout, reason = "seeds, shown when a test fails")]

mod harness;
mod invariants;
mod parallel;
mod plan;
mod policy;
mod sequences;
mod shaders;
mod slots;
