//! The messages of one topic as a table.

use super::decode::{Numbers, Path as FieldPath, paths};
use super::schema::Schema;
use super::signals::RobotState;
use super::sorting::{Sorting, StampedRow, WINDOW};
use super::topic::{Encoding, Topic};
use super::{MessageFile, Messages};
use crate::FormatError;
use crate::content_hash::ContentHash;
use crate::table::{Column, Step, Table};
use phiw_limits::Limits;
use std::path::{Path, PathBuf};

/// Messages at the beginning from which the columns are known: more than enough for each of a few robots that
/// share a topic to have come.
const HEAD: usize = 512;
/// Stamps count from a whole number of these \[ns\], 11.6 days: recordings of one session have one origin,
/// and a stamp in seconds keeps its nanoseconds.
const ORIGIN_STEP: i64 = 1_000_000_000_000_000;

/// Rows of one topic.
pub(crate) struct TopicTable {
    path: PathBuf,
    topic: Topic,
    schema: Schema,
    messages: Box<dyn Messages>,
    columns: Vec<Column>,
    /// What the messages at the beginning have.
    shapes: Vec<Shape>,
    selected: Vec<usize>,
    uses_header_stamp: bool,
    origin: i64,
    sorting: Sorting,
    ended: bool,
    /// Messages read so far, and those that name nothing of what is selected.
    count: u64,
    of_others: u64,
    /// Messages with an array of another length than at the beginning.
    numbers: Numbers,
    data: Vec<u8>,
    /// Where the numbers of a message like the latest go: number and place in the row.
    current: Option<(Vec<usize>, Vec<u8>)>,
    routes: Vec<(usize, usize)>,
    hash: ContentHash,
}

/// What a kind of message has.
struct Shape {
    counts: Vec<usize>,
    names: Vec<u8>,
    /// Columns of its numbers.
    columns: Vec<usize>,
}

impl TopicTable {
    /// Reads the messages at the beginning and starts again.
    pub fn new(path: &Path, topic: &Topic, file: &dyn MessageFile) -> Result<Self, FormatError> {
        let unsupported = |what: String| FormatError::Unsupported {
            path: path.into(),
            what: format!("topic `{}` can't be read: {what}", topic.name),
            mend: "record it as ROS messages (CDR), or export it as CSV".into(),
        };
        if let Encoding::Other(name) = &topic.encoding {
            return Err(unsupported(format!("its messages are encoded as `{name}`")));
        }
        let schema = Schema::parse(&topic.type_name, topic.definition.as_deref()).map_err(unsupported)?;
        let mut table = TopicTable {
            path: path.into(),
            topic: topic.clone(),
            schema,
            messages: file.messages(&topic.name)?,
            columns: vec![Column::named("t")],
            shapes: Vec::new(),
            selected: Vec::new(),
            uses_header_stamp: true,
            origin: 0,
            sorting: Sorting::default(),
            ended: false,
            count: 0,
            of_others: 0,
            numbers: Numbers::default(),
            data: Vec::new(),
            current: None,
            routes: Vec::new(),
            hash: ContentHash::default(),
        };
        table.read_head()?;
        table.messages = file.messages(&topic.name)?;
        table.count = 0;
        table.selected = (0..table.columns.len()).collect();
        Ok(table)
    }

    /// Columns and origin of time, from the messages at the beginning.
    fn read_head(&mut self) -> Result<(), FormatError> {
        let mut first: Option<(i64, Option<i64>)> = None;
        let mut stamped = false;
        for _ in 0..HEAD {
            let Some(recorded) = self.read_message()? else { break };
            let stamp = self.numbers.stamp;
            stamped |= stamp.is_some_and(|stamp| stamp != 0);
            first = first.or(Some((recorded, stamp)));
            let Numbers { counts, names, .. } = &self.numbers;
            if !self.shapes.iter().any(|shape| shape.counts == *counts && shape.names == *names) {
                self.add_shape()?;
            }
        }
        let Some((recorded, stamp)) = first else {
            return Err(FormatError::Empty { path: self.path.clone() });
        };
        self.uses_header_stamp = stamped;
        let first = stamp.filter(|_| stamped).unwrap_or(recorded);
        self.origin = first.div_euclid(ORIGIN_STEP) * ORIGIN_STEP;
        Ok(())
    }

    fn add_shape(&mut self) -> Result<(), FormatError> {
        let state = RobotState::of_type(&self.topic.type_name);
        let mut columns = Vec::new();
        for path in paths(&self.schema, &self.numbers) {
            let known = self.columns.iter().position(|column| column.name == path.text);
            columns.push(known.unwrap_or_else(|| {
                let signal = signal_of(state, &path)
                    .filter(|signal| !self.columns.iter().any(|other| other.signal.as_ref() == Some(signal)));
                self.columns.push(Column { name: path.text, signal });
                self.columns.len() - 1
            }));
        }
        if self.columns.len() > Limits::default().log_columns {
            let header = self.header();
            let columns = self.columns.len();
            return Err(FormatError::TooManyColumns { path: self.path.clone(), header, columns });
        }
        let Numbers { counts, names, .. } = &self.numbers;
        self.shapes.push(Shape { counts: counts.clone(), names: names.clone(), columns });
        Ok(())
    }

