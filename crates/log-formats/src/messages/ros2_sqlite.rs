//! ROS 2 bags in SQLite's format (`.db3`).

use super::topic::{Encoding, Topic};
use super::{MessageFile, Messages};
use crate::FormatError;
use phiw_limits::Limits;
use rusqlite::{Connection, OpenFlags};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Messages that are fetched at once.
const BATCH: usize = 128;
/// Bytes of messages from which on no more are fetched.
const BATCH_BYTES: usize = 4 << 20;
/// First bytes of a message packed by zstd (compression mode `message`).
const ZSTD: &[u8] = b"\x28\xb5\x2f\xfd";

/// A bag's file.
pub(crate) struct SqliteBag {
    path: PathBuf,
    connection: Rc<Connection>,
}

impl SqliteBag {
    /// # Errors
    /// It cannot be read, or was not closed.
    pub fn open(path: &Path) -> Result<Self, FormatError> {
        let unreadable = |source| FormatError::reading(path, source);
        for journal in ["-wal", "-journal"] {
            let mut name = path.file_name().unwrap_or_default().to_owned();
            name.push(journal);
            let beside = path.with_file_name(name);
            if beside.metadata().is_ok_and(|metadata| metadata.len() > 0) {
                return Err(FormatError::Unsupported {
                    path: path.into(),
                    what: format!("the recording was not closed: part of it is in {}", beside.display()),
                    mend: "end the recorder, or let `ros2 bag info` open it once".into(),
                });
            }
        }
        check_length(path).map_err(unreadable)?.map_err(|what| damaged_by(path, what))?;
        // Without `immutable`, SQLite would write beside the file.
        let name = path.to_string_lossy();
        let escaped: String = name
            .chars()
            .map(|c| match c {
                '%' | '?' | '#' => format!("%{:02X}", u32::from(c)),
                c => c.to_string(),
            })
            .collect();
        let flags =
            OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let connection = Connection::open_with_flags(format!("file:{escaped}?immutable=1"), flags)
            .map_err(|error| damaged(path, &error))?;
        Ok(SqliteBag { path: path.into(), connection: Rc::new(connection) })
    }

    fn has_table(&self, table: &str) -> rusqlite::Result<bool> {
        let sql = "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name = ?1";
        self.connection.query_row(sql, [table], |row| row.get::<_, i64>(0)).map(|count| count > 0)
    }

    fn read_topics(&self) -> rusqlite::Result<Vec<Topic>> {
        let mut definitions: Vec<(String, String, String)> = Vec::new();
        if self.has_table("message_definitions")? {
            let sql = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions";
            let mut statement = self.connection.prepare(sql)?;
            let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?;
            definitions = rows.collect::<rusqlite::Result<_>>()?;
        }
        let mut statement =
            self.connection.prepare("SELECT name, type, serialization_format FROM topics ORDER BY id")?;
        let rows = statement.query_map([], |row| {
            let (name, type_name, format): (String, String, String) = (row.get(0)?, row.get(1)?, row.get(2)?);
            let encoding = match format.as_str() {
                "cdr" => Encoding::Cdr,
                other => Encoding::Other(other.to_owned()),
            };
            let definition = definitions
                .iter()
                .find(|(of_type, encoding, _)| *of_type == type_name && encoding == "ros2msg")
                .map(|(_, _, text)| text.clone());
            Ok(Topic { name, type_name, definition, encoding })
        })?;
        rows.collect()
    }
}

/// Whether the file is as long as its header says; the inner error is what is wrong.
fn check_length(path: &Path) -> std::io::Result<Result<(), String>> {
    use std::io::Read;
    let mut header = [0; 100];
    let mut file = std::fs::File::open(path)?;
    let length = file.metadata()?.len();
    if file.read_exact(&mut header).is_err() {
        return Ok(Err("it ends inside its header".into()));
    }
    let be32 = |at: usize| u32::from_be_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]);
    let page = match u16::from_be_bytes([header[16], header[17]]) {
        1 => 65536,
        size => u64::from(size),
    };
    // The count is valid where the change counter was written with it.
    let pages = if be32(24) == be32(92) { u64::from(be32(28)) } else { 0 };
    Ok(match pages * page > length {
        true => Err(format!("its header says {} bytes, but it has {length}", pages * page)),
        false => Ok(()),
    })
}

