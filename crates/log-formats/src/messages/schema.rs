//! The layout of a message, from the text of its type's definition (`.msg` files, joined as ROS does).

use super::builtin_types::definition_of;

/// What a field holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Unsigned(u8),
    Signed(u8),
    Float(u8),
    String,
    WideString,
    /// Seconds and nanoseconds, 4 bytes each.
    Time,
    /// Index among the definitions.
    Message(usize),
}

/// How many of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Count {
    One,
    Fixed(usize),
    Any,
}

/// A field of a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Field {
    pub name: String,
    pub kind: Kind,
    pub count: Count,
}

/// The fields of a type of message and of all that it is made of; the type itself comes first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Schema {
    pub messages: Vec<Vec<Field>>,
}

/// Messages inside messages; what is published has six.
const DEEPEST: usize = 24;

impl Schema {
    /// Reads the definition of `type_name`; one that is well known needs no text.
    ///
    /// # Errors
    /// What in the text is not understood, in words.
    pub fn parse(type_name: &str, definition: Option<&str>) -> Result<Self, String> {
        let text = match definition.filter(|text| !text.trim().is_empty()) {
            Some(text) => text,
            None => definition_of(type_name)
                .ok_or_else(|| format!("the recording holds no definition of {type_name}"))?,
        };
        let mut sections = Sections::of(type_name, text);
        let mut messages = Vec::new();
        sections.read(0, &mut messages, 0)?;
        Ok(Schema { messages })
    }
}

/// The definitions of a text, each with its full name.
struct Sections<'a> {
    parts: Vec<(String, Vec<&'a str>)>,
    /// Which message a part has become.
    done: Vec<Option<usize>>,
}

impl<'a> Sections<'a> {
    fn of(type_name: &str, text: &'a str) -> Self {
        let mut parts = vec![(plain(type_name), Vec::new())];
        for line in text.lines() {
            let line = line.split('#').next().unwrap_or_default().trim();
            if let Some(name) = line.strip_prefix("MSG:") {
                parts.push((plain(name.trim()), Vec::new()));
            } else if !line.is_empty()
                && !line.bytes().all(|byte| byte == b'=')
                && let Some((_, lines)) = parts.last_mut()
            {
                lines.push(line);
            }
        }
        Sections { done: vec![None; parts.len()], parts }
    }

    /// Reads a part and all that it is made of; gives its index among the messages.
    fn read(&mut self, part: usize, messages: &mut Vec<Vec<Field>>, depth: usize) -> Result<usize, String> {
        if let Some(index) = self.done[part] {
            return Ok(index);
        }
        let (name, lines) = self.parts[part].clone();
        if depth > DEEPEST {
            return Err(format!("{name} is made of messages inside each other without end"));
        }
        let index = messages.len();
        messages.push(Vec::new());
        let mut fields = Vec::new();
        for line in lines {
            fields.extend(self.field(&name, line, messages, depth)?);
        }
        messages[index] = fields;
        self.done[part] = Some(index);
        Ok(index)
    }

    /// The field of a line; `None` for a constant.
    fn field(
        &mut self,
        inside: &str,
        line: &str,
        messages: &mut Vec<Vec<Field>>,
        depth: usize,
    ) -> Result<Option<Field>, String> {
        let mut words = line.split_whitespace();
        let (Some(type_name), Some(name)) = (words.next(), words.next()) else {
            return Err(format!("`{line}` in {inside} is no field"));
        };
        let is_constant = name.contains('=') || words.next().is_some_and(|word| word.starts_with('='));
        if is_constant {
            return Ok(None);
        }
        let (base, count) = match type_name.split_once('[') {
            None => (type_name, Count::One),
            Some((base, "]")) => (base, Count::Any),
            Some((base, length)) => {
                let length = length.trim_end_matches(']');
                match length.strip_prefix("<=") {
                    Some(_) => (base, Count::Any),
                    None => {
                        let length =
                            length.parse().map_err(|_| format!("`{line}` in {inside} is no field"))?;
                        (base, Count::Fixed(length))
                    }
                }
            }
        };
        // A bounded string: string<=10.
        let base = base.split_once("<=").map_or(base, |(base, _)| base);
        let kind = match base {
            "bool" | "byte" | "char" | "uint8" | "octet" => Kind::Unsigned(1),
            "uint16" => Kind::Unsigned(2),
            "uint32" => Kind::Unsigned(4),
            "uint64" => Kind::Unsigned(8),
            "int8" => Kind::Signed(1),
            "int16" => Kind::Signed(2),
            "int32" => Kind::Signed(4),
            "int64" => Kind::Signed(8),
            "float32" => Kind::Float(4),
            "float64" => Kind::Float(8),
            "string" => Kind::String,
            "wstring" => Kind::WideString,
            "time" | "duration" => Kind::Time,
            message => match plain(message).as_str() {
                "builtin_interfaces/Time" | "builtin_interfaces/Duration" => Kind::Time,
                message => Kind::Message(self.nested(inside, message, messages, depth)?),
            },
        };
        Ok(Some(Field { name: name.to_owned(), kind, count }))
    }

