//! What can be wrong.

/// Why in-fill cannot be planned or its weights cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The weights are not a safetensors file or lack a tensor.
    #[error("weights: {0}")]
    WeightsFile(String),
    /// A tensor has another shape.
    #[error("weights: tensor {name} has the shape {found:?} instead of {expected:?}")]
    WeightsShape {
        /// The tensor.
        name: String,
        /// Its shape in this network.
        expected: Vec<usize>,
        /// Its shape in the file.
        found: Vec<usize>,
    },
    /// A tensor has another type.
    #[error("weights: tensor {name} has the type {found} instead of F16 or F32")]
    WeightsType {
        /// The tensor.
        name: String,
        /// Its type in the file.
        found: String,
    },
    /// A tensor holds numbers that are not finite as f16.
    #[error("weights: tensor {name} holds numbers that half precision does not")]
    WeightsRange {
        /// The tensor.
        name: String,
    },
    /// A picture has more pixels than a buffer holds numbers for.
    #[error(
        "in-fill of {width}x{height} pixels needs a buffer of {needed} bytes, the device allows {available}"
    )]
    PictureSize {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// Bytes of the largest buffer.
        needed: u64,
        /// The device's limit.
        available: u64,
    },
    /// The pictures do not include what in-fill reads.
    #[error("in-fill needs the depth and normal outputs")]
    MissingOutputs,
    /// The plan has a network.
    #[error("the network was planned, and there are no weights")]
    NoWeights,
}
