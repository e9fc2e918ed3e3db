//! What can be wrong with a log.

use crate::MapError;
use phiw_log_formats::FormatError;
use std::io;
use std::path::PathBuf;

/// What is wrong with a log, where, and how to mend it.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The file can't be read, or is no log.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The map of the log's columns is wrong.
    #[error(transparent)]
    Map(#[from] MapError),
    /// The file can't be written.
    #[error("{}: can't be written: {source}", path.display())]
    Unwritable {
        /// The path as it was given.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// The file holds nothing, or a header only.
    #[error("{}: the log is empty; expected a header line such as `t,q.joint_1,tau.joint_1` and rows of numbers", path.display())]
    Empty {
        /// The log.
        path: PathBuf,
    },
    /// The header has no column `t`.
    #[error("{}{header}: no column `t` (time in seconds); {hint}", path.display())]
    NoTimeColumn {
        /// The log.
        path: PathBuf,
        /// Where the columns' names stand; starts with a separator or is empty.
        header: String,
        /// What the header looks like instead.
        hint: String,
    },
    /// Columns that the joints need are missing.
    #[error("{}{header}: no column `{}`{}; {}", path.display(), missing[0], others(missing), nearest_hint(nearest))]
    MissingColumn {
        /// The log.
        path: PathBuf,
        /// Where the columns' names stand; starts with a separator or is empty.
        header: String,
        /// The columns looked for and not found; at least one.
        missing: Vec<String>,
        /// The header's columns nearest in name to the first missing one, best first.
        nearest: Vec<String>,
    },
    /// Two columns have the same name.
    #[error("{}{header}: two columns are named `{column}`; rename or remove one", path.display())]
    DuplicateColumn {
        /// The log.
        path: PathBuf,
        /// Where the columns' names stand; starts with a separator or is empty.
        header: String,
        /// Their name.
        column: String,
    },
    /// A time stamp is earlier than the one before it.
    #[error(
        "{}, {rows_are} {line}, column `t`: time runs backwards, from {previous} s to {stamp} s; sort the rows, or split the file into one log a run",
        path.display()
    )]
    TimeBackwards {
        /// The log.
        path: PathBuf,
        /// What is counted: `line`, `message` or `row`.
        rows_are: &'static str,
        /// Line in the file, counted from 1.
        line: u64,
        /// The last stamp before, in seconds.
        previous: f64,
        /// The stamp, in seconds.
        stamp: f64,
    },
    /// The time stands still.
    #[error("{}, column `t`: it is {stamp} in all {rows} rows; log the time of each row in seconds", path.display())]
    ConstantTime {
        /// The log.
        path: PathBuf,
        /// The stamp \[s\].
        stamp: f64,
        /// Rows of the log.
        rows: u64,
    },
    /// The log is not what it was when it was surveyed.
    #[error("{}: the file changed while it was read; run again when nothing writes to it", path.display())]
    Changed {
        /// The log.
        path: PathBuf,
    },
    /// Every row is a gap.
    #[error("{}: no usable row of {rows}{reasons}", path.display())]
    NoUsableRows {
        /// The log.
        path: PathBuf,
        /// Rows in the file.
        rows: u64,
        /// Why they were skipped, in words; starts with a separator or is empty.
        reasons: String,
    },
    /// No segment is long enough for the filter.
    #[error(
        "{}: no stretch without a gap is long enough: the longest has {longest} samples, \
         a cut-off of {cutoff_hz:.3} Hz needs {needed}; raise the cut-off or record longer",
        path.display()
    )]
    NoLongSegment {
        /// The log.
        path: PathBuf,
        /// Samples of the longest segment.
        longest: usize,
        /// Samples that the filter needs.
        needed: usize,
        /// The lower of the two cut-off frequencies, in Hz.
        cutoff_hz: f64,
    },
    /// A cut-off that the log's sample rate can't carry.
    #[error(
        "{}: a cut-off of {cutoff_hz} Hz does not fit a sample rate of {rate_hz:.1} Hz; choose one above {lowest_hz:.3} and up to {highest_hz:.1} Hz",
        path.display()
    )]
    Cutoff {
        /// The log.
        path: PathBuf,
        /// The cut-off asked for, in Hz.
        cutoff_hz: f64,
        /// The log's sample rate, in Hz.
        rate_hz: f64,
        /// The lowest cut-off that fits, in Hz.
        lowest_hz: f64,
        /// The highest cut-off that fits, in Hz.
        highest_hz: f64,
    },
    /// The columns of a log in memory are not equally long.
    #[error(
        "{}: column `{column}` has {found} values, but `{first}` has {rows}; give each as many",
        path.display()
    )]
    ColumnLength {
        /// The log.
        path: PathBuf,
        /// The column.
        column: String,
        /// Its values.
        found: usize,
        /// The log's first column.
        first: String,
        /// The values of that.
        rows: usize,
    },
    /// Whoever asked for the work wants it no more.
    #[error("interrupted")]
    Interrupted,
    /// The arrays of a [`Recording`](crate::Recording) do not fit each other.
    #[error("recording: `{array}` has {found} values, but {rows} rows of {joints} joints need {expected}", expected = rows * joints)]
    Shape {
        /// Name of the array.
        array: &'static str,
        /// Rows of the recording.
        rows: usize,
        /// Joints of the recording.
        joints: usize,
        /// Values that the array holds.
        found: usize,
    },
}

fn others(missing: &[String]) -> String {
    match missing.len() {
        0 | 1 => String::new(),
        2 => format!(" (nor `{}`)", missing[1]),
        n => format!(" (nor {} others)", n - 1),
    }
}

fn nearest_hint(nearest: &[String]) -> String {
    match nearest {
        [] => "add it, or hold the joint".into(),
        names => {
            let quoted: Vec<_> = names.iter().map(|name| format!("`{name}`")).collect();
            format!("nearest: {}; rename the column, or hold the joint", quoted.join(", "))
        }
    }
}
