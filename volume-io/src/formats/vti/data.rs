//! The ways in which VTK writes the numbers of an array.

use std::io::{self, BufRead, BufReader, Read};

use flate2::bufread::ZlibDecoder;

use crate::error::{Error, Result};
use crate::input::Input;
use crate::source::{Format, SampleType};

/// How the integers before the data are written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Header {
    pub(super) bytes: usize,
    pub(super) big_endian: bool,
    pub(super) compressed: bool,
}

impl Header {
    fn int(&self, input: &mut Input<'_>) -> Result<u64> {
        let bytes = input.take_bytes(self.bytes as u64)?;
        let join = |n: u64, byte: &u8| n << 8 | u64::from(*byte);
        Ok(if self.big_endian {
            bytes.iter().fold(0, join)
        } else {
            bytes.iter().rev().fold(0, join)
        })
    }
}

/// The data of an array of `wanted` bytes whose integers come next.
pub(super) fn binary<'a>(mut input: Input<'a>, header: Header, wanted: u64) -> Result<Input<'a>> {
    if header.compressed {
        return compressed(input, header, wanted);
    }
    check_size(header.int(&mut input)?, wanted)?;
    input.check_length(input.position.saturating_add(wanted))?;
    let length = input.length.map(|_| wanted);
    Ok(input.decoded("", length, |input| input.take(wanted)))
}

fn check_size(found: u64, wanted: u64) -> Result<()> {
    if found == wanted {
        return Ok(());
    }
    let expected = format!("{wanted} bytes, by the extent and type");
    Err(Error::header(Format::Vti, "size of the array", expected, found))
}

fn compressed<'a>(mut input: Input<'a>, header: Header, wanted: u64) -> Result<Input<'a>> {
    let count = header.int(&mut input)?;
    let block = header.int(&mut input)?;
    let last = header.int(&mut input)?;
    let complete = if last == 0 { count } else { count.saturating_sub(1) };
    check_size(complete.saturating_mul(block).saturating_add(last), wanted)?;
    let mut sizes = Vec::new();
    for _ in 0..count {
        sizes.push(header.int(&mut input)?);
    }
    Ok(input.decoded("zlib", None, |input| {
        BufReader::new(Blocks {
            state: State::Between(input),
            sizes: sizes.into_iter(),
            block,
            left: wanted,
            block_left: 0,
        })
    }))
}

/// Blocks of an array, each compressed for itself.
struct Blocks<R> {
    state: State<R>,
    sizes: std::vec::IntoIter<u64>,
    /// Bytes of a block when decompressed, of all that follow, and of the present block.
    block: u64,
    left: u64,
    block_left: u64,
}

enum State<R> {
    Between(R),
    Inside(ZlibDecoder<io::Take<R>>),
    Failed,
}

impl<R: BufRead> Blocks<R> {
    /// Goes to the next block; false after the last.
    fn next_block(&mut self) -> io::Result<bool> {
        let reader = match std::mem::replace(&mut self.state, State::Failed) {
            State::Between(reader) => reader,
            State::Inside(decoder) => {
                let mut rest = decoder.into_inner();
                io::copy(&mut rest, &mut io::sink())?;
                rest.into_inner()
            }
            State::Failed => return Ok(false),
        };
        let Some(size) = self.sizes.next() else {
            self.state = State::Between(reader);
            return Ok(false);
        };
        self.block_left = self.block.min(self.left);
        self.left -= self.block_left;
        self.state = State::Inside(ZlibDecoder::new(reader.take(size)));
        Ok(true)
    }
}

impl<R: BufRead> Read for Blocks<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if buffer.is_empty() {
            return Ok(0);
        }
        loop {
            if let State::Inside(decoder) = &mut self.state {
                let count = decoder.read(buffer)?;
                let found = count as u64;
                if found > self.block_left || (count == 0 && self.block_left > 0) {
                    let expected = format!("{} more bytes", self.block_left);
                    self.state = State::Failed;
                    let error = Error::header(Format::Vti, "compressed block", expected, found);
                    return Err(io::Error::other(error));
                }
                self.block_left -= found;
                if count > 0 {
                    return Ok(count);
                }
            }
            if !self.next_block()? {
                return Ok(0);
            }
        }
    }
}

