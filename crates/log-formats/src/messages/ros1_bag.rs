//! ROS 1 bags (format 2.0).

use super::topic::{Encoding, Topic};
use super::{MessageFile, Messages, ROS1_BAG};
use crate::FormatError;
use phiw_limits::Limits;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Bytes of a record's header at most; those that are written have less than 100, but for a topic's name.
const LARGEST_HEADER: u32 = 1 << 20;

/// Kinds of records.
mod op {
    pub const MESSAGE: u8 = 2;
    pub const BAG_HEADER: u8 = 3;
    pub const CHUNK: u8 = 5;
    pub const CONNECTION: u8 = 7;
}

/// A bag.
pub(crate) struct Ros1Bag {
    path: PathBuf,
    /// Where its connections are listed.
    index: u64,
    connections: Vec<Connection>,
}

#[derive(Clone)]
struct Connection {
    id: u32,
    topic: Topic,
}

impl Ros1Bag {
    /// Reads the list of connections.
    ///
    /// # Errors
    /// It cannot be read, is damaged, or was not closed.
    pub fn open(path: &Path) -> Result<Self, FormatError> {
        let mut records = Records::open(path)?;
        let first = records.next()?.filter(|record| record.op() == Some(op::BAG_HEADER));
        let index = first.as_ref().and_then(|record| record.number::<8>("index_pos")).map(u64::from_le_bytes);
        let index = index.ok_or_else(|| damaged(path, "it does not begin with the header of a bag"))?;
        if index == 0 {
            return Err(FormatError::Unsupported {
                path: path.into(),
                what: "the bag was not closed".into(),
                mend: "run `rosbag reindex` on it".into(),
            });
        }
        if index > records.length {
            return Err(damaged(path, "it ends before its index"));
        }
        records.seek(index)?;
        let mut connections = Vec::new();
        while let Some(record) = records.next()? {
            if record.op() == Some(op::CONNECTION) {
                connections
                    .push(connection(&record).ok_or_else(|| damaged(path, "a connection is not described"))?);
            }
        }
        Ok(Ros1Bag { path: path.into(), index, connections })
    }
}

impl MessageFile for Ros1Bag {
    fn topics(&self) -> Result<Vec<Topic>, FormatError> {
        let mut topics: Vec<Topic> = Vec::new();
        for Connection { topic, .. } in &self.connections {
            if !topics.iter().any(|known| known.name == topic.name) {
                topics.push(topic.clone());
            }
        }
        Ok(topics)
    }

    fn messages(&self, topic: &str) -> Result<Box<dyn Messages>, FormatError> {
        let of_topic = self.connections.iter().filter(|connection| connection.topic.name == topic);
        Ok(Box::new(Ros1Messages {
            connections: of_topic.map(|connection| connection.id).collect(),
            index: self.index,
            records: Records::open(&self.path)?,
            chunk: Vec::new(),
            at: 0,
        }))
    }
}

fn damaged(path: &Path, what: impl Into<String>) -> FormatError {
    FormatError::Damaged { path: path.into(), format: "ROS bag", what: what.into() }
}

/// A record: its header's fields, and its data.
struct Record<'a> {
    header: &'a [u8],
    data: &'a [u8],
}

impl<'a> Record<'a> {
    /// The record at the beginning of these bytes, and how many it takes.
    fn split(bytes: &'a [u8]) -> Option<(Self, usize)> {
        let part = |at: usize| {
            let length = u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?) as usize;
            let end = (at + 4).checked_add(length)?;
            Some((bytes.get(at + 4..end)?, end))
        };
        let (header, end) = part(0)?;
        let (data, end) = part(end)?;
        Some((Record { header, data }, end))
    }

    fn field(&self, name: &str) -> Option<&'a [u8]> {
        field(self.header, name)
    }

    fn number<const SIZE: usize>(&self, name: &str) -> Option<[u8; SIZE]> {
        self.field(name)?.try_into().ok()
    }

    fn op(&self) -> Option<u8> {
        self.number::<1>("op").map(|[op]| op)
    }
}

/// A field of a header: each is a length and `name=value`.
fn field<'a>(mut header: &'a [u8], name: &str) -> Option<&'a [u8]> {
    while let Some(length) = header.first_chunk() {
        let end = 4_usize.checked_add(u32::from_le_bytes(*length) as usize)?;
        let entry = header.get(4..end)?;
        let equals = entry.iter().position(|&byte| byte == b'=')?;
        if &entry[..equals] == name.as_bytes() {
            return Some(&entry[equals + 1..]);
        }
        header = &header[end..];
    }
    None
}

fn connection(record: &Record<'_>) -> Option<Connection> {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let topic = Topic {
        name: text(record.field("topic")?),
        type_name: text(field(record.data, "type")?),
        definition: Some(text(field(record.data, "message_definition")?)),
        encoding: Encoding::Ros1,
    };
    Some(Connection { id: u32::from_le_bytes(record.number("conn")?), topic })
}

/// The records of a file, one after the other.
struct Records {
    path: PathBuf,
    file: BufReader<File>,
    at: u64,
    length: u64,
    bytes: Vec<u8>,
}

