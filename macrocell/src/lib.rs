#![doc = include_str!("../README.md")]

pub mod activate;
pub mod cpu;
mod error;
mod grid;
pub mod plan;
pub mod ranges;
pub mod wgsl;

pub use activate::{Activate, Masks};
pub use error::Error;
pub use gpu_primitives::wgpu;
pub use grid::Grid;
pub use plan::{MacrocellPlan, Region};
pub use ranges::{RangeBuffers, RangeScratch, Ranges};
