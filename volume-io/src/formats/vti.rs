//! `ImageData` of VTK in XML (`.vti`): one piece, one array of scalars.
//!
//! The file is read once from front to back, whatever the encoding, so that none of it has to be
//! in memory as a whole.

mod data;
mod xml;

use std::io::{BufRead, BufReader};

use crate::error::{Error, Result};
use crate::input::Input;
use crate::layout::{Layout, data_bytes, sizes};
use crate::options::ReadOptions;
use crate::source::{Format, Note, SampleType};
use data::{Ascii, Base64, Header, binary};
use xml::{Tag, next_tag};

/// Difference up to which a direction matrix counts as the identity.
const ALIGNED: f64 = 1e-6;

pub(super) fn open<'a>(mut input: Input<'a>, options: &ReadOptions) -> Result<(Layout, Input<'a>)> {
    let mut document = Document::default();
    let mut section = None;
    let mut active = None;
    while let Some(tag) = next_tag(&mut input)? {
        match tag.name.as_str() {
            "VTKFile" => document.file(&tag)?,
            "/VTKFile" => document.complete = true,
            "ImageData" => document.image(&tag)?,
            "Piece" => document.piece(&tag)?,
            "PointData" | "CellData" => {
                section = Some(tag.name == "CellData");
                active = tag.attribute("Scalars").filter(|name| !name.is_empty()).map(String::from);
            }
            "/PointData" | "/CellData" => section = None,
            "DataArray" => {
                let Some(cells) = section else { continue };
                let array = Array::new(&tag, cells);
                document.names.push(array.name.clone());
                let wanted = options.array.as_ref().or(active.as_ref());
                if document.chosen.is_some() || !array.is(wanted) {
                    continue;
                }
                if array.offset.is_none() {
                    return document.inline(array, input);
                }
                document.chosen = Some(array);
            }
            "AppendedData" => {
                document.complete = true;
                return document.appended(&tag, input, options);
            }
            _ => {}
        }
    }
    Err(document.nothing(options, input.position))
}

fn unsupported(expected: &'static str, found: impl Into<String>) -> Error {
    Error::Unsupported { format: Format::Vti, expected, found: found.into() }
}

fn invalid(field: &'static str, expected: &str, found: &str) -> Error {
    Error::header(Format::Vti, field, expected, format!("{found:?}"))
}

/// An array as its tag describes it.
#[derive(Debug)]
struct Array {
    name: String,
    ty: String,
    components: String,
    format: String,
    /// Whether it holds values of cells, not points.
    cells: bool,
    /// Where its data start among the appended data, as the tag says.
    offset: Option<String>,
}

impl Array {
    fn new(tag: &Tag, cells: bool) -> Self {
        let text = |name, default: &str| tag.attribute(name).unwrap_or(default).to_string();
        let format = text("format", "ascii");
        let offset = (format == "appended").then(|| text("offset", ""));
        let components = text("NumberOfComponents", "1");
        Self { name: text("Name", ""), ty: text("type", ""), components, format, cells, offset }
    }

    fn is(&self, wanted: Option<&String>) -> bool {
        wanted.map_or(self.components == "1", |wanted| *wanted == self.name)
    }

    fn sample_type(&self) -> Result<SampleType> {
        Ok(match self.ty.as_str() {
            "UInt8" => SampleType::U8,
            "Int8" => SampleType::I8,
            "UInt16" => SampleType::U16,
            "Int16" => SampleType::I16,
            "UInt32" => SampleType::U32,
            "Int32" => SampleType::I32,
            "UInt64" => SampleType::U64,
            "Int64" => SampleType::I64,
            "Float32" => SampleType::F32,
            "Float64" => SampleType::F64,
            other => {
                return Err(invalid("type", "Int8 to UInt64, Float32 or Float64", other));
            }
        })
    }
}

