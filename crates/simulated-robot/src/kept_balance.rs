//! How a robot that is bolted down would have kept its balance: what a force plate under its base sees.

use phiw_curriculum::{CurriculumError, KeptBalance};
use phiw_dynamics::Tree;
use phiw_dynamics::inertia::InertialParameters;
use phiw_plant::History;
use phiw_zmp::{Stance, ZmpWorkspace, multi_body_zmp, standing_parameters};

/// The ZMP of a run from the motion's start on; none on a base that floats, whose floor keeps it inside. The
/// `base_link` is not among the bodies of `tree`, but stands on the plate with them.
///
/// # Errors
/// The history is not of this robot.
pub(crate) fn kept_balance(
    history: &History,
    tree: &Tree,
    base_link: &InertialParameters,
    stance: &Stance,
) -> Result<Option<KeptBalance>, CurriculumError> {
    let joints = tree.joint_count();
    let first = (-history.start_s / history.step_s).round().max(0.0) as usize;
    let wrenches = history.wrench.chunks_exact(6).skip(first);
    if tree.is_floating() || wrenches.len() == 0 {
        return Ok(None);
    }
    let (standing, rest) = (standing_parameters(base_link, &tree.inertial_parameters()), vec![0.0; joints]);
    let posture = &history.link_angle[first * joints..(first + 1) * joints];
    let balance = ZmpWorkspace::new(tree).evaluate(tree, &standing, posture, &rest, &rest)?;
    let height = (balance.center_of_mass.position[2] - stance.floor_height()).max(1e-3);
    let omega = (balance.wrench[2] / balance.center_of_mass.mass / height).sqrt();
    let share = 1.0 - (-omega * history.step_s).exp();
    let mut kept = KeptBalance { margin_m: None, outside_share: 0.0, tipping_margin_m: f64::INFINITY };
    let mut smallest = f64::INFINITY;
    let (mut mean, mut outside, mut count) = (None, 0_usize, 0_usize);
    for wrench in wrenches {
        let zmp = multi_body_zmp(with_base_link(wrench, base_link, balance.gravity), stance.floor_height());
        let margin = zmp.map_or(f64::NEG_INFINITY, |zmp| stance.support().signed_margin(zmp));
        smallest = smallest.min(margin);
        (outside, count) = (outside + usize::from(margin < 0.0), count + 1);
        // Where it does not press on the floor it goes on as it was.
        if let Some(zmp) = zmp {
            let before: [f64; 2] = mean.unwrap_or(zmp);
            let after = [0, 1].map(|axis: usize| before[axis] + share * (zmp[axis] - before[axis]));
            kept.tipping_margin_m = kept.tipping_margin_m.min(stance.support().signed_margin(after));
            mean = Some(after);
        }
    }
    kept.outside_share = outside as f64 / count as f64;
    kept.margin_m = Some(smallest).filter(|margin| margin.is_finite());
    // A robot that never pressed on the floor had no mean to keep.
    Ok(mean.map(|_| kept))
}

/// What the floor gives to the bodies and to the link that stands on it.
fn with_base_link(wrench: &[f64], link: &InertialParameters, gravity: [f64; 3]) -> [f64; 6] {
    let [mass, x, y, z] = [link[0], link[1], link[2], link[3]];
    let [gx, gy, gz] = gravity.map(|gravity| -gravity);
    let own = [mass * gx, mass * gy, mass * gz, y * gz - z * gy, z * gx - x * gz, x * gy - y * gx];
    std::array::from_fn(|axis| wrench[axis] + own[axis])
}
