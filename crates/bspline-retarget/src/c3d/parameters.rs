//! The parameter section: groups of named arrays.

use super::{BLOCK, C3dError, Processor};

/// All parameters of a file, in its order; names are upper case.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parameters(pub Vec<Parameter>);

/// A parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name of its group, empty if the file never names it.
    pub group: String,
    /// Its own name.
    pub name: String,
    /// What it holds.
    pub value: ParameterValue,
}

/// The content of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum ParameterValue {
    /// Texts, trailing blanks removed.
    Text(Vec<String>),
    /// Integers of one or two bytes.
    Integers(Vec<i16>),
    /// Reals.
    Reals(Vec<f32>),
}

impl Parameters {
    /// A parameter by group and name.
    pub fn get(&self, group: &str, name: &str) -> Option<&ParameterValue> {
        self.0
            .iter()
            .find(|parameter| parameter.group == group && parameter.name == name)
            .map(|parameter| &parameter.value)
    }

    /// A number of a parameter, whatever its kind.
    pub fn number(&self, group: &str, name: &str, index: usize) -> Option<f64> {
        match self.get(group, name)? {
            ParameterValue::Integers(values) => values.get(index).map(|&value| f64::from(value)),
            ParameterValue::Reals(values) => values.get(index).map(|&value| f64::from(value)),
            ParameterValue::Text(_) => None,
        }
    }

    /// A count that is stored as a 16-bit integer without sign, or as a real.
    pub(super) fn count(&self, group: &str, name: &str) -> Option<usize> {
        match self.get(group, name)? {
            ParameterValue::Integers(values) => values.first().map(|&value| usize::from(value as u16)),
            ParameterValue::Reals(values) => {
                values.first().filter(|value| **value >= 0.0).map(|&value| value as usize)
            }
            ParameterValue::Text(_) => None,
        }
    }

    /// A count in two 16-bit words, low word first, or in one real.
    pub(super) fn long_count(&self, group: &str, name: &str) -> Option<usize> {
        match self.get(group, name)? {
            ParameterValue::Integers(values) if values.len() >= 2 => {
                Some(usize::from(values[0] as u16) | usize::from(values[1] as u16) << 16)
            }
            _ => self.count(group, name),
        }
    }

    /// Texts of a parameter; empty if it is absent.
    pub fn texts(&self, group: &str, name: &str) -> &[String] {
        match self.get(group, name) {
            Some(ParameterValue::Text(texts)) => texts,
            _ => &[],
        }
    }
}

/// Reads the section that starts at block `first_block` (1-based); also gives the processor and the section's
/// end (byte).
pub(super) fn read(bytes: &[u8], first_block: u8) -> Result<(Parameters, Processor, usize), C3dError> {
    let start = usize::from(first_block.saturating_sub(1)) * BLOCK;
    if start < BLOCK {
        let what = format!("it is said to start at block {first_block}, inside the header");
        return Err(C3dError::ParameterSection { at: 0, what });
    }
    let head = bytes.get(start..start + 4).ok_or(C3dError::Truncated {
        what: "the parameter section",
        from: start,
        to: start + 4,
        length: bytes.len(),
    })?;
    let processor = Processor::from_code(head[3], start + 3)?;
    // The number of blocks is a byte, and wrong in many files: the chain of entries says where the section
    // ends.
    let mut reader = Reader { bytes, at: start + 4 };
    let mut groups: Vec<(u8, String)> = Vec::new();
    let mut entries: Vec<(u8, String, ParameterValue)> = Vec::new();
    loop {
        let entry = reader.at;
        let name_length = reader.byte("an entry")? as i8;
        let id = reader.byte("an entry")? as i8;
        if name_length == 0 {
            break;
        }
        let name = reader.take(usize::from(name_length.unsigned_abs()), "the name of a parameter")?;
        let name = String::from_utf8_lossy(name).trim().to_ascii_uppercase();
        let offset_at = reader.at;
        let offset = processor.read_i16(reader.pair("the offset of an entry")?);
        let next = offset_at + usize::from(offset as u16);
        if offset != 0 && next < offset_at + 2 {
            let what = format!("the offset of {name} is {offset}, so it would lie in itself");
            return Err(C3dError::ParameterSection { at: offset_at, what });
        }
        match id {
            0 => {
                let what = format!("{name} belongs to group 0, which can not be");
                return Err(C3dError::ParameterSection { at: entry, what });
            }
            ..0 => groups.push((id.unsigned_abs(), name)),
            1.. => {
                let end = if offset == 0 { bytes.len() } else { next };
                let value = read_value(&mut reader, processor, &name, end)?;
                entries.push((id.unsigned_abs(), name, value));
            }
        }
        if offset == 0 {
            break;
        }
        if next > bytes.len() {
            return Err(C3dError::Truncated {
                what: "the parameter section",
                from: entry,
                to: next,
                length: bytes.len(),
            });
        }
        reader.at = next;
    }
    let named = |id: u8| {
        groups.iter().find(|(group, _)| *group == id).map(|(_, name)| name.clone()).unwrap_or_default()
    };
    let parameters =
        entries.into_iter().map(|(id, name, value)| Parameter { group: named(id), name, value }).collect();
    Ok((Parameters(parameters), processor, reader.at))
}

