//! Edits of an XML text that leave every other byte as it is.

use roxmltree::Node;
use std::ops::Range;

/// One more level of indentation.
const INDENT: &str = "  ";

/// Replacements of byte ranges of one text.
pub(super) struct Splices<'a> {
    text: &'a str,
    edits: Vec<(Range<usize>, String)>,
}

impl<'a> Splices<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Splices { text, edits: Vec::new() }
    }

    /// Removes an element, and the line that it leaves empty.
    pub(super) fn remove(&mut self, element: Node) {
        let Range { mut start, end } = element.range();
        let ends_line = self.text[end..].starts_with(['\n', '\r']);
        if let (Some(line_break), true) = (self.line_break_before(element), ends_line) {
            start -= line_break.len();
        }
        self.edits.push((start..end, String::new()));
    }

    /// Gives the element an attribute, or a new value to one that it has.
    pub(super) fn set_attribute(&mut self, element: Node, key: &str, value: &str) {
        match element.attribute_node(key) {
            Some(attribute) => self.edits.push((attribute.range_value(), value.to_owned())),
            None => {
                let start = element.range().start;
                let end = start + 1 + tag(&self.text[start..]).len();
                self.edits.push((end..end, format!(" {key}=\"{value}\"")));
            }
        }
    }

    /// Puts `<tag>` with the children in the place of the element.
    pub(super) fn replace_element(&mut self, element: Node, tag: &str, children: &[String]) {
        let with = nested(tag, children, self.line_break_before(element));
        self.edits.push((element.range(), with));
    }

    /// Puts `<tag>` with the children behind the last child of the element.
    pub(super) fn append_element(&mut self, element: Node, tag: &str, children: &[String]) {
        let with = nested(tag, children, self.line_break_inside(element).as_deref());
        self.append_child(element, &with);
    }

    /// Puts `child` behind the last child of the element, on a line of its own where its siblings are.
    pub(super) fn append_child(&mut self, element: Node, child: &str) {
        let range = element.range();
        let source = &self.text[range.clone()];
        let line_break = self.line_break_inside(element).unwrap_or_default();
        if source.ends_with("/>") {
            let closing = self.line_break_before(element).unwrap_or_default();
            let with = format!(">{line_break}{child}{closing}</{}>", tag(source));
            self.edits.push((range.end - 2..range.end, with));
        } else if let Some(closing) = source.rfind("</") {
            // Ahead of the white space that leads to the closing tag.
            let end = range.start + source[..closing].trim_end().len();
            self.edits.push((end..end, format!("{line_break}{child}")));
        }
    }

    /// The text with all edits made. Edits at one place keep their order; ranges must not overlap.
    pub(super) fn finish(mut self) -> String {
        self.edits.sort_by_key(|(range, _)| (range.start, range.end));
        let mut result = String::with_capacity(self.text.len());
        let mut done = 0;
        for (range, with) in &self.edits {
            result.push_str(&self.text[done..range.start]);
            result.push_str(with);
            done = range.end;
        }
        result.push_str(&self.text[done..]);
        result
    }

    /// Line break and indentation ahead of an element that begins its line.
    fn line_break_before(&self, element: Node) -> Option<&'a str> {
        let before = &self.text[..element.range().start];
        let line_break = &before[before.trim_end_matches([' ', '\t', '\n', '\r']).len()..];
        // The last line break of several: empty lines are not copied.
        line_break.rfind('\n').map(|newline| {
            let carriage_return = usize::from(line_break[..newline].ends_with('\r'));
            &line_break[newline - carriage_return..]
        })
    }

    /// Line break and indentation for a new child: that of the first child, or one level more than the
    /// element.
    fn line_break_inside(&self, element: Node) -> Option<String> {
        match element.first_element_child() {
            Some(sibling) => self.line_break_before(sibling).map(str::to_owned),
            None => self.line_break_before(element).map(|line_break| format!("{line_break}{INDENT}")),
        }
    }
}

/// The name in an opening tag at the start of the text.
fn tag(source: &str) -> &str {
    let name = source.strip_prefix('<').unwrap_or(source);
    &name[..name.find([' ', '\t', '\n', '\r', '/', '>']).unwrap_or(name.len())]
}

fn nested(tag: &str, children: &[String], line_break: Option<&str>) -> String {
    match line_break {
        Some(line_break) => {
            let inner: String = children.iter().map(|child| format!("{line_break}{INDENT}{child}")).collect();
            format!("<{tag}>{inner}{line_break}</{tag}>")
        }
        None => format!("<{tag}>{}</{tag}>", children.concat()),
    }
}
