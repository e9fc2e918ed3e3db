//! A long log is decoded once: what comes again is read as plain numbers.

use crate::FormatError;
use crate::open::{OpenOptions, open};
use crate::table::{Column, Step, Table};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, LazyLock, OnceLock};

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
    room: Arc<Room>,
    numbers: Arc<OnceLock<Numbers>>,
}

/// Bytes that temporary files may still take.
#[derive(Debug)]
struct Room(AtomicU64);

/// The room that one file has taken, given back when it goes.
#[derive(Debug)]
struct Taken {
    room: Arc<Room>,
    bytes: u64,
}

impl Taken {
    /// Takes as much more; `false` where there is no room for it.
    fn grow(&mut self, bytes: u64) -> bool {
        let left = |free: u64| free.checked_sub(bytes);
        let is_taken = self.room.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, left).is_ok();
        self.bytes += if is_taken { bytes } else { 0 };
        is_taken
    }
}

impl Drop for Taken {
    fn drop(&mut self) {
        self.room.0.fetch_add(self.bytes, Ordering::Relaxed);
    }
}

impl Default for DecodedOnce {
    fn default() -> Self {
        static ROOM: LazyLock<Arc<Room>> =
            LazyLock::new(|| Arc::new(Room(AtomicU64::new(DecodedOnce::MOST_BYTES))));
        DecodedOnce { room: Arc::clone(&ROOM), ..DecodedOnce::within(Self::LEAST_BYTES, 0) }
    }
}

impl DecodedOnce {
    /// Shorter logs are decoded again: it takes no time.
    pub const LEAST_BYTES: u64 = 16 << 20;
    /// The temporary files of all logs together take no more: what there is no room for is decoded again.
    pub const MOST_BYTES: u64 = 2 << 30;

    /// Of a log of at least `least_bytes`, in a temporary file of at most `most_bytes`, whatever other logs
    /// take.
    pub fn within(least_bytes: u64, most_bytes: u64) -> Self {
        let room = Arc::new(Room(AtomicU64::new(most_bytes)));
        DecodedOnce { least_bytes, room, numbers: Arc::default() }
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
    _taken: Taken,
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
    taken: Taken,
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
        let taken = Taken { room: Arc::clone(&self.of.room), bytes: 0 };
        let writer = |file| {
            Rows::WrittenDown(WrittenDown { file: BufWriter::new(file), taken, rows: 0, truncated: None })
        };
        tempfile::tempfile().map_or(Rows::Decoded, writer)
    }

    fn row_bytes(&self) -> usize {
        (1 + self.asked.selected.len()) * WORD
    }
}

impl WrittenDown {
    fn put(&mut self, place: u64, values: &[f64]) -> io::Result<()> {
        self.file.write_all(&place.to_le_bytes())?;
        values.iter().try_for_each(|value| self.file.write_all(&value.to_le_bytes()))?;
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
            let unreadable = |source: io::Error| {
                let told = format!("its numbers, in a temporary file: {source}");
                FormatError::reading(&self.asked.path, io::Error::new(source.kind(), told))
            };
            return again.next(row_bytes, values).map_err(unreadable);
        }
        let step = self.table.next(values)?;
        let Rows::WrittenDown(mut written) = std::mem::replace(&mut self.rows, Rows::Decoded) else {
            return Ok(step);
        };
        match step {
            Step::Row { place } => {
                if written.taken.grow(row_bytes as u64) && written.put(place, values).is_ok() {
                    self.rows = Rows::WrittenDown(written);
                }
            }
            Step::Truncated { place } => {
                written.truncated = Some(place);
                self.rows = Rows::WrittenDown(written);
            }
            Step::End => {
                let WrittenDown { file, taken, rows, truncated } = written;
                if let Ok(file) = file.into_inner() {
                    // Where two readings come to the end, what the first has left stays.
                    let _ = self.of.numbers.set(Numbers {
                        asked: self.asked.clone(),
                        file,
                        _taken: taken,
                        rows,
                        truncated,
                        content_hash: self.table.content_hash(),
                        notes: self.table.notes(),
                    });
                }
            }
        }
        Ok(step)
    }

    fn progress(&self) -> (u64, u64) {
        let (done, total) = self.table.progress();
        match (&self.rows, self.of.numbers.get()) {
            // In what the log itself counts.
            (Rows::Again(again), Some(numbers)) => {
                let share = again.rows as f64 / numbers.rows.max(1) as f64;
                ((share * total as f64) as u64, total)
            }
            _ => (done, total),
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
        // A hundred rows of a place and two numbers take 2400 bytes.
        let little = DecodedOnce::within(0, 2399);
        let expected = reading(&once, file.path(), &[0, 1]);
        for _ in 0..2 {
            assert_eq!(reading(&little, file.path(), &[0, 1]), expected);
            assert!(!little.is_decoded());
        }
    }

    /// Twenty logs of a session would have filled a disk, or the memory that stands for one.
    #[test]
    fn logs_share_the_room_and_give_it_back() {
        let file = log(&vec![vec![Some(1.5), None]; 100], 2, false);
        let first = DecodedOnce::within(0, 3000);
        let second = DecodedOnce { room: Arc::clone(&first.room), ..DecodedOnce::within(0, 0) };
        let expected = reading(&first, file.path(), &[0, 1]);
        assert!(first.is_decoded());
        assert_eq!(reading(&second, file.path(), &[0, 1]), expected);
        assert!(!second.is_decoded());
        drop(first);
        assert_eq!(reading(&second, file.path(), &[0, 1]), expected);
        assert!(second.is_decoded());
    }

    #[test]
    fn progress_counts_what_the_log_counts() {
        let file = log(&vec![vec![Some(1.5), Some(2.5)]; 100], 2, false);
        let bytes = file.path().metadata().unwrap().len();
        let once = DecodedOnce::within(0, u64::MAX);
        reading(&once, file.path(), &[0, 1]);
        let mut table = once.open(file.path(), &OpenOptions::default()).unwrap();
        (0..50).for_each(|_| assert_ne!(table.next(&mut [0.0; 2]).unwrap(), Step::End));
        assert_eq!(table.progress(), (bytes / 2, bytes));
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
