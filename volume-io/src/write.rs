//! Writing decoded volumes in uncompressed formats, a layer of blocks at a time.

use std::io::{BufWriter, Write};

use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::sink::writing;
use crate::source::SampleType;
use crate::volume::{Block, ZfpVolume};

/// Writes the decoded samples, x-fastest, as little-endian 32-bit floats without a header;
/// returns the number of bytes. [`raw_file_name`] makes the name that says what is in the file.
///
/// # Errors
/// [`Error::Io`] from the writer; [`Error::Dims`] for a volume with changed fields.
pub fn write_raw(volume: &ZfpVolume, writer: impl Write) -> Result<u64> {
    write_samples(volume, b"", writer)
}

/// The name of a raw file with the samples of a volume: `NAME_XxYxZ_float32.raw`.
#[must_use]
pub fn raw_file_name(name: &str, volume: &ZfpVolume) -> String {
    let [nx, ny, nz] = volume.dims;
    format!("{name}_{nx}x{ny}x{nz}_{}.raw", SampleType::F32.raw_name())
}

/// Writes the decoded samples as a NumPy array of 32-bit floats, `array[z, y, x]`; returns the
/// number of bytes. Geometry has no place in this format.
///
/// # Errors
/// As [`write_raw`].
pub fn write_npy(volume: &ZfpVolume, writer: impl Write) -> Result<u64> {
    let [nx, ny, nz] = volume.dims;
    let mut dictionary =
        format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({nz}, {ny}, {nx}), }}");
    // The data start at a multiple of 64 bytes; a line feed ends the header.
    while !(dictionary.len() + 11).is_multiple_of(64) {
        dictionary.push(' ');
    }
    dictionary.push('\n');
    let length = dictionary.len() as u16;
    let start = [&b"\x93NUMPY\x01\0"[..], &length.to_le_bytes(), dictionary.as_bytes()].concat();
    write_samples(volume, &start, writer)
}

/// Writes the decoded samples as NRRD of 32-bit floats with spacing and origin; returns the
/// number of bytes.
///
/// # Errors
/// As [`write_raw`].
pub fn write_nrrd(volume: &ZfpVolume, writer: impl Write) -> Result<u64> {
    let [nx, ny, nz] = volume.dims;
    let [dx, dy, dz] = volume.geometry.spacing;
    let [ox, oy, oz] = volume.geometry.origin;
    let header = format!(
        "NRRD0004\ntype: float\ndimension: 3\nspace dimension: 3\nsizes: {nx} {ny} {nz}\n\
         space directions: ({dx},0,0) (0,{dy},0) (0,0,{dz})\nkinds: domain domain domain\n\
         endian: little\nencoding: raw\nspace origin: ({ox},{oy},{oz})\n\n"
    );
    write_samples(volume, header.as_bytes(), writer)
}

fn write_samples(volume: &ZfpVolume, header: &[u8], writer: impl Write) -> Result<u64> {
    let grid = Grid::new(volume.dims)?;
    let [nx, ny, nz] = volume.dims;
    let slab_samples = 4 * u64::from(nx) * u64::from(ny);
    let length = usize::try_from(slab_samples)
        .map_err(|_error| Error::OutOfMemory { bytes: 4 * slab_samples })?;
    let mut slab = Vec::new();
    slab.try_reserve_exact(length)
        .map_err(|_error| Error::OutOfMemory { bytes: 4 * slab_samples })?;
    slab.resize(length, 0.0f32);
    let mut writer = BufWriter::new(writer);
    writer.write_all(header).map_err(writing)?;
    let mut blocks = volume.decoded_blocks();
    let layer = u64::from(grid.blocks[0]) * u64::from(grid.blocks[1]);
    for z in (0..nz).step_by(4) {
        for block in blocks.by_ref().take(usize::try_from(layer).unwrap_or(usize::MAX)) {
            scatter(&block, [nx, ny], &mut slab);
        }
        let valid = u64::from(nx) * u64::from(ny) * u64::from((nz - z).min(4));
        for sample in slab.iter().take(valid as usize) {
            writer.write_all(&sample.to_le_bytes()).map_err(writing)?;
        }
    }
    writer.flush().map_err(writing)?;
    Ok(header.len() as u64 + 4 * grid.voxel_count())
}

/// Puts the samples of a block to their places in a slab of four slices.
fn scatter(block: &Block, [nx, ny]: [u32; 2], slab: &mut [f32]) {
    for ([x, y, z], value) in block.voxels() {
        let at = x as usize + nx as usize * (y as usize + ny as usize * (z % 4) as usize);
        if let Some(sample) = slab.get_mut(at) {
            *sample = value;
        }
    }
}
