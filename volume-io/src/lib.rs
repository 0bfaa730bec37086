//! Reading volumes from the files people have, and conversion to fixed-rate ZFP.
//!
//! Everything ends in a [`ZfpVolume`]: a fixed-rate ZFP stream of a 3D field of 32-bit floats
//! with its placement in space and a record of where it comes from. The crate is pure CPU code
//! and runs in a browser too.
//!
//! ```
//! # fn main() -> Result<(), volume_io::Error> {
//! let ramp: Vec<f32> = (0..8 * 8 * 8).map(|i| (i % 8) as f32).collect();
//! let volume = volume_io::encode(&ramp, [8, 8, 8], 8.0)?;
//! assert_eq!(volume.bytes.len(), 8 * 8 * 8);
//! assert!((volume.decode()[7] - 7.0).abs() < 0.1);
//! # Ok(())
//! # }
//! ```

#[cfg(all(doctest, feature = "nifti"))]
#[doc = include_str!("../README.md")]
struct Readme;

mod arrival;
mod convert;
mod encode;
mod error;
mod formats;
mod grid;
mod input;
mod layout;
mod options;
mod sink;
mod source;
mod stats;
mod stream;
mod volume;
mod write;

pub use arrival::{FixedRateHeader, StreamScan};
pub use encode::{BlockEncoder, encode};
pub use error::{Error, Result};
pub use formats::{convert_bytes, read_bytes, write_zfp};
#[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
pub use formats::{convert_file, read_file};
pub use grid::{MAX_DIM, bits_per_block, pad_block};
pub use options::{Headerless, RawLayout, ReadOptions};
pub use source::{Distortion, Format, Note, SampleType, Source};
pub use stats::{Histogram, value_range};
pub use stream::{Conversion, StreamEncoder};
pub use volume::{Block, Geometry, MAX_EXPONENT, TINY_EXPONENT, ZfpVolume};
pub use write::{raw_file_name, write_npy, write_nrrd, write_raw};
