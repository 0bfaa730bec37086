//! zfp streams, with zfp's own header or without.

use std::io::Write;
use std::sync::Arc;

use zfp_rs::types::ZfpScalarType;
use zfp_rs::{
    ZfpBitStream, ZfpBitStreamRef, ZfpConfig, ZfpDimensionality, ZfpFieldMetadata, ZfpHeaderError,
    ZfpHeaderMask, ZfpMode,
};

use crate::convert::{Converter, Progress, Sample};
use crate::encode::{Encoded, Encoder};
use crate::error::{Error, Result};
use crate::grid::{Grid, bits_per_block};
use crate::options::{Headerless, ReadOptions};
use crate::sink::Sink;
use crate::source::{Format, Note, SampleType, Source};
use crate::stream::{Conversion, StreamEncoder};
use crate::volume::{Decoder, ZfpVolume, fixed_rate, load_words};

/// Reads a stream that starts with zfp's header.
pub(super) fn read(bytes: Arc<[u8]>, options: &ReadOptions) -> Result<ZfpVolume> {
    let header = Header::parse(&bytes)?;
    let mut volume = if header.is_kept() {
        keep(&header, bytes)?
    } else {
        let encoder = Encoder::in_memory(header.dims, options.rate, false)?;
        header.recode(&bytes, Converter::new(encoder, options, None)?)?.into_volume()?
    };
    if options.headerless.is_some() {
        volume.source.notes.push(Note::HeaderUsed);
    }
    Ok(volume)
}

/// Writes the stream `bytes` to `writer` at the rate asked for: as it is where that is its own
/// already, otherwise decoded and encoded again.
pub(super) fn convert(
    bytes: Arc<[u8]>,
    writer: impl Write,
    options: &ReadOptions,
    progress: Progress<'_>,
) -> Result<Conversion> {
    let bits = bits_per_block(options.rate)?;
    let header = Header::parse(&bytes)?;
    if header.is_kept() && header.config.max_bits() == bits {
        let volume = keep(&header, bytes)?;
        let total = volume.block_count();
        let written = write_zfp(&volume, writer)?;
        progress(total, total);
        return Ok(Conversion::new(&volume, written));
    }
    let encoder = StreamEncoder::new(header.dims, options.rate, writer)?.into_inner();
    let encoded = header.recode(&bytes, Converter::new(encoder, options, Some(progress))?)?;
    Conversion::finish(encoded)
}

/// Writes a headerless stream to `writer` with zfp's header, at the rate asked for.
pub(super) fn convert_headerless(
    bytes: Arc<[u8]>,
    layout: &Headerless,
    writer: impl Write,
    options: &ReadOptions,
    progress: Progress<'_>,
) -> Result<Conversion> {
    let bits = bits_per_block(options.rate)?;
    let volume = read_headerless(bytes, layout)?;
    if volume.bits_per_block == bits {
        let total = volume.block_count();
        let written = write_zfp(&volume, writer)?;
        progress(total, total);
        return Ok(Conversion::new(&volume, written));
    }
    let encoder = StreamEncoder::new(volume.dims, options.rate, writer)?.into_inner();
    let mut converter = Converter::new(encoder, options, Some(progress))?;
    for block in volume.decoded_blocks() {
        converter.push(block.samples.map(f64::from))?;
    }
    Conversion::finish(converter.finish(Format::ZfpHeaderless, SampleType::F32, 3)?)
}

/// Most bytes that a stream with this start can need, where its header is valid.
pub(super) fn most_bytes(start: &[u8]) -> u64 {
    let Ok(header) = Header::parse(start) else { return start.len() as u64 };
    let blocks = Grid::unchecked(header.dims).block_count();
    let bits = blocks.saturating_mul(u64::from(header.config.max_bits().max(64)));
    (header.bits.saturating_add(bits) / 8).saturating_add(64)
}

/// Reads a stream without a header. Its length must fit, since nothing else tells wrong dims.
pub(super) fn read_headerless(bytes: Arc<[u8]>, layout: &Headerless) -> Result<ZfpVolume> {
    let grid = Grid::new(layout.dims)?;
    let bits_per_block = bits_per_block(layout.rate)?;
    let (least, found) = (grid.stream_bytes(bits_per_block, 0), bytes.len() as u64);
    let expected = least.next_multiple_of(8);
    if !(least..=expected).contains(&found) {
        let dims = layout.dims;
        return Err(Error::LengthMismatch { dims, bits_per_block, expected, found });
    }
    let mut volume = ZfpVolume::from_stream(layout.dims, bits_per_block, 0, bytes)?;
    volume.source.format = Format::ZfpHeaderless;
    Ok(volume)
}

