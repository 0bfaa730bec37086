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
    /// A volume that is resident as a whole must fit the pages that a kernel binds.
    #[error("{blocks} blocks cannot all be resident, the device's limits allow {most}")]
    TooManyBlocks {
        /// Blocks of the volume.
        blocks: u64,
        /// Most blocks under the device's limits.
        most: u64,
    },
    /// The directory must fit one binding.
    #[error(
        "the directory of {blocks} blocks needs a binding of {needed} bytes, the device binds at most {available}"
    )]
    DirectoryTooLarge {
        /// Blocks of the volume.
        blocks: u64,
        /// Bytes of the directory.
        needed: u64,
        /// Largest storage binding of the device in bytes.
        available: u64,
    },
}
