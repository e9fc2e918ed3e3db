//! The URDF with the identified parameters in it: those of bodies that can exist.

use crate::Error;
use crate::exported::{Carried, LeftOut, MARK, fitted, header};
use phiw_dynamics::urdf::{JointFriction, write_identified_urdf};
use phiw_identification::EffectCatalogue;
use phiw_identification::effect::JointProperty;

/// Properties of a joint that URDF's `<dynamics>` has: damping and friction.
const EXPRESSED: [JointProperty; 2] = [JointProperty::Damping, JointProperty::Friction];

/// The URDF with the identified inertial parameters, and with damping and friction where they were
/// identified.
///
/// # Errors
/// The parameters cannot be expressed.
pub fn identified_urdf(carried: Carried<'_>) -> Result<String, Error> {
    let tree = carried.model.consistent_tree(carried.tree)?;
    let friction = |joint: usize| {
        let body = carried.tree.joint(joint);
        let [damping, friction] = EXPRESSED.map(|property| fitted(carried, property, &body.joint));
        // What was not identified stays as the URDF declares it.
        (damping.is_some() || friction.is_some()).then(|| JointFriction {
            joint: body.joint.clone(),
            damping: damping.unwrap_or(body.damping),
            friction: friction.unwrap_or(body.friction),
        })
    };
    let declared: Vec<JointFriction> = (0..tree.joint_count()).filter_map(friction).collect();
    let text = write_identified_urdf(carried.xml, &tree, &declared)
        .map_err(|source| Error::IdentifiedUrdf(Box::new(source)))?;
    Ok(with_header(&text, &header(carried, FILE, &not_expressed(carried))))
}

/// Name of the file.
const FILE: &str = "identified.urdf";

/// What of the model the URDF lacks, in words.
pub fn not_expressed(carried: Carried<'_>) -> Vec<String> {
    let mut left_out = LeftOut::default();
    for effect in &carried.model.effects {
        let property = carried.catalogue.joint_property(&effect.spec);
        if !property.is_some_and(|property| EXPRESSED.contains(&property)) {
            left_out.add(effect.spec.kind.clone(), &effect.spec.joints);
        }
    }
    left_out.in_words()
}

/// The text with a comment before its root element, in the place of one that an earlier run has put there.
fn with_header(text: &str, lines: &[String]) -> String {
    // Nothing may stand before the XML declaration, nor the mark of the byte order before that.
    let start = text.len() - text.trim_start_matches('\u{feff}').len();
    let declared = text[start..].starts_with("<?xml").then(|| text[start..].find("?>")).flatten();
    let head = declared.map_or(start, |end| start + end + 2);
    let (before, mut after) = text.split_at(head);
    let old = after.trim_start().strip_prefix("<!--").filter(|old| old.trim_start().starts_with(MARK));
    if let Some((_, rest)) = old.and_then(|old| old.split_once("-->")) {
        after = rest;
    }
    let gap = if declared.is_some() { "\n" } else { "" };
    format!("{before}{gap}{}{}", phiw_mjcf::comment(lines), after.trim_start_matches(['\n', '\r']))
}

#[cfg(test)]
mod tests {
    use super::with_header;

    #[test]
    fn a_header_stands_before_the_root_once() {
        let line = |text: &str| vec![format!("{} from {text}.", super::MARK)];
        for declaration in ["", "<?xml version=\"1.0\"?>\n", "\u{feff}<?xml version=\"1.0\"?>\n"] {
            let text = format!("{declaration}<!-- mine --><robot/>\n");
            let once = with_header(&text, &line("a -- b"));
            let again = with_header(&once, &line("c"));
            let expected =
                format!("{declaration}<!--\n  Identified by phiw from c.\n-->\n<!-- mine --><robot/>\n");
            assert_eq!(again, expected);
            assert!(once.contains("a - - b"));
        }
    }
}
