//! MCAP files.

use super::topic::{Encoding, Topic};
use super::{MessageFile, Messages};
use crate::FormatError;
use mcap::McapError;
use mcap::records::Record;
use mcap::sans_io::SummaryReaderOptions;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions, SummaryReadEvent, SummaryReader};
use phiw_limits::Limits;
use std::collections::HashMap;
use std::fs::File;
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};

/// An MCAP file.
pub(crate) struct McapFile {
    path: PathBuf,
}

impl McapFile {
    pub fn new(path: &Path) -> Self {
        McapFile { path: path.into() }
    }

    fn damaged(&self, error: McapError) -> FormatError {
        damaged(&self.path, error)
    }

    /// What the end of the file says of its channels; `None` where it says nothing.
    fn summary(&self) -> Result<Option<mcap::Summary>, FormatError> {
        let unreadable = |source| FormatError::reading(&self.path, source);
        let mut file = File::open(&self.path).map_err(unreadable)?;
        let options =
            SummaryReaderOptions::default().with_record_length_limit(Limits::default().message_bytes);
        let mut reader = SummaryReader::new_with_options(options);
        while let Some(event) = reader.next_event() {
            match event.map_err(|error| self.damaged(error))? {
                SummaryReadEvent::ReadRequest(count) => {
                    let read = file.read(reader.insert(count)).map_err(unreadable)?;
                    reader.notify_read(read);
                }
                SummaryReadEvent::SeekRequest(to) => {
                    let at = file.seek(to).map_err(|source| self.damaged(McapError::Io(source)))?;
                    reader.notify_seeked(at);
                }
            }
        }
        Ok(reader.finish())
    }

    /// The topics of a file without a summary: all of it is read.
    fn topics_of_records(&self) -> Result<Vec<Topic>, FormatError> {
        let mut records = Records::open(&self.path)?;
        while records.next(&mut |_, _| false)? {}
        let mut topics: Vec<Topic> = Vec::new();
        let mut channels: Vec<_> = records.channels.values().collect();
        channels.sort_by_key(|channel| channel.id);
        for channel in channels {
            let schema = records.schemas.get(&channel.schema_id);
            let (type_name, definition, format) = match schema {
                Some((name, encoding, data)) => (name.as_str(), Some(data.as_slice()), encoding.as_str()),
                None => ("", None, ""),
            };
            add(&mut topics, topic(&channel.topic, &channel.message_encoding, type_name, format, definition));
        }
        Ok(topics)
    }
}

fn damaged(path: &Path, error: McapError) -> FormatError {
    let what = match error {
        McapError::Io(source) => source.to_string(),
        // Its own words go over many lines.
        McapError::Parse(_) => "a record can't be parsed".to_owned(),
        error => error.to_string().to_lowercase(),
    };
    FormatError::Damaged { path: path.into(), format: "MCAP", what: what.replace('\n', " ") }
}

fn topic(name: &str, encoding: &str, type_name: &str, format: &str, definition: Option<&[u8]>) -> Topic {
    let encoding = match (encoding, format) {
        ("cdr", "ros2msg" | "") => Encoding::Cdr,
        ("ros1", "ros1msg" | "") => Encoding::Ros1,
        ("cdr", format) => Encoding::Other(format!("cdr with a schema in {format}")),
        (other, _) => Encoding::Other(other.to_owned()),
    };
    let definition = definition.map(|data| String::from_utf8_lossy(data).into_owned());
    Topic { name: name.into(), type_name: type_name.into(), definition, encoding }
}

fn add(topics: &mut Vec<Topic>, topic: Topic) {
    if !topics.iter().any(|known| known.name == topic.name) {
        topics.push(topic);
    }
}

impl MessageFile for McapFile {
    fn topics(&self) -> Result<Vec<Topic>, FormatError> {
        let Some(summary) = self.summary()?.filter(|summary| !summary.channels.is_empty()) else {
            return self.topics_of_records();
        };
        let mut channels: Vec<_> = summary.channels.values().collect();
        channels.sort_by_key(|channel| channel.id);
        let mut topics = Vec::new();
        for channel in channels {
            let schema = channel.schema.as_ref();
            add(
                &mut topics,
                topic(
                    &channel.topic,
                    &channel.message_encoding,
                    schema.map_or("", |schema| &schema.name),
                    schema.map_or("", |schema| &schema.encoding),
                    schema.map(|schema| schema.data.as_ref()),
                ),
            );
        }
        Ok(topics)
    }

