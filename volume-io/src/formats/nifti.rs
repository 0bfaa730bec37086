//! NIfTI-1 in one file (`.nii`), read in slabs of one layer of blocks.
//!
//! The crate `nifti` parses the header. The samples are read here, because it would allocate what
//! the header claims and read the whole volume at once.

use std::io::{self, Read};

use nifti::{Endianness, NiftiError, NiftiHeader, NiftiType};

use crate::convert::Converter;
use crate::encode::gather;
use crate::error::{Error, Result};
use crate::formats::ReadOptions;
use crate::source::{Format, Note, SampleType};
use crate::volume::{Geometry, ZfpVolume};

/// Length of the header with the four bytes that announce extensions.
pub(super) const HEADER_BYTES: u64 = 352;

/// Relative size up to which the off-diagonal elements of an affine matrix count as zero.
const ALIGNED: f64 = 1e-5;

/// Reads a volume from `reader`, whose length is `length` where that is known.
pub(super) fn read(
    name: &str,
    mut reader: impl Read,
    length: Option<u64>,
    options: &ReadOptions,
) -> Result<ZfpVolume> {
    let layout = Layout::read(name, &mut reader, options)?;
    if let Some(found) = length
        && found < layout.end
    {
        return Err(Error::TooShort { expected: layout.end, found });
    }
    let mut converter = Converter::new(layout.dims, options)?;
    let mut slabs = Slabs { name, reader, layout: &layout, position: HEADER_BYTES };
    slabs.skip_to(layout.start)?;
    for z in (0..layout.dims[2]).step_by(4) {
        let depth = (layout.dims[2] - z).min(4);
        let slab = slabs.next(depth)?;
        push_slab(&mut converter, &slab, [layout.dims[0], layout.dims[1], depth])?;
    }
    let mut volume = converter.finish(Format::Nifti, layout.sample_type, layout.rank)?;
    volume.geometry = layout.geometry;
    volume.source.notes = layout.notes.clone();
    let trailing = length.unwrap_or(0).saturating_sub(layout.file_end);
    if trailing > 0 {
        volume.source.notes.push(Note::TrailingBytes(trailing));
    }
    Ok(volume)
}

/// Adds the blocks of one layer.
fn push_slab(converter: &mut Converter, slab: &[f64], dims: [u32; 3]) -> Result<()> {
    let layer = u64::from(dims[0].div_ceil(4)) * u64::from(dims[1].div_ceil(4));
    for _ in 0..layer {
        let [x, y, _] = converter.next_origin();
        converter.push(gather(slab, dims, [x, y, 0], converter.next_valid()))?;
    }
    Ok(())
}

/// What the header says about the volume to read.
struct Layout {
    dims: [u32; 3],
    rank: u32,
    sample_type: SampleType,
    big_endian: bool,
    slope: f64,
    inter: f64,
    geometry: Geometry,
    notes: Vec<Note>,
    /// Bytes of the file before the volume, up to its end, and up to the end of all volumes.
    start: u64,
    end: u64,
    file_end: u64,
}

impl Layout {
    fn read(name: &str, reader: &mut impl Read, options: &ReadOptions) -> Result<Self> {
        let mut bytes = Vec::new();
        let access = |source| Error::Io { name: name.into(), source };
        reader.take(HEADER_BYTES).read_to_end(&mut bytes).map_err(access)?;
        if (bytes.len() as u64) < HEADER_BYTES {
            return Err(Error::TooShort { expected: HEADER_BYTES, found: bytes.len() as u64 });
        }
        let header = NiftiHeader::from_reader(bytes.as_slice()).map_err(header_error)?;
        if &header.magic != nifti::header::MAGIC_CODE_NIP1 {
            return Err(Error::Unsupported {
                format: Format::Nifti,
                expected: "header and data in one file (.nii)",
                found: "a header whose data are in a second file (.hdr and .img)".into(),
            });
        }
        Self::new(&header, options)
    }

    fn new(header: &NiftiHeader, options: &ReadOptions) -> Result<Self> {
        check(header.sizeof_hdr == 348, "sizeof_hdr", "348", &header.sizeof_hdr)?;
        let (dims, rank, count) = shape(header)?;
        let sample_type = sample_type(header)?;
        let (geometry, mut notes) = geometry(header);
        let index = choose(count, options, &mut notes)?;
        let volume = dims
            .iter()
            .fold(u64::from(sample_type.bytes()), |bytes, &n| bytes.saturating_mul(u64::from(n)));
        let first = data_start(header)?;
        let start = first.saturating_add(volume.saturating_mul(index));
        let scaled =
            header.scl_slope != 0.0 && header.scl_slope.is_finite() && header.scl_inter.is_finite();
        let scale = [f64::from(header.scl_slope), f64::from(header.scl_inter)];
        let [slope, inter] = if scaled { scale } else { [1.0, 0.0] };
        Ok(Self {
            dims,
            rank,
            sample_type,
            big_endian: header.endianness == Endianness::Big,
            slope,
            inter,
            geometry,
            notes,
            start,
            end: start.saturating_add(volume),
            file_end: first.saturating_add(volume.saturating_mul(count)),
        })
    }

