//! CPU twins of the shaders, one file per WGSL file, in f32 with the same operations in the same order.

pub mod dda;
pub mod ranges;
pub mod skip;
