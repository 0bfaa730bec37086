//! Tests of the crate through its public API; one binary, so that wgpu is linked once.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;
mod conservative;
mod plan;
mod ranges;
mod rays;
mod shaders;
mod walk;
mod walk_gpu;
