//! The bundled sample volume and generators of any size, for examples, tests and benchmarks.

mod analytic;
mod brain;
mod field;
mod math;
mod mixing;
mod noise;
mod noise_shapes;
mod patch;
mod rotated;
mod sample;
mod scans;
mod turbulence;

pub use analytic::{Gyroid, MarschnerLobb, PlaneRamp, SphereDistance};
pub use brain::{BRAIN_ISOVALUE, BRAIN_RATE, brain};
pub use field::{Field, NAMES, UnknownField, by_name, by_name_with_seed};
pub use mixing::MixingLayer;
pub use noise_shapes::{Blobs, Labels, Sheets, Tubes};
pub use patch::Patch;
pub use rotated::Rotated;
pub use sample::{generate, sample_block, samples};
pub use scans::{RoughSolid, Shells};
pub use turbulence::Turbulence;
