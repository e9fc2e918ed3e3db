//! A long log is decoded once: what comes again is read as plain numbers.

use crate::FormatError;
use crate::open::{OpenOptions, open};
use crate::table::{Column, Step, Table};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// Bytes of a number, and of a row's place.
const WORD: usize = size_of::<u64>();
/// Bytes that are read at a time.
const CHUNK_BYTES: usize = 1 << 18;

/// A log that is read several times, whose text or messages take longer to decode than to read.
///
/// The first reading that comes to the log's end leaves its numbers in a temporary file without a name, which
/// the system removes with the last clone of this. Later readings of the same columns take them from there.
/// Where there is no room for such a file the log is decoded again.
#[derive(Clone, Debug)]
pub struct DecodedOnce {
    least_bytes: u64,
    most_bytes: u64,
    numbers: Arc<OnceLock<Numbers>>,
}

impl Default for DecodedOnce {
    fn default() -> Self {
        DecodedOnce::within(Self::LEAST_BYTES, Self::MOST_BYTES)
    }
}

impl DecodedOnce {
    /// Shorter logs are decoded again: it takes no time.
    pub const LEAST_BYTES: u64 = 16 << 20;
    /// Longer temporary files are given up.
    pub const MOST_BYTES: u64 = 2 << 30;

    /// Of logs of at least `least_bytes`, in temporary files of at most `most_bytes`.
    pub fn within(least_bytes: u64, most_bytes: u64) -> Self {
        DecodedOnce { least_bytes, most_bytes, numbers: Arc::default() }
    }

    /// Whether the numbers are at hand.
    pub fn is_decoded(&self) -> bool {
        self.numbers.get().is_some()
    }

    /// Opens the log at its first row. All calls are of one log.
    ///
    /// # Errors
    /// As of [`open`].
    pub fn open(&self, path: &Path, options: &OpenOptions) -> Result<Box<dyn Table>, FormatError> {
        let table = open(path, options)?;
        let is_long = path.metadata().is_ok_and(|metadata| metadata.len() >= self.least_bytes);
        if !is_long {
            return Ok(table);
        }
        let selected = (0..table.columns().len()).collect();
        let asked = Asked { path: path.into(), topic: options.topic.clone(), selected };
        Ok(Box::new(DecodedOnceTable { of: self.clone(), table, asked, rows: Rows::NotBegun }))
    }
}

/// What numbers are of.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Asked {
    path: PathBuf,
    topic: Option<String>,
    selected: Vec<usize>,
}

/// The rows of a log, each its place and its numbers, eight bytes each.
#[derive(Debug)]
struct Numbers {
    asked: Asked,
    file: File,
    rows: u64,
    /// The place of a last row that is cut short.
    truncated: Option<u64>,
    content_hash: u64,
    notes: Vec<String>,
}

/// The rows of a log that are read for the first time, or come from the numbers of the first.
struct DecodedOnceTable {
    of: DecodedOnce,
    table: Box<dyn Table>,
    asked: Asked,
    rows: Rows,
}

enum Rows {
    NotBegun,
    /// From the log, and no further.
    Decoded,
    /// From the log, and written down.
    WrittenDown(WrittenDown),
    /// From what was written down.
    Again(Again),
}

struct WrittenDown {
    file: BufWriter<File>,
    rows: u64,
    truncated: Option<u64>,
}

struct Again {
    numbers: Arc<OnceLock<Numbers>>,
    /// Rows that were given.
    rows: u64,
    chunk: Vec<u8>,
    /// Where the next row begins in the chunk.
    at: usize,
    truncated_given: bool,
}

impl DecodedOnceTable {
    /// How the rows come, once the columns are chosen.
    fn begun(&self) -> Rows {
        if let Some(numbers) = self.of.numbers.get() {
            return match numbers.asked == self.asked {
                true => Rows::Again(Again {
                    numbers: Arc::clone(&self.of.numbers),
                    rows: 0,
                    chunk: Vec::new(),
                    at: 0,
                    truncated_given: false,
                }),
                false => Rows::Decoded,
            };
        }
        let writer =
            |file| Rows::WrittenDown(WrittenDown { file: BufWriter::new(file), rows: 0, truncated: None });
        tempfile::tempfile().map_or(Rows::Decoded, writer)
    }

