//! GPU building blocks shared by more than one stage: WGSL composition, accounted memory, upload,
//! readback, indirect arguments, scan, stream compaction and a key-value sort.
//!
//! Everything here only records commands: nothing submits, polls, maps synchronously or blocks.
//! Counts stay on the GPU and drive indirect dispatches.

pub use wgpu;

pub mod compact;
pub mod cpu;
pub mod indirect;
pub mod kernel;
pub mod memory;
pub mod profile;
pub mod readback;
pub mod scan;
pub mod sort;
pub mod upload;
pub mod wgsl;

/// Compiles the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
