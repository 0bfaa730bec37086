//! CPU twin of the cache: the same words, changed by the same rules.

mod request;
mod service;

pub use service::Cache;
