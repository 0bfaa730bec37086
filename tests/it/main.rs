//! Tests of the whole library through its public API; one binary, so that wgpu is linked once.
//!
//! `docs/testing.md` says how to run them on other drivers.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]
#![allow(clippy::print_stdout, reason = "measured numbers, shown with --nocapture")]

mod budget;
mod compare;
mod counters;
mod draw;
mod errors;
mod faults;
mod foveation;
mod frame_budget;
mod half_infill;
mod infill;
mod invariance;
mod left_out;
mod memory;
mod open_depth;
mod previews;
mod published;
mod reference;
mod residency;
mod stability;
mod streamed;
#[path = "../../examples/stability/suite/mod.rs"]
mod suite;
mod support;
mod work;