/// Dims, bits per block and first bit of a stream of the kind that the GPU decodes, from its start.
pub(crate) fn fixed_rate_header(start: &[u8]) -> Option<([u32; 3], u32, u64)> {
    let header = Header::parse(start).ok().filter(Header::is_kept)?;
    Some((header.dims, header.config.max_bits(), header.bits))
}

/// What zfp's header says.
struct Header {
    scalar_type: ZfpScalarType,
    rank: u32,
    dims: [u32; 3],
    config: ZfpConfig,
    /// Length of the header, which need not end at a byte: 96 or 148.
    bits: u64,
}

impl Header {
    fn parse(bytes: &[u8]) -> Result<Self> {
        let mut words = [0; 3];
        load_words(bytes, 0, &mut words);
        let header = ZfpBitStreamRef::from_words(&words)
            .read_header(ZfpHeaderMask::FULL)
            .map_err(|error| invalid(error, bytes))?;
        let bits = header.bits_read as u64;
        let (expected, found) = (bits.div_ceil(8), bytes.len() as u64);
        if found < expected {
            return Err(Error::TooShort { expected, found });
        }
        let (Some(metadata), Some(config)) = (header.metadata, header.config) else {
            return Err(invalid(ZfpHeaderError::InvalidMetadata, bytes));
        };
        let (rank, dims) = shape(&metadata)?;
        Ok(Self { scalar_type: metadata.scalar_type, rank, dims, config, bits })
    }

    /// Whether the stream is of the kind that the GPU decodes.
    fn is_kept(&self) -> bool {
        self.scalar_type == ZfpScalarType::F32
            && self.rank == 3
            && self.config.mode() == ZfpMode::FixedRate
    }

    fn recode<S: Sink>(&self, bytes: &[u8], converter: Converter<'_, S>) -> Result<Encoded<S>> {
        match self.scalar_type {
            ZfpScalarType::I32 => recode::<i32, S>(self, bytes, converter),
            ZfpScalarType::I64 => recode::<i64, S>(self, bytes, converter),
            ZfpScalarType::F32 => recode::<f32, S>(self, bytes, converter),
            ZfpScalarType::F64 => recode::<f64, S>(self, bytes, converter),
        }
    }
}

fn invalid(error: ZfpHeaderError, bytes: &[u8]) -> Error {
    let (field, expected) = match error {
        ZfpHeaderError::InvalidMagic => ("magic", "\"zfp\" and codec version 5"),
        ZfpHeaderError::InvalidMode => ("mode", "valid compression parameters"),
        _ => ("metadata", "a valid type and shape"),
    };
    let start: Vec<u8> = bytes.iter().take(19).copied().collect();
    let found = format!("bytes {start:02x?}");
    Error::InvalidHeader { format: Format::Zfp, field, expected: expected.into(), found }
}

/// Number of axes and sizes of a field; missing axes have size 1.
fn shape(metadata: &ZfpFieldMetadata) -> Result<(u32, [u32; 3])> {
    let rank = metadata.dims.iter().take_while(|&&n| n > 0).count();
    if rank == 4 {
        return Err(Error::Unsupported {
            format: Format::Zfp,
            expected: "an array of 1 to 3 dimensions",
            found: format!("4 dimensions, {:?}", metadata.dims),
        });
    }
    let sizes = metadata.dims.get(..rank).unwrap_or(&[]);
    let mut dims = [1; 3];
    for (dim, &size) in dims.iter_mut().zip(sizes) {
        *dim = u32::try_from(size).unwrap_or(u32::MAX);
    }
    // Refuses sizes beyond the limit; names all sizes as the file has them.
    Grid::new(dims)
        .map_err(|_error| Error::Dims { dims: sizes.iter().map(|&n| n as u64).collect() })?;
    Ok((rank as u32, dims))
}

fn keep(header: &Header, bytes: Arc<[u8]>) -> Result<ZfpVolume> {
    let found = bytes.len() as u64;
    let bits_per_block = header.config.max_bits();
    let mut volume = ZfpVolume::from_stream(header.dims, bits_per_block, header.bits, bytes)?;
    volume.source.format = Format::Zfp;
    let end = volume.grid().stream_bytes(bits_per_block, header.bits);
    note_trailing(&mut volume.source, end, found);
    Ok(volume)
}

/// Bytes after the word in which a stream ends are no part of it.
fn note_trailing(source: &mut Source, end: u64, found: u64) {
    let trailing = found.saturating_sub(end.next_multiple_of(8));
    if trailing > 0 {
        source.notes.push(Note::TrailingBytes(trailing));
    }
}

