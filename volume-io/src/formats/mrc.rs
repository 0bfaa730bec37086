//! MRC2014 and CCP4 maps.

use crate::error::{Error, Result};
use crate::input::Input;
use crate::layout::{Layout, choose, sizes};
use crate::options::ReadOptions;
use crate::source::{Format, SampleType};

const HEADER_BYTES: u64 = 1024;

/// Angles of a unit cell within this of 90 degrees count as right.
const RIGHT_ANGLE: f64 = 1e-3;

/// Space groups from here on mean a stack of volumes.
const VOLUME_STACK: i32 = 401;

pub(super) fn open<'a>(mut input: Input<'a>, options: &ReadOptions) -> Result<(Layout, Input<'a>)> {
    let bytes = input.take_bytes(HEADER_BYTES)?;
    let header = Header::new(&bytes)?;
    let columns = header.positive(0, "nx, ny, nz")?;
    let order = header.order()?;
    let sample_type = sample_type(header.int(3))?;
    let mut notes = Vec::new();
    let (depth, count) = header.stack(columns[2], order)?;
    let index = choose(count, options.time_index, &mut notes)?;
    let mut found = [1; 3];
    for (axis, size) in order.into_iter().zip([columns[0], columns[1], depth]) {
        found[axis] = size;
    }
    let extended = header.int(23);
    let first = u64::try_from(extended)
        .map_err(|_error| Error::header(Format::Mrc, "nsymbt", "0 or more bytes", extended))?;
    let first = HEADER_BYTES + first;
    let mut layout = Layout::new(Format::Mrc, sizes(&found)?, sample_type, first, [index, count]);
    layout.order = order;
    layout.big_endian = header.big_endian;
    header.place(&mut layout);
    layout.notes.extend(notes);
    Ok((layout, input))
}

fn sample_type(mode: i32) -> Result<SampleType> {
    match mode {
        0 => Ok(SampleType::I8),
        1 => Ok(SampleType::I16),
        2 => Ok(SampleType::F32),
        6 => Ok(SampleType::U16),
        12 => Ok(SampleType::F16),
        3 | 4 | 101 => Err(Error::Unsupported {
            format: Format::Mrc,
            expected: "mode 0, 1, 2, 6 or 12 (real numbers of 8 to 32 bits)",
            found: format!("mode {mode} (complex numbers or 4 bits)"),
        }),
        _ => Err(Error::header(Format::Mrc, "mode", "0, 1, 2, 3, 4, 6, 12 or 101", mode)),
    }
}

/// The header as 32-bit words in the byte order of the machine that wrote it.
struct Header<'a> {
    words: &'a [[u8; 4]],
    big_endian: bool,
}

impl<'a> Header<'a> {
    fn new(bytes: &'a [u8]) -> Result<Self> {
        let (words, _) = bytes.as_chunks::<4>();
        let stamp = words.get(53).copied().unwrap_or_default();
        let big_endian = match stamp {
            [0x44, 0x44 | 0x41, ..] => false,
            [0x11, 0x11, ..] => true,
            // Some writers leave the stamp out. The mode is a small number in one byte order only.
            [0, 0, ..] => {
                let mode = words.get(3).copied().unwrap_or_default();
                i32::from_le_bytes(mode).unsigned_abs() > i32::from_be_bytes(mode).unsigned_abs()
            }
            other => {
                let expected = "44 44, 44 41, 11 11 or 00 00";
                let found = format!("{other:02x?}");
                return Err(Error::header(Format::Mrc, "machine stamp", expected, found));
            }
        };
        Ok(Self { words, big_endian })
    }

    fn word(&self, index: usize) -> [u8; 4] {
        let mut word = self.words.get(index).copied().unwrap_or_default();
        if self.big_endian {
            word.reverse();
        }
        word
    }

    fn int(&self, index: usize) -> i32 {
        i32::from_le_bytes(self.word(index))
    }

    fn ints(&self, first: usize) -> [i32; 3] {
        [0, 1, 2].map(|i| self.int(first + i))
    }

    fn floats(&self, first: usize) -> [f64; 3] {
        [0, 1, 2].map(|i| f64::from(f32::from_le_bytes(self.word(first + i))))
    }

    fn positive(&self, first: usize, field: &'static str) -> Result<[u64; 3]> {
        let found = self.ints(first);
        if found.iter().any(|&n| n <= 0) {
            let found = format!("{found:?}");
            return Err(Error::header(Format::Mrc, field, "positive numbers", found));
        }
        Ok(found.map(|n| u64::from(n.unsigned_abs())))
    }

    /// The axes of columns, rows and sections; old files leave them out.
    fn order(&self) -> Result<[usize; 3]> {
        let found = self.ints(16);
        if found == [0; 3] {
            return Ok([0, 1, 2]);
        }
        let mut sorted = found;
        sorted.sort_unstable();
        if sorted != [1, 2, 3] {
            let found = format!("{found:?}");
            return Err(Error::header(
                Format::Mrc,
                "mapc, mapr, maps",
                "1, 2, 3 in any order",
                found,
            ));
        }
        Ok(found.map(|axis| axis.unsigned_abs() as usize - 1))
    }

    /// Sections per volume and number of volumes.
    fn stack(&self, sections: u64, order: [usize; 3]) -> Result<(u64, u64)> {
        if self.int(22) < VOLUME_STACK {
            return Ok((sections, 1));
        }
        let [_, _, depth] = self.positive(7, "mx, my, mz")?;
        if order[2] != 2 || !sections.is_multiple_of(depth) {
            return Err(Error::Unsupported {
                format: Format::Mrc,
                expected: "a stack of volumes along z, of mz sections each",
                found: format!("{sections} sections along axis {}, mz = {depth}", order[2] + 1),
            });
        }
        Ok((depth, sections / depth))
    }

    fn place(&self, layout: &mut Layout) {
        let (cell, angles) = (self.floats(10), self.floats(13));
        let intervals = self.ints(7);
        let spacing = [0, 1, 2].map(|axis| cell[axis] / f64::from(intervals[axis]));
        let right = angles.iter().all(|&a| a == 0.0 || (a - 90.0).abs() < RIGHT_ANGLE);
        let mut origin = self.floats(49);
        // Crystallographic maps say where they start in voxels of the unit cell.
        if origin == [0.0; 3] {
            for (axis, start) in layout.order.into_iter().zip(self.ints(4)) {
                let spacing = spacing[axis];
                let valid = spacing.is_finite() && spacing != 0.0;
                origin[axis] = f64::from(start) * if valid { spacing } else { 1.0 };
            }
        }
        layout.place(spacing, origin, right);
    }
}
