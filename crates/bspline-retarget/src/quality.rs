//! Quality measures of a retargeted motion.

use crate::bspline::Curve;
use crate::problem::Problem;
use crate::robot::RobotModel;

/// How good a motion is.
#[derive(Clone, Debug, PartialEq)]
pub struct Quality {
    /// RMS distance of the human model's markers from those that were seen \[m\].
    pub marker_rms_m: f64,
    /// The same for each marker by itself; NaN for one that was never seen.
    pub each_marker_rms_m: Vec<(String, f64)>,
    /// RMS distance of the robot's elbows from the human's, at the robot's size and seen from the shoulder
    /// \[m\].
    pub elbow_rms_m: f64,
    /// The same for the hands \[m\].
    pub hand_rms_m: f64,
    /// The robot's arm length, shoulder to hand \[m\].
    pub arm_length_m: f64,
    /// How far a joint goes beyond its position limits at most \[rad, m\]; 0 if none does.
    pub limit_excess: f64,
    /// Largest joint speed \[rad/s, m/s\].
    pub peak_speed: f64,
    /// Largest share of a joint's velocity limit; above 1 it is exceeded.
    pub peak_speed_share: f64,
    /// RMS jerk over joints and time \[rad/s³, m/s³\].
    pub jerk_rms: f64,
}

/// Judges a solution.
pub(crate) fn quality(
    problem: &Problem<'_>,
    robot: &RobotModel,
    curve: &Curve,
    variables: &[f64],
) -> Quality {
    let mut scratch = problem.pose_scratch();
    let names = problem.body.marker_names();
    let (mut errors, mut sums) = (vec![0.0f64; names.len()], vec![(0.0f64, 0.0f64); names.len()]);
    let (mut elbow_sum, mut hand_sum) = (0.0, 0.0);
    let joints = curve.dimension();
    let (mut values, mut local) = (vec![0.0; joints], vec![0.0; curve.basis().degree() + 1]);
    let (mut excess, mut peak, mut share, mut jerk) = (0.0f64, 0.0f64, 0.0f64, 0.0);
    let samples = problem.samples();
    for sample in 0..samples {
        problem.pose(variables, sample, &mut scratch);
        problem.marker_errors(sample, &scratch, &mut errors);
        for ((sum, seen), error) in sums.iter_mut().zip(&errors).filter(|(_, error)| error.is_finite()) {
            *sum += error;
            *seen += 1.0;
        }
        let residuals = problem.arm_residuals(robot, &scratch);
        // Elbow, wrist, hand of each arm.
        for arm in residuals.as_chunks::<3>().0 {
            elbow_sum += arm[0].dot(arm[0]);
            hand_sum += arm[2].dot(arm[2]);
        }
        let t = problem.time_s(sample);
        curve.evaluate(0, t, &mut local, &mut values);
        for (joint, &value) in values.iter().enumerate() {
            let limits = robot.tree().joint(joint).limits;
            excess = excess.max(value - limits.upper).max(limits.lower - value);
        }
        curve.evaluate(1, t, &mut local, &mut values);
        for (joint, &value) in values.iter().enumerate() {
            peak = peak.max(value.abs());
            let limit = robot.tree().joint(joint).limits.velocity;
            if limit.is_finite() && limit > 0.0 {
                share = share.max(value.abs() / limit);
            }
        }
        curve.evaluate(3, t, &mut local, &mut values);
        jerk += values.iter().map(|value| value * value).sum::<f64>();
    }
    let arms = (2 * samples) as f64;
    let all = sums.iter().fold((0.0, 0.0f64), |all, (sum, seen)| (all.0 + sum, all.1 + seen));
    let each = names.iter().cloned().zip(sums.iter().map(|(sum, seen)| (sum / seen).sqrt()));
    Quality {
        marker_rms_m: (all.0 / all.1).sqrt(),
        each_marker_rms_m: each.collect(),
        elbow_rms_m: (elbow_sum / arms).sqrt(),
        hand_rms_m: (hand_sum / arms).sqrt(),
        arm_length_m: robot.arm_length_m(),
        limit_excess: excess,
        peak_speed: peak,
        peak_speed_share: share,
        jerk_rms: (jerk / (samples * joints.max(1)) as f64).sqrt(),
    }
}

impl Quality {
    /// RMS distance of the hands as a share of the arm's length.
    pub fn hand_share(&self) -> f64 {
        self.hand_rms_m / self.arm_length_m
    }
    /// RMS distance of the elbows as a share of the arm's length.
    pub fn elbow_share(&self) -> f64 {
        self.elbow_rms_m / self.arm_length_m
    }
}
