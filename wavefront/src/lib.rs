#![doc = include_str!("../README.md")]

mod camera;
pub mod draw;
mod error;
pub mod frame;
mod outputs;
mod plan;
mod rays;
mod run_ahead;

pub use camera::Camera;
pub use draw::{Draw, DrawBuffers, DrawTarget};
pub use error::Error;
pub use frame::{FrameParams, FrameView};
pub use gpu_primitives::wgpu;
pub use outputs::{
    DEPTH_NONE, Light, OutputTextures, Outputs, PixelStatus, Shading, ShadingParams,
};
pub use plan::WavefrontPlan;
pub use rays::{Counters, RayBuffers, Rays};
pub use run_ahead::{RunAhead, RunAheadBuffers};
