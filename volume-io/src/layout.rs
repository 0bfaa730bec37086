//! Uncompressed samples of any type and axis order, read in slabs of one layer of blocks.

use crate::convert::Converter;
use crate::error::{Error, Result};
use crate::input::Input;
use crate::sink::Sink;
use crate::source::{Format, Note, SampleType};
use crate::volume::Geometry;

/// What a header says about the volume to read.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    pub(crate) format: Format,
    pub(crate) dims: [u32; 3],
    pub(crate) rank: u32,
    pub(crate) sample_type: SampleType,
    pub(crate) big_endian: bool,
    /// The axes of the volume from the one that varies fastest in the file to the slowest.
    pub(crate) order: [usize; 3],
    /// Samples are multiplied by the first and then added to the second.
    pub(crate) scale: [f64; 2],
    pub(crate) geometry: Geometry,
    pub(crate) notes: Vec<Note>,
    /// Bytes of the file before the volume, up to its end, and up to the end of all volumes.
    pub(crate) start: u64,
    pub(crate) end: u64,
    pub(crate) file_end: u64,
}

impl Layout {
    /// Volume `index` of `count` that follow each other from byte `first`, x-fastest, unscaled.
    pub(crate) fn new(
        format: Format,
        dims: [u32; 3],
        sample_type: SampleType,
        first: u64,
        [index, count]: [u64; 2],
    ) -> Self {
        let bytes = data_bytes(dims, sample_type);
        let at = |volumes: u64| first.saturating_add(bytes.saturating_mul(volumes));
        Self {
            format,
            dims,
            rank: 3,
            sample_type,
            big_endian: false,
            order: [0, 1, 2],
            scale: [1.0, 0.0],
            geometry: Geometry::default(),
            notes: Vec::new(),
            start: at(index),
            end: at(index + 1),
            file_end: at(count),
        }
    }

    /// Sets the placement in space from what a header says, which need not make sense.
    pub(crate) fn place(&mut self, spacing: [f64; 3], origin: [f64; 3], aligned: bool) {
        let valid = |s: f64| s.is_finite() && s != 0.0;
        if spacing.iter().any(|&s| !valid(s)) {
            self.notes.push(Note::SpacingIgnored);
        }
        let mirrored = spacing.iter().any(|&s| s < 0.0);
        let spacing = spacing.map(|s| if valid(s) { s.abs() } else { 1.0 });
        let placed = aligned && !mirrored && origin.iter().all(|v| v.is_finite());
        if !placed {
            self.notes.push(Note::OriginIgnored);
        }
        self.geometry = Geometry { spacing, origin: if placed { origin } else { [0.0; 3] } };
    }

    /// Samples between neighbours along each axis of the volume, in the file.
    fn strides(&self) -> [u64; 3] {
        let mut strides = [1; 3];
        let mut stride = 1u64;
        for axis in self.order {
            strides[axis] = stride;
            stride = stride.saturating_mul(u64::from(self.dims[axis]));
        }
        strides
    }

    /// Slices that have to be in memory at a time: a layer of blocks, if slices follow each other
    /// in the file.
    fn slab_depth(&self) -> u32 {
        if self.order[2] == 2 { 4 } else { self.dims[2].next_multiple_of(4) }
    }

    /// Reads all samples and converts them.
    pub(crate) fn read<S: Sink>(
        &self,
        input: &mut Input<'_>,
        converter: &mut Converter<'_, S>,
    ) -> Result<()> {
        input.skip_to(self.start)?;
        let [nx, ny, nz] = self.dims;
        let mut bytes = Vec::new();
        for first in (0..nz).step_by(self.slab_depth() as usize) {
            let depth = self.slab_depth().min(nz - first);
            self.fill(input, &mut bytes, data_bytes([nx, ny, depth], self.sample_type))?;
            let slab = Slab { layout: self, bytes: &bytes, strides: self.strides() };
            for _ in 0..blocks([nx, ny, depth]) {
                let [x, y, z] = converter.next_origin();
                let valid = converter.next_valid();
                converter.push(slab.block([x, y, z - first], valid))?;
            }
        }
        Ok(())
    }

    /// Reads a slab; a file that ends early is measured by the whole volume.
    fn fill(&self, input: &mut Input<'_>, bytes: &mut Vec<u8>, count: u64) -> Result<()> {
        input.fill(bytes, count).map_err(|error| match error {
            Error::TooShort { found, .. } => Error::TooShort { expected: self.end, found },
            other => other,
        })
    }
}

