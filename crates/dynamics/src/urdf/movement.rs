//! Which joints move by themselves, which follow another, and which stand still.

use super::UrdfError;
use super::error::nearest;
use super::joint::is_usable;
use super::robot::{Joint, JointKind, Robot};
use std::collections::HashMap;

/// How a joint gets its position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Movement {
    /// It stands still at this position: fixed, held, or (`led`) following a joint that stands still.
    Still { position: f64, led: bool },
    /// It has a coordinate of its own.
    Free,
    /// Position = `ratio` · position of the joint with index `leader` + `offset`.
    Follows { leader: usize, ratio: f64, offset: f64 },
}

/// The movement of every joint, in the order of the file.
///
/// `held` are the places and positions of the joints that are held \[rad, m\].
pub(super) fn movements(robot: &Robot, held: &[(usize, f64)]) -> Result<Vec<Movement>, UrdfError> {
    let indices: HashMap<&str, usize> =
        robot.joints.iter().enumerate().map(|(index, joint)| (joint.name.as_str(), index)).collect();
    let held: HashMap<usize, f64> = held.iter().copied().collect();
    (0..robot.joints.len()).map(|joint| movement(robot, &indices, &held, joint)).collect()
}

/// Goes along the chain of leaders to one that is free or still.
fn movement(
    robot: &Robot,
    indices: &HashMap<&str, usize>,
    held: &HashMap<usize, f64>,
    follower: usize,
) -> Result<Movement, UrdfError> {
    let (mut current, mut ratio, mut offset) = (follower, 1.0, 0.0);
    for _ in 0..=robot.joints.len() {
        let joint = &robot.joints[current];
        if let Some(position) = still_at(joint, held.get(&current)) {
            return Ok(Movement::Still { position: ratio * position + offset, led: current != follower });
        }
        match (unsingle(joint), current == follower) {
            (Some("floating"), true) => return Ok(Movement::Free),
            (Some(kind), true) => {
                return Err(UrdfError::UnsupportedJoint {
                    line: joint.line,
                    joint: joint.name.clone(),
                    kind: kind.to_owned(),
                });
            }
            (Some(kind), false) => {
                return Err(UrdfError::LeaderWithoutPosition {
                    line: robot.joints[follower].line,
                    joint: robot.joints[follower].name.clone(),
                    leader: joint.name.clone(),
                    kind,
                });
            }
            (None, _) => {}
        }
        let Some(mimic) = &joint.mimic else {
            return Ok(match (current == follower, ratio) {
                (true, _) => Movement::Free,
                (false, 0.0) => Movement::Still { position: offset, led: true },
                (false, _) => Movement::Follows { leader: current, ratio, offset },
            });
        };
        current = *indices.get(mimic.joint.as_str()).ok_or_else(|| UrdfError::UnknownLeader {
            line: joint.line,
            joint: joint.name.clone(),
            leader: mimic.joint.clone(),
            nearest: nearest(&mimic.joint, indices.keys().copied()),
        })?;
        offset += ratio * mimic.offset;
        ratio *= mimic.multiplier;
        let own_are_usable = is_usable(mimic.multiplier) && is_usable(mimic.offset);
        if own_are_usable && !(is_usable(ratio) && is_usable(offset)) {
            return Err(UrdfError::NotFinite {
                line: Some(robot.joints[follower].line),
                kind: "joint",
                name: robot.joints[follower].name.clone(),
                field: "what the chain of its mimics multiplies up to",
            });
        }
    }
    Err(UrdfError::MimicLoop {
        line: robot.joints[follower].line,
        joint: robot.joints[follower].name.clone(),
    })
}

fn still_at(joint: &Joint, held: Option<&f64>) -> Option<f64> {
    match joint.kind {
        JointKind::Fixed => Some(0.0),
        _ => held.copied(),
    }
}

/// The name of a joint type that is not described by a single position.
fn unsingle(joint: &Joint) -> Option<&'static str> {
    match joint.kind {
        JointKind::Floating | JointKind::Planar | JointKind::Spherical => Some(joint.kind.name()),
        _ => None,
    }
}
