//! Classes of defaults.

use super::MjcfReadError;
use super::element::line;
use roxmltree::Node;
use std::collections::BTreeMap;

/// Attributes of an element by name.
pub(super) type Attributes<'a> = BTreeMap<&'a str, &'a str>;

/// Elements whose defaults matter for a robot's dynamics.
const KINDS: [&str; 2] = ["joint", "geom"];

/// What each class says of each kind of element, inherited from the class that it stands in.
#[derive(Clone, Debug, Default)]
pub(super) struct Defaults<'a> {
    classes: BTreeMap<String, BTreeMap<&'a str, Attributes<'a>>>,
}

/// The class of all elements that name none.
const MAIN: &str = "main";

impl<'a> Defaults<'a> {
    /// Of the root element; there may be several sections.
    pub fn read(root: Node<'a, '_>) -> Result<Self, MjcfReadError> {
        let mut defaults = Defaults::default();
        defaults.classes.insert(MAIN.to_owned(), BTreeMap::new());
        for section in root.children().filter(|node| node.has_tag_name("default")) {
            let start = defaults.classes[MAIN].clone();
            defaults.class(section, section.attribute("class").unwrap_or(MAIN), start)?;
        }
        Ok(defaults)
    }

    fn class(
        &mut self,
        node: Node<'a, '_>,
        name: &str,
        mut own: BTreeMap<&'a str, Attributes<'a>>,
    ) -> Result<(), MjcfReadError> {
        for element in node.children() {
            if let Some(kind) = KINDS.iter().find(|kind| element.has_tag_name(**kind)) {
                let attributes = own.entry(kind).or_default();
                attributes
                    .extend(element.attributes().map(|attribute| (attribute.name(), attribute.value())));
            }
        }
        // The top class is the main one by whatever name it goes.
        let is_top = !node.parent().is_some_and(|parent| parent.has_tag_name("default"));
        if is_top {
            self.classes.insert(MAIN.to_owned(), own.clone());
        }
        self.classes.insert(name.to_owned(), own.clone());
        for inner in node.children().filter(|node| node.has_tag_name("default")) {
            let Some(name) = inner.attribute("class") else {
                return Err(MjcfReadError::Missing {
                    line: line(inner),
                    element: "default".to_owned(),
                    attribute: "class",
                });
            };
            self.class(inner, name, own.clone())?;
        }
        Ok(())
    }

    /// What an element's class says: its own, else `inherited`, that of the body it stands in, else the main.
    pub fn of(
        &self,
        node: Node<'_, '_>,
        inherited: Option<&str>,
    ) -> Result<Option<&Attributes<'a>>, MjcfReadError> {
        let name = node.attribute("class").or(inherited).unwrap_or(MAIN);
        let Some(class) = self.classes.get(name) else {
            let what = format!("the class `{name}` has no <default>");
            return Err(MjcfReadError::Name { line: line(node), what });
        };
        Ok(class.get(node.tag_name().name()))
    }
}
