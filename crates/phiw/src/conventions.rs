//! Where a log counts joints otherwise than the URDF: what it is, and how a map mends it.

use crate::session::Session;
use phiw_identification::checks::{Convention, ConventionKind, ConventionSettings, conventions};
use phiw_identification::{Data, IdentificationError};
use phiw_report::number::{percent, significant};

/// One warning for each difference between the training logs and the URDF.
///
/// # Errors
/// A log cannot be read.
pub fn warnings(session: &Session, data: &Data<'_>) -> Result<Vec<String>, IdentificationError> {
    let found = conventions(&session.tree, data, &ConventionSettings::default())?;
    let name = |joint: usize| session.tree.joint(joint).joint.as_str();
    Ok(found.iter().map(|convention| in_words(convention, name)).collect())
}

fn in_words<'a>(convention: &Convention, name: impl Fn(usize) -> &'a str) -> String {
    let joints: Vec<&str> = convention.joints.iter().map(|&joint| name(joint)).collect();
    let on = joints.join(" and ");
    let (what, mend) = match &convention.kind {
        ConventionKind::Axis => (
            format!("{on} turns the other way in the logs than in the URDF"),
            format!("give q, qd and tau of [joint.{on}] `sign = -1` in a map (--map)"),
        ),
        ConventionKind::TorqueSign => (
            format!("the torque of {on} is logged with the other sign"),
            format!("give tau of [joint.{on}] `sign = -1` in a map (--map)"),
        ),
        ConventionKind::PositionSign => (
            format!("the position of {on} is logged with the other sign, its torque is not"),
            format!("give q and qd of [joint.{on}] `sign = -1` in a map (--map)"),
        ),
        ConventionKind::AllTorqueSigns => (
            "all torques are logged with the other sign: the joints would take power from friction"
                .to_owned(),
            "give tau of [every_joint] `sign = -1` in a map (--map)".to_owned(),
        ),
        ConventionKind::TorqueScale(scale) => (
            format!("the torque of {on} is about {} times what it should be", significant(*scale, 2)),
            format!("say its gear, torque constant, unit or `scale` under [joint.{on}] of a map (--map)"),
        ),
        ConventionKind::EachTorqueScale(scales) => {
            let all = convention.joints.iter().zip(scales);
            let all: Vec<String> =
                all.map(|(joint, scale)| format!("{} {}", name(*joint), significant(*scale, 2))).collect();
            (
                format!(
                    "each torque has a unit of its own, as currents and torques before a gear have: times what \
                     it should be, as far as the URDF's masses are right, {}",
                    all.join(", ")
                ),
                "say gear, torque constant or `scale` of each joint in a map (--map)".to_owned(),
            )
        }
        ConventionKind::AllTorqueScales(scale) => {
            return format!(
                "it looks as if all torques were in another unit, or the masses of the URDF far off: the \
                 torques are {} times what these masses ask for; if it is the unit, give tau of [every_joint] \
                 a `scale` in a map (--map), since masses that are found are as many times too large",
                significant(*scale, 2)
            );
        }
        ConventionKind::Mounting(downward) => {
            let [x, y, z] = downward.map(|along| significant(along, 2));
            let [roll, pitch] = standing(*downward);
            (
                format!(
                    "the robot hung on a wall or under a ceiling: gravity points along ({x}, {y}, {z}) of its root link"
                ),
                format!(
                    "give the URDF a new root link and a fixed joint from it to the present one as the robot is \
                     mounted, about rpy=\"{roll:.2} {pitch:.2} 0\""
                ),
            )
        }
        ConventionKind::Swapped => (
            format!("{on} have each other's columns"),
            "name the columns of both in a map (--map)".to_owned(),
        ),
        ConventionKind::SwappedTorques => (
            format!("{on} have each other's torques"),
            "name the columns of both torques in a map (--map)".to_owned(),
        ),
        ConventionKind::NoGravity => (
            "the torques lack what holds the robot's weight (a controller's, without gravity compensation)"
                .to_owned(),
            "log the whole torque".to_owned(),
        ),
    };
    format!(
        "it looks as if {what}: read so, a rigid body with friction leaves {} % of the torques and not {} % \
         (geometric mean over the joints), and what is found below is of little worth; {mend}",
        percent(convention.left),
        percent(convention.left_as_named)
    )
}

/// Roll and pitch of a link in which gravity points along `downward`, in a world where it points down.
fn standing(downward: [f64; 3]) -> [f64; 2] {
    let [x, y, z] = downward;
    [(-y).atan2(-z), x.clamp(-1.0, 1.0).asin()]
}

#[cfg(test)]
mod tests {
    use super::standing;

    #[test]
    fn the_link_as_it_is_mounted_has_gravity_where_it_was_seen() {
        for downward in
            [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.6, 0.0, 0.8]]
        {
            let [roll, pitch] = standing(downward);
            // Third row of Rz(0)·Ry(pitch)·Rx(roll): the world's vertical in the link's frame.
            let upward = [-pitch.sin(), pitch.cos() * roll.sin(), pitch.cos() * roll.cos()];
            for (down, up) in downward.iter().zip(upward) {
                assert!((down + up).abs() < 1e-12, "{downward:?}: roll {roll}, pitch {pitch}");
            }
        }
    }
}
