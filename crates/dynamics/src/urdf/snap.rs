//! Right angles that a file gives with few digits, made exact.

use super::robot::{Joint, Robot};
use std::f64::consts::FRAC_PI_2;

/// How far an angle may be from a multiple of a right angle to be taken as it, and an axis from a coordinate
/// axis \[rad\]: π/2 with four decimals is off by 4e-6, with three by 2e-4, which is a robot's own angle.
const NEAR: f64 = 1e-4;

/// What is off by less has ten digits, and says nothing of a robot \[rad\].
const EXACT: f64 = 1e-9;

/// Makes right angles of the joints' frames exact, and axes along a coordinate axis; gives how many were not.
///
/// Gravity and parallel axes cancel in the regressor only where the angles between them are exact. An angle
/// of 1.5708 leaves 1e-5 of a column, from which a fit takes a parameter of tonnes.
pub(super) fn snap(robot: &mut Robot) -> usize {
    robot.joints.iter_mut().map(snap_joint).sum()
}

fn snap_joint(joint: &mut Joint) -> usize {
    let mut snapped = 0;
    for angle in &mut joint.origin.rpy {
        let right = (*angle / FRAC_PI_2).round() * FRAC_PI_2;
        let off = (*angle - right).abs();
        if off <= NEAR {
            snapped += usize::from(off > EXACT);
            *angle = right;
        }
    }
    let largest = joint.axis.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    let off = joint.axis.iter().filter(|x| x.abs() < largest).fold(0.0_f64, |off, x| off.max(x.abs()));
    if off > 0.0 && off <= NEAR * largest {
        snapped += usize::from(off > EXACT * largest);
        joint.axis.iter_mut().filter(|x| x.abs() < largest).for_each(|x| *x = 0.0);
    }
    snapped
}
