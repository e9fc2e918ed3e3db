//! The bytes of a text, unpacked where they are packed, hashed as they pass.

use crate::FormatError;
use phiw_limits::Limits;
use std::cell::RefCell;
use std::fs::File;
use std::hash::{DefaultHasher, Hasher};
use std::io::{self, BufReader, Read, Seek};
use std::path::Path;
use std::rc::Rc;

/// How a text is packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Packing {
    None,
    Gzip,
    Zstd,
}

impl Packing {
    /// Its name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Packing::None => "text",
            Packing::Gzip => "gzip",
            Packing::Zstd => "zstd",
        }
    }

    /// What an error that was met while reading means.
    pub fn error(self, path: &Path, source: io::Error) -> FormatError {
        match self {
            Packing::None => FormatError::reading(path, source),
            // What is wrong with the text itself has no kind.
            _ if source.kind() == io::ErrorKind::Other && source.to_string().starts_with("line ") => {
                FormatError::reading(path, source)
            }
            _ => FormatError::unpacking(path, self.name(), source),
        }
    }
}

/// What is known of the bytes that have passed.
#[derive(Default)]
pub(crate) struct Passed {
    hasher: DefaultHasher,
    /// The latest byte of the text.
    last: Option<u8>,
    /// Bytes of the file, packed as it is.
    of_file: u64,
}

/// The same, shared with who reads.
pub(crate) type SharedPassed = Rc<RefCell<Passed>>;

impl Passed {
    pub fn hash(&self) -> u64 {
        self.hasher.finish()
    }

    pub fn ends_with_line_feed(&self) -> bool {
        self.last == Some(b'\n')
    }

    pub fn bytes_of_file(&self) -> u64 {
        self.of_file
    }
}

/// A text whose lines are as long as a log's can be.
pub(crate) struct TextStream {
    bytes: Box<dyn Read>,
    passed: SharedPassed,
    /// Which line the next byte is on, and how many bytes of it have passed.
    line: u64,
    line_bytes: usize,
}

impl TextStream {
    /// The text of a file that is at its beginning.
    pub fn new(file: File, packing: Packing) -> io::Result<Self> {
        let passed = SharedPassed::default();
        let counted = Counted { file, passed: passed.clone() };
        let bytes: Box<dyn Read> = match packing {
            Packing::None => Box::new(counted),
            Packing::Gzip => Box::new(flate2::bufread::MultiGzDecoder::new(BufReader::new(counted))),
            #[cfg(not(feature = "zstd"))]
            Packing::Zstd => return Err(io::ErrorKind::Unsupported.into()),
            #[cfg(feature = "zstd")]
            Packing::Zstd => {
                let mut decoder = zstd::stream::read::Decoder::new(counted)?;
                decoder.window_log_max(LARGEST_WINDOW)?;
                Box::new(decoder)
            }
        };
        Ok(TextStream { bytes, passed, line: 1, line_bytes: 0 })
    }

    pub fn passed(&self) -> SharedPassed {
        self.passed.clone()
    }
}

#[cfg(feature = "zstd")]
/// log₂ of the bytes that zstd may look back on; what `zstd` itself unpacks without being asked to.
const LARGEST_WINDOW: u32 = 27;

impl Read for TextStream {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.bytes.read(buffer)?;
        let buffer = &buffer[..count];
        let mut passed = self.passed.borrow_mut();
        passed.hasher.write(buffer);
        passed.last = buffer.last().copied().or(passed.last);
        let most = Limits::default().log_line_bytes;
        for part in buffer.split_inclusive(|&byte| byte == b'\n') {
            self.line_bytes += part.len();
            // The CSV reader holds a whole line in memory, so its length is limited here.
            if self.line_bytes > most {
                let line = self.line;
                return Err(io::Error::other(format!(
                    "line {line} has more than {most} bytes; this is no log"
                )));
            }
            if part.ends_with(b"\n") {
                (self.line, self.line_bytes) = (self.line + 1, 0);
            }
        }
        Ok(count)
    }
}

/// A file whose bytes are counted.
struct Counted {
    file: File,
    passed: SharedPassed,
}

impl Read for Counted {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(buffer)?;
        self.passed.borrow_mut().of_file += count as u64;
        Ok(count)
    }
}

/// The first bytes of a text, unpacked; the file is at its beginning before and after.
pub(crate) fn head(path: &Path, file: &mut File, packing: Packing) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    TextStream::new(File::open(path)?, packing)?.take(4096).read_to_end(&mut head)?;
    file.rewind()?;
    Ok(head)
}
