//! A hash of rows, for formats whose bytes are not read from first to last.

use std::hash::{DefaultHasher, Hasher};

/// Collects a hash of rows.
#[derive(Default)]
pub(crate) struct ContentHash(DefaultHasher);

impl ContentHash {
    /// A row, and what tells it from an equal one.
    pub fn row(&mut self, mark: u64, values: &[f64]) {
        self.0.write_u64(mark);
        for value in values {
            self.0.write_u64(value.to_bits());
        }
    }

    pub fn finish(&self) -> u64 {
        self.0.finish()
    }
}
