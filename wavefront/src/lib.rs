#![doc = include_str!("../README.md")]

#[cfg(feature = "block-sorted")]
mod block_sorted;
mod camera;
pub mod cpu;
pub mod draw;
mod error;
mod foveation;
pub mod frame;
#[cfg(test)]
mod layout_tests;
mod order;
mod outputs;
mod plan;
mod preview;
mod rays;
mod run_ahead;
mod samples;
mod strategy;
pub mod wgsl;

#[cfg(feature = "block-sorted")]
pub use block_sorted::{BlockSorted, BlockSortedOptions, BlockSortedPlan};
pub use camera::Camera;
pub use draw::{Draw, DrawBuffers, DrawTarget};
pub use error::Error;
pub use foveation::{BlueNoise, Foveation, SamplingParams};
pub use frame::{FrameParams, FrameView, LookAhead};
pub use gpu_primitives::wgpu;
pub use order::RayOrder;
pub use outputs::{
    DEPTH_NONE, Light, OutputTextures, Outputs, PixelStatus, Shading, ShadingParams,
};
pub use plan::WavefrontPlan;
pub use preview::{PreviewBinds, Previews};
pub use rays::{Counters, RayBuffers, Rays};
pub use run_ahead::RunAhead;
pub use samples::{SampleLayout, Samples};
pub use strategy::{MakeResident, Rounds, Scene, Statistics, Strategy};
