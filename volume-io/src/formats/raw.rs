//! Files of nothing but samples, x-fastest, as the Open SciVis data sets name them:
//! `NAME_XxYxZ_TYPE.raw`.

use crate::error::{Error, Result};
use crate::input::Input;
use crate::layout::{Layout, data_bytes};
use crate::options::{RawLayout, ReadOptions};
use crate::source::{Format, Note, SampleType};

/// What is known about a raw file from the options or, failing that, from its name.
pub(super) fn layout(input: &Input<'_>, options: &ReadOptions) -> Option<RawLayout> {
    options.raw.or_else(|| parse_name(&input.file_name))
}

/// Whether the file is exactly as long as its layout says.
pub(super) fn fits(input: &Input<'_>, options: &ReadOptions) -> bool {
    layout(input, options)
        .is_some_and(|raw| input.length == Some(data_bytes(raw.dims, raw.sample_type)))
}

pub(super) fn open<'a>(input: Input<'a>, options: &ReadOptions) -> Result<(Layout, Input<'a>)> {
    let Some(RawLayout { dims, sample_type }) = layout(&input, options) else {
        return Err(Error::RawNeedsLayout { name: input.name });
    };
    crate::layout::sizes(&dims.map(u64::from))?;
    let expected = data_bytes(dims, sample_type);
    // Nothing but its length can tell that a layout is wrong.
    if let Some(found) = input.length
        && found != expected
    {
        return Err(Error::RawLength { dims, sample_type, expected, found });
    }
    let mut layout = Layout::new(Format::Raw, dims, sample_type, 0, [0, 1]);
    layout.big_endian = options.big_endian;
    Ok((layout, input))
}

/// What bytes after the data mean: in a raw file, that its layout is wrong.
pub(super) fn note_trailing(layout: &Layout, trailing: u64) -> Result<Note> {
    if layout.format != Format::Raw {
        return Ok(Note::TrailingBytes(trailing));
    }
    let (dims, sample_type, expected) = (layout.dims, layout.sample_type, layout.end);
    Err(Error::RawLength { dims, sample_type, expected, found: expected + trailing })
}

/// Reads `NAME_XxYxZ_TYPE.raw`.
fn parse_name(name: &str) -> Option<RawLayout> {
    let end = name.len().checked_sub(4)?;
    if !name.get(end..)?.eq_ignore_ascii_case(".raw") {
        return None;
    }
    let mut parts = name.get(..end)?.rsplit('_');
    let sample_type = SampleType::from_raw_name(parts.next()?)?;
    let mut sizes = parts.next()?.split(['x', 'X']).map(|size| size.parse().ok());
    let dims = [sizes.next()??, sizes.next()??, sizes.next()??];
    sizes.next().is_none().then_some(RawLayout { dims, sample_type })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_dims_and_type() {
        let parsed = |name| parse_name(name).map(|raw| (raw.dims, raw.sample_type));
        assert_eq!(parsed("fuel_64x32x16_uint8.raw"), Some(([64, 32, 16], SampleType::U8)));
        assert_eq!(parsed("a_b_1x2x3_FLOAT64.RAW"), Some(([1, 2, 3], SampleType::F64)));
        assert_eq!(parsed("1x2x3_int16.raw"), Some(([1, 2, 3], SampleType::I16)));
        for wrong in [
            "fuel.raw",
            "fuel_64x64_uint8.raw",
            "fuel_1x2x3x4_uint8.raw",
            "fuel_1x2x-3_uint8.raw",
            "fuel_1x2x3_byte.raw",
            "fuel_1x2x3_uint8.dat",
            "_uint8.raw",
            "\u{e9}\u{e9}",
            "",
        ] {
            assert_eq!(parsed(wrong), None, "{wrong}");
        }
    }
}
