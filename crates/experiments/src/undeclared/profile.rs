//! How a single motion runs over its time: fades, moves, and what lies between the samples of a simulation.

use super::trajectory::JointState;

/// Time in which a motion fades in and out \[s\].
const FADE: f64 = 1.2;

/// Rises from 0 to 1 in [`FADE`] and falls at the end, with three smooth derivatives.
pub fn window(time: f64, duration: f64) -> JointState {
    if time < FADE {
        smooth_step(time / FADE, FADE)
    } else if time > duration - FADE {
        let [w, dw, ddw] = smooth_step((duration - time) / FADE, FADE);
        [w, -dw, ddw]
    } else {
        [1.0, 0.0, 0.0]
    }
}

/// 35 x⁴ − 84 x⁵ + 70 x⁶ − 20 x⁷.
fn smooth_step(x: f64, length: f64) -> JointState {
    let value = x.powi(4) * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x)));
    let slope = 140.0 * (x * (1.0 - x)).powi(3);
    let curvature = 420.0 * (x * (1.0 - x)).powi(2) * (1.0 - 2.0 * x);
    [value, slope / length, curvature / (length * length)]
}

/// 10 x³ − 15 x⁴ + 6 x⁵ of the way; at the goal after x = 1.
pub fn minimum_jerk(x: f64, length: f64, from: f64, to: f64) -> JointState {
    if x >= 1.0 {
        return [to, 0.0, 0.0];
    }
    let way = to - from;
    let value = x.powi(3) * (10.0 + x * (-15.0 + 6.0 * x));
    let slope = 30.0 * (x * (1.0 - x)).powi(2);
    let curvature = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x);
    [from + way * value, way * slope / length, way * curvature / (length * length)]
}

/// Cubic in position, from positions and velocities on the grid; linear in acceleration.
pub fn hermite(states: &[JointState], place: f64, step: f64) -> JointState {
    let last = states.len() - 1;
    let index = (place as usize).min(last.saturating_sub(1));
    let ([q0, v0, a0], [q1, v1, a1]) = (states[index], states[(index + 1).min(last)]);
    let x = (place - index as f64).clamp(0.0, 1.0);
    let (h00, h10) = ((1.0 + 2.0 * x) * (1.0 - x).powi(2), x * (1.0 - x).powi(2));
    let (h01, h11) = (x * x * (3.0 - 2.0 * x), x * x * (x - 1.0));
    let position = h00 * q0 + h10 * step * v0 + h01 * q1 + h11 * step * v1;
    let velocity = (6.0 * x * x - 6.0 * x) * (q0 - q1) / step
        + (1.0 - x) * (1.0 - 3.0 * x) * v0
        + x * (3.0 * x - 2.0) * v1;
    [position, velocity, a0 + x * (a1 - a0)]
}

/// A stroke of constant speed between two ramps that take a share `ramp` of the time each; at the goal after
/// x = 1.
pub fn stroke(x: f64, length: f64, from: f64, to: f64, ramp: f64) -> JointState {
    if x >= 1.0 {
        return [to, 0.0, 0.0];
    }
    let way = to - from;
    let speed = 1.0 / (1.0 - ramp);
    let rising = |x: f64| [0.5 * speed * x * x / ramp, speed * x / ramp, speed / ramp];
    let [value, slope, curvature] = if x < ramp {
        rising(x)
    } else if x > 1.0 - ramp {
        let [value, slope, curvature] = rising(1.0 - x);
        [1.0 - value, slope, -curvature]
    } else {
        [speed * (x - 0.5 * ramp), speed, 0.0]
    };
    [from + way * value, way * slope / length, way * curvature / (length * length)]
}