/// Decodes a stream of any mode block by block and encodes it anew. Fields of lower rank have the
/// same blocks in the same order, only flat.
fn recode<T: Sample, S: Sink>(
    header: &Header,
    bytes: &[u8],
    mut converter: Converter<'_, S>,
) -> Result<Encoded<S>> {
    let (rank, block_size) = match header.rank {
        1 => (ZfpDimensionality::D1, 4),
        2 => (ZfpDimensionality::D2, 16),
        _ => (ZfpDimensionality::D3, 64),
    };
    let blocks = converter.block_count();
    let found = bytes.len() as u64;
    let least = u64::from(header.config.min_bits());
    let expected = header.bits.saturating_add(blocks.saturating_mul(least)).div_ceil(8);
    if found < expected {
        return Err(Error::TooShort { expected, found });
    }
    let mut decoder = Decoder::new(header.config, rank);
    let mut samples = [T::default(); 64];
    let mut position = header.bits;
    for block in 0..blocks {
        let flat = samples.get_mut(..block_size).unwrap_or_default();
        position += decoder.decode(bytes, position, flat)?;
        if position > found * 8 {
            return Err(Error::StreamEnds { block, blocks, found: found * 8 });
        }
        converter.push(samples.map(Sample::to_f64))?;
    }
    let mut encoded = converter.finish(Format::Zfp, header.scalar_type.into(), header.rank)?;
    note_trailing(&mut encoded.source, position.div_ceil(8), found);
    Ok(encoded)
}

/// Writes a volume with zfp's own header, so that the `zfp` program (option `-h`) and libzfp read
/// it; returns the number of bytes. Geometry has no place in this format.
///
/// # Errors
/// [`Error::Io`] from the writer; [`Error::Dims`], [`Error::BitsPerBlock`] or [`Error::TooShort`]
/// for a volume whose fields contradict each other.
pub fn write_zfp(volume: &ZfpVolume, writer: impl Write) -> Result<u64> {
    let grid = Grid::new(volume.dims)?;
    crate::volume::check_bits_per_block(volume.bits_per_block)?;
    let expected = grid.stream_bytes(volume.bits_per_block, volume.first_bit);
    let found = volume.bytes.len() as u64;
    if found < expected {
        return Err(Error::TooShort { expected, found });
    }
    let (words, header_bits) = header_words(volume.dims, volume.bits_per_block)?;
    let total = grid.block_count() * u64::from(volume.bits_per_block);
    write_words(volume, &words, header_bits, total, writer)
        .map_err(|source| Error::Io { name: "the zfp stream to write".into(), source })
}

/// The header of a fixed-rate stream as words, and its length in bits.
pub(crate) fn header_words(dims: [u32; 3], bits_per_block: u32) -> Result<(Vec<u64>, u32)> {
    let codec = |reason: String| Error::Codec { reason };
    let [nx, ny, nz] = dims.map(|n| n as usize);
    let metadata = ZfpFieldMetadata { scalar_type: ZfpScalarType::F32, dims: [nx, ny, nz, 0] };
    let mut stream = ZfpBitStream::new(24).map_err(|error| codec(error.to_string()))?;
    let bits = stream
        .write_header(&fixed_rate(bits_per_block), &metadata, ZfpHeaderMask::FULL)
        .map_err(|error| codec(error.to_string()))?;
    Ok((stream.into_words(), bits as u32))
}

/// Writes the header and, right behind its last bit, `total` bits of the stream.
fn write_words(
    volume: &ZfpVolume,
    header: &[u64],
    header_bits: u32,
    total: u64,
    writer: impl Write,
) -> std::io::Result<u64> {
    let mut writer = std::io::BufWriter::new(writer);
    let complete = (header_bits / 64) as usize;
    for word in header.iter().take(complete) {
        writer.write_all(&word.to_le_bytes())?;
    }
    let shift = header_bits % 64;
    let mut carry = header.get(complete).copied().unwrap_or(0);
    let mut written = 8 * complete as u64;
    let mut done = 0;
    while done < total {
        let count = (total - done).min(64) as u32;
        let bits = bits_at(&volume.bytes, volume.first_bit + done) & (u64::MAX >> (64 - count));
        writer.write_all(&(carry | bits << shift).to_le_bytes())?;
        written += 8;
        carry = bits.checked_shr(64 - shift).unwrap_or(0);
        done += 64;
    }
    if written < 8 * (u64::from(header_bits) + total).div_ceil(64) {
        writer.write_all(&carry.to_le_bytes())?;
        written += 8;
    }
    writer.flush()?;
    Ok(written)
}

/// 64 bits from any position.
fn bits_at(bytes: &[u8], bit: u64) -> u64 {
    let mut words = [0; 2];
    load_words(bytes, bit / 8, &mut words);
    let shift = (bit % 8) as u32;
    words[0] >> shift | words[1].checked_shl(64 - shift).unwrap_or(0)
}