    /// Decodes the next message; gives the time of its recording.
    fn read_message(&mut self) -> Result<Option<i64>, FormatError> {
        let Some(recorded) = self.messages.next(&mut self.data)? else { return Ok(None) };
        self.count += 1;
        self.numbers.decode(&self.schema, &self.topic.encoding, &self.data).map_err(|what| {
            FormatError::Damaged {
                path: self.path.clone(),
                format: "recording",
                what: format!("topic `{}`, message {}: {what}", self.topic.name, self.count),
            }
        })?;
        Ok(Some(recorded))
    }

    /// Finds where the numbers of a message like the present one go.
    fn find_routes(&mut self) {
        let Numbers { counts, names, .. } = &self.numbers;
        if self.current.as_ref().is_some_and(|(c, n)| c == counts && n == names) {
            return;
        }
        self.routes.clear();
        for (number, path) in paths(&self.schema, &self.numbers).iter().enumerate() {
            let places = self.selected.iter().enumerate();
            let places = places.filter(|&(_, &column)| column > 0 && self.columns[column].name == path.text);
            self.routes.extend(places.map(|(place, _)| (number, place)));
        }
        self.current = Some((counts.clone(), names.clone()));
    }

    /// Reads one message into the rows that are being sorted.
    fn take_message(&mut self) -> Result<(), FormatError> {
        let Some(recorded) = self.read_message()? else {
            self.ended = true;
            return Ok(());
        };
        self.find_routes();
        if self.routes.is_empty() {
            self.of_others += 1;
            return Ok(());
        }
        let stamp = self.numbers.stamp.filter(|_| self.uses_header_stamp).unwrap_or(recorded);
        let mut values = self.sorting.row(self.selected.len());
        for &(number, place) in &self.routes {
            values[place] = self.numbers.values[number];
        }
        let seconds = (stamp - self.origin) as f64 / 1e9;
        for (value, _) in values.iter_mut().zip(&self.selected).filter(|(_, column)| **column == 0) {
            *value = seconds;
        }
        if !self.sorting.push(StampedRow { stamp, place: self.count, values }) {
            return Err(FormatError::OutOfOrder {
                path: self.path.clone(),
                topic: self.topic.name.clone(),
                message: self.count,
                window: WINDOW,
            });
        }
        Ok(())
    }

    /// The sets of joints that messages name, in words.
    fn sets(&self) -> Vec<String> {
        let mut sets: Vec<String> = Vec::new();
        for shape in &self.shapes {
            let mut names: Vec<String> = shape
                .names
                .split(|&byte| byte == b'\n')
                .filter(|name| !name.is_empty())
                .map(|name| String::from_utf8_lossy(name).into_owned())
                .collect();
            names.sort();
            let set = match names.is_empty() {
                true => format!("[{} numbers]", shape.columns.len()),
                false => format!("[{}]", names.join(", ")),
            };
            if !sets.contains(&set) {
                sets.push(set);
            }
        }
        sets
    }
}

fn signal_of(state: Option<RobotState>, path: &FieldPath) -> Option<String> {
    let (array, joint) = path.joint.as_ref()?;
    Some(format!("{}{joint}", state?.signal(array)?))
}

impl Table for TopicTable {
    fn columns(&self) -> &[Column] {
        &self.columns
    }

    fn select(&mut self, columns: &[usize]) -> Result<(), FormatError> {
        let holds_all =
            |shape: &Shape| columns.iter().all(|column| *column == 0 || shape.columns.contains(column));
        if !self.shapes.iter().any(holds_all) {
            return Err(FormatError::SeparateMessages {
                path: self.path.clone(),
                topic: self.topic.name.clone(),
                sets: self.sets(),
            });
        }
        self.selected = columns.to_vec();
        self.current = None;
        Ok(())
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Step, FormatError> {
        while !self.ended && !self.sorting.is_full() {
            self.take_message()?;
        }
        let Some((stamp, place)) = self.sorting.pop(values) else { return Ok(Step::End) };
        self.hash.row(stamp.cast_unsigned(), values);
        Ok(Step::Row { place })
    }

    fn progress(&self) -> (u64, u64) {
        self.messages.progress()
    }

    fn content_hash(&self) -> u64 {
        self.hash.finish()
    }

    fn rows_are(&self) -> &'static str {
        "message"
    }

    fn header(&self) -> String {
        format!(", topic `{}`", self.topic.name)
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if !self.uses_header_stamp {
            notes.push("the messages have no stamp of their own: `t` is when they were recorded".into());
        }
        if self.of_others > 0 {
            notes.push(format!(
                "{} of {} messages name none of the joints asked for and are left out",
                self.of_others, self.count
            ));
        }
        if self.sorting.moved > 0 {
            notes.push(format!(
                "{} of {} messages came out of order and were sorted by their stamps",
                self.sorting.moved, self.count
            ));
        }
        notes
    }
}
