//! Choice of the reader. One module per file format.

mod mrc;
#[cfg(feature = "nifti")]
mod nifti;
mod npy;
mod nrrd;
mod raw;
#[cfg(feature = "vti")]
mod vti;
mod zfp;

use std::io::Write;
use std::sync::Arc;

use crate::convert::{Converter, Progress};
use crate::encode::{Encoded, Encoder};
use crate::error::{Error, Result};
use crate::input::Input;
use crate::layout::Layout;
use crate::options::{Headerless, ReadOptions};
use crate::sink::Sink;
use crate::stream::{Conversion, StreamEncoder};
use crate::volume::ZfpVolume;

pub use zfp::write_zfp;
pub(crate) use zfp::{fixed_rate_header, header_words};

/// Reads a volume from a file; see [`read_bytes`] for what is recognised.
///
/// Of uncompressed and gzipped files only a few slices are in memory at a time, beside the
/// encoded volume. Files that come in pairs (NIfTI's `.hdr` and `.img`, detached NRRD) are read
/// by giving the header; the other file has to lie beside or below it.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read, otherwise as [`read_bytes`].
#[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
pub fn read_file(path: impl AsRef<std::path::Path>, options: &ReadOptions) -> Result<ZfpVolume> {
    read(open_path(path.as_ref())?, None, options)
}

/// Reads a volume from a file and writes it as ZFP of [`ReadOptions::rate`] with zfp's header,
/// never holding more than a layer of blocks (four slices of the file's samples) and buffers of
/// fixed size. `progress` is called after every layer with the number of blocks done and in all.
///
/// More is held of these: zfp streams (the whole compressed file), and files whose slices do not
/// follow each other (all samples: NumPy in Fortran order, MRC whose sections are not along z).
///
/// Unlike in [`read_file`], also fixed-rate streams end up at the rate asked for.
///
/// # Errors
/// As [`read_file`], and [`Error::Io`] from the writer. What was written then is incomplete.
#[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
pub fn convert_file(
    path: impl AsRef<std::path::Path>,
    writer: impl Write,
    options: &ReadOptions,
    mut progress: impl FnMut(u64, u64),
) -> Result<Conversion> {
    convert(open_path(path.as_ref())?, writer, options, &mut progress)
}

/// As `convert_file`, for the contents of a file; `name` as in [`read_bytes`].
///
/// # Errors
/// As [`read_bytes`], and [`Error::Io`] from the writer. What was written then is incomplete.
pub fn convert_bytes(
    name: &str,
    bytes: &[u8],
    writer: impl Write,
    options: &ReadOptions,
    mut progress: impl FnMut(u64, u64),
) -> Result<Conversion> {
    convert(Input::from_bytes(name, bytes), writer, options, &mut progress)
}

fn convert(
    input: Input<'_>,
    writer: impl Write,
    options: &ReadOptions,
    progress: Progress<'_>,
) -> Result<Conversion> {
    match open(input, options)? {
        Opened::Samples(layout, input) => {
            input.check_length(layout.end)?;
            let encoder = StreamEncoder::new(layout.dims, options.rate, writer)?.into_inner();
            let converter = Converter::new(encoder, options, Some(progress))?;
            Conversion::finish(run(&layout, input, converter)?)
        }
        Opened::Zfp(input) => zfp::convert(load_zfp(input)?, writer, options, progress),
        Opened::Headerless(layout, input) => {
            let bytes = input.load(u64::MAX)?;
            zfp::convert_headerless(bytes, &layout, writer, options, progress)
        }
    }
}

/// Opens a file, and of a NIfTI pair always the header.
#[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
fn open_path(path: &std::path::Path) -> Result<Input<'static>> {
    let header = path.with_extension("hdr");
    let is_image = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("img"));
    Input::open(if is_image && header.is_file() { &header } else { path })
}

/// Reads a volume from the contents of a file.
///
/// The first bytes decide: zfp's own header, NIfTI-1 (feature `nifti`), NumPy, NRRD, VTK
/// `ImageData` (feature `vti`), MRC, or gzip around any of these (feature `gzip`). Files of nothing
/// but samples are recognised by a name like `NAME_XxYxZ_TYPE.raw` or by [`ReadOptions::raw`].
/// Anything else is taken for a headerless zfp stream if [`ReadOptions::headerless`] is given.
/// `name` is used in messages, and its parts in hints.
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
    read(Input::from_bytes(name, &bytes), Some(&bytes), options)
}

