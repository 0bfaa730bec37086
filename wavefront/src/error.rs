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
    /// The projection's w must depend on view depth alone.
    #[error("the last row of clip_from_view is {row:?}; its x and y must be 0")]
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
}
