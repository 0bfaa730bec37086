#![doc = include_str!("../README.md")]

pub mod cpu;
mod decode;
mod error;
mod extrema;
mod payload;
mod plan;
mod stream;
pub mod wgsl;

pub use decode::{Decode, DecodeBuffers, SLOT_BYTES};
pub use error::Error;
pub use extrema::{BlockExtrema, ExtremaBuffers, KeptSamples};
pub use payload::Payload;
pub use plan::{MAX_BLOCKS, PayloadPage, PayloadPlan};
pub use stream::{BLOCK_EDGE, BLOCK_SAMPLES, MAX_BITS_PER_BLOCK, MIN_BITS_PER_BLOCK, StreamLayout};
