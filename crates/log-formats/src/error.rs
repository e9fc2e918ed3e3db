//! What can be wrong with a file.

use std::io;
use std::path::{Path, PathBuf};

/// What is wrong with a file, where, and how to mend it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FormatError {
    /// There is no such file.
    #[error("{}: no such file; check the path", path.display())]
    NotFound {
        /// The path as it was given.
        path: PathBuf,
    },
    /// The file exists but can't be read.
    #[error("{}: can't be read: {source}", path.display())]
    Unreadable {
        /// The path as it was given.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// The file is something that no log is.
    #[error("{}: this is no log but {kind}; name a CSV, MCAP, ROS bag, LeRobot folder, npz, HDF5 or MAT file", path.display())]
    NoLog {
        /// The path as it was given.
        path: PathBuf,
        /// What it looks like, and the mend where there is one.
        kind: String,
    },
    /// A folder in which nothing is known.
    #[error(
        "{}: this is a folder, but neither a ROS 2 bag (metadata.yaml) nor a LeRobot dataset (meta/info.json); name a file or such a folder",
        path.display()
    )]
    UnknownFolder {
        /// The path as it was given.
        path: PathBuf,
    },
    /// This build leaves the format out.
    #[error("{}: this is {format}, which this build leaves out; build with the feature `{feature}`", path.display())]
    LeftOut {
        /// The path as it was given.
        path: PathBuf,
        /// The format.
        format: &'static str,
        /// The feature of this crate that reads it.
        feature: &'static str,
    },
    /// The file breaks the rules of its format.
    #[error("{}: the {format} is damaged or cut short ({what}); copy or record it again", path.display())]
    Damaged {
        /// The path as it was given.
        path: PathBuf,
        /// The format.
        format: &'static str,
        /// What breaks which rule.
        what: String,
    },
    /// The format allows it, but it is not read.
    #[error("{}: {what}; {mend}", path.display())]
    Unsupported {
        /// The path as it was given.
        path: PathBuf,
        /// What is not read.
        what: String,
        /// What to do instead.
        mend: String,
    },
    /// More columns than a log has.
    #[error("{}{header}: {columns} columns are more than a log has; check the path", path.display())]
    TooManyColumns {
        /// The path as it was given.
        path: PathBuf,
        /// Where the columns' names stand; starts with a separator or is empty.
        header: String,
        /// Columns in the header.
        columns: usize,
    },
    /// The file holds nothing, or no rows.
    #[error("{}: the log is empty; expected a header line such as `t,q.joint_1,tau.joint_1` and rows of numbers", path.display())]
    Empty {
        /// The log.
        path: PathBuf,
    },
    /// A cell of a used column is not a number.
    #[error("{}, line {line}, column `{column}`: `{cell}` is not a number; leave the cell empty to mark a gap", path.display())]
    NotANumber {
        /// The log.
        path: PathBuf,
        /// Line in the file, counted from 1.
        line: u64,
        /// Name of the column.
        column: String,
        /// The cell's text.
        cell: String,
    },
    /// A row, not the last, has too few or too many cells.
    #[error("{}, line {line}: {found} cells, but the header has {expected}; mend or delete the line", path.display())]
    WrongCellCount {
        /// The log.
        path: PathBuf,
        /// Line in the file, counted from 1.
        line: u64,
        /// Cells in the header.
        expected: usize,
        /// Cells in the row.
        found: usize,
    },
    /// No topic by this name.
    #[error("{}: no topic `{topic}` in it; there are {}", path.display(), listed(topics))]
    NoSuchTopic {
        /// The log.
        path: PathBuf,
        /// What was asked for.
        topic: String,
        /// The topics, with their types.
        topics: Vec<String>,
    },
    /// Several topics could be meant.
    #[error("{}: more than one topic could be the log: {}; name one in a map: topic = \"…\"", path.display(), listed(topics))]
    WhichTopic {
        /// The log.
        path: PathBuf,
        /// The topics, with their types.
        topics: Vec<String>,
    },
    /// A message is out of order by more than is sorted.
    #[error(
        "{}, topic `{topic}`, message {message}: its stamp is earlier than that of a message more than {window} \
         before it; sort the recording by stamp, or split it where the clock was set",
        path.display()
    )]
    OutOfOrder {
        /// The log.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// The message, counted from 1 on its topic.
        message: u64,
        /// Messages that are held back to be sorted.
        window: usize,
    },
    /// The joints that are asked for come in different messages.
    #[error(
        "{}, topic `{topic}`: no message names all joints that are asked for; its messages name {}; \
         hold the joints of the others (--hold), or record one topic for the robot",
        path.display(), listed(sets)
    )]
    SeparateMessages {
        /// The log.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// The sets of joints that messages name.
        sets: Vec<String>,
    },
}

impl FormatError {
    /// An [`io::Error`] met while reading and unpacking `path`.
    pub(crate) fn unpacking(path: &Path, packing: &'static str, source: io::Error) -> Self {
        match source.kind() {
            io::ErrorKind::NotFound => FormatError::NotFound { path: path.into() },
            _ => {
                let what = source.to_string().replace('\n', " ");
                FormatError::Damaged { path: path.into(), format: packing, what }
            }
        }
    }

    /// An [`io::Error`] met while reading `path`.
    pub(crate) fn reading(path: &Path, source: io::Error) -> Self {
        match source.kind() {
            io::ErrorKind::NotFound => FormatError::NotFound { path: path.into() },
            _ => FormatError::Unreadable { path: path.into(), source },
        }
    }
}

/// Names that a message lists at most.
const LISTED: usize = 12;

fn listed(names: &[String]) -> String {
    let more = names.len().saturating_sub(LISTED);
    let mut text = names.iter().take(LISTED).cloned().collect::<Vec<_>>().join(", ");
    if names.is_empty() {
        text.push_str("none");
    }
    if more > 0 {
        text.push_str(&format!(" and {more} more"));
    }
    text
}
