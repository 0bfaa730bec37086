//! Where encoded words go: to memory, or to a writer.

use std::io::{BufWriter, Write};
use std::sync::Arc;

use crate::error::{Error, Result};

/// Takes the words of a stream in order.
pub(crate) trait Sink {
    /// Makes sure that `more` bytes can follow, as far as that can be known.
    fn reserve(&mut self, more: u64) -> Result<()>;
    fn write(&mut self, word: [u8; 8]) -> Result<()>;
}

/// Bytes of the pieces of a stream that may turn out shorter than announced: every piece is as long
/// as all before it, within these bounds. The upper one is large enough for allocators to give
/// each piece back to the system when it is freed.
const PIECE_BYTES: [u64; 2] = [1 << 16, 64 << 20];

/// Zeros in a shared slice.
pub(crate) fn zeros(bytes: u64) -> Result<Arc<[u8]>> {
    let length = check_allocation(bytes)?;
    Ok(std::iter::repeat_n(0, length).collect())
}

/// Allocating a shared slice cannot report failure, so this asks first.
fn check_allocation(bytes: u64) -> Result<usize> {
    let length = usize::try_from(bytes).map_err(|_error| Error::OutOfMemory { bytes })?;
    Vec::<u8>::new().try_reserve_exact(length).map_err(|_error| Error::OutOfMemory { bytes })?;
    Ok(length)
}

/// A stream of known length in memory: in one piece, or in pieces that are allocated as the
/// stream grows.
#[derive(Debug)]
pub(crate) struct Memory {
    pieces: Vec<Arc<[u8]>>,
    /// Least and most bytes of a piece; multiples of 8, as is the total.
    bounds: [u64; 2],
    total: u64,
    /// Bytes allocated, and bytes written.
    capacity: u64,
    length: u64,
    /// Where the next word goes: the piece and the place in it.
    next: [usize; 2],
}

impl Memory {
    pub(crate) fn new(total: u64, whole: bool) -> Self {
        let bounds = if whole { [total; 2] } else { PIECE_BYTES };
        Self { pieces: Vec::new(), bounds, total, capacity: 0, length: 0, next: [0; 2] }
    }

    /// The stream. Pieces are freed while they are joined.
    pub(crate) fn into_bytes(mut self) -> Result<Arc<[u8]>> {
        if self.pieces.len() == 1
            && let Some(only) = self.pieces.pop()
        {
            return Ok(only);
        }
        let length = check_allocation(self.length)?;
        let mut rest = self.pieces.into_iter();
        let (mut piece, mut next): (Arc<[u8]>, _) = (Arc::from([]), 0);
        // A range has a length that the standard library trusts, so this allocates once.
        let bytes = (0..length).map(|_| {
            if next == piece.len() {
                (piece, next) = (rest.next().unwrap_or_default(), 0);
            }
            next += 1;
            piece.get(next - 1).copied().unwrap_or(0)
        });
        Ok(bytes.collect())
    }
}

impl Sink for Memory {
    fn reserve(&mut self, more: u64) -> Result<()> {
        while self.capacity < self.total.min(self.length + more) {
            let [least, most] = self.bounds;
            let bytes = self.capacity.clamp(least, most).min(self.total - self.capacity);
            self.pieces.push(zeros(bytes)?);
            self.capacity += bytes;
        }
        Ok(())
    }

    fn write(&mut self, word: [u8; 8]) -> Result<()> {
        self.reserve(8)?;
        let [piece, at] = self.next;
        let current = self.pieces.get_mut(piece).and_then(Arc::get_mut).unwrap_or_default();
        let rest = current.len().saturating_sub(at + 8);
        self.next = if rest == 0 { [piece + 1, 0] } else { [piece, at + 8] };
        let place = current.get_mut(at..at + 8);
        if let Some(place) = place {
            place.copy_from_slice(&word);
        }
        self.length += 8;
        Ok(())
    }
}

/// A stream that is written away.
#[derive(Debug)]
pub(crate) struct Stream<W: Write> {
    writer: BufWriter<W>,
    written: u64,
}

impl<W: Write> Stream<W> {
    pub(crate) fn new(writer: W) -> Self {
        Self { writer: BufWriter::with_capacity(1 << 16, writer), written: 0 }
    }

    /// Flushes, and returns the number of bytes written.
    pub(crate) fn finish(mut self) -> Result<u64> {
        self.writer.flush().map_err(writing)?;
        Ok(self.written)
    }
}

impl<W: Write> Sink for Stream<W> {
    fn reserve(&mut self, _more: u64) -> Result<()> {
        Ok(())
    }

    fn write(&mut self, word: [u8; 8]) -> Result<()> {
        self.written += 8;
        self.writer.write_all(&word).map_err(writing)
    }
}

/// A writer failed.
pub(crate) fn writing(source: std::io::Error) -> Error {
    Error::Io { name: "the file to write".into(), source }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_become_one_stream() {
        for (bounds, total) in
            [([24; 2], 24), ([24; 2], 72), ([8, 16], 72), ([8, 64], 80), ([8, 8], 8), ([64; 2], 72)]
        {
            let mut memory = Memory::new(total, false);
            memory.bounds = bounds;
            let words: Vec<u64> = (0..total / 8).map(|i| 0x0102_0304_0506_0708 * i).collect();
            for word in &words {
                memory.write(word.to_le_bytes()).unwrap();
            }
            assert_eq!(memory.capacity, total);
            let expected: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
            assert_eq!(memory.into_bytes().unwrap()[..], expected, "{bounds:?} {total}");
        }
    }

    #[test]
    fn memory_is_allocated_once_or_as_it_fills() {
        let mut whole = Memory::new(1 << 20, true);
        whole.write([1; 8]).unwrap();
        assert_eq!((whole.pieces.len(), whole.capacity), (1, 1 << 20));
        let address = whole.pieces[0].as_ptr();
        assert_eq!(whole.into_bytes().unwrap().as_ptr(), address, "no copy");

        let mut growing = Memory::new(1 << 50, false);
        growing.reserve(1).unwrap();
        assert_eq!(growing.capacity, PIECE_BYTES[0]);
        let error = Memory::new(1 << 62, true).write([0; 8]).unwrap_err();
        assert!(matches!(error, Error::OutOfMemory { bytes } if bytes == 1 << 62), "{error}");
    }
}
