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
    /// The directory numbers blocks in 32 bits.
    #[error("a volume of {blocks} blocks has more than the {most} that can be numbered")]
    TooManyBlocks {
        /// Blocks of the volume.
        blocks: u64,
        /// Most blocks.
        most: u64,
    },
}
