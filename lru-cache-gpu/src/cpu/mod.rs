//! CPU twin of the cache: the same words, changed by the same rules.

mod cache;
mod directory;
mod request;
mod service;

pub use cache::Cache;
