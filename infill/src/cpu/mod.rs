//! The filler on the CPU: twins of the kernels, dense, for tests and for making training data.

mod calibrate;
pub mod candidate;
pub mod features;
pub mod field;
pub mod fill;
pub mod march;
pub mod network;
#[cfg(feature = "published-network")]
pub mod published;
pub mod push_pull;
pub mod reduced;
pub mod reproject;

pub use candidate::Candidate;
pub use fill::{Fill, Finished, Scene};
