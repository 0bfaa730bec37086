//! The bundled sample volume and generators of any size, for examples, tests and benchmarks.

mod analytic;
mod brain;
mod field;
mod math;
mod mixing;
mod noise;
mod patch;
mod sample;
mod scans;
mod turbulence;

pub use analytic::{Gyroid, MarschnerLobb, PlaneRamp, SphereDistance};
pub use brain::{BRAIN_ISOVALUE, BRAIN_RATE, brain};
pub use field::{Field, NAMES, UnknownField, by_name};
pub use mixing::MixingLayer;
pub use patch::Patch;
pub use sample::{generate, sample_block, samples};
pub use scans::{RoughSolid, Shells};
pub use turbulence::Turbulence;
