//! Torso and head for recordings that hold neither: gaze-and-reach coordination.
//!
//! The trunk turns and leans towards what the hand reaches for, the more the further it is from the shoulder,
//! and the head looks at the hand that works. The hand that moves faster is taken for it. The constants below
//! are plausible, not measured: the output says which joints come from them.

use crate::problem::Problem;
use crate::robot::{RobotModel, norm};
use phiw_dynamics::Vec3;

/// Correspondences of the left and the right hand.
const HANDS: [usize; 2] = [2, 5];
/// Share of the hand's azimuth that the trunk turns.
const TURN_SHARE: f64 = 0.3;
/// Lean at full reach \[rad\].
const FULL_LEAN: f64 = 0.35;
/// Reach, as a share of the arm's length, at which leaning begins, and at which it is full.
const LEAN_FROM_TO: (f64, f64) = (0.6, 1.0);
/// Time over which the speed of the hands is averaged, to each side \[s\].
const ATTENTION_S: f64 = 0.5;
/// Speed of a hand that is at rest \[m/s\].
const IDLE_SPEED: f64 = 0.05;

/// For the torso's and the head's correspondence, if the robot has them, the vectors that they should have in
/// each sample.
pub(crate) fn targets(
    problem: &Problem<'_>,
    robot: &RobotModel,
    variables: &[f64],
) -> Vec<(usize, Vec<Vec3<f64>>)> {
    let mut scratch = problem.pose_scratch();
    let shoulders = problem.zero_points(robot.arms().map(|arm| arm.shoulder), &mut scratch);
    let middle = (shoulders[0] + shoulders[1]).scale(0.5);
    let arm = robot.arm_length_m();
    // Hands at the robot's size, seen from its base.
    let hands: Vec<[Vec3<f64>; 2]> = (0..problem.samples())
        .map(|sample| {
            problem.pose(variables, sample, &mut scratch);
            let vectors = problem.human_vectors(robot, sample, &scratch);
            let [left, right] = HANDS.map(|hand| vectors[hand]);
            [shoulders[0] + left, shoulders[1] + right]
        })
        .collect();
    let watched = watched(&hands, problem.rate_hz());
    let mut targets = Vec::new();
    if let Some(torso) = robot.torso {
        let length = robot.correspondences[torso].human.iter().map(|(_, vector)| norm(*vector)).sum::<f64>();
        let vectors = watched.iter().map(|hand| {
            let [x, y, _] = (*hand - middle).0;
            let reach = (x * x + y * y).sqrt() / arm;
            let share = ((reach - LEAN_FROM_TO.0) / (LEAN_FROM_TO.1 - LEAN_FROM_TO.0)).clamp(0.0, 1.0);
            // 3s² − 2s³ begins and ends without a jerk.
            let lean = FULL_LEAN * share * share * (3.0 - 2.0 * share);
            let turn = TURN_SHARE * y.atan2(x.max(0.1));
            let (sine, cosine) = lean.sin_cos();
            Vec3([sine * turn.cos(), sine * turn.sin(), cosine]).scale(length)
        });
        targets.push((torso, vectors.collect()));
    }
    if let Some(head) = robot.head {
        let line = &robot.correspondences[head];
        let length = line.human.iter().map(|(_, vector)| norm(*vector)).sum::<f64>();
        let [eyes] = problem.zero_points([line.from], &mut scratch);
        let vectors = watched.iter().map(|hand| {
            let gaze = *hand - eyes;
            gaze.scale(length / norm(gaze).max(1e-6))
        });
        targets.push((head, vectors.collect()));
    }
    targets
}

/// The point between the hands that attention is on: nearer to the one that moves.
fn watched(hands: &[[Vec3<f64>; 2]], rate_hz: f64) -> Vec<Vec3<f64>> {
    let reach = ((ATTENTION_S * rate_hz) as usize).max(1);
    // Way of each hand up to each sample.
    let mut ways = vec![[0.0; 2]; hands.len()];
    for sample in 1..hands.len() {
        for hand in 0..2 {
            ways[sample][hand] = ways[sample - 1][hand] + norm(hands[sample][hand] - hands[sample - 1][hand]);
        }
    }
    let last = hands.len().saturating_sub(1);
    (0..hands.len())
        .map(|sample| {
            let (from, to) = (sample.saturating_sub(reach), (sample + reach).min(last));
            let duration = (to - from).max(1) as f64 / rate_hz;
            let [left, right] = [0, 1].map(|hand| {
                let speed = (ways[to][hand] - ways[from][hand]) / duration;
                speed * speed + IDLE_SPEED * IDLE_SPEED
            });
            (hands[sample][0].scale(left) + hands[sample][1].scale(right)).scale(1.0 / (left + right))
        })
        .collect()
}
