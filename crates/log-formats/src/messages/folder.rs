//! One file of messages, or the folder of a ROS 2 bag with several that follow each other.

use super::topic::{Topic, choose};
use super::topic_table::TopicTable;
use super::{MCAP, MessageFile, Messages, ROS1_BAG, SQLITE};
use crate::open::start_of;
use crate::table::Table;
use crate::{FormatError, OpenOptions};
use std::fs::File;
use std::path::{Path, PathBuf};

/// Opens a file of messages, of which the first bytes are known.
pub(crate) fn open_file(
    path: &Path,
    start: &[u8],
    options: &OpenOptions,
) -> Result<Box<dyn Table>, FormatError> {
    let bag = Bag { parts: vec![reader_of(path, start)?] };
    of_bag(path, &bag, options)
}

/// Opens the folder of a ROS 2 bag.
pub(crate) fn open_folder(path: &Path, options: &OpenOptions) -> Result<Box<dyn Table>, FormatError> {
    let unreadable = |source| FormatError::reading(path, source);
    let mut parts = Vec::new();
    for entry in path.read_dir().map_err(unreadable)? {
        let file = entry.map_err(unreadable)?.path();
        let of_file = |source| FormatError::reading(&file, source);
        if !file.metadata().map_err(of_file)?.is_file() {
            continue;
        }
        let start = start_of(&mut File::open(&file).map_err(of_file)?).map_err(of_file)?;
        if file.extension().is_some_and(|extension| extension == "zstd") {
            return Err(FormatError::Unsupported {
                path: file,
                what: "this file of a bag is packed as a whole".into(),
                mend: "unpack it with `zstd -d`, or record with compression mode `message`".into(),
            });
        }
        if start.starts_with(MCAP) || start.starts_with(SQLITE) {
            parts.push((file, start));
        }
    }
    if parts.is_empty() {
        return Err(FormatError::UnknownFolder { path: path.into() });
    }
    // The files of a bag are numbered: bag_0, bag_1, … bag_10.
    parts.sort_by_cached_key(|(file, _)| number_at_end(file));
    let parts = parts.iter().map(|(file, start)| reader_of(file, start)).collect::<Result<_, _>>()?;
    of_bag(path, &Bag { parts }, options)
}

fn of_bag(path: &Path, bag: &Bag, options: &OpenOptions) -> Result<Box<dyn Table>, FormatError> {
    let topics = bag.topics()?;
    let topic = choose(path, &topics, options)?;
    Ok(Box::new(TopicTable::new(path, topic, bag)?))
}

/// The number that a file's name ends with, and the whole name.
fn number_at_end(path: &Path) -> (u64, PathBuf) {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let digits = stem.len() - stem.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    (stem[stem.len() - digits..].parse().unwrap_or(0), path.to_owned())
}

fn reader_of(path: &Path, start: &[u8]) -> Result<Box<dyn MessageFile>, FormatError> {
    if start.starts_with(MCAP) {
        #[cfg(feature = "mcap")]
        return Ok(Box::new(super::mcap_file::McapFile::new(path)));
        #[cfg(not(feature = "mcap"))]
        return Err(FormatError::LeftOut { path: path.into(), format: "MCAP", feature: "mcap" });
    }
    if start.starts_with(ROS1_BAG) {
        #[cfg(feature = "ros1")]
        return Ok(Box::new(super::ros1_bag::Ros1Bag::open(path)?));
        #[cfg(not(feature = "ros1"))]
        return Err(FormatError::LeftOut { path: path.into(), format: "a ROS 1 bag", feature: "ros1" });
    }
    #[cfg(feature = "ros2-sqlite")]
    return Ok(Box::new(super::ros2_sqlite::SqliteBag::open(path)?));
    #[cfg(not(feature = "ros2-sqlite"))]
    return Err(FormatError::LeftOut {
        path: path.into(),
        format: "a ROS 2 bag in SQLite's format",
        feature: "ros2-sqlite",
    });
}

/// Files that follow each other.
struct Bag {
    parts: Vec<Box<dyn MessageFile>>,
}

impl MessageFile for Bag {
    fn topics(&self) -> Result<Vec<Topic>, FormatError> {
        let mut topics: Vec<Topic> = Vec::new();
        for part in &self.parts {
            for topic in part.topics()? {
                if !topics.iter().any(|known| known.name == topic.name) {
                    topics.push(topic);
                }
            }
        }
        Ok(topics)
    }

    fn messages(&self, topic: &str) -> Result<Box<dyn Messages>, FormatError> {
        let parts = self.parts.iter().map(|part| part.messages(topic)).collect::<Result<Vec<_>, _>>()?;
        Ok(Box::new(Chain { parts, current: 0 }))
    }
}

/// One file's messages after the other's.
struct Chain {
    parts: Vec<Box<dyn Messages>>,
    current: usize,
}

impl Messages for Chain {
    fn next(&mut self, data: &mut Vec<u8>) -> Result<Option<i64>, FormatError> {
        while let Some(part) = self.parts.get_mut(self.current) {
            if let Some(recorded) = part.next(data)? {
                return Ok(Some(recorded));
            }
            self.current += 1;
        }
        Ok(None)
    }

    fn progress(&self) -> (u64, u64) {
        let parts = self.parts.iter().map(|part| part.progress());
        parts.fold((0, 0), |(done, total), (part_done, part_total)| (done + part_done, total + part_total))
    }
}
