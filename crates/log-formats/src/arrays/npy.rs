//! The format of NumPy's arrays.

use super::array_table::Array;
use super::element::{Element, ElementKind};
use super::rows::Order;
use super::section::{Section, SectionPacking, SectionReader};
use crate::FormatError;
use phiw_limits::Limits;
use std::io;
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
    let mut reader = section.whole()?;
    let (text, skip) = header(&mut reader)?;
    let wrong = || io::Error::new(io::ErrorKind::InvalidData, "its header is not one of NumPy");
    let shape = field(&text, "shape").and_then(shape).ok_or_else(wrong)?;
    let is_fortran = field(&text, "fortran_order").ok_or_else(wrong)?.starts_with("True");
    let description = field(&text, "descr").ok_or_else(wrong)?;
    let section = Section { skip, ..section };
    let order = if is_fortran { Order::FirstFastest } else { Order::LastFastest };
    if let Some(quoted) = description.strip_prefix(['\'', '"']) {
        let code = quoted.split(['\'', '"']).next().unwrap_or_default();
        // Texts and objects are no numbers: such an array is not there.
        let element = element(code);
        return Ok(element
            .map(|element| Array { name, shape, element, order, section, record: None })
            .into_iter()
            .collect());
    }
    let fields = fields(description).ok_or_else(wrong)?;
    let record = fields.iter().fold(0, |all: usize, (_, _, bytes)| all.saturating_add(*bytes));
    if record > Limits::default().log_line_bytes || shape.len() > 1 {
        return Err(wrong());
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

/// The header's text, and where the numbers begin.
fn header(reader: &mut SectionReader) -> io::Result<(String, u64)> {
    let wrong = |what: &str| io::Error::new(io::ErrorKind::InvalidData, what.to_owned());
    let mut start = [0; 8];
    reader.fill(&mut start)?;
    if !start.starts_with(super::NPY) {
        return Err(wrong("it is no array of NumPy"));
    }
    let (length, before) = match start[6] {
        1 => {
            let mut length = [0; 2];
            reader.fill(&mut length)?;
            (usize::from(u16::from_le_bytes(length)), 10)
        }
        2 | 3 => {
            let mut length = [0; 4];
            reader.fill(&mut length)?;
            (u32::from_le_bytes(length) as usize, 12)
        }
        _ => return Err(wrong("it is an array of a NumPy newer than is known")),
    };
    if length > LARGEST_HEADER {
        return Err(wrong("its header is too long"));
    }
    let mut text = vec![0; length];
    reader.fill(&mut text)?;
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
