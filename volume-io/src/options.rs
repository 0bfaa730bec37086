//! Choices for reading a file.

use crate::source::SampleType;

/// Choices for reading a file.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadOptions {
    /// Bits per voxel at which files that are not fixed-rate ZFP of 3D floats are encoded.
    /// Default: 8.
    pub rate: f64,
    /// Takes the place of NaN and infinity in uncompressed or re-encoded files, which are refused
    /// otherwise. A finite magnitude below 2^123.
    pub replace_non_finite: Option<f32>,
    /// What a zfp stream without a header does not say itself.
    pub headerless: Option<Headerless>,
    /// Which volume to take from a file with several, counted from 0.
    pub time_index: Option<u32>,
    /// What a raw file does not say itself; takes the place of what its name says.
    pub raw: Option<RawLayout>,
    /// Whether the samples of raw files have their most significant byte first.
    pub big_endian: bool,
    /// Name of the array to take from a file with several. Default: the one that the file marks
    /// as active, or its first array of scalars.
    pub array: Option<String>,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            rate: 8.0,
            replace_non_finite: None,
            headerless: None,
            time_index: None,
            raw: None,
            big_endian: false,
            array: None,
        }
    }
}

/// Layout of a zfp stream without a header: fixed-rate, 3D, 32-bit floats.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Headerless {
    /// Voxels along x, y and z.
    pub dims: [u32; 3],
    /// Bits per voxel, as given to zfp's encoder.
    pub rate: f64,
}

/// Layout of a file of nothing but samples, x-fastest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawLayout {
    /// Voxels along x, y and z.
    pub dims: [u32; 3],
    /// Type of the samples.
    pub sample_type: SampleType,
}
