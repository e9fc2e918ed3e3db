//! Readers of others, some of which panic where a file is damaged.

use crate::FormatError;
use crate::table::{Column, Step, Table};
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Whether a panic on this thread would come from a reader whose panics become errors: a panic hook has
/// nothing to say then.
pub fn is_guarded() -> bool {
    GUARDED.get()
}

/// A table whose reader may panic where the file is damaged.
pub(crate) struct GuardedTable {
    path: PathBuf,
    table: Box<dyn Table>,
}

impl GuardedTable {
    /// # Errors
    /// What `open` finds; a panic is damage.
    pub fn open(
        path: &Path,
        open: impl FnOnce() -> Result<Box<dyn Table>, FormatError>,
    ) -> Result<Box<dyn Table>, FormatError> {
        let table = guarded(path, open)?;
        Ok(Box::new(GuardedTable { path: path.into(), table }))
    }
}

fn guarded<T>(path: &Path, read: impl FnOnce() -> Result<T, FormatError>) -> Result<T, FormatError> {
    let before = GUARDED.replace(true);
    // What is left half done is not used again: an error ends the reading.
    let result = catch_unwind(AssertUnwindSafe(read));
    GUARDED.set(before);
    result.unwrap_or_else(|_| {
        let what = "its parts contradict each other".to_owned();
        Err(FormatError::Damaged { path: path.into(), format: "file", what })
    })
}

impl Table for GuardedTable {
    fn columns(&self) -> &[Column] {
        self.table.columns()
    }

    fn select(&mut self, columns: &[usize]) -> Result<(), FormatError> {
        guarded(&self.path, || self.table.select(columns))
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Step, FormatError> {
        guarded(&self.path, || self.table.next(values))
    }

    fn progress(&self) -> (u64, u64) {
        self.table.progress()
    }

    fn content_hash(&self) -> u64 {
        self.table.content_hash()
    }

    fn rows_are(&self) -> &'static str {
        self.table.rows_are()
    }

    fn header(&self) -> String {
        self.table.header()
    }

    fn notes(&self) -> Vec<String> {
        self.table.notes()
    }
}
