//! CPU twins of the shaders: same arithmetic, same results bit for bit.

pub mod decode;
pub mod extrema;
