//! NRRD, header and data in one file or in two.

use std::io::{BufRead, Read};

use crate::error::{Error, Result};
use crate::input::Input;
use crate::layout::{Layout, choose, sizes};
use crate::options::ReadOptions;
use crate::source::{Format, SampleType};

/// Most bytes of a header line, and most lines, before a file is taken for broken.
const MAX_LINE_BYTES: u64 = 1 << 16;
const MAX_LINES: usize = 10_000;

/// Relative size up to which the other components of an axis direction count as zero.
const ALIGNED: f64 = 1e-5;

pub(super) fn open<'a>(mut input: Input<'a>, options: &ReadOptions) -> Result<(Layout, Input<'a>)> {
    let header = Header::read(&mut input)?;
    let mut data = match &header.data_file {
        None => input,
        Some(name) if name.starts_with("LIST") || name.contains('%') => {
            return Err(unsupported("one data file", format!("data file: {name}")));
        }
        Some(name) => input.open_other(name)?,
    };
    for _ in 0..header.line_skip {
        if line(&mut data)?.is_none() {
            let found = data.position;
            return Err(Error::TooShort { expected: found + 1, found });
        }
    }
    let mut data = match header.encoding.as_str() {
        "raw" => data,
        "gzip" | "gz" => super::gunzip(data)?,
        other => {
            return Err(unsupported("encoding raw or gzip", format!("encoding: {other}")));
        }
    };
    let axes = header.axes()?;
    let mut notes = Vec::new();
    let index = choose(axes.count, options.time_index, &mut notes)?;
    let ty = header.sample_type()?;
    let mut layout = Layout::new(Format::Nrrd, axes.dims, ty, 0, [index, axes.count]);
    let first = first_byte(&header, &mut data, layout.file_end)?;
    layout = Layout::new(Format::Nrrd, axes.dims, ty, first, [index, axes.count]);
    layout.rank = axes.rank;
    layout.big_endian = header.big_endian(ty)?;
    header.place(&axes, &mut layout)?;
    layout.notes.extend(notes);
    Ok((layout, data))
}

fn unsupported(expected: &'static str, found: String) -> Error {
    Error::Unsupported { format: Format::Nrrd, expected, found }
}

fn invalid(field: &'static str, expected: &str, found: &str) -> Error {
    Error::header(Format::Nrrd, field, expected, format!("{found:?}"))
}

/// Where the data start: -1 bytes to skip mean that they end where the file does.
fn first_byte(header: &Header, data: &mut Input<'_>, bytes: u64) -> Result<u64> {
    match (header.byte_skip, data.length) {
        (Some(skip), _) => Ok(data.position.saturating_add(skip)),
        (None, Some(length)) => {
            length.checked_sub(bytes).ok_or(Error::TooShort { expected: bytes, found: length })
        }
        (None, None) => {
            Err(unsupported("a file of known length where byte skip is -1", "gzip".into()))
        }
    }
}

/// The next line without its end; none at the end of the file.
fn line(input: &mut Input<'_>) -> Result<Option<String>> {
    let mut bytes = Vec::new();
    let read = input.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut bytes);
    let count = read.map_err(|source| input.error(source))?;
    if count == 0 {
        return Ok(None);
    }
    let text = String::from_utf8_lossy(&bytes);
    Ok(Some(text.trim_end_matches(['\r', '\n']).into()))
}

/// The fields of a header that matter here, as text.
#[derive(Debug, Default)]
struct Header {
    dimension: Option<usize>,
    sizes: Vec<u64>,
    ty: String,
    encoding: String,
    endian: String,
    kinds: Vec<String>,
    spacings: Option<String>,
    directions: Option<String>,
    origin: Option<String>,
    data_file: Option<String>,
    line_skip: u64,
    /// None: -1.
    byte_skip: Option<u64>,
}

impl Header {
    fn read(input: &mut Input<'_>) -> Result<Self> {
        let magic = line(input)?.unwrap_or_default();
        if !magic.starts_with("NRRD000") || magic.len() != 8 {
            return Err(invalid("magic", "NRRD0001 to NRRD0005", &magic));
        }
        let mut header = Self { byte_skip: Some(0), ..Self::default() };
        for _ in 0..MAX_LINES {
            let Some(line) = line(input)? else {
                // A header of its own may end with the file.
                if header.data_file.is_some() {
                    return Ok(header);
                }
                let found = input.position;
                return Err(Error::TooShort { expected: found + 1, found });
            };
            if line.is_empty() {
                return Ok(header);
            }
            header.add(&line)?;
        }
        Err(invalid("header", "at most 10000 lines", "more"))
    }

