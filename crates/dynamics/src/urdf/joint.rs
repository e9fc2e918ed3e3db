//! `<joint>`: its placement, axis, limits and friction.

use super::robot::{Joint, JointKind, Pose};
use super::{Finding, UrdfError};
use crate::{JointLimits, Mat3, Placement, Vec3};

/// How far a declared axis may be from unit length before it is reported.
const AXIS_ROUNDING: f64 = 1e-6;

/// No number of a robot is as large, in any unit; the square of a product of two is still finite.
const LARGEST: f64 = 1e50;

/// Whether a number can be one of a robot: finite, and not so large that a product with others is infinite.
pub(super) fn is_usable(number: f64) -> bool {
    number.abs() < LARGEST
}

/// The same of all numbers of a placement.
pub(super) fn is_usable_pose(pose: &Pose) -> bool {
    pose.xyz.iter().chain(&pose.rpy).all(|&x| is_usable(x))
}

/// The placement of a frame.
///
/// Roll, pitch, yaw about the fixed axes x, y, z: R = Rz(yaw) · Ry(pitch) · Rx(roll).
pub(super) fn pose(pose: &Pose) -> Placement<f64> {
    let [roll, pitch, yaw] = pose.rpy;
    let ((sr, cr), (sp, cp), (sy, cy)) = (roll.sin_cos(), pitch.sin_cos(), yaw.sin_cos());
    let rotation = Mat3([
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]);
    Placement { rotation, translation: Vec3(pose.xyz) }
}

/// An error if any number of the joint is NaN, or too large where that means nothing.
pub(super) fn check_finite(joint: &Joint) -> Result<(), UrdfError> {
    let [lower, upper] = joint.limit.range.unwrap_or_default();
    let is_number = |number: Option<f64>| !number.is_some_and(f64::is_nan);
    let mimic = joint.mimic.as_ref();
    let fields = [
        ("its origin", is_usable_pose(&joint.origin)),
        ("its axis", joint.axis.iter().all(|&x| is_usable(x))),
        ("its lower limit", !lower.is_nan() && lower < f64::INFINITY),
        ("its upper limit", !upper.is_nan() && upper > f64::NEG_INFINITY),
        ("its velocity limit", is_number(joint.limit.velocity)),
        ("its effort limit", is_number(joint.limit.effort)),
        ("its damping", is_usable(joint.damping)),
        ("its friction", is_usable(joint.friction)),
        ("the multiplier of its mimic", mimic.is_none_or(|mimic| is_usable(mimic.multiplier))),
        ("the offset of its mimic", mimic.is_none_or(|mimic| is_usable(mimic.offset))),
    ];
    match fields.into_iter().find(|(_, fine)| !fine) {
        Some((field, _)) => Err(UrdfError::NotFinite {
            line: Some(joint.line),
            kind: "joint",
            name: joint.name.clone(),
            field,
        }),
        None => Ok(()),
    }
}

/// The unit axis in the joint frame.
pub(super) fn axis(joint: &Joint, findings: &mut Vec<Finding>) -> Result<Vec3<f64>, UrdfError> {
    let axis = Vec3(joint.axis);
    // Scaled first: the square of a tiny component would vanish.
    let largest = axis.0.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    if largest == 0.0 {
        return Err(UrdfError::ZeroAxis { line: joint.line, joint: joint.name.clone() });
    }
    let scaled = axis.scale(1.0 / largest);
    let length = scaled.dot(scaled).sqrt();
    if (largest * length - 1.0).abs() > AXIS_ROUNDING {
        findings.push(Finding::AxisNotUnit { joint: joint.name.clone(), length: largest * length });
    }
    Ok(Vec3(scaled.0.map(|x| x / length)))
}

/// The joint's limits.
pub(super) fn limits(joint: &Joint, findings: &mut Vec<Finding>) -> JointLimits {
    let declared = &joint.limit;
    let name = || joint.name.clone();
    let mut missing = Vec::new();
    let (mut lower, mut upper) = (f64::NEG_INFINITY, f64::INFINITY);
    if joint.kind != JointKind::Continuous {
        // Both left out would be a joint that cannot move, which nobody means.
        match declared.range {
            Some(range) => [lower, upper] = range,
            None => missing.extend(["lower", "upper"]),
        }
    }
    if lower > upper {
        findings.push(Finding::ReversedLimits { joint: name(), lower, upper });
        (lower, upper) = (upper, lower);
    } else if lower == upper {
        findings.push(Finding::NoRange { joint: name(), position: lower });
    }
    // Exporters write 0 for what they do not know.
    let mut positive = |key, declared: Option<f64>| match declared {
        Some(value) if value > 0.0 => value,
        _ => {
            missing.push(key);
            f64::INFINITY
        }
    };
    let (velocity, effort) = (positive("velocity", declared.velocity), positive("effort", declared.effort));
    if !missing.is_empty() && joint.kind != JointKind::Continuous {
        findings.push(Finding::MissingLimits { joint: name(), missing });
    }
    JointLimits { lower, upper, velocity, effort }
}