/// Decodes base64 up to the next tag or the end of the file. Several pieces may follow each other,
/// each with its own padding.
pub(super) struct Base64<R> {
    reader: R,
    /// Symbols of the present group of four, as bits, and how many they are with padding.
    bits: u32,
    symbols: u32,
    padding: u32,
    /// Bytes decoded, and how many of them were given away.
    decoded: Vec<u8>,
    given: usize,
}

impl<R: BufRead> Base64<R> {
    pub(super) fn new(reader: R) -> Self {
        Self { reader, bits: 0, symbols: 0, padding: 0, decoded: Vec::new(), given: 0 }
    }

    /// Decodes what the reader has at hand; false at the end.
    fn decode(&mut self) -> io::Result<bool> {
        let available = self.reader.fill_buf()?;
        let end = available.iter().position(|&byte| byte == b'<').unwrap_or(available.len());
        let chunk: Vec<u8> = available.iter().take(end.min(CHUNK)).copied().collect();
        self.reader.consume(chunk.len());
        self.decoded.clear();
        self.given = 0;
        for &byte in &chunk {
            if let Some((bytes, count)) = self.take(byte)? {
                self.decoded.extend(bytes.iter().take(count));
            }
        }
        Ok(!chunk.is_empty())
    }

    /// Takes one character and returns the bytes that it completes.
    fn take(&mut self, byte: u8) -> io::Result<Option<([u8; 3], usize)>> {
        let value = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            b'=' if self.symbols >= 2 => 0,
            b' ' | b'\t' | b'\r' | b'\n' => return Ok(None),
            _ => return Err(invalid(byte)),
        };
        if byte != b'=' && self.padding > 0 {
            return Err(invalid(byte));
        }
        self.padding += u32::from(byte == b'=');
        self.bits = self.bits << 6 | u32::from(value);
        self.symbols += 1;
        if self.symbols < 4 {
            return Ok(None);
        }
        let [_, bytes @ ..] = self.bits.to_be_bytes();
        let count = 3 - self.padding as usize;
        (self.bits, self.symbols, self.padding) = (0, 0, 0);
        Ok(Some((bytes, count)))
    }
}

fn invalid(byte: u8) -> io::Error {
    let found = format!("{:?}", char::from(byte));
    io::Error::other(Error::header(Format::Vti, "data", "base64 characters", found))
}

impl<R: BufRead> Read for Base64<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.given == self.decoded.len() {
            if !self.decode()? {
                return Ok(0);
            }
        }
        let rest = self.decoded.get(self.given..).unwrap_or_default();
        let count = copy(rest, buffer);
        self.given += count;
        Ok(count)
    }
}

/// Copies as much as fits and returns how much that was.
fn copy(from: &[u8], to: &mut [u8]) -> usize {
    let count = from.len().min(to.len());
    for (to, from) in to.iter_mut().zip(from) {
        *to = *from;
    }
    count
}

/// Characters decoded at a time.
const CHUNK: usize = 4096;

/// Most characters of a number.
const MAX_NUMBER: usize = 400;

/// Parses numbers up to the next tag, and gives them as little-endian samples.
pub(super) struct Ascii<R> {
    reader: R,
    sample_type: SampleType,
    ended: bool,
    /// The sample that was parsed last, and how much of it was given away.
    sample: Vec<u8>,
    given: usize,
}

impl<R: BufRead> Ascii<R> {
    pub(super) fn new(reader: R, sample_type: SampleType) -> Self {
        Self { reader, sample_type, ended: false, sample: Vec::new(), given: 0 }
    }

    /// The next number as text; none at the end.
    fn number(&mut self) -> io::Result<Option<String>> {
        let mut text = String::new();
        while !self.ended {
            let Some(&byte) = self.reader.fill_buf()?.first() else {
                self.ended = true;
                break;
            };
            if byte == b'<' {
                self.ended = true;
                break;
            }
            self.reader.consume(1);
            if !byte.is_ascii_whitespace() {
                text.push(char::from(byte));
            } else if !text.is_empty() {
                break;
            }
            if text.len() > MAX_NUMBER {
                return Err(self.invalid(&text));
            }
        }
        Ok((!text.is_empty()).then_some(text))
    }

