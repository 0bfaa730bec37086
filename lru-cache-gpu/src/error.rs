use thiserror::Error as ThisError;

/// Why a cache cannot be planned.
#[derive(Debug, Clone, PartialEq, Eq, ThisError)]
#[non_exhaustive]
pub enum Error {
    /// The bytes given do not hold the least number of slots.
    #[error(
        "a cache for {blocks} blocks needs at least {minimum} bytes, {available} are available"
    )]
    TooFewBytes {
        /// Blocks of the volume.
        blocks: u64,
        /// Least bytes.
        minimum: u64,
        /// Bytes given.
        available: u64,
    },
    /// The blocks must be numbered in 32 bits and, where they are resident as a whole, fit the pages
    /// that a kernel binds.
    #[error(
        "a volume of {blocks} blocks has more than the {most} that can be numbered or resident"
    )]
    TooManyBlocks {
        /// Blocks of the volume.
        blocks: u64,
        /// Most blocks.
        most: u64,
    },
}