    /// The samples of the file's type, scaled.
    fn convert(&self, bytes: &[u8]) -> Vec<f64> {
        let big = self.big_endian;
        let raw: Vec<f64> = match self.sample_type {
            SampleType::U8 => values(bytes, big, |b: [u8; 1]| f64::from(b[0])),
            SampleType::I8 => values(bytes, big, |b| f64::from(i8::from_le_bytes(b))),
            SampleType::U16 => values(bytes, big, |b| f64::from(u16::from_le_bytes(b))),
            SampleType::I16 => values(bytes, big, |b| f64::from(i16::from_le_bytes(b))),
            SampleType::U32 => values(bytes, big, |b| f64::from(u32::from_le_bytes(b))),
            SampleType::I32 => values(bytes, big, |b| f64::from(i32::from_le_bytes(b))),
            SampleType::U64 => values(bytes, big, |b| u64::from_le_bytes(b) as f64),
            SampleType::I64 => values(bytes, big, |b| i64::from_le_bytes(b) as f64),
            SampleType::F32 => values(bytes, big, |b| f64::from(f32::from_le_bytes(b))),
            SampleType::F64 => values(bytes, big, f64::from_le_bytes),
        };
        if self.slope == 1.0 && self.inter == 0.0 {
            return raw;
        }
        raw.into_iter().map(|value| value * self.slope + self.inter).collect()
    }
}

/// Splits `bytes` into samples of N bytes and converts each from little-endian order.
fn values<const N: usize>(bytes: &[u8], big: bool, value: impl Fn([u8; N]) -> f64) -> Vec<f64> {
    let (samples, _) = bytes.as_chunks::<N>();
    let ordered = samples.iter().map(|&sample| {
        let mut sample = sample;
        if big {
            sample.reverse();
        }
        sample
    });
    ordered.map(value).collect()
}

/// The data of a volume, a layer of blocks at a time.
struct Slabs<'a, R> {
    name: &'a str,
    reader: R,
    layout: &'a Layout,
    position: u64,
}

impl<R: Read> Slabs<'_, R> {
    fn skip_to(&mut self, position: u64) -> Result<()> {
        let wanted = position.saturating_sub(self.position);
        let skipped = io::copy(&mut self.reader.by_ref().take(wanted), &mut io::sink())
            .map_err(|source| Error::Io { name: self.name.into(), source })?;
        self.advance(skipped, wanted)
    }

    /// The next `depth` slices. Memory grows with the data that arrive.
    fn next(&mut self, depth: u32) -> Result<Vec<f64>> {
        let [nx, ny, _] = self.layout.dims.map(u64::from);
        let wanted = nx * ny * u64::from(depth) * u64::from(self.layout.sample_type.bytes());
        let mut bytes = Vec::new();
        let found = self
            .reader
            .by_ref()
            .take(wanted)
            .read_to_end(&mut bytes)
            .map_err(|source| Error::Io { name: self.name.into(), source })?;
        self.advance(found as u64, wanted)?;
        Ok(self.layout.convert(&bytes))
    }

    fn advance(&mut self, found: u64, wanted: u64) -> Result<()> {
        self.position += found;
        if found < wanted {
            return Err(Error::TooShort { expected: self.layout.end, found: self.position });
        }
        Ok(())
    }
}

fn header_error(error: NiftiError) -> Error {
    Error::InvalidHeader {
        format: Format::Nifti,
        field: "header",
        expected: "a NIfTI-1 header".into(),
        found: error.to_string(),
    }
}

fn check(
    valid: bool,
    field: &'static str,
    expected: &str,
    found: &dyn std::fmt::Display,
) -> Result<()> {
    if valid {
        return Ok(());
    }
    Err(Error::InvalidHeader {
        format: Format::Nifti,
        field,
        expected: expected.into(),
        found: found.to_string(),
    })
}

/// Voxels along three axes, number of spatial axes, and number of volumes.
fn shape(header: &NiftiHeader) -> Result<([u32; 3], u32, u64)> {
    let axes = header.dim[0];
    check((1..=7).contains(&axes), "dim[0]", "1 to 7 axes", &axes)?;
    let sizes: Vec<u16> = header.dim.iter().skip(1).take(axes.into()).copied().collect();
    for size in &sizes {
        // The standard's type is signed; the parser's is not.
        let found = *size as i16;
        check(found > 0, "dim", "1 to 32767 voxels along each axis", &found)?;
    }
    let mut dims = [1; 3];
    for (dim, &size) in dims.iter_mut().zip(&sizes) {
        *dim = u32::from(size);
    }
    let count = sizes.iter().skip(3).fold(1u64, |n, &size| n.saturating_mul(u64::from(size)));
    Ok((dims, u32::from(axes.min(3)), count))
}

