//! Recordings of messages: MCAP files and ROS bags.

mod builtin_types;
mod cursor;
mod decode;
mod folder;
#[cfg(feature = "mcap")]
mod mcap_file;
#[cfg(feature = "ros1")]
mod ros1_bag;
#[cfg(feature = "ros2-sqlite")]
mod ros2_sqlite;
mod schema;
mod signals;
mod sorting;
mod topic;
mod topic_table;

pub(crate) use folder::{open_file, open_folder};
pub(crate) use topic::Topic;

use crate::FormatError;

/// First bytes of an MCAP file.
pub(crate) const MCAP: &[u8] = b"\x89MCAP0\r\n";
/// First bytes of an SQLite database.
pub(crate) const SQLITE: &[u8] = b"SQLite format 3\0";

/// First bytes of a ROS 1 bag.
pub(crate) const ROS1_BAG: &[u8] = b"#ROSBAG V2.0\n";

/// A file of messages.
pub(crate) trait MessageFile {
    /// The topics, as the file declares them.
    fn topics(&self) -> Result<Vec<Topic>, FormatError>;

    /// Reads one topic from the beginning.
    fn messages(&self, topic: &str) -> Result<Box<dyn Messages>, FormatError>;
}

/// The messages of one topic, in the order of the file.
pub(crate) trait Messages {
    /// Puts the next message's bytes into `data`, and gives the time at which it was recorded \[ns\]; `None`
    /// at the end.
    fn next(&mut self, data: &mut Vec<u8>) -> Result<Option<i64>, FormatError>;

    /// Bytes done and in total.
    fn progress(&self) -> (u64, u64);
}