/// Reads a volume; `whole` are the bytes of the input, where they are in memory already.
fn read(input: Input<'_>, whole: Option<&Arc<[u8]>>, options: &ReadOptions) -> Result<ZfpVolume> {
    let volume = match open(input, options)? {
        Opened::Samples(layout, input) => {
            input.check_length(layout.end)?;
            let encoder = Encoder::in_memory(layout.dims, options.rate, input.length.is_some())?;
            run(&layout, input, Converter::new(encoder, options, None)?)?.into_volume()
        }
        Opened::Zfp(input) => match whole {
            Some(whole) if input.length.is_some() => zfp::read(Arc::clone(whole), options),
            _ => zfp::read(load_zfp(input)?, options),
        },
        Opened::Headerless(layout, input) => match whole {
            Some(whole) if input.length.is_some() => {
                zfp::read_headerless(Arc::clone(whole), &layout)
            }
            _ => zfp::read_headerless(input.load(u64::MAX)?, &layout),
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

/// A zfp stream as a whole; of one that is compressed, no more than it can need.
fn load_zfp(mut input: Input<'_>) -> Result<Arc<[u8]>> {
    let most = zfp::most_bytes(&input.peek(24)?);
    input.load(most)
}

/// Converts samples and adds what their header says.
fn run<S: Sink>(
    layout: &Layout,
    mut input: Input<'_>,
    mut converter: Converter<'_, S>,
) -> Result<Encoded<S>> {
    layout.read(&mut input, &mut converter)?;
    let mut encoded = converter.finish(layout.format, layout.sample_type, layout.rank)?;
    encoded.geometry = layout.geometry;
    encoded.source.notes.clone_from(&layout.notes);
    let trailing = input.length()?.saturating_sub(layout.file_end);
    if trailing > 0 {
        encoded.source.notes.push(raw::note_trailing(layout, trailing)?);
    }
    Ok(encoded)
}

/// A file whose kind is known.
enum Opened<'a> {
    Samples(Layout, Input<'a>),
    Zfp(Input<'a>),
    Headerless(Headerless, Input<'a>),
}

/// Kinds of file that their first bytes tell apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Zfp,
    Nifti,
    Npy,
    Nrrd,
    Vti,
    Mrc,
    Gzip,
}

/// Bytes that tell the kind of a file.
const START_BYTES: u64 = 512;

impl Kind {
    fn of(bytes: &[u8]) -> Option<Self> {
        let text = bytes.trim_ascii_start();
        if bytes.starts_with(b"zfp") {
            Some(Self::Zfp)
        } else if bytes.starts_with(&[0x1f, 0x8b]) {
            Some(Self::Gzip)
        } else if bytes.starts_with(b"\x93NUMPY") {
            Some(Self::Npy)
        } else if bytes.starts_with(b"NRRD") {
            Some(Self::Nrrd)
        } else if text.starts_with(b"<?xml") || text.starts_with(b"<VTKFile") {
            Some(Self::Vti)
        } else if matches!(bytes.get(344..348), Some(b"n+1\0" | b"ni1\0")) {
            Some(Self::Nifti)
        } else if bytes.get(208..212) == Some(b"MAP ") {
            Some(Self::Mrc)
        } else {
            None
        }
    }
}

fn open<'a>(mut input: Input<'a>, options: &ReadOptions) -> Result<Opened<'a>> {
    let start = input.peek(START_BYTES)?;
    match Kind::of(&start) {
        Some(Kind::Gzip) if !raw::fits(&input, options) => {
            let mut input = gunzip(input)?;
            let start = input.peek(START_BYTES)?;
            match Kind::of(&start) {
                Some(Kind::Gzip) => Err(unknown(&input, &start)),
                kind => open_kind(kind, input, &start, options),
            }
        }
        kind => open_kind(kind, input, &start, options),
    }
}

fn open_kind<'a>(
    kind: Option<Kind>,
    input: Input<'a>,
    start: &[u8],
    options: &ReadOptions,
) -> Result<Opened<'a>> {
    let (layout, input) = match kind {
        // The first samples of a raw file may look like any header.
        _ if raw::fits(&input, options) => raw::open(input, options)?,
        Some(Kind::Zfp) => return Ok(Opened::Zfp(input)),
        Some(Kind::Nifti) => open_nifti(input, options)?,
        Some(Kind::Npy) => npy::open(input, options)?,
        Some(Kind::Nrrd) => nrrd::open(input, options)?,
        Some(Kind::Vti) => open_vti(input, options)?,
        Some(Kind::Mrc) => mrc::open(input, options)?,
        Some(Kind::Gzip) | None => match options.headerless {
            Some(layout) if options.raw.is_none() => return Ok(Opened::Headerless(layout, input)),
            _ if raw::layout(&input, options).is_some() => raw::open(input, options)?,
            _ => return Err(unknown(&input, start)),
        },
    };
    Ok(Opened::Samples(layout, input))
}

fn unknown(input: &Input<'_>, start: &[u8]) -> Error {
    let name = input.name.clone();
    let file_name = input.file_name.to_ascii_lowercase();
    if file_name.ends_with(".zfp") {
        Error::HeaderlessNeedsLayout { name }
    } else if file_name.ends_with(".raw") {
        Error::RawNeedsLayout { name }
    } else {
        Error::UnknownFormat { name, start: start.iter().take(8).copied().collect() }
    }
}

#[cfg(feature = "nifti")]
fn open_nifti<'a>(input: Input<'a>, options: &ReadOptions) -> Result<(Layout, Input<'a>)> {
    nifti::open(input, options)
}

#[cfg(not(feature = "nifti"))]
fn open_nifti<'a>(input: Input<'a>, _options: &ReadOptions) -> Result<(Layout, Input<'a>)> {
    Err(Error::MissingFeature { name: input.name, feature: "nifti" })
}

#[cfg(feature = "vti")]
fn open_vti<'a>(input: Input<'a>, options: &ReadOptions) -> Result<(Layout, Input<'a>)> {
    vti::open(input, options)
}

#[cfg(not(feature = "vti"))]
fn open_vti<'a>(input: Input<'a>, _options: &ReadOptions) -> Result<(Layout, Input<'a>)> {
    Err(Error::MissingFeature { name: input.name, feature: "vti" })
}

/// The contents of a gzip file, whose length is not known before its end.
#[cfg(feature = "gzip")]
fn gunzip(input: Input<'_>) -> Result<Input<'_>> {
    use std::io::BufReader;
    let decode = |input| BufReader::new(flate2::bufread::MultiGzDecoder::new(input));
    Ok(input.decoded("gzip", None, decode))
}

#[cfg(not(feature = "gzip"))]
fn gunzip(input: Input<'_>) -> Result<Input<'_>> {
    Err(Error::MissingFeature { name: input.name, feature: "gzip" })
}
