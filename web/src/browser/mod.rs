//! What the page's script calls.

mod convert;
mod gpu;
mod present;
mod viewer;

pub use convert::{
    Converted, Converter, header_bytes, is_fixed_rate, linked_infill, linked_volume,
};
pub use viewer::{Picture, Viewer};
