#![doc = include_str!("../README.md")]

mod arriving;
#[cfg(not(target_arch = "wasm32"))]
mod blocking;
mod budget;
mod capture;
mod casting;
mod error;
mod faults;
mod load;
mod options;
mod plan;
mod records;
mod renderer;
mod report;
mod samples;
mod schedule;
mod stages;
mod strategy;
mod timing;
mod volume;

pub use arriving::StreamFeed;
pub use budget::BudgetMode;
pub use capture::{Capture, PendingCapture};
pub use error::Error;
pub use gpu_primitives::memory::Category;
pub use infill::{Sources as InfillSources, Weights as InfillWeights};
pub use options::{
    Completeness, Frame, FrameOptions, Infill, InfillOptions, InfillWhen, RendererOptions,
    Residency, TraversalStrategy,
};
pub use plan::{Part, ScenePlan, When, Work};
pub use renderer::ProgressiveIsoRenderer;
pub use report::PassReport;
pub use volume::{CompressedVolume, StreamBytes};
#[cfg(feature = "block-sorted")]
pub use wavefront::BlockSortedOptions;
pub use wavefront::{
    BlueNoise, Camera, DEPTH_NONE, DrawTarget, Foveation, FrameView, Light, OutputTextures,
    Outputs, PixelStatus, Shading,
};
pub use wgpu;
pub use zfp_gpu::StreamLayout;
