//! What a text asks for, before any parser sees it: sizes, depth and counts in one pass without memory.
//!
//! A parser that recurses, compares every attribute with every other, or expands entities is at the mercy of
//! the text. This pass over-estimates where the text is no XML: the parser then says what is wrong with it.

use super::UrdfError;
use phiw_limits::Limits;

/// Checks the text of a URDF, or of another description of a robot in XML, against the limits, before a
/// parser sees it.
///
/// # Errors
/// [`UrdfError::TooMuch`].
pub fn check(text: &str, limits: &Limits) -> Result<(), UrdfError> {
    let size = text.len() as u64;
    if size > limits.urdf_bytes {
        return Err(UrdfError::TooMuch {
            line: 1,
            what: format!("the file has {size} bytes, more than {}", limits.urdf_bytes),
        });
    }
    let bytes = text.as_bytes();
    let too_much = |at: usize, what: String| {
        let line = 1 + bytes[..at].iter().filter(|&&byte| byte == b'\n').count();
        Err(UrdfError::TooMuch { line, what })
    };
    let (mut depth, mut elements, mut at) = (0_usize, 0_usize, 0);
    let mut entities = Entities::default();
    while let Some(found) = bytes[at..].iter().position(|&byte| byte == b'<' || byte == b'&') {
        at += found;
        let rest = &text[at..];
        if let Some(reference) = rest.strip_prefix('&') {
            let name = reference.split(';').next().unwrap_or_default();
            if entities.expand(name) > limits.xml_expanded_bytes {
                return too_much(
                    at,
                    format!("its entities expand to more than {} bytes", limits.xml_expanded_bytes),
                );
            }
            at += 1;
        } else if let Some(length) = skipped(rest) {
            at += length;
        } else if rest.starts_with("<!DOCTYPE") {
            let end = rest.find("]>").or_else(|| rest.find('>')).unwrap_or(rest.len());
            entities.declare(&rest[..end]);
            at += end.max(1);
        } else {
            let Tag { length, attributes, closed } = tag(rest);
            if attributes > limits.xml_attributes {
                return too_much(
                    at,
                    format!("an element has more than {} attributes", limits.xml_attributes),
                );
            }
            match (rest.starts_with("</"), closed) {
                (true, _) => depth = depth.saturating_sub(1),
                (false, true) => elements += 1,
                (false, false) => (elements, depth) = (elements + 1, depth + 1),
            }
            if depth > limits.xml_depth {
                return too_much(
                    at,
                    format!("elements stand inside each other more than {} deep", limits.xml_depth),
                );
            }
            if elements > limits.xml_elements {
                return too_much(at, format!("there are more than {} elements", limits.xml_elements));
            }
            at += length;
        }
    }
    Ok(())
}

/// Length of a comment, of character data, or of a processing instruction at the start of the text.
fn skipped(text: &str) -> Option<usize> {
    let kinds = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")];
    let (_, end) = kinds.into_iter().find(|(start, _)| text.starts_with(start))?;
    Some(text.find(end).map_or(text.len(), |found| found + end.len()))
}

struct Tag {
    length: usize,
    attributes: usize,
    /// `<…/>`.
    closed: bool,
}

/// The tag at the start of the text; `>` inside quotes does not end it.
fn tag(text: &str) -> Tag {
    let (mut quote, mut attributes, mut before) = (None, 0, b' ');
    for (index, byte) in text.bytes().enumerate().skip(1) {
        match (quote, byte) {
            (Some(open), _) if open == byte => quote = None,
            (Some(_), _) => {}
            (None, b'"' | b'\'') => {
                attributes += 1;
                quote = Some(byte);
            }
            (None, b'>') => return Tag { length: index + 1, attributes, closed: before == b'/' },
            (None, _) => {}
        }
        before = byte;
    }
    Tag { length: text.len(), attributes, closed: false }
}

/// Lengths of the entities that a document type declares, those inside them expanded.
#[derive(Default)]
struct Entities {
    lengths: Vec<(String, u64)>,
    /// Bytes expanded so far.
    expanded: u64,
}

impl Entities {
    fn declare(&mut self, document_type: &str) {
        for declaration in document_type.split("<!ENTITY").skip(1) {
            let mut words = declaration.split_whitespace();
            let name = words.next().unwrap_or_default().to_owned();
            let quote = declaration.find(['"', '\'']);
            let value = quote.map(|start| {
                let open = declaration[start..].chars().next().unwrap_or('"');
                declaration[start + 1..].split(open).next().unwrap_or_default()
            });
            let value = value.unwrap_or_default();
            let inside =
                value.split('&').skip(1).map(|rest| self.length(rest.split(';').next().unwrap_or("")));
            let length = inside.fold(value.len() as u64, u64::saturating_add);
            self.lengths.push((name, length));
        }
    }

    /// Length of an entity; those that are declared later or not at all are no more than a character.
    fn length(&self, name: &str) -> u64 {
        self.lengths.iter().find(|(other, _)| other == name).map_or(1, |(_, length)| *length)
    }

    /// Counts one reference, and gives all bytes so far.
    fn expand(&mut self, name: &str) -> u64 {
        self.expanded = self.expanded.saturating_add(self.length(name));
        self.expanded
    }
}
