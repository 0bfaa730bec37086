//! Twin of the stream compaction.

/// The values whose flag is not 0, in order; the shorter slice decides the length.
#[must_use]
pub fn compact(flags: &[u32], values: &[u32]) -> Vec<u32> {
    flags.iter().zip(values).filter(|&(&flag, _)| flag != 0).map(|(_, &value)| value).collect()
}
