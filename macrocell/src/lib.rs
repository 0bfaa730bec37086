#![doc = include_str!("../README.md")]

/// Name, byte offset and byte size of the members of a uniform struct.
#[cfg(test)]
macro_rules! members {
    ($params:ty: $($name:ident),*) => {{
        let params = <$params as bytemuck::Zeroable>::zeroed();
        [$((
            stringify!($name),
            std::mem::offset_of!($params, $name) as u32,
            size_of_val(&params.$name) as u32,
        )),*]
    }};
}

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
