//! A kind of effect on some joints, as a command line and a model's file name it.

use crate::EffectSpec;
use std::fmt;

/// A kind of effect, on given joints or wherever it can act: `KIND[:JOINT[+JOINT…]]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EffectSelector {
    /// Kind, as in the catalogue (`viscous_friction`, …).
    pub kind: String,
    /// Names of joints; `None` stands for all on which the kind can act.
    pub joints: Option<Vec<String>>,
}

impl EffectSelector {
    /// Reads `KIND` or `KIND:JOINT[+JOINT…]`; white space around a name is no part of it. A name that is
    /// missing is read as an empty one, which no kind and no joint has.
    pub fn read(text: &str) -> Self {
        let (kind, joints) = match text.split_once(':') {
            Some((kind, joints)) => (kind, Some(joints.split('+'))),
            None => (text, None),
        };
        let joints = joints.map(|joints| joints.map(|joint| joint.trim().to_owned()).collect());
        EffectSelector { kind: kind.trim().to_owned(), joints }
    }

    /// Whether an effect is of this kind and on these joints alone.
    pub fn holds(&self, effect: &EffectSpec) -> bool {
        let on_these = |joints: &Vec<String>| effect.joints.iter().all(|joint| joints.contains(joint));
        self.kind == effect.kind && self.joints.as_ref().is_none_or(on_these)
    }
}

impl fmt::Display for EffectSelector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.kind)?;
        match &self.joints {
            Some(joints) => write!(f, ":{}", joints.join("+")),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::EffectSelector;
    use crate::EffectSpec;

    fn check(text: &str, kind: &str, joints: Option<&[&str]>, written: &str) {
        let selector = EffectSelector::read(text);
        let joints = joints.map(|joints| joints.iter().map(|joint| (*joint).to_owned()).collect());
        assert_eq!((selector.kind.as_str(), &selector.joints), (kind, &joints), "{text}");
        assert_eq!(selector.to_string(), written, "{text}");
    }

    #[test]
    fn selectors_are_read_and_written() {
        check("viscous_friction", "viscous_friction", None, "viscous_friction");
        check("payload:j1", "payload", Some(&["j1"]), "payload:j1");
        check(" payload : j1 + j2 ", "payload", Some(&["j1", "j2"]), "payload:j1+j2");
        // What is not there has no name, and nothing is called so.
        check("payload:", "payload", Some(&[""]), "payload:");
        check("payload:j1+", "payload", Some(&["j1", ""]), "payload:j1+");
        check(":j1", "", Some(&["j1"]), ":j1");
    }

    #[test]
    fn a_selector_holds_its_kind_on_its_joints_alone() {
        let (on_a, on_both) = (EffectSpec::new("k", &["a"]), EffectSpec::new("k", &["a", "b"]));
        for (text, expected) in [
            ("k", [true, true]),
            ("k:a", [true, false]),
            ("k:b+a", [true, true]),
            ("k:b", [false, false]),
            ("l", [false, false]),
        ] {
            let selector = EffectSelector::read(text);
            assert_eq!([selector.holds(&on_a), selector.holds(&on_both)], expected, "{text}");
        }
    }
}