    fn invalid(&self, text: &str) -> io::Error {
        let expected = format!("a number of type {}", self.sample_type);
        let found = format!("{:?}", text.chars().take(40).collect::<String>());
        io::Error::other(Error::header(Format::Vti, "data", expected, found))
    }
}

fn parse(text: &str, ty: SampleType) -> Option<Vec<u8>> {
    Some(match ty {
        SampleType::U8 => text.parse::<u8>().ok()?.to_le_bytes().into(),
        SampleType::I8 => text.parse::<i8>().ok()?.to_le_bytes().into(),
        SampleType::U16 => text.parse::<u16>().ok()?.to_le_bytes().into(),
        SampleType::I16 => text.parse::<i16>().ok()?.to_le_bytes().into(),
        SampleType::U32 => text.parse::<u32>().ok()?.to_le_bytes().into(),
        SampleType::I32 => text.parse::<i32>().ok()?.to_le_bytes().into(),
        SampleType::U64 => text.parse::<u64>().ok()?.to_le_bytes().into(),
        SampleType::I64 => text.parse::<i64>().ok()?.to_le_bytes().into(),
        SampleType::F16 => return None,
        SampleType::F32 => text.parse::<f32>().ok()?.to_le_bytes().into(),
        SampleType::F64 => text.parse::<f64>().ok()?.to_le_bytes().into(),
    })
}

impl<R: BufRead> Read for Ascii<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut filled = 0;
        while filled < buffer.len() {
            if self.given == self.sample.len() {
                let Some(text) = self.number()? else { break };
                let sample = parse(&text, self.sample_type);
                self.sample = sample.ok_or_else(|| self.invalid(&text))?;
                self.given = 0;
            }
            let rest = self.sample.get(self.given..).unwrap_or_default();
            let count = copy(rest, buffer.get_mut(filled..).unwrap_or_default());
            filled += count;
            self.given += count;
        }
        Ok(filled)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn base64(text: &str, capacity: usize) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let reader = Base64::new(BufReader::with_capacity(capacity, text.as_bytes()));
        BufReader::with_capacity(16, reader).read_to_end(&mut bytes)?;
        Ok(bytes)
    }

    #[test]
    fn base64_is_decoded_up_to_the_next_tag() {
        for capacity in 1..9 {
            assert_eq!(base64("", capacity).unwrap(), b"");
            assert_eq!(base64(" TWFu\n TWE= TQ==TWFu <x>TWFu", capacity).unwrap(), b"ManMaMMan");
            assert_eq!(base64("+/8A", capacity).unwrap(), [0xfb, 0xff, 0x00]);
        }
        let long = "TWFu".repeat(5000);
        assert_eq!(base64(&long, 64).unwrap(), b"Man".repeat(5000));
        for wrong in ["TW!u", "=AAA", "T=AA", "TW=u", "TWFu\u{e9}"] {
            assert!(base64(wrong, 8).is_err(), "{wrong}");
        }
    }

    #[test]
    fn numbers_are_parsed_up_to_the_next_tag() {
        let read = |text: &str, ty| {
            let mut bytes = Vec::new();
            Ascii::new(text.as_bytes(), ty).read_to_end(&mut bytes).map(|_| bytes)
        };
        assert_eq!(read("\n 1 -2\t300<4", SampleType::I16).unwrap(), [1, 0, 254, 255, 44, 1]);
        assert_eq!(read("1.5e0", SampleType::F32).unwrap(), 1.5f32.to_le_bytes());
        for (wrong, ty) in
            [("256", SampleType::U8), ("x", SampleType::F64), ("1.5", SampleType::I32)]
        {
            assert!(read(wrong, ty).is_err(), "{wrong}");
        }
        assert!(read(&"1".repeat(500), SampleType::F64).is_err());
    }
}
