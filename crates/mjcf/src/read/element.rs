//! An element with the defaults of its class.

use super::MjcfReadError;
use super::defaults::Attributes;
use roxmltree::Node;

/// An element whose attributes are its own, or its class's.
pub(super) struct Element<'a, 'input> {
    pub node: Node<'a, 'input>,
    defaults: Option<&'a Attributes<'a>>,
}

/// Line of the text in which an element begins, from 1.
pub(super) fn line(node: Node<'_, '_>) -> u32 {
    node.document().text_pos_at(node.range().start).row
}

impl<'a, 'input> Element<'a, 'input> {
    pub fn new(node: Node<'a, 'input>, defaults: Option<&'a Attributes<'a>>) -> Self {
        Element { node, defaults }
    }

    /// An attribute, its own or its class's.
    pub fn text(&self, name: &str) -> Option<&'a str> {
        let of_class = || self.defaults.and_then(|defaults| defaults.get(name).copied());
        self.node.attribute(name).or_else(of_class)
    }

    /// An error that names an attribute.
    pub fn wrong(&self, attribute: &'static str, value: &str, expected: impl Into<String>) -> MjcfReadError {
        MjcfReadError::Number {
            line: line(self.node),
            element: self.node.tag_name().name().to_owned(),
            attribute,
            value: value.chars().take(80).collect(),
            expected: expected.into(),
        }
    }

    /// All numbers of an attribute.
    pub fn list(&self, name: &'static str) -> Result<Option<Vec<f64>>, MjcfReadError> {
        let Some(text) = self.text(name) else { return Ok(None) };
        let number = |word: &str| word.parse::<f64>().ok().filter(|number| number.is_finite());
        let numbers: Option<Vec<f64>> = text.split_whitespace().map(number).collect();
        numbers.map(Some).ok_or_else(|| self.wrong(name, text, "finite numbers"))
    }

    /// A list of a length.
    pub fn numbers<const N: usize>(&self, name: &'static str) -> Result<Option<[f64; N]>, MjcfReadError> {
        let Some(list) = self.list(name)? else { return Ok(None) };
        let exact = <[f64; N]>::try_from(list);
        let text = self.text(name).unwrap_or_default();
        exact.map(Some).map_err(|_| self.wrong(name, text, format!("{N} numbers")))
    }

    /// The first number of an attribute (MuJoCo takes polynomials where there was a number).
    pub fn number(&self, name: &'static str) -> Result<Option<f64>, MjcfReadError> {
        Ok(self.list(name)?.and_then(|list| list.first().copied()))
    }

    /// An attribute that is `true`, `false` or `auto`.
    pub fn flag(&self, name: &'static str, auto: bool) -> Result<bool, MjcfReadError> {
        match self.text(name) {
            None | Some("auto") => Ok(auto),
            Some("true") => Ok(true),
            Some("false") => Ok(false),
            Some(other) => Err(self.wrong(name, other, "true, false or auto")),
        }
    }
}
