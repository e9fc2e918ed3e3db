//! NumPy's files: arrays (npy), and zip archives of them (npz).
//!
//! The form of an array is that of NumPy Enhancement Proposal 1: `\x93NUMPY`, version, length of the header,
//! a header that is a Python dictionary, the numbers. [`Array::from_npy`] reads it.

pub use phiw_log_formats::NumberArray as Array;

use std::io::{Cursor, Read, Write};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

const MAGIC: &[u8] = b"\x93NUMPY";

/// An archive of arrays that is read.
pub struct Npz<'a> {
    archive: ZipArchive<Cursor<&'a [u8]>>,
    /// Bytes that an array may have.
    most: u64,
}

impl<'a> Npz<'a> {
    /// An archive that is held in memory, whose arrays have at most `most` bytes each.
    ///
    /// # Errors
    /// It is no whole archive.
    pub fn new(bytes: &'a [u8], most: u64) -> Result<Self, String> {
        let archive = ZipArchive::new(Cursor::new(bytes))
            .map_err(|error| format!("it is no whole npz ({error}); write it again with numpy.savez"))?;
        Ok(Npz { archive, most })
    }

    /// Names of its arrays.
    pub fn names(&self) -> Vec<String> {
        let names = self.archive.file_names().flatten();
        names.filter_map(|name| name.strip_suffix(".npy").map(str::to_owned)).collect()
    }

    /// An array of numbers, if it is there.
    ///
    /// # Errors
    /// It is damaged, too large, or does not hold numbers row by row.
    pub fn array(&mut self, name: &str) -> Result<Option<Array>, String> {
        let file = format!("{name}.npy");
        if !self.archive.file_names().flatten().any(|other| other == file) {
            return Ok(None);
        }
        let wrong = |what: String| format!("array `{name}`: {what}");
        let damaged = |error: &dyn std::fmt::Display| wrong(format!("{error}; the file is damaged"));
        let entry = self.archive.by_name(&file).map_err(|error| damaged(&error))?;
        let mut bytes = Vec::new();
        entry.take(self.most + 1).read_to_end(&mut bytes).map_err(|error| damaged(&error))?;
        if bytes.len() as u64 > self.most {
            return Err(wrong(format!("it has more than {} bytes; cut the recording", self.most)));
        }
        Array::from_npy(&bytes).map(Some).map_err(wrong)
    }
}

/// Writes an archive of arrays, which NumPy reads with `numpy.load`.
#[derive(Default)]
pub struct NpzWriter {
    files: Vec<(String, Vec<u8>)>,
}

impl NpzWriter {
    /// Adds an array of numbers, which has as many as its shape says.
    pub fn numbers(&mut self, name: &str, array: &Array) {
        let mut bytes = header("<f8", &array.shape);
        array.values.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
        self.files.push((name.to_owned(), bytes));
    }

    /// Adds a list of names.
    pub fn names(&mut self, name: &str, names: &[String]) {
        let longest = names.iter().map(|name| name.chars().count()).max().unwrap_or(0).max(1);
        let mut bytes = header(&format!("<U{longest}"), &[names.len()]);
        for name in names {
            let filled = name.chars().map(u32::from).chain(std::iter::repeat(0)).take(longest);
            filled.for_each(|letter| bytes.extend(letter.to_le_bytes()));
        }
        self.files.push((name.to_owned(), bytes));
    }

    /// The archive's bytes.
    ///
    /// # Errors
    /// Memory has no place for them.
    pub fn finish(self) -> std::io::Result<Vec<u8>> {
        let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
        // Stored as numpy.savez does. The time is fixed, so that equal arrays make equal files.
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(zip::DateTime::default());
        for (name, bytes) in self.files {
            writer.start_file(format!("{name}.npy"), options)?;
            writer.write_all(&bytes)?;
        }
        Ok(writer.finish()?.into_inner())
    }
}

/// A header of version 1, padded so that the numbers begin at a multiple of 64 bytes.
fn header(kind: &str, shape: &[usize]) -> Vec<u8> {
    let lengths: String = shape.iter().map(|length| format!("{length}, ")).collect();
    let lengths = if shape.len() > 1 { lengths.trim_end_matches(", ") } else { lengths.trim_end() };
    let mut text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({lengths}), }}");
    let before = MAGIC.len() + 4;
    while !(before + text.len() + 1).is_multiple_of(64) {
        text.push(' ');
    }
    text.push('\n');
    let mut bytes = MAGIC.to_vec();
    bytes.extend([1, 0]);
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn arrays_read_back(rows in 0_usize..5, columns in 1_usize..4, seed in -1e6..1e6) {
            let values = (0..rows * columns).map(|k| seed * (k as f64 + 0.1).sin()).collect();
            let (matrix, number) =
                (Array { shape: vec![rows, columns], values }, Array { shape: vec![], values: vec![seed] });
            let mut writer = NpzWriter::default();
            writer.numbers("matrix", &matrix);
            writer.numbers("number", &number);
            let list = Array { shape: vec![1], values: vec![seed] };
            writer.numbers("list", &list);
            writer.names("names", &["left".to_owned(), "ε".to_owned()]);
            let bytes = writer.finish().unwrap();
            let mut npz = Npz::new(&bytes, 1 << 20).unwrap();
            prop_assert_eq!(npz.array("matrix").unwrap(), Some(matrix));
            prop_assert_eq!(npz.array("number").unwrap(), Some(number));
            prop_assert_eq!(npz.array("list").unwrap(), Some(list));
            prop_assert_eq!(npz.array("other").unwrap(), None);
            prop_assert!(npz.array("names").unwrap_err().contains("<U4"));
        }
    }

    #[test]
    fn an_archive_that_is_cut_or_spoiled_gives_a_message() {
        let mut writer = NpzWriter::default();
        writer.numbers("poses", &Array { shape: vec![4, 6], values: (0..24).map(f64::from).collect() });
        let bytes = writer.finish().unwrap();
        for length in 0..bytes.len() {
            assert!(Npz::new(&bytes[..length], 1 << 20).is_err(), "cut after {length} bytes it is read");
        }
        let place = bytes.len() / 2;
        let mut spoiled = bytes.clone();
        spoiled[place] ^= 4;
        let read = Npz::new(&spoiled, 1 << 20).and_then(|mut npz| npz.array("poses"));
        assert!(read.is_err(), "{read:?}");
        let most = Npz::new(&bytes, 20).unwrap().array("poses").unwrap_err();
        assert!(most.contains("more than 20 bytes"), "{most}");
    }
}
