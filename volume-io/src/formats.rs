//! Choice of the reader. One module per file format.

#[cfg(feature = "nifti")]
mod nifti;
mod zfp;

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::volume::ZfpVolume;

pub use zfp::write_zfp;

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
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self { rate: 8.0, replace_non_finite: None, headerless: None, time_index: None }
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

/// Reads a volume from a file; see [`read_bytes`] for what is recognised.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read, otherwise as [`read_bytes`].
#[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
pub fn read_file(path: impl AsRef<std::path::Path>, options: &ReadOptions) -> Result<ZfpVolume> {
    let path = path.as_ref();
    let name = path.display().to_string();
    let bytes = load(path).map_err(|source| Error::Io { name: name.clone(), source })?;
    read_bytes(&name, bytes, options)
}

/// The contents of a file, read into their final place, since they may be kept as they are.
#[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
fn load(path: &std::path::Path) -> std::io::Result<Arc<[u8]>> {
    use std::io::{Error, ErrorKind, Read};
    let mut file = std::fs::File::open(path)?;
    let metadata = file.metadata()?;
    if !metadata.is_file() || metadata.len() == 0 {
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        return Ok(bytes.into());
    }
    let length = usize::try_from(metadata.len())
        .map_err(|error| Error::new(ErrorKind::OutOfMemory, error))?;
    // Allocating the shared slice cannot report failure, so ask first.
    Vec::<u8>::new()
        .try_reserve_exact(length)
        .map_err(|error| Error::new(ErrorKind::OutOfMemory, error))?;
    let mut bytes: Arc<[u8]> = std::iter::repeat_n(0, length).collect();
    if let Some(buffer) = Arc::get_mut(&mut bytes) {
        file.read_exact(buffer)?;
    }
    Ok(bytes)
}

/// Reads a volume from the contents of a file.
///
/// The first bytes decide: zfp's own header, NIfTI-1 (feature `nifti`), or gzip around NIfTI-1
/// (feature `gzip`). Anything else is taken for a headerless zfp stream if
/// [`ReadOptions::headerless`] is given. `name` is used in messages, and its ending in hints.
///
/// Fixed-rate 3D streams of 32-bit floats are kept as they are; everything else is encoded at
/// [`ReadOptions::rate`] and the error that this introduces is measured (see [`crate::Source`]).
///
/// # Errors
/// Any [`Error`] that says what was expected and what was found. No input makes this panic, and
/// memory grows with the data that are there, not with what a header claims.
pub fn read_bytes(
    name: &str,
    bytes: impl Into<Arc<[u8]>>,
    options: &ReadOptions,
) -> Result<ZfpVolume> {
    let bytes = bytes.into();
    let volume = match Kind::of(&bytes) {
        Some(Kind::Zfp) => zfp::read(bytes, options),
        Some(Kind::Nifti) => read_nifti(name, &bytes, options),
        Some(Kind::Gzip) => read_gzip(name, &bytes, options),
        None => match &options.headerless {
            Some(layout) => zfp::read_headerless(bytes, layout),
            None => Err(unknown(name, &bytes)),
        },
    }?;
    tracing::debug!(
        dims = ?volume.dims,
        bits_per_block = volume.bits_per_block,
        bytes = volume.bytes.len(),
        "volume read"
    );
    Ok(volume)
}

/// Kinds of file that their first bytes tell apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Zfp,
    Nifti,
    Gzip,
}

impl Kind {
    fn of(bytes: &[u8]) -> Option<Self> {
        if bytes.starts_with(b"zfp") {
            Some(Self::Zfp)
        } else if bytes.starts_with(&[0x1f, 0x8b]) {
            Some(Self::Gzip)
        } else if matches!(bytes.get(344..348), Some(b"n+1\0" | b"ni1\0")) {
            Some(Self::Nifti)
        } else {
            None
        }
    }
}

fn unknown(name: &str, bytes: &[u8]) -> Error {
    if name.to_ascii_lowercase().ends_with(".zfp") {
        Error::HeaderlessNeedsLayout { name: name.into() }
    } else {
        let start = bytes.iter().take(8).copied().collect();
        Error::UnknownFormat { name: name.into(), start }
    }
}

#[cfg(feature = "nifti")]
fn read_nifti(name: &str, bytes: &[u8], options: &ReadOptions) -> Result<ZfpVolume> {
    nifti::read(name, bytes, Some(bytes.len() as u64), options)
}

#[cfg(not(feature = "nifti"))]
fn read_nifti(name: &str, _bytes: &[u8], _options: &ReadOptions) -> Result<ZfpVolume> {
    Err(Error::MissingFeature { name: name.into(), feature: "nifti" })
}

#[cfg(all(feature = "nifti", feature = "gzip"))]
fn read_gzip(name: &str, bytes: &[u8], options: &ReadOptions) -> Result<ZfpVolume> {
    use std::io::Read;
    let io = |source| Error::Io { name: format!("{name} (gzip)"), source };
    let mut decoder = flate2::read::MultiGzDecoder::new(bytes);
    let mut start = Vec::new();
    decoder.by_ref().take(nifti::HEADER_BYTES).read_to_end(&mut start).map_err(io)?;
    match Kind::of(&start) {
        Some(Kind::Nifti) => nifti::read(name, start.as_slice().chain(decoder), None, options),
        _ => Err(Error::UnknownFormat {
            name: format!("{name} (gzip)"),
            start: start.into_iter().take(8).collect(),
        }),
    }
}

#[cfg(not(all(feature = "nifti", feature = "gzip")))]
fn read_gzip(name: &str, _bytes: &[u8], _options: &ReadOptions) -> Result<ZfpVolume> {
    let feature = if cfg!(feature = "gzip") { "nifti" } else { "gzip" };
    Err(Error::MissingFeature { name: name.into(), feature })
}
