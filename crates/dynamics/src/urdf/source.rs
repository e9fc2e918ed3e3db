//! The URDF's text as a document, and how its elements are found.

use super::UrdfError;
use roxmltree::{Document, Node};

/// Parses the text as a `<robot>`.
pub(super) fn parse(xml: &str) -> Result<Document<'_>, UrdfError> {
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    let document = Document::parse_with_options(xml.trim_start_matches('\u{feff}'), options)?;
    let root = document.root_element();
    if root.tag_name().name() != "robot" {
        return Err(UrdfError::NotRobot { root: root.tag_name().name().to_owned() });
    }
    let is_xacro = |node: Node| node.tag_name().namespace().is_some_and(|uri| uri.ends_with("/xacro"));
    if root.descendants().any(is_xacro) {
        return Err(UrdfError::Xacro);
    }
    Ok(document)
}

/// The element's children of that tag.
pub(super) fn children<'a, 'input>(
    element: Node<'a, 'input>,
    tag: &str,
) -> impl Iterator<Item = Node<'a, 'input>> {
    element.children().filter(move |node| node.tag_name().name() == tag)
}

/// The element's first child of that tag.
pub(super) fn child<'a, 'input>(element: Node<'a, 'input>, tag: &str) -> Option<Node<'a, 'input>> {
    children(element, tag).next()
}

/// The element's `name`.
pub(super) fn name(element: Node) -> String {
    element.attribute("name").unwrap_or_default().to_owned()
}

/// The line at which the element starts.
pub(super) fn line(element: Node) -> u32 {
    element.document().text_pos_at(element.range().start).row
}

/// The element's children of that tag, each with the line at which it starts: [`line`] of one after the other
/// would go through the text each time.
pub(super) fn children_with_lines<'a, 'input>(
    element: Node<'a, 'input>,
    tag: &str,
) -> impl Iterator<Item = (Node<'a, 'input>, u32)> {
    let text = element.document().input_text().as_bytes();
    let (mut position, mut line) = (0, 1);
    children(element, tag).map(move |node| {
        let start = node.range().start;
        if start < position {
            // What an entity holds stands where the entity is declared.
            (position, line) = (0, 1);
        }
        line += text[position..start].iter().filter(|&&byte| byte == b'\n').count() as u32;
        position = start;
        (node, line)
    })
}
