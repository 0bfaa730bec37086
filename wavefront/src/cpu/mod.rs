//! CPU twins of the shaders, one file per WGSL file, in f32 with the same operations in the same order.

pub mod block_walk;
pub mod cell;
pub mod frame;
pub mod sampling_mask;
pub mod shading;
pub mod upscale;
pub mod walk;