    /// Takes a line `field: value`; comments and `key:=value` pairs say nothing here.
    fn add(&mut self, line: &str) -> Result<()> {
        if line.starts_with('#') {
            return Ok(());
        }
        let Some((field, value)) = line.split_once(':') else {
            return Err(invalid("header", "lines like \"field: value\"", line));
        };
        if value.starts_with('=') {
            return Ok(());
        }
        let value = value.trim();
        match field.trim().to_ascii_lowercase().as_str() {
            "dimension" => {
                let dimension = value.parse().ok().filter(|n| (1..=16).contains(n));
                let error = || invalid("dimension", "a number from 1 to 16", value);
                self.dimension = Some(dimension.ok_or_else(error)?);
            }
            "sizes" => {
                let sizes: Option<_> = value.split_whitespace().map(|n| n.parse().ok()).collect();
                self.sizes = sizes.ok_or_else(|| invalid("sizes", "positive numbers", value))?;
            }
            "type" => self.ty = value.to_ascii_lowercase(),
            "encoding" => self.encoding = value.to_ascii_lowercase(),
            "endian" => self.endian = value.to_ascii_lowercase(),
            "kinds" => self.kinds = value.split_whitespace().map(String::from).collect(),
            "spacings" => self.spacings = Some(value.into()),
            "space directions" => self.directions = Some(value.into()),
            "space origin" => self.origin = Some(value.into()),
            "data file" | "datafile" => self.data_file = Some(value.into()),
            "line skip" | "lineskip" => {
                let error = || invalid("line skip", "0 or more", value);
                self.line_skip = value.parse().map_err(|_e| error())?;
            }
            "byte skip" | "byteskip" => {
                let error = || invalid("byte skip", "-1, 0 or more", value);
                self.byte_skip = match value {
                    "-1" => None,
                    _ => Some(value.parse().map_err(|_e| error())?),
                };
            }
            _ => {}
        }
        Ok(())
    }

    /// Which axes of the file span the volume.
    fn axes(&self) -> Result<Axes> {
        let found = &self.sizes;
        let dimension = self.dimension.unwrap_or(0);
        if dimension != found.len() || found.is_empty() {
            let expected = format!("as many numbers as dimension says, {dimension}");
            return Err(invalid("sizes", &expected, &format!("{found:?}")));
        }
        let (first, rank) =
            (usize::from(found.len() == 4 && self.starts_with_components()), found.len());
        let (inner, outer) =
            if first == 1 { (found[0], 1) } else { (1, found.get(3).copied().unwrap_or(1)) };
        if rank > 4 || inner != 1 {
            return Err(unsupported(
                "1 to 3 axes of space, and at most one of time behind them",
                format!("sizes {found:?}, kinds {:?}", self.kinds),
            ));
        }
        let spatial: Vec<u64> = found.iter().skip(first).take(3).copied().collect();
        let dims = sizes(&spatial)?;
        if outer == 0 {
            return Err(Error::Dims { dims: found.clone() });
        }
        Ok(Axes { dims, rank: spatial.len() as u32, first, count: outer })
    }

    /// Whether the fastest axis is not one of space.
    fn starts_with_components(&self) -> bool {
        let kind = self.kinds.first().map(|kind| kind.to_ascii_lowercase());
        let named =
            kind.is_some_and(|kind| !matches!(kind.as_str(), "domain" | "space" | "???" | "none"));
        let directed = self.directions.as_ref().is_some_and(|text| text.starts_with("none"));
        named || directed
    }

