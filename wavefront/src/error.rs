use thiserror::Error as ThisError;

/// Why a frame or its buffers cannot be made.
#[derive(Debug, Clone, PartialEq, ThisError)]
#[non_exhaustive]
pub enum Error {
    /// A matrix holds a NaN or an infinity.
    #[error("{what} holds a value that is not finite")]
    NotFinite {
        /// Which matrix or value.
        what: &'static str,
    },
    /// A matrix has no inverse.
    #[error("{what} cannot be inverted")]
    Singular {
        /// Which matrix.
        what: &'static str,
    },
    /// The projection's w must depend on view depth alone and not change sign where the volume is.
    #[error(
        "the last row of clip_from_view is {row:?}; its x and y must be 0, and w - z * depth must keep its sign where the volume is"
    )]
    UnsupportedProjection {
        /// Last row.
        row: [f64; 4],
    },
    /// A picture has at least one pixel and its rays fit one binding.
    #[error(
        "a picture of {width}x{height} pixels: expected at least 1x1, at most {most} pixels and {most_edge} per axis"
    )]
    PictureSize {
        /// Pixels per row.
        width: u32,
        /// Rows.
        height: u32,
        /// Most pixels under the device's limits.
        most: u64,
        /// Most pixels per axis under the device's limits.
        most_edge: u32,
    },
    /// A number of a frame's foveation is out of range.
    #[error(
        "{found:?}: expected finite numbers, sigma not below 0, a base density of 0 to 1 and 1 to 64 passes"
    )]
    Foveation {
        /// Choice given.
        found: crate::Foveation,
    },
    /// The strategy decodes blocks as rays need them.
    #[error("this strategy works with a cache only, not with a volume that is resident as a whole")]
    NeedsCache,
    /// Pipelines for one kind of samples were given the other.
    #[error(
        "the pipelines were made for a cache and given a resident volume, or the other way round"
    )]
    OtherSamples,
    /// The start factor is out of range.
    #[error("the start factor is {found}, expected 1 to 8")]
    StartFactor {
        /// Factor given.
        found: u32,
    },
    /// The ray-block pairs must fit one binding.
    #[error(
        "{pairs} ray-block pairs need a binding of {needed} bytes, the device binds at most {available}"
    )]
    TooManyPairs {
        /// Pixels times start factor.
        pairs: u64,
        /// Bytes of the pairs.
        needed: u64,
        /// Largest storage binding of the device in bytes.
        available: u64,
    },
}
