#![doc = include_str!("../README.md")]

mod buffers;
pub mod cpu;
mod error;
mod layout;
mod plan;
mod resident;
mod service;
pub mod wgsl;

pub use buffers::CacheBuffers;
pub use error::Error;
pub use gpu_primitives::wgpu;
pub use plan::{CachePlan, CacheRoom, LruParams, MAX_PAGES, SLOT_BYTES};
pub use resident::{ResidentBuffers, ResidentPlan};
pub use service::{Counters, Service};
