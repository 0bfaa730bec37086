//! NumPy's `.npy`, versions 1 to 3.
//!
//! The last index of an array is x, whatever its order in the file: `array[z, y, x]`, and
//! `array[t, z, y, x]` for several volumes.

use crate::error::{Error, Result};
use crate::input::Input;
use crate::layout::{Layout, choose, sizes};
use crate::options::ReadOptions;
use crate::source::{Format, SampleType};

/// More than any array that can be read needs; NumPy itself stops at 10000.
const MAX_HEADER_BYTES: u32 = 1 << 16;

pub(super) fn open<'a>(mut input: Input<'a>, options: &ReadOptions) -> Result<(Layout, Input<'a>)> {
    let start = input.take_bytes(8)?;
    let version = start.get(6).copied().unwrap_or(0);
    let length = match version {
        1 => input.take_bytes(2)?,
        2 | 3 => input.take_bytes(4)?,
        other => {
            return Err(Error::header(Format::Npy, "version", "1, 2 or 3", other));
        }
    };
    let length = length.iter().rev().fold(0u32, |n, &byte| n << 8 | u32::from(byte));
    if length > MAX_HEADER_BYTES {
        let expected = format!("at most {MAX_HEADER_BYTES}");
        return Err(Error::header(Format::Npy, "header length", expected, length));
    }
    let header = Header::parse(&input.take_bytes(length.into())?)?;
    let layout = header.layout(input.position, options)?;
    Ok((layout, input))
}

/// The dictionary of the header.
#[derive(Debug, PartialEq)]
struct Header {
    descr: String,
    fortran_order: bool,
    shape: Vec<u64>,
}

impl Header {
    fn parse(bytes: &[u8]) -> Result<Self> {
        let text = String::from_utf8_lossy(bytes);
        let invalid = |field| {
            let expected = "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2, 3), }";
            let found: String = text.chars().take(200).collect();
            Error::header(Format::Npy, field, expected, format!("{found:?}"))
        };
        let (mut descr, mut fortran_order, mut shape) = (None, None, None);
        let mut parser = Parser { rest: text.trim() };
        let read = parser.dictionary(|parser, key| {
            match key {
                "descr" => descr = Some(parser.string_or_list()?),
                "fortran_order" => fortran_order = Some(parser.boolean()?),
                "shape" => shape = Some(parser.tuple()?),
                _ => return None,
            }
            Some(())
        });
        read.ok_or_else(|| invalid("header"))?;
        Ok(Self {
            descr: descr.ok_or_else(|| invalid("descr"))?,
            fortran_order: fortran_order.ok_or_else(|| invalid("fortran_order"))?,
            shape: shape.ok_or_else(|| invalid("shape"))?,
        })
    }

    fn layout(&self, first: u64, options: &ReadOptions) -> Result<Layout> {
        let (sample_type, big_endian) = self.sample_type()?;
        let mut notes = Vec::new();
        let (axes, count) = match self.shape.as_slice() {
            [] => {
                return Err(Error::Unsupported {
                    format: Format::Npy,
                    expected: "an array of 1 to 4 dimensions",
                    found: "a single number".into(),
                });
            }
            [count, axes @ ..] if axes.len() == 3 && (!self.fortran_order || *count == 1) => {
                (axes, *count)
            }
            axes if axes.len() <= 3 => (axes, 1),
            axes => {
                return Err(Error::Unsupported {
                    format: Format::Npy,
                    expected: "an array of 1 to 3 dimensions, or 4 in C order",
                    found: format!("shape {axes:?}, Fortran order {}", self.fortran_order),
                });
            }
        };
        let reversed: Vec<u64> = axes.iter().rev().copied().collect();
        let dims = sizes(&reversed)?;
        if count == 0 {
            return Err(Error::Dims { dims: self.shape.clone() });
        }
        let index = choose(count, options.time_index, &mut notes)?;
        let mut layout = Layout::new(Format::Npy, dims, sample_type, first, [index, count]);
        layout.rank = axes.len() as u32;
        layout.big_endian = big_endian;
        if self.fortran_order {
            layout.order = match axes.len() {
                1 => [0, 1, 2],
                2 => [1, 0, 2],
                _ => [2, 1, 0],
            };
        }
        layout.notes = notes;
        Ok(layout)
    }

