//! The numbers of a message, and what each of them is called.

use super::cursor::{Broken, Cursor};
use super::schema::{Count, Field, Kind, Schema};
use super::topic::Encoding;
use phiw_limits::Limits;

/// The numbers of one message, in the order of its definition.
///
/// Two messages with the same `counts` and `names` have the same numbers in the same places.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Numbers {
    pub values: Vec<f64>,
    /// Lengths of the arrays that may have any, in the order in which they come.
    pub counts: Vec<usize>,
    /// The joints' names, each ended by a line feed.
    pub names: Vec<u8>,
    /// `header.stamp` \[ns\].
    pub stamp: Option<i64>,
}

/// Fields that name the joints which a message's arrays are about.
const NAMES: [&str; 3] = ["name", "joint_names", "names"];

impl Numbers {
    /// Decodes a message into this place, whose memory is used again.
    ///
    /// # Errors
    /// The bytes do not fit the definition.
    pub fn decode(&mut self, schema: &Schema, encoding: &Encoding, data: &[u8]) -> Result<(), Broken> {
        self.values.clear();
        self.counts.clear();
        self.names.clear();
        self.stamp = None;
        let mut cursor = Cursor::new(data, encoding)?;
        self.message(schema, 0, &mut cursor, true, false)
    }

    fn message(
        &mut self,
        schema: &Schema,
        message: usize,
        cursor: &mut Cursor<'_>,
        outermost: bool,
        is_header: bool,
    ) -> Result<(), Broken> {
        let fields = &schema.messages[message];
        if fields.is_empty() && cursor.fills_empty {
            cursor.bytes(1)?;
        }
        for field in fields {
            let count = match field.count {
                Count::One => 1,
                Count::Fixed(count) => count,
                Count::Any => {
                    let count = cursor.u32()? as usize;
                    if count > cursor.rest() {
                        return Err(format!(
                            "`{}` claims {count} entries, more than there are bytes",
                            field.name
                        ));
                    }
                    self.counts.push(count);
                    count
                }
            };
            if is_blob(field) {
                cursor.bytes(count)?;
                continue;
            }
            for _ in 0..count {
                match field.kind {
                    Kind::Unsigned(size) => self.values.push(cursor.unsigned(size)?),
                    Kind::Signed(size) => self.values.push(cursor.signed(size)?),
                    Kind::Float(size) => self.values.push(cursor.float(size)?),
                    Kind::String => {
                        let text = cursor.string()?;
                        if outermost && field.count != Count::One && NAMES.contains(&field.name.as_str()) {
                            self.names.extend_from_slice(text);
                            self.names.push(b'\n');
                        }
                    }
                    Kind::WideString => cursor.wide_string()?,
                    Kind::Time => {
                        let seconds = cursor.u32()?;
                        let nanoseconds = cursor.u32()?;
                        // ROS 2 counts seconds with a sign, ROS 1 without; both agree until 2038.
                        let all = i64::from(seconds.cast_signed()) * 1_000_000_000 + i64::from(nanoseconds);
                        if is_header && field.name == "stamp" {
                            self.stamp = Some(all);
                        }
                        self.values.push(all as f64 / 1e9);
                    }
                    Kind::Message(message) => {
                        let is_header = outermost && field.name == "header";
                        self.message(schema, message, cursor, false, is_header)?;
                    }
                }
                if self.values.len() > Limits::default().log_columns {
                    return Err("it has more numbers than a log has columns; take another topic".into());
                }
            }
        }
        Ok(())
    }
}

/// Bytes without end, such as a picture: no numbers of a log.
fn is_blob(field: &Field) -> bool {
    field.count == Count::Any && matches!(field.kind, Kind::Unsigned(1) | Kind::Signed(1))
}

/// What a number of a message is called.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Path {
    /// All of it, such as `effort[elbow]`, `motor_states[3].q`, `header.stamp`.
    pub text: String,
    /// The array that it is an entry of, and the joint, where the message says which joint it is about.
    pub joint: Option<(String, String)>,
}

/// The paths of a message's numbers, in their order.
pub(crate) fn paths(schema: &Schema, numbers: &Numbers) -> Vec<Path> {
    let names: Vec<String> = numbers
        .names
        .split(|&byte| byte == b'\n')
        .map(|name| String::from_utf8_lossy(name).into_owned())
        .collect();
    // The last line feed is followed by nothing.
    let names = &names[..names.len() - 1];
    let mut walk = Walk { schema, names, counts: numbers.counts.iter(), paths: Vec::new() };
    walk.message(0, "", None);
    walk.paths
}

struct Walk<'a> {
    schema: &'a Schema,
    names: &'a [String],
    counts: std::slice::Iter<'a, usize>,
    paths: Vec<Path>,
}

impl Walk<'_> {
    fn message(&mut self, message: usize, prefix: &str, joint: Option<&(String, String)>) {
        let schema = self.schema;
        for field in &schema.messages[message] {
            let base = format!("{prefix}{}", field.name);
            let count = match field.count {
                Count::One => 1,
                Count::Fixed(count) => count,
                Count::Any => self.counts.next().copied().unwrap_or(0),
            };
            if is_blob(field) {
                continue;
            }
            let of_joints = field.count != Count::One && !self.names.is_empty() && count == self.names.len();
            for entry in 0..count {
                let (text, joint) = match (field.count, of_joints) {
                    (Count::One, _) => (base.clone(), joint.cloned()),
                    (_, false) => (format!("{base}[{entry}]"), joint.cloned()),
                    (_, true) => {
                        let name = &self.names[entry];
                        (format!("{base}[{name}]"), Some((base.clone(), name.clone())))
                    }
                };
                match field.kind {
                    Kind::String | Kind::WideString => {}
                    Kind::Message(message) => self.message(message, &format!("{text}."), joint.as_ref()),
                    _ => self.paths.push(Path { text, joint }),
                }
            }
        }
    }
}
