//! Effects that may be missing, with the constants that are tried.

use phiw_effects::{Catalogue, Constants, EffectKind, JointRange, SignalRanges};
use phiw_estimation::{MotionLog, Robot};
use phiw_identification::EffectSpec;

/// Kind and joints are the same.
pub(crate) fn is_alike(one: &EffectSpec, other: &EffectSpec) -> bool {
    one.kind == other.kind && one.joints == other.joints
}

/// Every effect that may be beside `present`, with all constants to try. Every log of a curriculum has a
/// clock of its own: of what changes with the time since a motor was switched on, nothing is known.
pub(crate) fn candidates(
    robot: &Robot,
    catalogue: &Catalogue,
    ranges: &SignalRanges,
    present: &[EffectSpec],
) -> Vec<EffectSpec> {
    let tree = robot.tree();
    let mut specs = Vec::new();
    let can_be_identified = |kind: &&dyn EffectKind| {
        kind.varies().is_none() && !kind.needs_held_model() && !kind.needs_session_time(&Constants::new())
    };
    for kind in catalogue.kinds().filter(can_be_identified) {
        for site in kind.sites(tree) {
            let joints: Vec<String> = site.iter().map(|&joint| tree.joint(joint).joint.clone()).collect();
            let spec = |constants: Constants| EffectSpec {
                kind: kind.name().to_owned(),
                joints: joints.clone(),
                constants,
            };
            let needs = kind.build(tree, &site, &Constants::new()).needs();
            let is_present = present.iter().any(|other| is_alike(other, &spec(Constants::new())));
            if !is_present && !needs.derivatives {
                specs.extend(kind.scan(&site, ranges).into_iter().map(spec));
            }
        }
    }
    specs
}

/// What the logs cover. No period of a ripple is known from a residual that is mostly noise, so there is none
/// to try.
pub(crate) fn ranges(robot: &Robot, logs: &[MotionLog]) -> SignalRanges {
    let joints = robot.tree().joint_count();
    let joint = |joint: usize| {
        let each = |pick: fn(&MotionLog) -> &Vec<f64>| {
            logs.iter().flat_map(move |log| pick(log).iter().skip(joint).step_by(joints.max(1)).copied())
        };
        let rms = |pick: fn(&MotionLog) -> &Vec<f64>| {
            let (sum, count) = each(pick).fold((0.0, 0_usize), |(sum, count), x| (sum + x * x, count + 1));
            (sum / count.max(1) as f64).sqrt()
        };
        JointRange {
            position: each(|log| &log.q)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| (low.min(q), high.max(q))),
            velocity_rms: rms(|log| &log.qd),
            torque_rms: rms(|log| &log.tau),
            torque_peak: each(|log| &log.tau).fold(0.0, |peak, torque| peak.max(torque.abs())),
            residual_rms: 0.0,
        }
    };
    let session = (0.0, logs.iter().map(MotionLog::duration_s).fold(0.0, f64::max));
    SignalRanges {
        joints: (0..joints).map(joint).collect(),
        session,
        period: logs.first().map_or(0.0, |log| log.period_s),
        ripple_frequencies: vec![Vec::new(); joints],
        friction_frequencies: vec![Vec::new(); joints],
        temperature: false,
        // A simulated or real loop zeroes no torque between motions.
        logs: 1,
        longest_log: session.1,
    }
}