fn sample_type(header: &NiftiHeader) -> Result<SampleType> {
    let ty = header.data_type().map_err(header_error)?;
    Ok(match ty {
        NiftiType::Uint8 => SampleType::U8,
        NiftiType::Int8 => SampleType::I8,
        NiftiType::Uint16 => SampleType::U16,
        NiftiType::Int16 => SampleType::I16,
        NiftiType::Uint32 => SampleType::U32,
        NiftiType::Int32 => SampleType::I32,
        NiftiType::Uint64 => SampleType::U64,
        NiftiType::Int64 => SampleType::I64,
        NiftiType::Float32 => SampleType::F32,
        NiftiType::Float64 => SampleType::F64,
        other => {
            return Err(Error::Unsupported {
                format: Format::Nifti,
                expected: "real numbers of 8 to 64 bits",
                found: format!("{other:?}"),
            });
        }
    })
}

/// Index of the volume to read, out of `count`.
fn choose(count: u64, options: &ReadOptions, notes: &mut Vec<Note>) -> Result<u64> {
    match options.time_index {
        None if count > 1 => Err(Error::SeveralVolumes { count }),
        None => Ok(0),
        Some(index) if u64::from(index) >= count => Err(Error::TimeIndex { index, count }),
        Some(index) => {
            if count > 1 {
                notes.push(Note::VolumeChosen { index, count });
            }
            Ok(u64::from(index))
        }
    }
}

/// Where the data begin: not inside the header; some writers leave 0 for "right behind it".
fn data_start(header: &NiftiHeader) -> Result<u64> {
    let offset = f64::from(header.vox_offset);
    let valid = offset == 0.0 || (offset >= HEADER_BYTES as f64 && offset < (1u64 << 53) as f64);
    check(valid, "vox_offset", "352 or more bytes", &offset)?;
    Ok((offset as u64).max(HEADER_BYTES))
}

/// Spacing, and the origin where spacing and origin say all.
fn geometry(header: &NiftiHeader) -> (Geometry, Vec<Note>) {
    let mut notes = Vec::new();
    let mut geometry = Geometry::default();
    for (spacing, &found) in geometry.spacing.iter_mut().zip(header.pixdim.iter().skip(1)) {
        if found.is_finite() && found != 0.0 {
            *spacing = f64::from(found.abs());
        } else if !notes.contains(&Note::SpacingIgnored) {
            notes.push(Note::SpacingIgnored);
        }
    }
    match affine(header) {
        Some((matrix, origin)) if is_aligned(&matrix) && origin.iter().all(|v| v.is_finite()) => {
            geometry.origin = origin;
        }
        Some(_) => notes.push(Note::OriginIgnored),
        None => {}
    }
    (geometry, notes)
}

/// The matrix from voxel indices to world axes, and the position of voxel (0, 0, 0).
fn affine(header: &NiftiHeader) -> Option<([[f64; 3]; 3], [f64; 3])> {
    if header.sform_code > 0 {
        let rows = [header.srow_x, header.srow_y, header.srow_z].map(|row| row.map(f64::from));
        Some((rows.map(|[a, b, c, _]| [a, b, c]), rows.map(|[.., origin]| origin)))
    } else if header.qform_code > 0 {
        let origin = [header.quatern_x, header.quatern_y, header.quatern_z].map(f64::from);
        Some((quaternion_matrix(header), origin))
    } else {
        None
    }
}

/// Rotation by the header's unit quaternion, times spacing and handedness.
fn quaternion_matrix(header: &NiftiHeader) -> [[f64; 3]; 3] {
    let [b, c, d] = [header.quatern_b, header.quatern_c, header.quatern_d].map(f64::from);
    let a = (1.0 - b * b - c * c - d * d).max(0.0).sqrt();
    let rotation = [
        [a * a + b * b - c * c - d * d, 2.0 * (b * c - a * d), 2.0 * (b * d + a * c)],
        [2.0 * (b * c + a * d), a * a + c * c - b * b - d * d, 2.0 * (c * d - a * b)],
        [2.0 * (b * d - a * c), 2.0 * (c * d + a * b), a * a + d * d - b * b - c * c],
    ];
    let handedness = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
    let [_, dx, dy, dz, ..] = header.pixdim.map(f64::from);
    let scale = [dx, dy, dz * handedness];
    rotation.map(|row| std::array::from_fn(|axis| row[axis] * scale[axis]))
}

/// Whether the matrix only scales, by positive factors.
fn is_aligned(matrix: &[[f64; 3]; 3]) -> bool {
    let diagonal = [matrix[0][0], matrix[1][1], matrix[2][2]];
    let least = diagonal.into_iter().fold(f64::INFINITY, f64::min);
    let others = (0..3).flat_map(|row| (0..3).filter(move |&c| c != row).map(move |c| [row, c]));
    // A NaN anywhere makes one of these comparisons false.
    diagonal.iter().all(|&v| v > 0.0 && v.is_finite())
        && others.into_iter().all(|[row, column]| matrix[row][column].abs() <= ALIGNED * least)
}