    fn sample_type(&self) -> Result<SampleType> {
        Ok(match self.ty.as_str() {
            "signed char" | "int8" | "int8_t" => SampleType::I8,
            "uchar" | "unsigned char" | "uint8" | "uint8_t" => SampleType::U8,
            "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => {
                SampleType::I16
            }
            "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => {
                SampleType::U16
            }
            "int" | "signed int" | "int32" | "int32_t" => SampleType::I32,
            "uint" | "unsigned int" | "uint32" | "uint32_t" => SampleType::U32,
            "longlong"
            | "long long"
            | "long long int"
            | "signed long long"
            | "signed long long int"
            | "int64"
            | "int64_t" => SampleType::I64,
            "ulonglong"
            | "unsigned long long"
            | "unsigned long long int"
            | "uint64"
            | "uint64_t" => SampleType::U64,
            "float" => SampleType::F32,
            "double" => SampleType::F64,
            "block" => return Err(unsupported("samples of a number type", "type: block".into())),
            other => {
                return Err(invalid("type", "a type of C such as uchar, int16 or float", other));
            }
        })
    }

    fn big_endian(&self, ty: SampleType) -> Result<bool> {
        match self.endian.as_str() {
            "little" => Ok(false),
            "big" => Ok(true),
            "" if ty.bytes() == 1 => Ok(false),
            other => Err(invalid("endian", "little or big", other)),
        }
    }

    fn place(&self, axes: &Axes, layout: &mut Layout) -> Result<()> {
        let error = |field, text: &str| invalid(field, "numbers for every axis", text);
        let (mut spacing, mut aligned) = ([1.0; 3], true);
        if let Some(text) = &self.directions {
            let vectors = vectors(text).ok_or_else(|| error("space directions", text))?;
            if vectors.len() != self.sizes.len() {
                return Err(error("space directions", text));
            }
            let spatial = vectors.into_iter().skip(axes.first).take(axes.rank as usize);
            for (axis, vector) in spatial.enumerate() {
                // An axis without a direction is not placed in space.
                let vector = vector.unwrap_or_default();
                spacing[axis] = vector.iter().map(|v| v * v).sum::<f64>().sqrt();
                aligned &= is_along(&vector, axis, spacing[axis]);
            }
        } else if let Some(text) = &self.spacings {
            let found: Option<Vec<f64>> = text.split_whitespace().map(|v| v.parse().ok()).collect();
            let found = found.filter(|found| found.len() == self.sizes.len());
            let found = found.ok_or_else(|| error("spacings", text))?;
            for (spacing, &found) in spacing.iter_mut().zip(found.iter().skip(axes.first)) {
                // NaN stands for "not known".
                *spacing = if found.is_nan() { 1.0 } else { found };
            }
        }
        let mut origin = [0.0; 3];
        if let Some(text) = &self.origin {
            let found = vectors(text).and_then(|mut all| all.pop().flatten());
            let found = found.ok_or_else(|| error("space origin", text))?;
            for (origin, &found) in origin.iter_mut().zip(&found) {
                *origin = found;
            }
        }
        layout.place(spacing, origin, aligned);
        Ok(())
    }
}

/// The axes that span the volume: from axis `first` on, and how many volumes there are.
struct Axes {
    dims: [u32; 3],
    rank: u32,
    first: usize,
    count: u64,
}

fn is_along(vector: &[f64], axis: usize, length: f64) -> bool {
    vector.iter().enumerate().all(
        |(i, &v)| {
            if i == axis { v > 0.0 } else { v.abs() <= ALIGNED * length }
        },
    )
}

/// Vectors such as `(1,0,0) none (0,0,2)`.
fn vectors(text: &str) -> Option<Vec<Option<Vec<f64>>>> {
    let mut vectors = Vec::new();
    let mut rest = text.trim();
    while !rest.is_empty() {
        let after = if let Some(after) = rest.strip_prefix("none") {
            vectors.push(None);
            after
        } else {
            let (inside, after) = rest.strip_prefix('(')?.split_once(')')?;
            let numbers: Option<Vec<f64>> =
                inside.split(',').map(|v| v.trim().parse().ok()).collect();
            vectors.push(Some(numbers.filter(|numbers| numbers.len() <= 4)?));
            after
        };
        rest = after.trim_start();
    }
    Some(vectors)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_are_parsed_or_refused() {
        let found = vectors(" (1,0, 0.5) none (nan,-2e3,0)").unwrap();
        assert_eq!(found[0], Some(vec![1.0, 0.0, 0.5]));
        assert_eq!(found[1], None);
        assert_eq!(found[2].as_ref().unwrap()[1], -2e3);
        assert_eq!(vectors(""), Some(vec![]));
        for wrong in ["(", "(1,2", "1,2", "(1,x)", "(1) 2", "(1,2,3,4,5)", "()"] {
            assert_eq!(vectors(wrong), None, "{wrong}");
        }
    }
}