impl Records {
    fn open(path: &Path) -> Result<Self, FormatError> {
        let unreadable = |source| FormatError::reading(path, source);
        let file = File::open(path).map_err(unreadable)?;
        let length = file.metadata().map_err(unreadable)?.len();
        let mut records =
            Records { path: path.into(), file: BufReader::new(file), at: 0, length, bytes: Vec::new() };
        records.seek(ROS1_BAG.len() as u64)?;
        Ok(records)
    }

    fn seek(&mut self, to: u64) -> Result<(), FormatError> {
        self.at = to;
        self.file.seek(SeekFrom::Start(to)).map_err(|source| FormatError::reading(&self.path, source))?;
        Ok(())
    }

    /// Reads one of a record's two parts behind the bytes that are there.
    fn part(&mut self, largest: u32) -> Result<(), FormatError> {
        let cut = |path: &Path| damaged(path, "it ends inside a record");
        let mut length = [0; 4];
        self.file.read_exact(&mut length).map_err(|_| cut(&self.path))?;
        let count = u32::from_le_bytes(length);
        if u64::from(count) > self.length - self.at.min(self.length) {
            return Err(cut(&self.path));
        }
        if count > largest {
            return Err(damaged(&self.path, format!("a record claims {count} bytes")));
        }
        self.bytes.extend_from_slice(&length);
        let start = self.bytes.len();
        self.bytes.resize(start + count as usize, 0);
        self.file.read_exact(&mut self.bytes[start..]).map_err(|_| cut(&self.path))?;
        self.at += 4 + u64::from(count);
        Ok(())
    }

    fn next(&mut self) -> Result<Option<Record<'_>>, FormatError> {
        if self.at >= self.length {
            return Ok(None);
        }
        self.bytes.clear();
        self.part(LARGEST_HEADER)?;
        self.part(u32::try_from(Limits::default().message_bytes).unwrap_or(u32::MAX))?;
        Ok(Record::split(&self.bytes).map(|(record, _)| record))
    }
}

struct Ros1Messages {
    connections: Vec<u32>,
    index: u64,
    records: Records,
    /// The chunk that is being read, unpacked, and where in it.
    chunk: Vec<u8>,
    at: usize,
}

impl Ros1Messages {
    /// Reads the next chunk. Returns whether there was one.
    fn next_chunk(&mut self) -> Result<bool, FormatError> {
        self.at = 0;
        while self.records.at < self.index {
            let path = self.records.path.clone();
            let Some(record) = self.records.next()? else { break };
            if record.op() != Some(op::CHUNK) {
                continue;
            }
            let size = record.number("size").map(u32::from_le_bytes);
            let size = size.ok_or_else(|| damaged(&path, "a chunk does not say its size"))? as usize;
            if size > Limits::default().message_bytes {
                return Err(damaged(&path, format!("a chunk claims {size} bytes")));
            }
            let packed = record.data;
            self.chunk.clear();
            let most = size as u64 + 1;
            let unpacked = match record.field("compression") {
                Some(b"none") => {
                    self.chunk.extend_from_slice(packed);
                    Ok(packed.len())
                }
                Some(b"bz2") => bzip2::read::BzDecoder::new(packed).take(most).read_to_end(&mut self.chunk),
                Some(b"lz4") => lz4::Decoder::new(packed)
                    .and_then(|decoder| decoder.take(most).read_to_end(&mut self.chunk)),
                other => {
                    let name = String::from_utf8_lossy(other.unwrap_or_default());
                    return Err(damaged(&path, format!("a chunk is packed by `{name}`")));
                }
            };
            match unpacked {
                Ok(count) if count == size => return Ok(true),
                Ok(count) => {
                    return Err(damaged(&path, format!("a chunk has {count} bytes instead of {size}")));
                }
                Err(error) => return Err(damaged(&path, format!("a chunk can't be unpacked: {error}"))),
            }
        }
        Ok(false)
    }
}

impl Messages for Ros1Messages {
    fn next(&mut self, data: &mut Vec<u8>) -> Result<Option<i64>, FormatError> {
        loop {
            if self.at == self.chunk.len() && !self.next_chunk()? {
                return Ok(None);
            }
            if self.at == self.chunk.len() {
                continue;
            }
            let cut = || damaged(&self.records.path, "a chunk ends inside a record");
            let (record, length) = Record::split(&self.chunk[self.at..]).ok_or_else(cut)?;
            self.at += length;
            if record.op() != Some(op::MESSAGE) {
                continue;
            }
            let connection = record.number("conn").map(u32::from_le_bytes).ok_or_else(cut)?;
            if self.connections.contains(&connection) {
                let [a, b, c, d, e, f, g, h] = record.number("time").ok_or_else(cut)?;
                let seconds = u32::from_le_bytes([a, b, c, d]);
                let nanoseconds = u32::from_le_bytes([e, f, g, h]);
                data.clear();
                data.extend_from_slice(record.data);
                return Ok(Some(i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds)));
            }
        }
    }

    fn progress(&self) -> (u64, u64) {
        (self.records.at.min(self.index), self.index)
    }
}