    fn row_bytes(&self) -> usize {
        (1 + self.asked.selected.len()) * WORD
    }
}

impl WrittenDown {
    fn put(&mut self, place: u64, values: &[f64]) -> io::Result<()> {
        self.file.write_all(&place.to_le_bytes())?;
        values.iter().try_for_each(|value| self.file.write_all(&value.to_bits().to_le_bytes()))?;
        self.rows += 1;
        Ok(())
    }
}

impl Again {
    fn next(&mut self, row_bytes: usize, values: &mut [f64]) -> io::Result<Step> {
        let Some(numbers) = self.numbers.get() else { return Ok(Step::End) };
        if self.rows == numbers.rows {
            let truncated = numbers.truncated.filter(|_| !std::mem::replace(&mut self.truncated_given, true));
            return Ok(truncated.map_or(Step::End, |place| Step::Truncated { place }));
        }
        if self.at == self.chunk.len() {
            let rows = ((CHUNK_BYTES / row_bytes).max(1) as u64).min(numbers.rows - self.rows);
            self.chunk.resize(rows as usize * row_bytes, 0);
            read_exact_at(&numbers.file, &mut self.chunk, self.rows * row_bytes as u64)?;
            self.at = 0;
        }
        let words = self.chunk[self.at..self.at + row_bytes].as_chunks::<WORD>().0;
        if let [place, words @ ..] = words {
            values.iter_mut().zip(words).for_each(|(value, word)| *value = f64::from_le_bytes(*word));
            self.at += row_bytes;
            self.rows += 1;
            return Ok(Step::Row { place: u64::from_le_bytes(*place) });
        }
        Ok(Step::End)
    }
}

impl Table for DecodedOnceTable {
    fn columns(&self) -> &[Column] {
        self.table.columns()
    }

    fn select(&mut self, columns: &[usize]) -> Result<(), FormatError> {
        self.asked.selected = columns.to_vec();
        self.table.select(columns)
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Step, FormatError> {
        if matches!(self.rows, Rows::NotBegun) {
            self.rows = self.begun();
        }
        let row_bytes = self.row_bytes();
        if let Rows::Again(again) = &mut self.rows {
            let unreadable = |source| FormatError::reading(&self.asked.path, source);
            return again.next(row_bytes, values).map_err(unreadable);
        }
        let step = self.table.next(values)?;
        let Rows::WrittenDown(mut written) = std::mem::replace(&mut self.rows, Rows::Decoded) else {
            return Ok(step);
        };
        match step {
            Step::Row { place } => {
                let has_room = (written.rows + 1) * row_bytes as u64 <= self.of.most_bytes;
                if has_room && written.put(place, values).is_ok() {
                    self.rows = Rows::WrittenDown(written);
                }
            }
            Step::Truncated { place } => {
                written.truncated = Some(place);
                self.rows = Rows::WrittenDown(written);
            }
            Step::End => {
                let WrittenDown { file, rows, truncated } = written;
                if let Ok(file) = file.into_inner() {
                    let (content_hash, notes) = (self.table.content_hash(), self.table.notes());
                    let asked = self.asked.clone();
                    // Where two readings come to the end, what the first has left stays.
                    let _ =
                        self.of.numbers.set(Numbers { asked, file, rows, truncated, content_hash, notes });
                }
            }
        }
        Ok(step)
    }

    fn progress(&self) -> (u64, u64) {
        match &self.rows {
            Rows::Again(again) => {
                let total = again.numbers.get().map_or(0, |numbers| numbers.rows);
                (again.rows, total)
            }
            _ => self.table.progress(),
        }
    }

    fn content_hash(&self) -> u64 {
        match (&self.rows, self.of.numbers.get()) {
            (Rows::Again(_), Some(numbers)) => numbers.content_hash,
            _ => self.table.content_hash(),
        }
    }

    fn rows_are(&self) -> &'static str {
        self.table.rows_are()
    }

    fn header(&self) -> String {
        self.table.header()
    }

    fn notes(&self) -> Vec<String> {
        match (&self.rows, self.of.numbers.get()) {
            (Rows::Again(_), Some(numbers)) => numbers.notes.clone(),
            _ => self.table.notes(),
        }
    }
}

