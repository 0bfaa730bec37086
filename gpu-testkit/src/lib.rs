//! Test support: adapter choice, sentinels, comparisons that are themselves tested, an f64
//! reference renderer and how far from it a picture may be, image metrics.
//!
//! Everything here may block, submit and panic: it is for tests, benches and examples only.

pub mod bounds;
pub mod compare;
mod flip;
pub mod gpu;
pub mod image;
pub mod judge;
pub mod layout;
pub mod picture;
mod property;
pub mod reference;
mod ssim;
pub mod statistics;

pub use property::property;
