//! `<joint>`: its placement, axis, limits and friction.

use super::{Finding, UrdfError};
use crate::{Limits, Mat3, Placement, Vec3};
use urdf_rs::{Joint, JointType, Pose};

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
    pose.xyz.0.iter().chain(&pose.rpy.0).all(|&x| is_usable(x))
}

/// The placement of a frame.
///
/// Roll, pitch, yaw about the fixed axes x, y, z: R = Rz(yaw) · Ry(pitch) · Rx(roll).
pub(super) fn pose(pose: &Pose) -> Placement<f64> {
    let [roll, pitch, yaw] = pose.rpy.0;
    let ((sr, cr), (sp, cp), (sy, cy)) = (roll.sin_cos(), pitch.sin_cos(), yaw.sin_cos());
    let rotation = Mat3([
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]);
    Placement { rotation, translation: Vec3(pose.xyz.0) }
}

/// An error if any number of the joint is NaN, or too large where that means nothing.
pub(super) fn check_finite(joint: &Joint) -> Result<(), UrdfError> {
    let fields = [
        ("its origin", is_usable_pose(&joint.origin)),
        ("its axis", joint.axis.xyz.0.iter().all(|&x| is_usable(x))),
        ("its lower limit", !joint.limit.lower.is_nan() && joint.limit.lower < f64::INFINITY),
        ("its upper limit", !joint.limit.upper.is_nan() && joint.limit.upper > f64::NEG_INFINITY),
        ("its velocity limit", !joint.limit.velocity.is_nan()),
        ("its effort limit", !joint.limit.effort.is_nan()),
        ("its damping", joint.dynamics.as_ref().is_none_or(|d| is_usable(d.damping))),
        ("its friction", joint.dynamics.as_ref().is_none_or(|d| is_usable(d.friction))),
        (
            "the multiplier of its mimic",
            joint.mimic.as_ref().and_then(|m| m.multiplier).is_none_or(is_usable),
        ),
        ("the offset of its mimic", joint.mimic.as_ref().and_then(|m| m.offset).is_none_or(is_usable)),
    ];
    match fields.into_iter().find(|(_, fine)| !fine) {
        Some((field, _)) => Err(UrdfError::NotFinite { kind: "joint", name: joint.name.clone(), field }),
        None => Ok(()),
    }
}

/// The unit axis in the joint frame.
pub(super) fn axis(joint: &Joint, findings: &mut Vec<Finding>) -> Result<Vec3<f64>, UrdfError> {
    let axis = Vec3(joint.axis.xyz.0);
    // Scaled first: the square of a tiny component would vanish.
    let largest = axis.0.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    if largest == 0.0 {
        return Err(UrdfError::ZeroAxis { joint: joint.name.clone() });
    }
    let scaled = axis.scale(1.0 / largest);
    let length = scaled.dot(scaled).sqrt();
    if (largest * length - 1.0).abs() > AXIS_ROUNDING {
        findings.push(Finding::AxisNotUnit { joint: joint.name.clone(), length: largest * length });
    }
    Ok(Vec3(scaled.0.map(|x| x / length)))
}

/// The joint's limits; `given` are those that the file declares.
pub(super) fn limits(joint: &Joint, given: &[&'static str], findings: &mut Vec<Finding>) -> Limits {
    let declared = &joint.limit;
    let name = || joint.name.clone();
    let mut missing = Vec::new();
    let (mut lower, mut upper) = (f64::NEG_INFINITY, f64::INFINITY);
    if joint.joint_type != JointType::Continuous {
        // URDF: one that is left out is zero. Both left out would be a joint that cannot move, which nobody means.
        if given.contains(&"lower") || given.contains(&"upper") {
            (lower, upper) = (declared.lower, declared.upper);
        } else {
            missing.extend(["lower", "upper"]);
        }
    }
    if lower > upper {
        findings.push(Finding::ReversedLimits { joint: name(), lower, upper });
        (lower, upper) = (upper, lower);
    } else if lower == upper {
        findings.push(Finding::NoRange { joint: name(), position: lower });
    }
    // Exporters write 0 for what they do not know.
    let mut positive = |key, value: f64| {
        if given.contains(&key) && value > 0.0 {
            return value;
        }
        missing.push(key);
        f64::INFINITY
    };
    let (velocity, effort) = (positive("velocity", declared.velocity), positive("effort", declared.effort));
    if !missing.is_empty() && joint.joint_type != JointType::Continuous {
        findings.push(Finding::MissingLimits { joint: name(), missing });
    }
    Limits { lower, upper, velocity, effort }
}
