//! The renderer as a web page: `cargo xtask web --serve`.
//!
//! What needs no browser is plain Rust with tests; `browser` is what the page's script calls.

pub mod bars;
#[cfg(target_arch = "wasm32")]
pub mod browser;
pub mod camera;
pub mod exchange;
pub mod link;
pub mod rows;
pub mod session;
pub mod text;
