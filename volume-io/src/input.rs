//! The bytes of a file, read once from front to back.

use std::io::{self, BufRead, Cursor, Read};
use std::path::PathBuf;
use std::sync::Arc;

use crate::error::{Error, Result};

/// A file or what a decoder makes of it.
pub(crate) struct Input<'a> {
    /// For messages.
    pub(crate) name: String,
    /// Name of the file without folder and `.gz`, whose parts may say what it holds.
    pub(crate) file_name: String,
    /// Where the other files of a set lie, if they may be opened.
    #[cfg_attr(
        all(target_arch = "wasm32", target_os = "unknown"),
        allow(dead_code, reason = "there are no files")
    )]
    pub(crate) folder: Option<PathBuf>,
    /// Bytes in all, where that is known.
    pub(crate) length: Option<u64>,
    /// Bytes read so far.
    pub(crate) position: u64,
    reader: Box<dyn BufRead + 'a>,
}

impl<'a> Input<'a> {
    pub(crate) fn new(name: &str, length: Option<u64>, reader: impl BufRead + 'a) -> Self {
        let file_name = name.rsplit(['/', '\\']).next().unwrap_or(name);
        let unzipped = file_name.len().saturating_sub(3);
        let file_name = match file_name.get(unzipped..) {
            Some(ending) if ending.eq_ignore_ascii_case(".gz") => &file_name[..unzipped],
            _ => file_name,
        };
        Self {
            name: name.into(),
            file_name: file_name.into(),
            folder: None,
            length,
            position: 0,
            reader: Box::new(reader),
        }
    }

    pub(crate) fn from_bytes(name: &str, bytes: &'a [u8]) -> Self {
        Self::new(name, Some(bytes.len() as u64), bytes)
    }

    /// A file of the file system; its length is known if it is a regular file.
    #[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
    pub(crate) fn open(path: &std::path::Path) -> Result<Self> {
        let name = path.display().to_string();
        let access = |source| Error::Io { name: name.clone(), source };
        let file = std::fs::File::open(path).map_err(access)?;
        let metadata = file.metadata().map_err(access)?;
        let length = (metadata.is_file() && metadata.len() > 0).then_some(metadata.len());
        let mut input = Self::new(&name, length, io::BufReader::with_capacity(1 << 16, file));
        input.folder = Some(path.parent().map(PathBuf::from).unwrap_or_default());
        Ok(input)
    }

    /// Opens another file of the same set. Only files beside or below this one: a header must not
    /// name just any file of the system.
    #[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
    pub(crate) fn open_other<'b>(&self, name: &str) -> Result<Input<'b>> {
        use std::path::{Component, Path};
        let inside = |c| matches!(c, Component::Normal(_) | Component::CurDir);
        match &self.folder {
            Some(folder) if Path::new(name).components().all(inside) => {
                Input::open(&folder.join(name))
            }
            _ => Err(self.other_refused(name)),
        }
    }

    #[cfg(all(target_arch = "wasm32", target_os = "unknown"))]
    pub(crate) fn open_other<'b>(&self, name: &str) -> Result<Input<'b>> {
        Err(self.other_refused(name))
    }

    fn other_refused(&self, file: &str) -> Error {
        Error::SecondFile { name: self.name.clone(), file: file.into() }
    }

    /// What `decode` makes of the rest of this file.
    #[cfg(any(feature = "gzip", feature = "vti"))]
    pub(crate) fn decoded<R: BufRead + 'a>(
        self,
        what: &str,
        length: Option<u64>,
        decode: impl FnOnce(Self) -> R,
    ) -> Self {
        let name =
            if what.is_empty() { self.name.clone() } else { format!("{} ({what})", self.name) };
        let (file_name, folder) = (self.file_name.clone(), self.folder.clone());
        Self { name, file_name, folder, length, position: 0, reader: Box::new(decode(self)) }
    }

    /// Up to `count` bytes from the current position, which stays where it is.
    pub(crate) fn peek(&mut self, count: u64) -> Result<Vec<u8>> {
        let mut start = Vec::new();
        let read = self.reader.by_ref().take(count).read_to_end(&mut start);
        read.map_err(|source| self.error(source))?;
        let rest = std::mem::replace(&mut self.reader, Box::new(io::empty()));
        self.reader = Box::new(Cursor::new(start.clone()).chain(rest));
        Ok(start)
    }

    /// Reads `count` bytes into `bytes`, whose memory grows with what is there.
    pub(crate) fn fill(&mut self, bytes: &mut Vec<u8>, count: u64) -> Result<()> {
        bytes.clear();
        if self.rest().is_some_and(|rest| rest >= count) {
            let exact = usize::try_from(count).unwrap_or(usize::MAX);
            bytes.try_reserve_exact(exact).map_err(|_e| Error::OutOfMemory { bytes: count })?;
        }
        let expected = self.position.saturating_add(count);
        let read = self.by_ref().take(count).read_to_end(bytes);
        read.map_err(|source| self.error(source))?;
        self.check_position(expected)
    }

    /// The next `count` bytes.
    pub(crate) fn take_bytes(&mut self, count: u64) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.fill(&mut bytes, count)?;
        Ok(bytes)
    }

    pub(crate) fn skip_to(&mut self, position: u64) -> Result<()> {
        let wanted = position.saturating_sub(self.position);
        let skipped = io::copy(&mut self.by_ref().take(wanted), &mut io::sink());
        skipped.map_err(|source| self.error(source))?;
        self.check_position(position)
    }

    /// The whole file, read into its final place where its length is known.
    pub(crate) fn load(mut self, limit: u64) -> Result<Arc<[u8]>> {
        let Some(rest) = self.rest() else {
            let mut bytes = Vec::new();
            let read = self.by_ref().take(limit).read_to_end(&mut bytes);
            read.map_err(|source| self.error(source))?;
            return Ok(bytes.into());
        };
        let mut bytes = crate::sink::zeros(rest)?;
        if let Some(buffer) = Arc::get_mut(&mut bytes) {
            self.read_exact(buffer).map_err(|source| self.error(source))?;
        }
        Ok(bytes)
    }

    /// Bytes that follow, where that is known.
    pub(crate) fn rest(&self) -> Option<u64> {
        self.length.map(|length| length.saturating_sub(self.position))
    }

    /// Bytes in all. Where that is not known yet, reads to the end, which also verifies what
    /// stands there.
    pub(crate) fn length(&mut self) -> Result<u64> {
        if let Some(length) = self.length {
            return Ok(length);
        }
        let read = io::copy(&mut self.by_ref(), &mut io::sink());
        read.map_err(|source| self.error(source))?;
        Ok(self.position)
    }

    /// Fails if the file is known to end before `expected`.
    pub(crate) fn check_length(&self, expected: u64) -> Result<()> {
        match self.length {
            Some(found) if found < expected => Err(Error::TooShort { expected, found }),
            _ => Ok(()),
        }
    }

    fn check_position(&self, expected: u64) -> Result<()> {
        if self.position < expected {
            return Err(Error::TooShort { expected, found: self.position });
        }
        Ok(())
    }

    /// What a reader reported: its own typed error, or one of the system's.
    pub(crate) fn error(&self, source: io::Error) -> Error {
        match source.downcast::<Error>() {
            Ok(typed) => typed,
            Err(source) => Error::Io { name: self.name.clone(), source },
        }
    }
}

impl Read for Input<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.reader.read(buffer)?;
        self.position += count as u64;
        Ok(count)
    }
}

impl BufRead for Input<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.reader.fill_buf()
    }

    fn consume(&mut self, count: usize) {
        self.position += count as u64;
        self.reader.consume(count);
    }
}