/// What the tags said so far.
#[derive(Debug, Default)]
struct Document {
    header: Option<Header>,
    extent: Option<[i64; 6]>,
    spacing: [f64; 3],
    origin: [f64; 3],
    aligned: bool,
    pieces: u32,
    /// All tags that can describe an array were seen.
    complete: bool,
    names: Vec<String>,
    chosen: Option<Array>,
}

impl Document {
    fn file(&mut self, tag: &Tag) -> Result<()> {
        let text = |name, default| tag.attribute(name).unwrap_or(default);
        let ty = text("type", "");
        if ty != "ImageData" {
            return Err(unsupported("VTKFile of type ImageData", format!("type {ty:?}")));
        }
        let big_endian = match text("byte_order", "LittleEndian") {
            "LittleEndian" => false,
            "BigEndian" => true,
            other => return Err(invalid("byte_order", "LittleEndian or BigEndian", other)),
        };
        let bytes = match text("header_type", "UInt32") {
            "UInt32" => 4,
            "UInt64" => 8,
            other => return Err(invalid("header_type", "UInt32 or UInt64", other)),
        };
        let compressed = match text("compressor", "") {
            "" => false,
            "vtkZLibDataCompressor" => true,
            other => {
                return Err(unsupported("no compressor or vtkZLibDataCompressor", other));
            }
        };
        self.header = Some(Header { bytes, big_endian, compressed });
        Ok(())
    }

    fn image(&mut self, tag: &Tag) -> Result<()> {
        if let Some(text) = tag.attribute("WholeExtent") {
            self.extent = Some(numbers(text, "WholeExtent")?);
        }
        self.spacing = match tag.attribute("Spacing") {
            Some(text) => numbers(text, "Spacing")?,
            None => [1.0; 3],
        };
        self.origin = match tag.attribute("Origin") {
            Some(text) => numbers(text, "Origin")?,
            None => [0.0; 3],
        };
        let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        let direction: [f64; 9] = match tag.attribute("Direction") {
            Some(text) => numbers(text, "Direction")?,
            None => identity,
        };
        self.aligned = direction.iter().zip(identity).all(|(d, i)| (d - i).abs() <= ALIGNED);
        Ok(())
    }

    fn piece(&mut self, tag: &Tag) -> Result<()> {
        self.pieces += 1;
        if self.pieces > 1 {
            return Err(unsupported("one piece", "several pieces"));
        }
        // Of an image in several files, this one holds a part.
        if let Some(text) = tag.attribute("Extent") {
            self.extent = Some(numbers(text, "Extent")?);
        }
        Ok(())
    }

    fn header(&self) -> Result<Header> {
        self.header.ok_or_else(|| invalid("document", "an element VTKFile first", "none"))
    }

    /// The layout of an array whose data come alone.
    fn layout(&self, array: &Array) -> Result<Layout> {
        let header = self.header()?;
        let extent = self.extent.ok_or_else(|| invalid("WholeExtent", "six integers", ""))?;
        if array.components != "1" {
            let found = format!("array {:?} of {} components", array.name, array.components);
            return Err(unsupported("an array of one component", found));
        }
        let [x0, x1, y0, y1, z0, z1] = extent;
        let (first, last) = ([x0, y0, z0], [x1, y1, z1]);
        let mut found = [0; 3];
        for axis in 0..3 {
            let intervals = u64::try_from(last[axis].saturating_sub(first[axis]));
            let expected = "six integers, the second of each pair not below the first";
            let intervals =
                intervals.map_err(|_e| invalid("Extent", expected, &format!("{extent:?}")))?;
            // A flat image has one layer of cells.
            found[axis] = if array.cells { intervals.max(1) } else { intervals.saturating_add(1) };
        }
        let dims = sizes(&found)?;
        let mut layout = Layout::new(Format::Vti, dims, array.sample_type()?, 0, [0, 1]);
        layout.big_endian = header.big_endian && array.format != "ascii";
        let mut origin = self.origin;
        for axis in 0..3 {
            let flat = last[axis] == first[axis];
            let shift = if array.cells && !flat { 0.5 } else { 0.0 };
            origin[axis] += (first[axis] as f64 + shift) * self.spacing[axis];
        }
        layout.place(self.spacing, origin, self.aligned);
        if !array.name.is_empty() {
            layout.notes.push(Note::Array { name: array.name.clone() });
        }
        if array.cells {
            layout.notes.push(Note::CellData);
        }
        Ok(layout)
    }