    fn messages(&self, topic: &str) -> Result<Box<dyn Messages>, FormatError> {
        Ok(Box::new(McapMessages { records: Records::open(&self.path)?, topic: topic.to_owned() }))
    }
}

struct Channel {
    id: u16,
    topic: String,
    message_encoding: String,
    schema_id: u16,
}

/// The records of a file from first to last, in constant memory.
struct Records {
    path: PathBuf,
    file: File,
    reader: LinearReader,
    channels: HashMap<u16, Channel>,
    /// Name, encoding and text by number.
    schemas: HashMap<u16, (String, String, Vec<u8>)>,
    done: u64,
    total: u64,
}

impl Records {
    fn open(path: &Path) -> Result<Self, FormatError> {
        let unreadable = |source| FormatError::reading(path, source);
        let file = File::open(path).map_err(unreadable)?;
        let total = file.metadata().map_err(unreadable)?.len();
        let options = LinearReaderOptions::default()
            .with_validate_chunk_crcs(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true)
            .with_record_length_limit(Limits::default().message_bytes);
        let reader = LinearReader::new_with_options(options);
        Ok(Records {
            path: path.into(),
            file,
            reader,
            channels: HashMap::new(),
            schemas: HashMap::new(),
            done: 0,
            total,
        })
    }

    /// Goes on to the next message that `take` (with its channel and bytes) wants, or to the end. Returns
    /// whether there was one.
    fn next(
        &mut self,
        take: &mut dyn FnMut(&Channel, &mcap::records::MessageHeader) -> bool,
    ) -> Result<bool, FormatError> {
        self.next_with(&mut |channel, header, _| take(channel, header))
    }

    fn next_with(
        &mut self,
        take: &mut dyn FnMut(&Channel, &mcap::records::MessageHeader, &[u8]) -> bool,
    ) -> Result<bool, FormatError> {
        while let Some(event) = self.reader.next_event() {
            match event.map_err(|error| damaged(&self.path, error))? {
                LinearReadEvent::ReadRequest(count) => {
                    let buffer = self.reader.insert(count);
                    let read = self.file.read(buffer);
                    let read = read.map_err(|source| FormatError::reading(&self.path, source))?;
                    self.done += read as u64;
                    self.reader.notify_read(read);
                }
                LinearReadEvent::Record { data, opcode } => {
                    let record =
                        mcap::parse_record(opcode, data).map_err(|error| damaged(&self.path, error))?;
                    match record {
                        Record::Schema { header, data } => {
                            let schema = (header.name, header.encoding, data.into_owned());
                            self.schemas.insert(header.id, schema);
                        }
                        Record::Channel(channel) => {
                            let known = Channel {
                                id: channel.id,
                                topic: channel.topic,
                                message_encoding: channel.message_encoding,
                                schema_id: channel.schema_id,
                            };
                            self.channels.insert(channel.id, known);
                        }
                        Record::Message { header, data } => {
                            let channel = self.channels.get(&header.channel_id).ok_or_else(|| {
                                damaged(
                                    &self.path,
                                    McapError::UnknownChannel(header.sequence, header.channel_id),
                                )
                            })?;
                            if take(channel, &header, &data) {
                                return Ok(true);
                            }
                        }
                        _ => {}
                    }
                }
            }
        }
        Ok(false)
    }
}

struct McapMessages {
    records: Records,
    topic: String,
}

impl Messages for McapMessages {
    fn next(&mut self, data: &mut Vec<u8>) -> Result<Option<i64>, FormatError> {
        let mut recorded = 0;
        let topic = &self.topic;
        let found = self.records.next_with(&mut |channel, header, bytes| {
            if channel.topic != *topic {
                return false;
            }
            recorded = header.log_time.cast_signed();
            data.clear();
            data.extend_from_slice(bytes);
            true
        })?;
        Ok(found.then_some(recorded))
    }

    fn progress(&self) -> (u64, u64) {
        (self.records.done.min(self.records.total), self.records.total)
    }
}
