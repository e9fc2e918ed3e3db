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
    let (what, mend) = match convention.kind {
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
            format!("the torque of {on} is about {} times what it should be", significant(scale, 2)),
            format!("say its gear, torque constant, unit or `scale` under [joint.{on}] of a map (--map)"),
        ),
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
