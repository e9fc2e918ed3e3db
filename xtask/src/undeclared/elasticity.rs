//! A flexible transmission: the encoder sits on the motor, the link hangs behind a spring.

use super::load::Loads;
use super::plant::{States, rigid_torque};
use super::trajectory::Motion;

/// Step of the central differences that turn the link's torque into the spring's rates \[s\].
const STEP: f64 = 1e-3;

/// Replaces the state of the joint by its motor's: θ = q + compliance·τ of the link, and its derivatives.
///
/// The link moves as the motion says; all friction and the rotor are on the motor's side.
pub fn deflect(
    motor: &mut States,
    loads: &Loads,
    motion: &Motion,
    times: &[f64],
    joint: usize,
    compliance: f64,
) {
    let torque = |shift: f64| {
        let shifted: Vec<f64> = times.iter().map(|time| time + shift).collect();
        rigid_torque(&States::of_motion(motion, &shifted), |sample| loads.tree_at(shifted[sample]))
    };
    let [before, now, after] = [-STEP, 0.0, STEP].map(torque);
    let joints = motion.joints.len();
    for sample in 0..times.len() {
        let index = sample * joints + joint;
        let rate = (after[index] - before[index]) / (2.0 * STEP);
        let acceleration = (after[index] - 2.0 * now[index] + before[index]) / (STEP * STEP);
        let [q, v, a] = motor.at(sample).map(|all| all[joint]);
        let state = [q + compliance * now[index], v + compliance * rate, a + compliance * acceleration];
        motor.set(sample, joint, state);
    }
}
