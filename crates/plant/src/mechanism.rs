//! Torques of a joint's angle: springs, balancers, ripple, stops, cables.

use crate::numbers::Numbers;

/// A torque that depends on the joint's angle \[rad, m\]; torques in N·m or N.
#[derive(Clone, Debug, PartialEq)]
pub enum Mechanism {
    /// k·(q − rest).
    Spring {
        /// k \[N·m/rad, N/m\].
        stiffness: f64,
        /// Angle at which it is slack.
        rest: f64,
    },
    /// k·sin(q − zero)·(1 − rest/length): a spring between the base and a lever on the link, whose length is
    /// that of the third side of a triangle with the sides 1 and `arm`. `rest` is its slack length; with 0
    /// the torque is a pure sinusoid.
    Balancer {
        /// k.
        torque: f64,
        /// Angle at which it is at dead centre.
        zero: f64,
        /// Lever over the distance of the spring's anchor, in (0, 1).
        arm: f64,
        /// Slack length over the same distance.
        rest: f64,
    },
    /// a·sin(N·q + phase): cogging, or a gear's teeth.
    Ripple {
        /// a.
        torque: f64,
        /// N, periods in a turn (in 2π m of a slide).
        cycles: f64,
        /// Phase \[rad\].
        phase: f64,
    },
    /// What cables and hoses do as they bend, slip and catch: torques that were measured at angles, which
    /// ascend; linear between two of them, and those of the first and the last beyond.
    Cable {
        /// Angles, each with its torque; at least one.
        points: Vec<[f64; 2]>,
    },
    /// torque·((q − threshold)/depth)^exponent beyond the threshold: what brakes near a joint's limit.
    EndStop {
        /// Where it sets in.
        threshold: f64,
        /// Whether it stops motion to larger angles, or to smaller ones.
        upper: bool,
        /// Torque at `depth` beyond the threshold.
        torque: f64,
        /// See `torque`.
        depth: f64,
        /// 1 is a spring.
        exponent: f64,
    },
}

impl Mechanism {
    /// Torque that the joint must deliver at an angle.
    pub fn torque(&self, q: f64) -> f64 {
        match *self {
            Mechanism::Cable { ref points } => {
                let Some(last) = points.len().checked_sub(1) else { return 0.0 };
                let next = points.partition_point(|[angle, _]| *angle <= q);
                let [before, behind] = [points[next.saturating_sub(1)], points[next.min(last)]];
                let width = behind[0] - before[0];
                let share = if width > 0.0 { (q - before[0]) / width } else { 0.0 };
                before[1] + share * (behind[1] - before[1])
            }
            Mechanism::Spring { stiffness, rest } => stiffness * (q - rest),
            Mechanism::Balancer { torque, zero, arm, rest } => {
                let (sine, cosine) = (q - zero).sin_cos();
                let length = (1.0 + arm * arm - 2.0 * arm * cosine).sqrt();
                torque * sine * (1.0 - rest / length)
            }
            Mechanism::Ripple { torque, cycles, phase } => torque * (cycles * q + phase).sin(),
            Mechanism::EndStop { threshold, upper, torque, depth, exponent } => {
                let side = if upper { 1.0 } else { -1.0 };
                side * torque * ((q - threshold) * side / depth).max(0.0).powf(exponent)
            }
        }
    }

    /// Whether it is so stiff that a step must be solved for it.
    pub(crate) fn is_stiff(&self) -> bool {
        matches!(self, Mechanism::EndStop { .. })
    }

    /// The name of its kind in files.
    pub fn kind(&self) -> &'static str {
        match self {
            Mechanism::Spring { .. } => "joint_spring",
            Mechanism::Balancer { .. } => "gravity_balancer",
            Mechanism::Ripple { .. } => "torque_ripple",
            Mechanism::Cable { .. } => "position_map",
            Mechanism::EndStop { .. } => "end_stop",
        }
    }

    /// Its numbers.
    pub(crate) fn numbers(&self) -> Numbers {
        let numbers = |free, positive| Numbers { free, positive, ..Numbers::default() };
        match *self {
            Mechanism::Cable { ref points } => {
                let all = points.iter().flat_map(|&[angle, torque]| [("angle", angle), ("torque", torque)]);
                let ways = points.windows(2).map(|pair| ("way between angles", pair[1][0] - pair[0][0]));
                numbers(all.collect(), ways.chain([("number of angles", points.len() as f64)]).collect())
            }
            Mechanism::Spring { stiffness, rest } => {
                numbers(vec![("stiffness", stiffness), ("rest", rest)], vec![])
            }
            Mechanism::Balancer { torque, zero, arm, rest } => numbers(
                vec![("torque", torque), ("zero", zero), ("rest", rest)],
                vec![("arm", arm), ("1 − arm", 1.0 - arm)],
            ),
            Mechanism::Ripple { torque, cycles, phase } => {
                numbers(vec![("torque", torque), ("phase", phase)], vec![("cycles", cycles)])
            }
            Mechanism::EndStop { threshold, torque, depth, exponent, .. } => numbers(
                vec![("threshold", threshold)],
                vec![("torque", torque), ("depth", depth), ("exponent", exponent)],
            ),
        }
    }
}