#[cfg(unix)]
fn read_exact_at(file: &File, bytes: &mut [u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, bytes, offset)
}

#[cfg(windows)]
fn read_exact_at(file: &File, mut bytes: &mut [u8], mut offset: u64) -> io::Result<()> {
    while !bytes.is_empty() {
        let read = std::os::windows::fs::FileExt::seek_read(file, bytes, offset)?;
        if read == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        bytes = &mut bytes[read..];
        offset += read as u64;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::fmt::Write as _;

    /// What a reading gives: its steps, the numbers' bits, and what is said of it at its end.
    type Reading = (Vec<(Step, Vec<u64>)>, u64, Vec<String>);

    fn reading(of: &DecodedOnce, path: &Path, columns: &[usize]) -> Reading {
        let mut table = of.open(path, &OpenOptions::default()).unwrap();
        table.select(columns).unwrap();
        let mut values = vec![0.0; columns.len()];
        let mut steps = Vec::new();
        loop {
            values.fill(0.0);
            let step = table.next(&mut values).unwrap();
            steps.push((step, values.iter().map(|value| value.to_bits()).collect()));
            if step == Step::End {
                return (steps, table.content_hash(), table.notes());
            }
        }
    }

    fn log(rows: &[Vec<Option<f64>>], columns: usize, is_cut: bool) -> tempfile::NamedTempFile {
        let mut text = (0..columns).map(|column| format!("c{column}")).collect::<Vec<_>>().join(",") + "\n";
        for row in rows {
            let cell = |cell: &Option<f64>| cell.map(|value| value.to_string()).unwrap_or_default();
            writeln!(text, "{}", row.iter().map(cell).collect::<Vec<_>>().join(",")).unwrap();
        }
        if is_cut {
            text.push_str("1.2");
        }
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(text.as_bytes()).unwrap();
        file
    }

    proptest! {
        /// Numbers that come again are those of the log, to the last bit; so are the columns that were not
        /// asked for at first.
        #[test]
        fn what_comes_again_is_what_was_decoded(
            rows in prop::collection::vec(prop::collection::vec(prop::option::of(any::<f64>()), 4), 1..300),
            is_cut in any::<bool>(),
            chosen in prop::sample::subsequence(vec![0, 1, 2, 3], 1..=4),
        ) {
            let file = log(&rows, 4, is_cut);
            let never = DecodedOnce::within(u64::MAX, u64::MAX);
            let once = DecodedOnce::within(0, u64::MAX);
            let expected = reading(&never, file.path(), &chosen);
            prop_assert!(!never.is_decoded());
            for _ in 0..3 {
                prop_assert_eq!(&reading(&once, file.path(), &chosen), &expected);
                prop_assert!(once.is_decoded());
            }
            let all = [0, 1, 2, 3];
            prop_assert_eq!(reading(&once, file.path(), &all), reading(&never, file.path(), &all));
        }
    }

    #[test]
    fn a_reading_that_ends_early_or_finds_no_room_leaves_nothing() {
        let file = log(&vec![vec![Some(1.5), None]; 100], 2, false);
        let once = DecodedOnce::within(0, u64::MAX);
        let mut table = once.open(file.path(), &OpenOptions::default()).unwrap();
        table.next(&mut [0.0; 2]).unwrap();
        drop(table);
        assert!(!once.is_decoded());
        let little = DecodedOnce::within(0, 99 * 24);
        let expected = reading(&once, file.path(), &[0, 1]);
        for _ in 0..2 {
            assert_eq!(reading(&little, file.path(), &[0, 1]), expected);
            assert!(!little.is_decoded());
        }
    }

    /// The file is not asked again: what stands in its place would be another log.
    #[test]
    fn numbers_are_those_of_the_first_reading() {
        let file = log(&vec![vec![Some(1.5), Some(2.5)]; 100], 2, false);
        let once = DecodedOnce::within(0, u64::MAX);
        let first = reading(&once, file.path(), &[0, 1]);
        std::fs::write(file.path(), "c0,c1\n3,4\n").unwrap();
        assert_eq!(reading(&once, file.path(), &[0, 1]), first);
    }
}
