use thiserror::Error as ThisError;

/// Why a plan cannot be made.
#[derive(Debug, Clone, PartialEq, Eq, ThisError)]
#[non_exhaustive]
pub enum Error {
    /// The masks of all coarse cells must fit one binding.
    #[error(
        "masks of {dims:?} voxels need a binding of {needed} bytes, the device binds at most {available}"
    )]
    MasksTooLarge {
        /// Voxels on each axis.
        dims: [u32; 3],
        /// Bytes of the masks.
        needed: u64,
        /// Largest storage binding of the device in bytes.
        available: u64,
    },
    /// Blocks are numbered in 30 bits.
    #[error("{dims:?} voxels make {blocks} blocks, at most {limit} can be numbered")]
    TooManyBlocks {
        /// Voxels on each axis.
        dims: [u32; 3],
        /// Blocks of 4^3 voxels.
        blocks: u64,
        /// Most blocks.
        limit: u64,
    },
    /// A volume has at least one voxel on each axis.
    #[error("a volume has at least one voxel on each axis, found {dims:?}")]
    EmptyVolume {
        /// Voxels on each axis.
        dims: [u32; 3],
    },
}
