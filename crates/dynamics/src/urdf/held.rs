//! Which joints are held: names, and patterns of names.

use super::UrdfError;
use super::error::nearest;
use super::joint::is_usable;
use super::robot::{Joint, JointKind, Robot};

/// The joints that are held, each once, with their place in the file and position \[rad, m\].
///
/// A name that no joint has may be a pattern: `*` stands for any letters, `?` for one. It holds the joints
/// that move by themselves; what follows one of them stands still with it.
///
/// # Errors
/// A name or pattern that no joint has, a position that is no number, or a joint held in two places.
pub(super) fn held_joints(robot: &Robot, asked: &[(String, f64)]) -> Result<Vec<(usize, f64)>, UrdfError> {
    let mut held: Vec<(usize, f64)> = Vec::new();
    for (name, position) in asked {
        if !is_usable(*position) {
            return Err(UrdfError::NotFinite {
                line: None,
                kind: "joint",
                name: name.clone(),
                field: "the held position",
            });
        }
        for joint in joints_of(robot, name)? {
            match held.iter().find(|(other, _)| *other == joint) {
                Some((_, first)) if first != position => {
                    let joint = robot.joints[joint].name.clone();
                    return Err(UrdfError::HeldTwice { joint, positions: [*first, *position] });
                }
                Some(_) => {}
                None => held.push((joint, *position)),
            }
        }
    }
    Ok(held)
}

/// The joint of this name; if there is none, those that it is a pattern of.
fn joints_of(robot: &Robot, name: &str) -> Result<Vec<usize>, UrdfError> {
    let joints = || robot.joints.iter().enumerate();
    if let Some((joint, _)) = joints().find(|(_, joint)| joint.name == name) {
        return Ok(vec![joint]);
    }
    let is_pattern = name.contains(['*', '?']);
    let matching: Vec<usize> = joints()
        .filter(|(_, joint)| moves_by_itself(joint))
        .filter(|(_, joint)| is_pattern && matches(name.as_bytes(), joint.name.as_bytes()))
        .map(|(joint, _)| joint)
        .collect();
    match (is_pattern, matching.is_empty()) {
        (true, true) => Err(UrdfError::NothingToHold {
            pattern: name.to_owned(),
            joints: joints()
                .filter(|(_, joint)| moves_by_itself(joint))
                .map(|(_, joint)| joint.name.clone())
                .collect(),
        }),
        (false, _) => Err(UrdfError::UnknownHeldJoint {
            joint: name.to_owned(),
            nearest: nearest(name, joints().map(|(_, joint)| joint.name.as_str())),
        }),
        (true, false) => Ok(matching),
    }
}

/// Whether a joint has a coordinate of its own that can be held: the base does not stand still by a pattern.
fn moves_by_itself(joint: &Joint) -> bool {
    !matches!(joint.kind, JointKind::Fixed | JointKind::Floating) && joint.mimic.is_none()
}

/// Whether a pattern stands for a name. Where letters do not fit, the last `*` takes one letter more.
fn matches(pattern: &[u8], name: &[u8]) -> bool {
    let (mut p, mut n) = (0, 0);
    // Places behind the last `*`, and in the name up to which it reaches.
    let mut star: Option<(usize, usize)> = None;
    while n < name.len() {
        match pattern.get(p) {
            Some(b'*') => {
                p += 1;
                star = Some((p, n));
            }
            Some(b'?') => {
                // One letter, of however many bytes.
                p += 1;
                n += 1;
                n += name[n..].iter().take_while(|byte| **byte & 0xC0 == 0x80).count();
            }
            Some(letter) if *letter == name[n] => (p, n) = (p + 1, n + 1),
            _ => match star {
                Some((behind, reach)) => {
                    (p, n) = (behind, reach + 1);
                    star = Some((behind, n));
                }
                None => return false,
            },
        }
    }
    pattern[p..].iter().all(|letter| *letter == b'*')
}

#[cfg(test)]
mod tests {
    use super::matches;

    fn check(pattern: &str, matching: &[&str], others: &[&str]) {
        for name in matching {
            assert!(matches(pattern.as_bytes(), name.as_bytes()), "{pattern} {name}");
        }
        for name in others {
            assert!(!matches(pattern.as_bytes(), name.as_bytes()), "{pattern} {name}");
        }
    }

    #[test]
    fn patterns_stand_for_names() {
        check("left_*", &["left_", "left_knee"], &["left", "right_knee", "my_left_knee"]);
        check("*_knee", &["_knee", "left_knee", "a_knee_knee"], &["left_knee_pitch", "knee"]);
        check("l?ft", &["left", "l_ft", "läft"], &["lft", "leeft"]);
        check("*a*b*", &["ab", "xaybz", "aab"], &["ba", "a"]);
        check("*", &["", "a", "ä"], &[]);
        check("?", &["a", "ä"], &["", "ab"]);
        check("", &[""], &["a"]);
        check("a**b", &["ab", "acb"], &["a"]);
    }
}
