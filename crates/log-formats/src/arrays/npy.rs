//! The format of NumPy's arrays.

use super::array_table::Array;
use super::element::{Element, ElementKind};
use super::rows::Order;
use super::section::{Section, SectionPacking};
use crate::FormatError;
use phiw_limits::Limits;
use std::io::{self, Read};
use std::path::Path;

/// Bytes of a header at most; NumPy itself refuses more.
const LARGEST_HEADER: usize = 1 << 16;

/// The array of a `.npy` file: its fields where it is structured.
pub(crate) fn read_file(path: &Path) -> Result<Vec<Array>, FormatError> {
    let length = path.metadata().map_err(|source| FormatError::reading(path, source))?.len();
    let section =
        Section { path: path.into(), offset: 0, length, packing: SectionPacking::Stored, skip: 0, crc: None };
    let damaged = |what: String| FormatError::Damaged { path: path.into(), format: "npy", what };
    arrays(String::new(), section).map_err(|error| damaged(error.to_string()))
}

/// The arrays of a section that begins with NumPy's header; one, or one for each field.
///
/// # Errors
/// It is no such section.
pub(crate) fn arrays(name: String, section: Section) -> io::Result<Vec<Array>> {
    let (text, skip) = header(&mut section.whole()?)?;
    let Header { shape, order, description } = Header::of_text(&text).ok_or_else(wrong_header)?;
    let section = Section { skip, ..section };
    if let Some((code, _)) = quoted(description) {
        // Texts and objects are no numbers: such an array is not there.
        let element = element(code);
        return Ok(element
            .map(|element| Array { name, shape, element, order, section, record: None })
            .into_iter()
            .collect());
    }
    let fields = fields(description).ok_or_else(wrong_header)?;
    let record = fields.iter().fold(0, |all: usize, (_, _, bytes)| all.saturating_add(*bytes));
    if record > Limits::default().log_line_bytes || shape.len() > 1 {
        return Err(wrong_header());
    }
    let mut within = 0;
    let mut found = Vec::new();
    for (field, element, bytes) in fields {
        if let Some(element) = element {
            let width = bytes / element.bytes;
            let shape = if width == 1 { shape.clone() } else { [shape.as_slice(), &[width]].concat() };
            let name = if name.is_empty() { field } else { format!("{name}.{field}") };
            found.push(Array {
                name,
                shape,
                element,
                order,
                section: section.clone(),
                record: Some((record, within)),
            });
        }
        within += bytes;
    }
    Ok(found)
}

/// An array of numbers in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct NumberArray {
    /// Its lengths; none of a single number.
    pub shape: Vec<usize>,
    /// Its numbers, row by row.
    pub values: Vec<f64>,
}

impl NumberArray {
    /// The array of a `.npy` file: floats or integers of any width and order of bytes.
    ///
    /// # Errors
    /// In words: it is cut short, or does not hold numbers row by row.
    pub fn from_npy(bytes: &[u8]) -> Result<Self, String> {
        let in_words = |error: io::Error| match error.kind() {
            io::ErrorKind::UnexpectedEof => "it is cut short".to_owned(),
            _ => error.to_string(),
        };
        let mut rest = bytes;
        let (text, _) = header(&mut rest).map_err(in_words)?;
        let header = Header::of_text(&text).ok_or_else(|| in_words(wrong_header()))?;
        let Header { shape, order, description } = header;
        let (code, _) = quoted(description).ok_or("it is of records, not of numbers")?;
        let element = element(code).ok_or_else(|| format!("it holds `{code}`, not numbers"))?;
        if order == Order::FirstFastest {
            return Err("it is stored by columns; save numpy.ascontiguousarray of it".to_owned());
        }
        let count = shape.iter().try_fold(element.bytes, |count, &length| count.checked_mul(length));
        if count != Some(rest.len()) {
            let numbers = rest.len() / element.bytes;
            return Err(format!("it should have {shape:?} numbers, but has {numbers}"));
        }
        let values = rest.chunks_exact(element.bytes).map(|bytes| element.value(bytes)).collect();
        Ok(NumberArray { shape, values })
    }
}

/// What a header says.
struct Header<'a> {
    shape: Vec<usize>,
    order: Order,
    /// The type of its numbers, or of its records.
    description: &'a str,
}

impl<'a> Header<'a> {
    fn of_text(text: &'a str) -> Option<Self> {
        let is_fortran = field(text, "fortran_order")?.starts_with("True");
        let order = if is_fortran { Order::FirstFastest } else { Order::LastFastest };
        Some(Header { shape: shape(field(text, "shape")?)?, order, description: field(text, "descr")? })
    }
}

fn wrong_header() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, "its header is not one of NumPy")
}

/// The header's text, and where the numbers begin.
fn header(reader: &mut dyn Read) -> io::Result<(String, u64)> {
    let wrong = |what: &str| io::Error::new(io::ErrorKind::InvalidData, what.to_owned());
    let mut start = [0; 8];
    reader.read_exact(&mut start)?;
    if !start.starts_with(super::NPY) {
        return Err(wrong("it is no array of NumPy"));
    }
    let (length, before) = match start[6] {
        1 => {
            let mut length = [0; 2];
            reader.read_exact(&mut length)?;
            (usize::from(u16::from_le_bytes(length)), 10)
        }
        2 | 3 => {
            let mut length = [0; 4];
            reader.read_exact(&mut length)?;
            (u32::from_le_bytes(length) as usize, 12)
        }
        _ => return Err(wrong("it is an array of a NumPy newer than is known")),
    };
    if length > LARGEST_HEADER {
        return Err(wrong("its header is too long"));
    }
    let mut text = vec![0; length];
    reader.read_exact(&mut text)?;
    let text = String::from_utf8(text).map_err(|_| wrong("its header is no text"))?;
    Ok((text, (before + length) as u64))
}