/// Bytes of a volume; saturating.
pub(crate) fn data_bytes(dims: [u32; 3], sample_type: SampleType) -> u64 {
    let bytes = u64::from(sample_type.bytes());
    dims.iter().fold(bytes, |bytes, &n| bytes.saturating_mul(u64::from(n)))
}

fn blocks(dims: [u32; 3]) -> u64 {
    dims.iter().fold(1, |count, &n| count.saturating_mul(u64::from(n.div_ceil(4))))
}

/// Some slices of a volume as they are in the file.
struct Slab<'a> {
    layout: &'a Layout,
    bytes: &'a [u8],
    strides: [u64; 3],
}

impl Slab<'_> {
    /// The samples of the block at `origin`; those outside the volume are zero.
    fn block(&self, origin: [u32; 3], valid: [u32; 3]) -> [f64; 64] {
        let big = self.layout.big_endian;
        let mut block = match self.layout.sample_type {
            SampleType::U8 => self.gather(origin, valid, big, |b: [u8; 1]| f64::from(b[0])),
            SampleType::I8 => self.gather(origin, valid, big, |b| f64::from(i8::from_le_bytes(b))),
            SampleType::U16 => {
                self.gather(origin, valid, big, |b| f64::from(u16::from_le_bytes(b)))
            }
            SampleType::I16 => {
                self.gather(origin, valid, big, |b| f64::from(i16::from_le_bytes(b)))
            }
            SampleType::U32 => {
                self.gather(origin, valid, big, |b| f64::from(u32::from_le_bytes(b)))
            }
            SampleType::I32 => {
                self.gather(origin, valid, big, |b| f64::from(i32::from_le_bytes(b)))
            }
            SampleType::U64 => self.gather(origin, valid, big, |b| u64::from_le_bytes(b) as f64),
            SampleType::I64 => self.gather(origin, valid, big, |b| i64::from_le_bytes(b) as f64),
            SampleType::F16 => self.gather(origin, valid, big, |b| half(u16::from_le_bytes(b))),
            SampleType::F32 => {
                self.gather(origin, valid, big, |b| f64::from(f32::from_le_bytes(b)))
            }
            SampleType::F64 => self.gather(origin, valid, big, f64::from_le_bytes),
        };
        let [slope, inter] = self.layout.scale;
        if slope != 1.0 || inter != 0.0 {
            block = block.map(|value| value * slope + inter);
        }
        block
    }

    fn gather<const N: usize>(
        &self,
        origin: [u32; 3],
        valid: [u32; 3],
        big: bool,
        value: impl Fn([u8; N]) -> f64,
    ) -> [f64; 64] {
        let (samples, _) = self.bytes.as_chunks::<N>();
        let [dx, dy, dz] = self.strides.map(|stride| stride as usize);
        let [x0, y0, z0] = origin.map(|n| n as usize);
        let [nx, ny, nz] = valid.map(|n| n.min(4) as usize);
        let mut block = [0.0; 64];
        for z in 0..nz {
            for y in 0..ny {
                let row = x0 * dx + (y0 + y) * dy + (z0 + z) * dz;
                for x in 0..nx {
                    let mut sample = samples.get(row + x * dx).copied().unwrap_or([0; N]);
                    if big {
                        sample.reverse();
                    }
                    block[x + 4 * y + 16 * z] = value(sample);
                }
            }
        }
        block
    }
}

/// The value of a 16-bit float.
pub(crate) fn half(bits: u16) -> f64 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023));
    let magnitude = match exponent {
        0 => fraction * 2f64.powi(-24),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1024.0 + fraction) * 2f64.powi(exponent - 25),
    };
    if bits >> 15 == 1 { -magnitude } else { magnitude }
}

/// Index of the volume to read, out of `count`.
pub(crate) fn choose(count: u64, time_index: Option<u32>, notes: &mut Vec<Note>) -> Result<u64> {
    match time_index {
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

/// Sizes as they are in a file, x first, missing axes 1.
pub(crate) fn sizes(found: &[u64]) -> Result<[u32; 3]> {
    let mut dims = [1; 3];
    let valid = found.len() <= 3 && found.iter().all(|&n| (1..=1 << 16).contains(&n));
    if !valid {
        return Err(Error::Dims { dims: found.to_vec() });
    }
    for (dim, &size) in dims.iter_mut().zip(found) {
        *dim = size as u32;
    }
    Ok(dims)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_those_of_the_crate_half() {
        for bits in 0..=u16::MAX {
            let (found, expected) = (half(bits), half::f16::from_bits(bits).to_f64());
            assert!(found == expected || (found.is_nan() && expected.is_nan()), "{bits:#x}");
            assert_eq!(found.is_sign_negative(), bits >> 15 == 1);
        }
    }
}