    /// The type of the samples, and whether they are big-endian.
    fn sample_type(&self) -> Result<(SampleType, bool)> {
        let (order, name) = match self.descr.split_at_checked(1) {
            Some((order @ ("<" | ">" | "|" | "="), name)) => (order, name),
            _ => ("<", self.descr.as_str()),
        };
        let sample_type = match name {
            "u1" | "b1" => SampleType::U8,
            "i1" => SampleType::I8,
            "u2" => SampleType::U16,
            "i2" => SampleType::I16,
            "u4" => SampleType::U32,
            "i4" => SampleType::I32,
            "u8" => SampleType::U64,
            "i8" => SampleType::I64,
            "f2" => SampleType::F16,
            "f4" => SampleType::F32,
            "f8" => SampleType::F64,
            _ => {
                return Err(Error::Unsupported {
                    format: Format::Npy,
                    expected: "descr b1, u1, i1, u2, i2, u4, i4, u8, i8, f2, f4 or f8",
                    found: self.descr.clone(),
                });
            }
        };
        Ok((sample_type, order == ">"))
    }
}

/// The little of Python's syntax that NumPy writes.
struct Parser<'a> {
    rest: &'a str,
}

impl<'a> Parser<'a> {
    /// Skips white space and `token`, if it comes next.
    fn accept(&mut self, token: &str) -> bool {
        let rest = self.rest.trim_start();
        match rest.strip_prefix(token) {
            Some(rest) => {
                self.rest = rest;
                true
            }
            None => false,
        }
    }

    fn expect(&mut self, token: &str) -> Option<()> {
        self.accept(token).then_some(())
    }

    fn dictionary(&mut self, mut value: impl FnMut(&mut Self, &str) -> Option<()>) -> Option<()> {
        self.expect("{")?;
        while !self.accept("}") {
            let key = self.string()?;
            self.expect(":")?;
            value(self, key)?;
            if !self.accept(",") {
                self.expect("}")?;
                break;
            }
        }
        self.rest.trim().is_empty().then_some(())
    }

    fn string(&mut self) -> Option<&'a str> {
        let quote = if self.accept("'") { '\'' } else { self.expect("\"").map(|()| '"')? };
        let (string, rest) = self.rest.split_once(quote)?;
        self.rest = rest;
        Some(string)
    }

    /// A string, or the list that describes a record, as it is.
    fn string_or_list(&mut self) -> Option<String> {
        if !self.accept("[") {
            return self.string().map(String::from);
        }
        let mut depth = 1;
        let end = self.rest.find(|c| {
            depth += i32::from(c == '[') - i32::from(c == ']');
            depth == 0
        })?;
        let (list, rest) = self.rest.split_at_checked(end)?;
        self.rest = rest.get(1..)?;
        Some(format!("[{list}]"))
    }

    fn boolean(&mut self) -> Option<bool> {
        if self.accept("True") { Some(true) } else { self.expect("False").map(|()| false) }
    }

    fn tuple(&mut self) -> Option<Vec<u64>> {
        self.expect("(")?;
        let (inside, rest) = self.rest.split_once(')')?;
        self.rest = rest;
        let inside = inside.trim();
        let inside = inside.strip_suffix(',').unwrap_or(inside);
        if inside.is_empty() {
            return Some(Vec::new());
        }
        // Python 2 wrote long integers with an L.
        inside.split(',').map(|n| n.trim().trim_end_matches('L').parse().ok()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_of_all_writers_are_parsed() {
        let expected = Header { descr: "<f4".into(), fortran_order: false, shape: vec![3, 4, 5] };
        for text in [
            "{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4, 5), }          \n",
            "{\"shape\":(3L,4L,5L,),\"descr\":\"<f4\",\"fortran_order\":False}\n",
        ] {
            assert_eq!(Header::parse(text.as_bytes()).unwrap(), expected);
        }
        let record = "{'descr': [('a', '<f4', [2])], 'fortran_order': True, 'shape': ()}";
        let header = Header::parse(record.as_bytes()).unwrap();
        assert_eq!(header.descr, "[('a', '<f4', [2])]");
        assert_eq!((header.fortran_order, header.shape), (true, vec![]));
    }

    #[test]
    fn broken_headers_say_what_was_expected() {
        for text in [
            "",
            "{",
            "{}",
            "{'descr': '<f4', 'fortran_order': False}",
            "{'descr': '<f4', 'fortran_order': 0, 'shape': (1,)}",
            "{'descr': '<f4, 'fortran_order': False, 'shape': (1,)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1, -1)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2)} x",
            "{'descr': [, 'fortran_order': False, 'shape': (1, 2)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1,), 'other': 3}",
        ] {
            let error = Header::parse(text.as_bytes()).unwrap_err();
            assert!(matches!(error, Error::InvalidHeader { format: Format::Npy, .. }), "{text}");
            assert!(error.to_string().contains("expected {'descr'"), "{error}");
        }
    }
}