fn damaged_by(path: &Path, what: String) -> FormatError {
    FormatError::Damaged { path: path.into(), format: "ROS 2 bag", what }
}

fn damaged(path: &Path, error: &rusqlite::Error) -> FormatError {
    damaged_by(path, error.to_string().replace('\n', " "))
}

impl MessageFile for SqliteBag {
    fn topics(&self) -> Result<Vec<Topic>, FormatError> {
        let of_bag = ["topics", "messages"].map(|table| self.has_table(table));
        for has in of_bag {
            if !has.map_err(|error| damaged(&self.path, &error))? {
                return Err(FormatError::Unsupported {
                    path: self.path.clone(),
                    what: "this SQLite database is no ROS 2 bag: it has no tables `topics` and `messages`"
                        .into(),
                    mend: "name a bag, or export the log as CSV".into(),
                });
            }
        }
        self.read_topics().map_err(|error| damaged(&self.path, &error))
    }

    fn messages(&self, topic: &str) -> Result<Box<dyn Messages>, FormatError> {
        let read = || -> rusqlite::Result<(Vec<i64>, i64)> {
            let mut statement = self.connection.prepare("SELECT id FROM topics WHERE name = ?1")?;
            let ids = statement.query_map([topic], |row| row.get(0))?.collect::<rusqlite::Result<_>>()?;
            let last: Option<i64> =
                self.connection.query_row("SELECT max(id) FROM messages", [], |row| row.get(0))?;
            Ok((ids, last.unwrap_or(0)))
        };
        let (topics, last) = read().map_err(|error| damaged(&self.path, &error))?;
        Ok(Box::new(SqliteMessages {
            path: self.path.clone(),
            connection: self.connection.clone(),
            topics,
            batch: VecDeque::new(),
            id: 0,
            last,
            ended: false,
        }))
    }
}

/// The messages of one topic, fetched in batches by their number.
struct SqliteMessages {
    path: PathBuf,
    connection: Rc<Connection>,
    /// Its numbers; more than one where a topic was offered twice.
    topics: Vec<i64>,
    batch: VecDeque<(i64, Vec<u8>)>,
    /// Number of the latest message fetched, and the largest in the file.
    id: i64,
    last: i64,
    ended: bool,
}

impl SqliteMessages {
    fn fetch(&mut self) -> rusqlite::Result<()> {
        let sql = "SELECT id, topic_id, timestamp, data FROM messages WHERE id > ?1 ORDER BY id";
        let mut statement = self.connection.prepare(sql)?;
        let mut rows = statement.query([self.id])?;
        let mut bytes = 0;
        while self.batch.len() < BATCH && bytes < BATCH_BYTES {
            let Some(row) = rows.next()? else {
                self.ended = true;
                break;
            };
            self.id = row.get(0)?;
            if self.topics.contains(&row.get(1)?) {
                let data = row.get_ref(3)?.as_blob()?.to_vec();
                bytes += data.len();
                self.batch.push_back((row.get(2)?, data));
            }
        }
        Ok(())
    }
}

impl Messages for SqliteMessages {
    fn next(&mut self, data: &mut Vec<u8>) -> Result<Option<i64>, FormatError> {
        while self.batch.is_empty() && !self.ended {
            self.fetch().map_err(|error| damaged(&self.path, &error))?;
        }
        let Some((recorded, bytes)) = self.batch.pop_front() else { return Ok(None) };
        if bytes.starts_with(ZSTD) {
            *data = zstd::bulk::decompress(&bytes, Limits::default().message_bytes)
                .map_err(|error| damaged_by(&self.path, format!("a message can't be unpacked: {error}")))?;
        } else {
            *data = bytes;
        }
        Ok(Some(recorded))
    }

    fn progress(&self) -> (u64, u64) {
        (self.id.min(self.last).max(0).cast_unsigned(), self.last.max(0).cast_unsigned())
    }
}