/// Kind, dimensions and elements of a parameter, which must end before byte `end`.
fn read_value(
    reader: &mut Reader<'_>,
    processor: Processor,
    name: &str,
    end: usize,
) -> Result<ParameterValue, C3dError> {
    let at = reader.at;
    let wrong = |what: String| C3dError::ParameterSection { at, what };
    let kind = reader.byte("the kind of a parameter")? as i8;
    let dimensions = usize::from(reader.byte("the dimensions of a parameter")?);
    let dimensions = reader.take(dimensions, "the dimensions of a parameter")?;
    let element = match kind {
        -1 | 1 => 1,
        2 => 2,
        4 => 4,
        _ => return Err(wrong(format!("{name} is of kind {kind}; known are -1, 1, 2 and 4"))),
    };
    let size = dimensions
        .iter()
        .try_fold(element, |size: usize, &length| size.checked_mul(usize::from(length)))
        .filter(|size| reader.at + size <= end)
        .ok_or_else(|| wrong(format!("{name} has dimensions {dimensions:?}, more than its entry holds")))?;
    let data = reader.take(size, "the values of a parameter")?;
    Ok(match kind {
        -1 => ParameterValue::Text(texts(data, dimensions)),
        1 => ParameterValue::Integers(data.iter().map(|&byte| i16::from(byte as i8)).collect()),
        2 => ParameterValue::Integers(
            data.as_chunks::<2>().0.iter().map(|&pair| processor.read_i16(pair)).collect(),
        ),
        _ => ParameterValue::Reals(
            data.as_chunks::<4>().0.iter().map(|&four| processor.read_f32(four)).collect(),
        ),
    })
}

/// A text for each run of the first dimension; without dimensions, one character.
fn texts(data: &[u8], dimensions: &[u8]) -> Vec<String> {
    let length = dimensions.first().map_or(1, |&length| usize::from(length));
    if length == 0 {
        return Vec::new();
    }
    data.chunks_exact(length)
        .map(|text| {
            String::from_utf8_lossy(text).trim_matches(|c: char| c.is_whitespace() || c == '\0').to_owned()
        })
        .collect()
}

/// A place in the file.
struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize, what: &'static str) -> Result<&'a [u8], C3dError> {
        let to = self.at.saturating_add(count);
        let taken = self.bytes.get(self.at..to).ok_or(C3dError::Truncated {
            what,
            from: self.at,
            to,
            length: self.bytes.len(),
        })?;
        self.at = to;
        Ok(taken)
    }

    fn byte(&mut self, what: &'static str) -> Result<u8, C3dError> {
        self.take(1, what).map(|taken| taken[0])
    }

    fn pair(&mut self, what: &'static str) -> Result<[u8; 2], C3dError> {
        self.take(2, what).map(|taken| [taken[0], taken[1]])
    }
}
