//! MATLAB's files up to version 7 (level 5 MAT-files): arrays of numbers; structures and cells are passed over.

use super::array_table::Array;
use super::element::{Element, ElementKind};
use super::rows::Order;
use super::section::{Section, SectionPacking, SectionReader};
use crate::FormatError;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// First bytes of such a file.
pub(crate) const MAT5: &[u8] = b"MATLAB 5.0 MAT-file";
/// Bytes of the file's header.
const HEADER: u64 = 128;
/// Types of elements.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Classes of arrays whose entries are numbers: double to uint64.
const NUMBERS: std::ops::RangeInclusive<u8> = 6..=15;
/// Bytes of a name or of sizes at most.
const LONGEST: usize = 1 << 12;

/// The arrays of numbers in a file.
///
/// # Errors
/// It cannot be read or is damaged.
pub(crate) fn read(path: &Path) -> Result<Vec<Array>, FormatError> {
    let unreadable = |source| FormatError::reading(path, source);
    let damaged = |what: String| FormatError::Damaged { path: path.into(), format: "MAT-file", what };
    let mut file = File::open(path).map_err(unreadable)?;
    let length = file.metadata().map_err(unreadable)?.len();
    let mut header = [0; HEADER as usize];
    file.read_exact(&mut header).map_err(|_| damaged("it ends inside its header".into()))?;
    let big_endian = match &header[126..] {
        b"IM" => false,
        b"MI" => true,
        _ => return Err(damaged("its header does not say its byte order".into())),
    };
    let mut found = Vec::new();
    let mut at = HEADER;
    while at < length {
        let mut tag = [0; 8];
        file.seek(SeekFrom::Start(at)).map_err(unreadable)?;
        file.read_exact(&mut tag).map_err(|_| damaged("it ends inside a tag".into()))?;
        let number = |at: usize| u32_of(&tag[at..at + 4], big_endian);
        let (kind, bytes) = (number(0), u64::from(number(4)));
        if at + 8 + bytes > length {
            return Err(damaged("it ends inside an array".into()));
        }
        let section = Section {
            path: path.into(),
            offset: at + 8,
            length: bytes,
            packing: if kind == COMPRESSED { SectionPacking::Zlib } else { SectionPacking::Stored },
            skip: 0,
            crc: None,
        };
        if kind == COMPRESSED || kind == MATRIX {
            let array =
                array(section, kind == COMPRESSED, big_endian).map_err(|error| damaged(error.to_string()))?;
            found.extend(array);
        }
        // Arrays that are not packed end at a multiple of 8.
        at += 8 + if kind == COMPRESSED { bytes } else { bytes.next_multiple_of(8) };
    }
    if found.is_empty() {
        return Err(FormatError::Unsupported {
            path: path.into(),
            what: "the MAT-file holds no array of numbers (structures and cells are not looked into)".into(),
            mend: "save t, q and tau as variables of their own: save('log.mat', 't', 'q', 'tau')".into(),
        });
    }
    Ok(found)
}

fn u32_of(bytes: &[u8], big_endian: bool) -> u32 {
    let mut number = [0; 4];
    number.copy_from_slice(bytes);
    if big_endian { u32::from_be_bytes(number) } else { u32::from_le_bytes(number) }
}

/// The bytes of an array's element, read from the beginning, and how many they were.
struct Parts {
    reader: SectionReader,
    passed: u64,
    big_endian: bool,
}

/// A part's type and bytes, and bytes of padding behind them.
struct Part {
    kind: u32,
    bytes: usize,
    padding: usize,
}

impl Parts {
    fn fill(&mut self, buffer: &mut [u8]) -> io::Result<()> {
        self.passed += buffer.len() as u64;
        self.reader.fill(buffer)
    }

    fn tag(&mut self) -> io::Result<Part> {
        let mut first = [0; 4];
        self.fill(&mut first)?;
        let first = u32_of(&first, self.big_endian);
        if first >> 16 != 0 {
            // Small parts have their bytes in the tag.
            let bytes = (first >> 16) as usize;
            return Ok(Part { kind: first & 0xffff, bytes, padding: 4_usize.saturating_sub(bytes) });
        }
        let mut bytes = [0; 4];
        self.fill(&mut bytes)?;
        let bytes = u32_of(&bytes, self.big_endian) as usize;
        Ok(Part { kind: first, bytes, padding: bytes.next_multiple_of(8) - bytes })
    }

    fn short(&mut self) -> io::Result<Vec<u8>> {
        let Part { bytes, padding, .. } = self.tag()?;
        if bytes > LONGEST {
            return Err(wrong("a name or a size is too long"));
        }
        let mut data = vec![0; bytes + padding];
        self.fill(&mut data)?;
        data.truncate(bytes);
        Ok(data)
    }
}

fn wrong(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what.to_owned())
}

/// The array of an element; `None` where it is not one of numbers.
fn array(section: Section, is_packed: bool, big_endian: bool) -> io::Result<Option<Array>> {
    let mut parts = Parts { reader: section.whole()?, passed: 0, big_endian };
    if is_packed && parts.tag()?.kind != MATRIX {
        return Ok(None);
    }
    let flags = parts.short()?;
    if flags.len() < 8 {
        return Err(wrong("an array has no flags"));
    }
    let flags = u32_of(&flags[..4], big_endian);
    let is_complex = flags >> 8 & 8 != 0;
    if is_complex || !NUMBERS.contains(&(flags as u8)) {
        return Ok(None);
    }
    let sizes = parts.short()?;
    let shape: Vec<usize> = sizes.chunks_exact(4).map(|size| u32_of(size, big_endian) as usize).collect();
    let name = String::from_utf8_lossy(&parts.short()?).into_owned();
    let numbers = parts.tag()?;
    let (kind, bytes) = match numbers.kind {
        1 => (ElementKind::Signed, 1),
        2 => (ElementKind::Unsigned, 1),
        3 => (ElementKind::Signed, 2),
        4 => (ElementKind::Unsigned, 2),
        5 => (ElementKind::Signed, 4),
        6 => (ElementKind::Unsigned, 4),
        7 => (ElementKind::Float, 4),
        9 => (ElementKind::Float, 8),
        12 => (ElementKind::Signed, 8),
        13 => (ElementKind::Unsigned, 8),
        other => return Err(wrong(&format!("array `{name}` has numbers of the unknown type {other}"))),
    };
    let entries = shape.iter().fold(1_usize, |all, &size| all.saturating_mul(size));
    if entries.saturating_mul(bytes) != numbers.bytes {
        return Err(wrong(&format!("array `{name}` has {} bytes, which is not its size", numbers.bytes)));
    }
    let element = Element { kind, bytes, big_endian };
    let section = Section { skip: parts.passed, ..section };
    Ok(Some(Array { name, shape, element, order: Order::FirstFastest, section, record: None }))
}