    /// The data that follow the tag of the array.
    fn inline<'a>(&self, array: Array, input: Input<'a>) -> Result<(Layout, Input<'a>)> {
        let layout = self.layout(&array)?;
        let wanted = data_bytes(layout.dims, layout.sample_type);
        let data = match array.format.as_str() {
            "ascii" => {
                let ty = layout.sample_type;
                input.decoded("ascii", None, |input| BufReader::new(Ascii::new(input, ty)))
            }
            "binary" => binary(base64(input), self.header()?, wanted)?,
            other => return Err(invalid("format", "appended, binary or ascii", other)),
        };
        Ok((layout, data))
    }

    /// The data behind the tag `AppendedData`.
    fn appended<'a>(
        &self,
        tag: &Tag,
        mut input: Input<'a>,
        options: &ReadOptions,
    ) -> Result<(Layout, Input<'a>)> {
        let Some(array) = &self.chosen else {
            return Err(self.nothing(options, input.position));
        };
        let layout = self.layout(array)?;
        let text = array.offset.as_deref().unwrap_or_default();
        let offset: u64 =
            text.parse().map_err(|_e| invalid("offset", "a number of bytes", text))?;
        skip_to_underscore(&mut input)?;
        let position = input.position.saturating_add(offset);
        input.check_length(position)?;
        input.skip_to(position)?;
        let input = match tag.attribute("encoding") {
            Some("raw") => input,
            Some("base64") | None => base64(input),
            Some(other) => return Err(invalid("encoding", "raw or base64", other)),
        };
        let wanted = data_bytes(layout.dims, layout.sample_type);
        Ok((layout, binary(input, self.header()?, wanted)?))
    }

    /// Why no array was found before the end.
    fn nothing(&self, options: &ReadOptions, position: u64) -> Error {
        match &options.array {
            _ if self.header.is_none() => invalid("document", "an element VTKFile", "none"),
            _ if self.chosen.is_some() || !self.complete => {
                Error::TooShort { expected: position + 1, found: position }
            }
            Some(wanted) => {
                Error::NoSuchArray { wanted: wanted.clone(), found: self.names.clone() }
            }
            None => unsupported(
                "point or cell data with an array of one component",
                format!("arrays {:?}", self.names),
            ),
        }
    }
}

fn base64(input: Input<'_>) -> Input<'_> {
    input.decoded("base64", None, |input| BufReader::new(Base64::new(input)))
}

/// Appended data start behind an underscore.
fn skip_to_underscore(input: &mut Input<'_>) -> Result<()> {
    loop {
        let byte = match input.fill_buf() {
            Ok(buffer) => buffer.first().copied(),
            Err(source) => return Err(input.error(source)),
        };
        let Some(byte) = byte else {
            let found = input.position;
            return Err(Error::TooShort { expected: found + 1, found });
        };
        if byte != b'_' && !byte.is_ascii_whitespace() {
            let found = char::from(byte).to_string();
            return Err(invalid("AppendedData", "an underscore first", &found));
        }
        input.consume(1);
        if byte == b'_' {
            return Ok(());
        }
    }
}

/// As many numbers as the field has.
fn numbers<T: std::str::FromStr + Copy, const N: usize>(
    text: &str,
    field: &'static str,
) -> Result<[T; N]> {
    let found: Option<Vec<T>> = text.split_whitespace().map(|n| n.parse().ok()).collect();
    let found = found.and_then(|numbers| <[T; N]>::try_from(numbers).ok());
    found.ok_or_else(|| invalid(field, &format!("{N} numbers"), text))
}
