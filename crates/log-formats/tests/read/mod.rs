//! The log of `files/`, read in any format.

// Each test file uses a part of this.
#![allow(dead_code)]

use phiw_log_formats::{FormatError, OpenOptions, Step, open};
use std::path::{Path, PathBuf};

/// A file of the folder.
pub fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/files").join(name)
}

/// Formats without a check sum over all numbers are named apart: a flipped bit there is another number.
pub const CHECKED: [&str; 10] = [
    "packed.csv.gz",
    "arrays.npz",
    "packed.npz",
    "columns.npz",
    "fortran.npz",
    "transposed.npz",
    "matlab5_packed.mat",
    "lz4.mcap",
    "zstd.mcap",
    "ros1_bz2.bag",
];
pub const UNCHECKED: [&str; 9] = [
    "semicolons.csv",
    "packed.csv.zst",
    "records.npy",
    "arrays.h5",
    "packed.h5",
    "matlab73.mat",
    "matlab5.mat",
    "ros1_lz4.bag",
    "ros2_sqlite/ros2_sqlite.db3",
];

/// Bits of all rows `[t, q.a, q.b, tau.a, tau.b]`.
pub fn rows(path: &Path) -> Result<Vec<Vec<u64>>, FormatError> {
    let mut table = open(path, &OpenOptions::default())?;
    let mut selected = Vec::new();
    for (signal, entry) in [("t", None), ("q", Some(0)), ("q", Some(1)), ("tau", Some(0)), ("tau", Some(1))] {
        let names = match entry {
            None => vec![signal.to_owned()],
            Some(entry) => vec![format!("{signal}.{}", ["a", "b"][entry]), format!("{signal}[{entry}]")],
        };
        let found = table.columns().iter().position(|column| {
            names.contains(&column.name)
                || column.signal.as_ref().is_some_and(|signal| names.contains(signal))
        });
        let absent = || FormatError::NoLog { path: path.into(), kind: format!("without {names:?}") };
        selected.push(found.ok_or_else(absent)?);
    }
    table.select(&selected)?;
    let mut row = [0.0; 5];
    let mut rows = Vec::new();
    while let Step::Row { .. } = table.next(&mut row)? {
        rows.push(row.map(f64::to_bits).to_vec());
    }
    Ok(rows)
}
