//! What can be wrong with a volume or a file, said as what was expected and what was found.

use crate::source::{Format, SampleType};

/// Result of this crate's fallible functions.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Why a volume could not be read, converted or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file system or a writer failed.
    #[error("cannot access {name}: {source}")]
    Io {
        /// The file, or what was being read or written.
        name: String,
        /// The reason the system gave.
        source: std::io::Error,
    },
    /// Neither the first bytes nor the name say what kind of file this is.
    #[error(
        "{name}: unknown kind of file (first bytes {start:02x?}); expected zfp with its header, \
         NIfTI, NumPy, NRRD, VTK ImageData or MRC, a raw file named NAME_XxYxZ_TYPE.raw, or dims \
         and rate or type given"
    )]
    UnknownFormat {
        /// Name of the file.
        name: String,
        /// Up to eight bytes from its start.
        start: Vec<u8>,
    },
    /// A file whose name ends in `.zfp` has no header, and no dims and rate were given.
    #[error("{name}: no zfp header found; a headerless stream needs its dims and rate to be given")]
    HeaderlessNeedsLayout {
        /// Name of the file.
        name: String,
    },
    /// A file whose name ends in `.raw` does not say what it holds, and nothing else was given.
    #[error(
        "{name}: expected a name like NAME_XxYxZ_TYPE.raw with TYPE one of uint8, int8, uint16, \
         int16, uint32, int32, uint64, int64, float16, float32, float64; or dims and type given"
    )]
    RawNeedsLayout {
        /// Name of the file.
        name: String,
    },
    /// The data are in a second file, which cannot or must not be opened.
    #[error(
        "{name}: the data are in a second file {file:?}; expected a file beside or below the \
         header, read with `read_file` or `convert_file`"
    )]
    SecondFile {
        /// Name of the file.
        name: String,
        /// The other file, as the header names it.
        file: String,
    },
    /// The file needs a reader that was left out of this build.
    #[error("{name}: this build cannot read it; enable the cargo feature `{feature}` of volume-io")]
    MissingFeature {
        /// Name of the file.
        name: String,
        /// The cargo feature with the reader.
        feature: &'static str,
    },
    /// A header field has a value that the format does not allow.
    #[error("invalid {format} header: {field}: expected {expected}, found {found}")]
    InvalidHeader {
        /// The kind of file.
        format: Format,
        /// The field.
        field: &'static str,
        /// What the format allows.
        expected: String,
        /// What the file holds.
        found: String,
    },
    /// The file is valid but holds something that cannot become a 3D scalar field.
    #[error("unsupported {format} file: expected {expected}, found {found}")]
    Unsupported {
        /// The kind of file.
        format: Format,
        /// What can be read.
        expected: &'static str,
        /// What the file holds.
        found: String,
    },
    /// A size along an axis is zero or too large.
    #[error("volume size {dims:?}: expected 1 to 65536 voxels along each axis")]
    Dims {
        /// The sizes found, x first.
        dims: Vec<u64>,
    },
    /// The volume is larger than this machine can address or allocate.
    #[error("cannot allocate {bytes} bytes")]
    OutOfMemory {
        /// Bytes asked for.
        bytes: u64,
    },
    /// A rate that gives no valid number of bits per block.
    #[error("rate {rate} bits per voxel: expected more than 0 and at most 260")]
    Rate {
        /// The rate found, in bits per voxel.
        rate: f64,
    },
    /// A number of bits per block that a fixed-rate stream of floats cannot have.
    #[error("{found} bits per block of 64 voxels: expected 9 to 16658")]
    BitsPerBlock {
        /// The number found.
        found: u64,
    },
    /// The data end before the volume does.
    #[error("the data end too early: expected at least {expected} bytes, found {found}")]
    TooShort {
        /// Least number of bytes that the volume needs.
        expected: u64,
        /// Number of bytes there are.
        found: u64,
    },
    /// A compressed stream of variable rate ends inside a block.
    #[error("the stream ends in block {block} of {blocks}: its {found} bits are too few")]
    StreamEnds {
        /// The block that is incomplete.
        block: u64,
        /// Number of blocks of the volume.
        blocks: u64,
        /// Number of bits there are.
        found: u64,
    },
    /// The length of a headerless stream contradicts the dims and rate given for it.
    #[error(
        "headerless stream: {dims:?} voxels at {bits_per_block} bits per block take {expected} \
         bytes, found {found}; dims or rate may be wrong"
    )]
    LengthMismatch {
        /// Voxels along each axis, as given.
        dims: [u32; 3],
        /// Bits per block, from the rate given.
        bits_per_block: u32,
        /// Bytes that these take.
        expected: u64,
        /// Bytes there are.
        found: u64,
    },
    /// The length of a raw file contradicts its dims and type.
    #[error(
        "raw file: {dims:?} voxels of type {sample_type} take {expected} bytes, found {found}; \
         dims or type may be wrong"
    )]
    RawLength {
        /// Voxels along each axis, as given or named.
        dims: [u32; 3],
        /// Type of the samples, as given or named.
        sample_type: SampleType,
        /// Bytes that these take.
        expected: u64,
        /// Bytes there are.
        found: u64,
    },
    /// The array asked for is not in the file.
    #[error("array {wanted:?}: expected one of {found:?}")]
    NoSuchArray {
        /// The name asked for.
        wanted: String,
        /// The names there are.
        found: Vec<String>,
    },
    /// A NaN or an infinity, which ZFP cannot hold.
    #[error(
        "voxel {voxel:?} is {value}: expected finite values (give a replacement to read it anyway)"
    )]
    NonFinite {
        /// The first such voxel in the order of reading.
        voxel: [u32; 3],
        /// Its value.
        value: f64,
    },
    /// A finite value too large to be decoded safely in 32-bit arithmetic.
    #[error("voxel {voxel:?} is {value}: expected magnitudes below 2^123 (about 1.06e37)")]
    TooLarge {
        /// The first such voxel in the order of reading.
        voxel: [u32; 3],
        /// Its value.
        value: f64,
    },
    /// The replacement given for NaN and infinity is itself not usable.
    #[error("replacement value {value}: expected a finite magnitude below 2^123")]
    Replacement {
        /// The value given.
        value: f32,
    },
    /// A block of a compressed stream may overflow 32-bit arithmetic when decoded.
    #[error(
        "block {block} (at voxel {voxel:?}) has biased exponent {exponent}: expected at most 250"
    )]
    BlockExponent {
        /// Index of the block, x fastest.
        block: u64,
        /// First voxel of the block.
        voxel: [u32; 3],
        /// Its biased exponent.
        exponent: u32,
    },
    /// The file holds several volumes and none was chosen.
    #[error("the file holds {count} volumes: choose one with a time index from 0 to {}", count - 1)]
    SeveralVolumes {
        /// How many there are.
        count: u64,
    },
    /// The volume chosen does not exist.
    #[error("time index {index}: expected less than {count}")]
    TimeIndex {
        /// The index given.
        index: u32,
        /// How many volumes there are.
        count: u64,
    },
    /// The number of samples given is not the number of voxels.
    #[error("{found} samples given: expected {expected}")]
    SampleCount {
        /// Voxels of the volume.
        expected: u64,
        /// Samples given.
        found: u64,
    },
    /// The number of blocks given is not the number of blocks of the volume.
    #[error("{found} blocks given: expected {expected}")]
    BlockCount {
        /// Blocks of the volume.
        expected: u64,
        /// Blocks given.
        found: u64,
    },
    /// The ZFP codec refused its parameters.
    #[error("the ZFP codec failed: {reason}")]
    Codec {
        /// What it said.
        reason: String,
    },
}

impl Error {
    /// A header field without a value that the format allows.
    pub(crate) fn header(
        format: Format,
        field: &'static str,
        expected: impl Into<String>,
        found: impl std::fmt::Display,
    ) -> Self {
        Self::InvalidHeader { format, field, expected: expected.into(), found: found.to_string() }
    }
}
