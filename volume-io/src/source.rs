//! Where a volume comes from and what was done to it on the way.

use std::fmt;

/// The kind of file that a volume was read from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Format {
    /// Samples in memory.
    Memory,
    /// A stream with zfp's own header.
    Zfp,
    /// A zfp stream without a header.
    ZfpHeaderless,
    /// NIfTI-1.
    Nifti,
    /// Samples without a header (`.raw`).
    Raw,
    /// NumPy's `.npy`.
    Npy,
    /// NRRD, attached or detached.
    Nrrd,
    /// `ImageData` of VTK in XML (`.vti`).
    Vti,
    /// MRC2014 or CCP4.
    Mrc,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Memory => "in-memory",
            Self::Zfp => "zfp",
            Self::ZfpHeaderless => "headerless zfp",
            Self::Nifti => "NIfTI",
            Self::Raw => "raw",
            Self::Npy => "NumPy",
            Self::Nrrd => "NRRD",
            Self::Vti => "VTK ImageData",
            Self::Mrc => "MRC",
        })
    }
}

/// Type of the samples before they became 32-bit floats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum SampleType {
    /// Unsigned 8-bit integer.
    U8,
    /// Signed 8-bit integer.
    I8,
    /// Unsigned 16-bit integer.
    U16,
    /// Signed 16-bit integer.
    I16,
    /// Unsigned 32-bit integer.
    U32,
    /// Signed 32-bit integer.
    I32,
    /// Unsigned 64-bit integer.
    U64,
    /// Signed 64-bit integer.
    I64,
    /// 16-bit float.
    F16,
    /// 32-bit float.
    F32,
    /// 64-bit float.
    F64,
}

impl SampleType {
    /// Every type.
    pub const ALL: &'static [Self] = &[
        Self::U8,
        Self::I8,
        Self::U16,
        Self::I16,
        Self::U32,
        Self::I32,
        Self::U64,
        Self::I64,
        Self::F16,
        Self::F32,
        Self::F64,
    ];

    /// The name that raw files carry, such as `uint8` or `float32`.
    #[must_use]
    pub fn raw_name(self) -> &'static str {
        match self {
            Self::U8 => "uint8",
            Self::I8 => "int8",
            Self::U16 => "uint16",
            Self::I16 => "int16",
            Self::U32 => "uint32",
            Self::I32 => "int32",
            Self::U64 => "uint64",
            Self::I64 => "int64",
            Self::F16 => "float16",
            Self::F32 => "float32",
            Self::F64 => "float64",
        }
    }

    /// The type of this name, as raw files carry it; the case does not matter.
    #[must_use]
    pub fn from_raw_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|ty| ty.raw_name().eq_ignore_ascii_case(name))
    }

    /// Bytes of one sample.
    #[must_use]
    pub fn bytes(self) -> u32 {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 | Self::F16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }
}

impl fmt::Display for SampleType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::U8 => "u8",
            Self::I8 => "i8",
            Self::U16 => "u16",
            Self::I16 => "i16",
            Self::U32 => "u32",
            Self::I32 => "i32",
            Self::U64 => "u64",
            Self::I64 => "i64",
            Self::F16 => "f16",
            Self::F32 => "f32",
            Self::F64 => "f64",
        })
    }
}

/// Difference between the samples of a file and those that the encoded volume decodes to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distortion {
    /// Largest absolute difference.
    pub max: f64,
    /// Root of the mean squared difference.
    pub rms: f64,
    /// Peak signal-to-noise ratio, 20 log10(value range / rms), in dB; infinite without error.
    pub psnr_db: f64,
}

/// Something about the file that did not stop reading but that its user should know.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Note {
    /// Bytes after the end of the data were ignored.
    TrailingBytes(u64),
    /// Dims and rate were given for a stream whose own header was used instead.
    HeaderUsed,
    /// The file's placement in space cannot be said by spacing and origin alone (it is rotated,
    /// mirrored or sheared); the origin was left at zero.
    OriginIgnored,
    /// A spacing that is zero or not finite was taken as 1.
    SpacingIgnored,
    /// One of several volumes was chosen.
    VolumeChosen {
        /// Which, counted from 0.
        index: u32,
        /// Of how many.
        count: u64,
    },
    /// The array that was read, of a file whose arrays have names.
    Array {
        /// Its name.
        name: String,
    },
    /// The file holds values of cells and none of points; the cells became voxels.
    CellData,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TrailingBytes(n) => write!(f, "{n} bytes after the data were ignored"),
            Self::HeaderUsed => {
                f.write_str("the file has a header; the dims and rate given were ignored")
            }
            Self::OriginIgnored => f.write_str(
                "the file's axes are rotated, mirrored or sheared; the origin was left at zero",
            ),
            Self::SpacingIgnored => f.write_str("an invalid spacing was taken as 1"),
            Self::VolumeChosen { index, count } => write!(f, "volume {index} of {count}"),
            Self::Array { name } => write!(f, "array {name:?} was read"),
            Self::CellData => f.write_str("values of cells were taken as voxels at their centres"),
        }
    }
}

/// Where a volume comes from and what was done to it on the way.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Source {
    /// The kind of file.
    pub format: Format,
    /// Type of the samples in the file.
    pub sample_type: SampleType,
    /// Number of axes in the file, 1 to 3; missing ones have size 1.
    pub rank: u32,
    /// Whether the samples were encoded here. False: the compressed stream is the file's own.
    pub encoded: bool,
    /// The error that encoding introduced, where it was measured.
    pub distortion: Option<Distortion>,
    /// Number of non-finite samples that were replaced.
    pub replaced: u64,
    /// Number of blocks that are not all zero but whose magnitudes are all below 2^-96: the GPU
    /// decodes them as zero.
    pub tiny_blocks: u64,
    /// What else should be known.
    pub notes: Vec<Note>,
}

impl Source {
    pub(crate) fn new(format: Format, sample_type: SampleType) -> Self {
        Self {
            format,
            sample_type,
            rank: 3,
            encoded: false,
            distortion: None,
            replaced: 0,
            tiny_blocks: 0,
            notes: Vec::new(),
        }
    }
}

/// Sums from which a [`Distortion`] follows.
#[derive(Clone, Debug)]
pub(crate) struct DistortionSum {
    max: f64,
    squares: f64,
    count: u64,
    range: [f64; 2],
}

impl DistortionSum {
    pub(crate) fn new() -> Self {
        Self { max: 0.0, squares: 0.0, count: 0, range: [f64::INFINITY, f64::NEG_INFINITY] }
    }

    pub(crate) fn add(&mut self, exact: f64, decoded: f32) {
        let error = (exact - f64::from(decoded)).abs();
        self.max = self.max.max(error);
        self.squares += error * error;
        self.count += 1;
        self.range = [self.range[0].min(exact), self.range[1].max(exact)];
    }

    pub(crate) fn distortion(&self) -> Distortion {
        let rms = (self.squares / self.count.max(1) as f64).sqrt();
        let peak = self.range[1] - self.range[0];
        let psnr_db = if rms > 0.0 { 20.0 * (peak / rms).log10() } else { f64::INFINITY };
        Distortion { max: self.max, rms, psnr_db }
    }
}