/// What follows `'name':` in a dictionary of Python.
fn field<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let at = text.find(&format!("'{name}'"))?;
    Some(text[at + name.len() + 2..].trim_start().strip_prefix(':')?.trim_start())
}

/// `(3, 4)`, `(3,)` or `()`.
fn shape(text: &str) -> Option<Vec<usize>> {
    let inside = text.strip_prefix('(')?.split_once(')')?.0;
    inside.split(',').map(str::trim).filter(|part| !part.is_empty()).map(|part| part.parse().ok()).collect()
}

/// The type that a code such as `<f8` stands for; `None` where it is no number.
fn element(code: &str) -> Option<Element> {
    let (big_endian, code) = match code.as_bytes().first()? {
        b'>' => (true, &code[1..]),
        b'<' | b'=' | b'|' => (false, &code[1..]),
        _ => (false, code),
    };
    let kind = match code.as_bytes().first()? {
        b'f' => ElementKind::Float,
        b'i' => ElementKind::Signed,
        b'u' | b'b' => ElementKind::Unsigned,
        _ => return None,
    };
    let bytes = code[1..].parse().ok()?;
    let fits = match kind {
        ElementKind::Float => [2, 4, 8].contains(&bytes),
        _ => [1, 2, 4, 8].contains(&bytes),
    };
    fits.then_some(Element { kind, bytes, big_endian })
}

/// `[('t', '<f8'), ('q', '<f8', (6,)), …]`: names, types and sizes.
fn fields(text: &str) -> Option<Vec<(String, Option<Element>, usize)>> {
    let mut rest = text.strip_prefix('[')?.trim_start();
    let mut fields = Vec::new();
    while let Some(entry) = rest.strip_prefix('(') {
        let (name, after) = quoted(entry)?;
        let (code, after) = quoted(after.trim_start_matches([',', ' ']))?;
        let after = after.trim_start_matches([',', ' ']);
        let (count, after) = match after.starts_with('(') {
            true => {
                let (inside, after) = after.split_once(')')?;
                (shape(&format!("{inside})"))?.iter().product(), after)
            }
            false => (1, after),
        };
        let element = element(code);
        let bytes = match element {
            Some(element) => element.bytes,
            None => bytes_of_other(code)?,
        };
        fields.push((name.to_owned(), element, usize::checked_mul(bytes, count).filter(|&bytes| bytes > 0)?));
        rest = after.trim_start_matches(',').trim_start().strip_prefix(')')?.trim_start_matches([',', ' ']);
    }
    rest.starts_with(']').then_some(fields)
}

fn quoted(text: &str) -> Option<(&str, &str)> {
    let quote = text.chars().next().filter(|&c| c == '\'' || c == '"')?;
    text[1..].split_once(quote)
}

/// Bytes of a type that is no number: a text or a time.
fn bytes_of_other(code: &str) -> Option<usize> {
    let code = code.trim_start_matches(['<', '>', '|', '=']);
    let digits: String = code.chars().skip(1).take_while(char::is_ascii_digit).collect();
    let count: usize = digits.parse().ok()?;
    match code.chars().next()? {
        'U' => count.checked_mul(4),
        'S' | 'V' | 'M' | 'm' | 'c' | 'a' => Some(count),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of `shape` `code`s.
    fn npy(code: &str, order: &str, shape: &str, data: &[u8]) -> Vec<u8> {
        let text = format!("{{'descr': '{code}', 'fortran_order': {order}, 'shape': {shape}, }}\n");
        let length = (text.len() as u16).to_le_bytes();
        [super::super::NPY, &[1, 0], &length, text.as_bytes(), data].concat()
    }

    #[test]
    fn arrays_in_memory_are_read_or_refused_in_words() {
        let data = [1.5f32.to_le_bytes(), (-2.0f32).to_le_bytes()].concat();
        let read = NumberArray::from_npy(&npy("<f4", "False", "(1, 2)", &data)).unwrap();
        assert_eq!(read, NumberArray { shape: vec![1, 2], values: vec![1.5, -2.0] });
        let read = NumberArray::from_npy(&npy(">f8", "False", "()", &0.25f64.to_be_bytes())).unwrap();
        assert_eq!(read, NumberArray { shape: vec![], values: vec![0.25] });
        let refused = |bytes: &[u8], said: &str| {
            let what = NumberArray::from_npy(bytes).unwrap_err();
            assert!(what.contains(said), "{what}");
        };
        refused(&npy("<f4", "True", "(1, 2)", &data), "numpy.ascontiguousarray");
        refused(&npy("<f4", "False", "(3,)", &data), "should have [3] numbers, but has 2");
        refused(&npy("<f4", "False", "(2,)", &data[..7]), "but has 1");
        refused(&npy("<U1", "False", "(2,)", &data), "`<U1`, not numbers");
        refused(&npy("<f4", "False", "(2,)", &data)[..20], "cut short");
        refused(b"PK\x03\x04 and more", "no array of NumPy");
    }
}
