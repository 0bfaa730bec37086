//! The same results on the CPU, for tests to compare with.

pub mod compact;
pub mod indirect;
pub mod scan;
pub mod sort;
