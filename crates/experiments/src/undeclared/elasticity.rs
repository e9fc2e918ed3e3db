//! A flexible transmission: the encoder sits on the motor, the link hangs behind a spring.

use super::load::Loads;
use super::plant::{States, rigid_torque};
use super::trajectory::Trajectory;
use phiw_dynamics::{Tree, Workspace};
use std::f64::consts::TAU;

/// Step of the central differences that turn the link's torque into the spring's rates \[s\].
const STEP: f64 = 1e-3;
/// Lowest resonance of a joint on its spring with the motor held \[Hz\]: twice the highest frequency of the
/// motions. Nobody can move a robot as these logs say it moved once the motion's band holds the resonance.
const LOWEST_RESONANCE: f64 = 3.0;
/// Samples from one look at the inertia to the next.
const STRIDE: usize = 20;

/// The greatest compliance with which the joint's resonance stays above the motions' band, whatever the pose
/// \[rad/(N·m), m/N\].
pub fn softest(tree: &Tree, motions: &[Trajectory], times: &[Vec<f64>], joint: usize) -> f64 {
    let joints = tree.joint_count();
    let mut workspace = Workspace::new(tree);
    let mut matrix = vec![0.0; joints * joints];
    let mut inertia = 0.0_f64;
    for (motion, times) in motions.iter().zip(times) {
        for &time in times.iter().step_by(STRIDE) {
            let pose: Vec<f64> = (0..joints).map(|joint| motion.state(joint, time)[0]).collect();
            if tree.mass_matrix(&pose, &mut workspace, &mut matrix).is_ok() {
                inertia = inertia.max(matrix[joint * joints + joint]);
            }
        }
    }
    1.0 / (inertia * (TAU * LOWEST_RESONANCE).powi(2))
}

/// Replaces the state of the joint by its motor's: θ = q + compliance·τ of the link, and its derivatives.
///
/// The link moves as the motion says; all friction and the rotor are on the motor's side.
pub fn deflect(
    motor: &mut States,
    loads: &Loads,
    motion: &Trajectory,
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
