//! Files that a file includes, written into it.

use super::MjcfReadError;
use super::element::line;
use phiw_dynamics::urdf::check_xml;
use phiw_limits::Limits;
use roxmltree::{Document, Node};
use std::collections::BTreeSet;

/// Gives the text of an included file, by its name as it is written; in words why it cannot.
pub type Loader<'a> = dyn FnMut(&str) -> Result<String, String> + 'a;

/// The text with every `<include>` replaced by what stands in the root element of its file; none where it
/// includes nothing.
///
/// # Errors
/// A file cannot be had, is included twice (as one that includes itself is), or all together are too large.
pub(super) fn with_includes(text: &str, load: &mut Loader<'_>) -> Result<Option<String>, MjcfReadError> {
    let mut expansion = Expansion { load, taken: BTreeSet::new(), bytes: text.len() as u64 };
    let document = parse(text)?;
    if includes(&document).next().is_none() {
        return Ok(None);
    }
    expansion.expanded(&document).map(Some)
}

struct Expansion<'a, 'b> {
    load: &'a mut Loader<'b>,
    /// Files that have been included.
    taken: BTreeSet<String>,
    /// Bytes of all texts so far.
    bytes: u64,
}

impl Expansion<'_, '_> {
    fn expanded(&mut self, document: &Document<'_>) -> Result<String, MjcfReadError> {
        let text = document.input_text();
        let (mut whole, mut done) = (String::with_capacity(text.len()), 0);
        for include in includes(document) {
            let Some(file) = include.attribute("file") else {
                let element = "include".to_owned();
                return Err(MjcfReadError::Missing { line: line(include), element, attribute: "file" });
            };
            let range = include.range();
            // One include within another is gone with it.
            if range.start < done {
                continue;
            }
            whole.push_str(&text[done..range.start]);
            whole.push_str(&self.content(include, file)?);
            done = range.end;
        }
        whole.push_str(&text[done..]);
        Ok(whole)
    }

    /// What stands in the root element of an included file.
    fn content(&mut self, include: Node<'_, '_>, file: &str) -> Result<String, MjcfReadError> {
        let refused = |what: String| MjcfReadError::NotRead { line: line(include), what };
        let shown: String = file.chars().take(200).collect();
        if !self.taken.insert(file.to_owned()) {
            return Err(refused(format!(
                "it includes `{shown}` twice, which MuJoCo refuses, too: include it once"
            )));
        }
        let text = (self.load)(file)
            .map_err(|why| refused(format!("it includes `{shown}`, which cannot be read: {why}")))?;
        self.bytes += text.len() as u64;
        let most = Limits::default().urdf_bytes;
        if self.bytes > most {
            return Err(refused(format!(
                "with `{shown}` the files that it includes have more than {most} bytes"
            )));
        }
        let within = |source| MjcfReadError::Included { file: shown.clone(), source: Box::new(source) };
        let document = parse(&text).map_err(within)?;
        let root = document.root_element().tag_name().name();
        if !matches!(root, "mujoco" | "mujocoinclude") {
            return Err(within(MjcfReadError::NoMjcf { found: root.to_owned() }));
        }
        let whole = self.expanded(&document).map_err(within)?;
        let document = parse(&whole).map_err(within)?;
        let root = document.root_element();
        let inside = root.first_child().zip(root.last_child());
        let range = inside.map_or(0..0, |(first, last)| first.range().start..last.range().end);
        Ok(whole[range].to_owned())
    }
}

fn includes<'a, 'input>(document: &'a Document<'input>) -> impl Iterator<Item = Node<'a, 'input>> {
    document.descendants().filter(|node| node.has_tag_name("include"))
}

pub(super) fn parse(text: &str) -> Result<Document<'_>, MjcfReadError> {
    let text = text.trim_start_matches('\u{feff}');
    check_xml(text, &Limits::default())?;
    Document::parse(text)
        .map_err(|error| MjcfReadError::Malformed { line: error.pos().row, why: error.to_string() })
}
