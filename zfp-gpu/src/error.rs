//! What can go wrong before anything is recorded.

/// Why a stream, a plan or a set of buffers cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A volume has at least one sample per axis.
    #[error("volume dimensions must be at least 1 on every axis, found {dims:?}")]
    EmptyVolume {
        /// Samples per axis as given.
        dims: [u32; 3],
    },
    /// A block has a nine-bit header and no more bits than zfp itself allows.
    #[error("bits per block must be in {least}..={most}, found {found}")]
    BitsPerBlock {
        /// Bits per block as given.
        found: u32,
        /// Smallest number of bits that holds a block's header.
        least: u32,
        /// Largest number of bits that zfp accepts.
        most: u32,
    },
    /// A rate is a finite number of bits per sample that gives an allowed number of bits per block.
    #[error("rate must be a finite number of bits per sample in 0..={most}, found {found}")]
    Rate {
        /// Rate as given, in bits per sample.
        found: f64,
        /// Largest rate that zfp accepts for 3D blocks.
        most: f64,
    },
    /// The last bit of the stream has no 64-bit address.
    #[error("a stream of {bits_per_block} bits per block for {dims:?} samples has no 64-bit size")]
    StreamTooLong {
        /// Samples per axis as given.
        dims: [u32; 3],
        /// Bits per block as given.
        bits_per_block: u32,
    },
    /// Block indices are 32-bit numbers on the GPU, and the last two of them are reserved.
    #[error("the GPU addresses at most {most} blocks, the volume has {found}")]
    TooManyBlocks {
        /// Blocks of the volume.
        found: u64,
        /// Largest number of blocks.
        most: u64,
    },
    /// One page holds at least 32 blocks.
    #[error("a payload page needs at least {needed} bytes, the device binds at most {limit}")]
    PageTooSmall {
        /// Bytes of the smallest page.
        needed: u64,
        /// Bytes that one storage binding of one buffer can have.
        limit: u64,
    },
    /// The stream is uploaded from its first byte on, without gaps.
    #[error("the next chunk must start at stream byte {expected} (or 0 to restart), found {found}")]
    UploadOrder {
        /// Byte after the last one uploaded.
        expected: u64,
        /// First byte of the chunk.
        found: u64,
    },
    /// Decoded blocks are written to one to three cache pages.
    #[error("expected {expected} cache pages, found {found}")]
    CachePages {
        /// What is possible here.
        expected: String,
        /// What was given.
        found: usize,
    },
    /// A buffer is shorter than its use requires.
    #[error("{what} needs at least {expected} bytes, found {found}")]
    BufferTooSmall {
        /// Which buffer.
        what: &'static str,
        /// Bytes needed.
        expected: u64,
        /// Bytes there are.
        found: u64,
    },
    /// An offset into a buffer of 32-bit words is a multiple of four.
    #[error("{what} must be a multiple of 4 bytes, found {found}")]
    Unaligned {
        /// Which offset.
        what: &'static str,
        /// Bytes as given.
        found: u64,
    },
}