    fn nested(
        &mut self,
        inside: &str,
        message: &str,
        messages: &mut Vec<Vec<Field>>,
        depth: usize,
    ) -> Result<usize, String> {
        let full = match message {
            "Header" => "std_msgs/Header".to_owned(),
            message if message.contains('/') => message.to_owned(),
            message => format!("{}/{message}", inside.split('/').next().unwrap_or_default()),
        };
        if let Some(part) = self.parts.iter().position(|(name, _)| *name == full) {
            return self.read(part, messages, depth + 1);
        }
        let known =
            definition_of(&full).ok_or_else(|| format!("{inside} uses {full}, which is not defined"))?;
        let mut known = Sections::of(&full, known);
        // Its indices continue ours, so that it can be read in place.
        known.read(0, messages, depth + 1)
    }
}

/// `package/Type`, without `msg` between them.
fn plain(type_name: &str) -> String {
    type_name.replace("/msg/", "/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn definitions_are_read() {
        let text = "# a comment\nint32 A=1\nstring B = \"x # y\"\nHeader header\nfloat64[] x\nfloat32[3] y\nuint8[<=4] z\nPart[2] p\n\
                    string<=5 s\nint32 d 7\n\
                    ================\nMSG: pack/Part\nbuiltin_interfaces/Duration d\nint16 i # c\n\
                    ===\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n";
        let schema = Schema::parse("pack/msg/Whole", Some(text)).unwrap();
        let field = |name: &str, kind, count| Field { name: name.into(), kind, count };
        assert_eq!(
            schema.messages,
            [
                vec![
                    field("header", Kind::Message(1), Count::One),
                    field("x", Kind::Float(8), Count::Any),
                    field("y", Kind::Float(4), Count::Fixed(3)),
                    field("z", Kind::Unsigned(1), Count::Any),
                    field("p", Kind::Message(2), Count::Fixed(2)),
                    field("s", Kind::String, Count::One),
                    field("d", Kind::Signed(4), Count::One),
                ],
                vec![field("stamp", Kind::Time, Count::One), field("frame_id", Kind::String, Count::One)],
                vec![field("d", Kind::Time, Count::One), field("i", Kind::Signed(2), Count::One)],
            ]
        );
    }

    #[test]
    fn what_is_not_defined_is_named() {
        let check = |text: Option<&str>, part: &str| {
            let message = Schema::parse("pack/Whole", text).unwrap_err();
            assert!(message.contains(part), "{message}");
        };
        check(None, "no definition of pack/Whole");
        check(Some("Other o"), "pack/Whole uses pack/Other");
        check(Some("x"), "`x` in pack/Whole");
        check(Some("float64[x] y"), "`float64[x] y`");
        check(Some("Whole w"), "without end");
    }

    #[test]
    fn well_known_types_need_no_text() {
        for name in ["sensor_msgs/msg/JointState", "sensor_msgs/JointState", "std_msgs/msg/Float64MultiArray"]
        {
            Schema::parse(name, None).unwrap();
        }
    }
}
