//! NIfTI-1, in one file (`.nii`) or as a pair (`.hdr` and `.img`).
//!
//! The crate `nifti` parses the header. It does not read the samples, because it would allocate
//! what the header claims and read the whole volume at once.

use nifti::{Endianness, NiftiError, NiftiHeader, NiftiType};

use crate::error::{Error, Result};
use crate::input::Input;
use crate::layout::{Layout, choose};
use crate::options::ReadOptions;
use crate::source::{Format, SampleType};

/// Length of the header with the four bytes that announce extensions.
const HEADER_BYTES: u64 = 352;

/// Length of the header without them: files of a pair may end there.
const PAIR_HEADER_BYTES: u64 = 348;

/// Relative size up to which the off-diagonal elements of an affine matrix count as zero.
const ALIGNED: f64 = 1e-5;

/// Reads the header, and finds the file with the data.
pub(super) fn open<'a>(mut input: Input<'a>, options: &ReadOptions) -> Result<(Layout, Input<'a>)> {
    let bytes = input.take_bytes(PAIR_HEADER_BYTES)?;
    let header = NiftiHeader::from_reader(bytes.as_slice()).map_err(header_error)?;
    if &header.magic == nifti::header::MAGIC_CODE_NIP1 {
        input.skip_to(HEADER_BYTES)?;
        return Ok((layout(&header, HEADER_BYTES, options)?, input));
    }
    if input.folder.is_none() {
        return Err(Error::Unsupported {
            format: Format::Nifti,
            expected: "header and data in one file (.nii), or a pair read from the file system",
            found: "a header whose data are in a second file (.hdr and .img)".into(),
        });
    }
    let layout = layout(&header, 0, options)?;
    Ok((layout, image(&input)?))
}

/// The file with the data of a pair, compressed or not.
fn image<'a>(header: &Input<'_>) -> Result<Input<'a>> {
    let name = &header.file_name;
    let stem = name.len().saturating_sub(4);
    let ending = match name.get(stem..) {
        Some(".HDR") => "IMG",
        Some(ending) if ending.eq_ignore_ascii_case(".hdr") => "img",
        _ => {
            let file = format!("{name}.img");
            return Err(Error::SecondFile { name: header.name.clone(), file });
        }
    };
    let plain = format!("{}.{ending}", name.get(..stem).unwrap_or_default());
    match header.open_other(&plain) {
        Err(Error::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {
            // Names the plain file where neither exists.
            let zipped = header.open_other(&format!("{plain}.gz"));
            super::gunzip(zipped.or_else(|_| header.open_other(&plain))?)
        }
        other => other,
    }
}

/// What the header says; `least` bytes come before the data.
fn layout(header: &NiftiHeader, least: u64, options: &ReadOptions) -> Result<Layout> {
    check(header.sizeof_hdr == 348, "sizeof_hdr", "348", &header.sizeof_hdr)?;
    let (dims, rank, count) = shape(header)?;
    let sample_type = sample_type(header)?;
    let first = data_start(header, least)?;
    let mut notes = Vec::new();
    let index = choose(count, options.time_index, &mut notes)?;
    let mut layout = Layout::new(Format::Nifti, dims, sample_type, first, [index, count]);
    layout.rank = rank;
    layout.big_endian = header.endianness == Endianness::Big;
    let [slope, inter] = [f64::from(header.scl_slope), f64::from(header.scl_inter)];
    if slope != 0.0 && slope.is_finite() && inter.is_finite() {
        layout.scale = [slope, inter];
    }
    place(&mut layout, header);
    layout.notes.extend(notes);
    Ok(layout)
}

fn header_error(error: NiftiError) -> Error {
    Error::header(Format::Nifti, "header", "a NIfTI-1 header", error)
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
    Err(Error::header(Format::Nifti, field, expected, found))
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

/// Where the data begin: not inside the header; some writers leave 0 for "right behind it".
fn data_start(header: &NiftiHeader, least: u64) -> Result<u64> {
    let offset = f64::from(header.vox_offset);
    let valid = offset == 0.0 || (offset >= least as f64 && offset < (1u64 << 53) as f64);
    check(valid, "vox_offset", &format!("{least} or more bytes"), &offset)?;
    Ok((offset as u64).max(least))
}

/// Spacing, and the origin where spacing and origin say all.
fn place(layout: &mut Layout, header: &NiftiHeader) {
    let [_, dx, dy, dz, ..] = header.pixdim.map(|size| f64::from(size.abs()));
    let (aligned, origin) = match affine(header) {
        Some((matrix, origin)) => (is_aligned(&matrix), origin),
        None => (true, [0.0; 3]),
    };
    layout.place([dx, dy, dz], origin, aligned);
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
