//! CPU twin of the cache.
