#![doc = include_str!("../README.md")]

pub mod cpu;
mod error;
mod guide;
mod kernels;
#[cfg(test)]
#[macro_use]
mod layout_tests;
pub mod options;
mod plan;
#[cfg(feature = "published-network")]
pub mod published;
mod reduced;
mod stage;
pub mod weights;

pub use error::Error;
pub use gpu_primitives::wgpu;
pub use guide::{Guide, GuideBinds, GuideScene};
pub use options::{DOUBT, Look, PRIOR, Source, Sources};
pub use plan::InfillPlan;
pub use stage::{Infill, InfillBuffers, Method, Scene};
pub use weights::Weights;
