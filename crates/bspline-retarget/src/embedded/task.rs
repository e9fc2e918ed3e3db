//! The tasks of Table 1 (Krebs et al. 2021) and the patterns that stand for them.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

/// A task of Table 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Task {
    /// Its name there.
    pub name: &'static str,
    /// Motions of it.
    pub count: usize,
    /// The shortest \[s\].
    pub shortest_s: f64,
    /// The longest \[s\].
    pub longest_s: f64,
    /// What is done with the joints: centre and amplitude \[rad\], cycles in a second, phase \[turns\].
    pattern: &'static [Stroke],
}

/// A joint, where it works (from standing), how far it swings, how often, and when.
type Stroke = (&'static str, f64, f64, f64, f64);

const fn task(
    name: &'static str,
    count: usize,
    shortest_s: f64,
    longest_s: f64,
    pattern: &'static [Stroke],
) -> Task {
    Task { name, count, shortest_s, longest_s, pattern }
}

/// Table 1: 12 tasks, 110 motions.
pub const TASKS: [Task; 12] = [
    task(
        "Close",
        8,
        5.29,
        9.25,
        &[
            ("right_upper_arm_flexion", 0.75, 0.10, 0.35, 0.0),
            ("right_forearm_flexion", 1.00, 0.15, 0.35, 0.5),
            ("right_forearm_pronation", 0.30, 0.70, 0.70, 0.2),
            ("left_upper_arm_flexion", 0.60, 0.03, 0.20, 0.0),
            ("left_forearm_flexion", 1.20, 0.05, 0.20, 0.0),
            ("left_upper_arm_rotation", 0.45, 0.05, 0.20, 0.3),
        ],
    ),
    task(
        "Cut",
        7,
        7.65,
        11.41,
        &[
            ("right_upper_arm_flexion", 0.50, 0.30, 1.10, 0.0),
            ("right_forearm_flexion", 1.10, 0.35, 1.10, 0.5),
            ("right_hand_deviation", 0.05, 0.15, 1.10, 0.25),
            ("left_upper_arm_flexion", 0.60, 0.08, 0.25, 0.0),
            ("left_forearm_flexion", 1.10, 0.05, 0.30, 0.4),
            ("left_upper_arm_rotation", 0.50, 0.05, 0.25, 0.0),
        ],
    ),
    task(
        "Mix",
        6,
        7.41,
        8.33,
        &[
            ("right_upper_arm_flexion", 0.60, 0.20, 1.30, 0.0),
            ("right_upper_arm_abduction", 0.20, 0.25, 1.30, 0.25),
            ("right_forearm_flexion", 1.20, 0.20, 1.30, 0.5),
            ("left_upper_arm_flexion", 0.55, 0.20, 1.30, 0.5),
            ("left_upper_arm_abduction", 0.20, 0.25, 1.30, 0.75),
            ("left_forearm_flexion", 1.20, 0.20, 1.30, 0.0),
        ],
    ),
    task(
        "Open",
        6,
        5.89,
        7.65,
        &[
            ("right_upper_arm_flexion", 0.70, 0.12, 0.30, 0.0),
            ("right_forearm_flexion", 1.05, 0.10, 0.40, 0.3),
            ("right_forearm_pronation", -0.20, 0.80, 0.60, 0.0),
            ("left_upper_arm_flexion", 0.55, 0.05, 0.30, 0.2),
            ("left_forearm_flexion", 1.25, 0.10, 0.30, 0.0),
            ("left_forearm_pronation", 0.20, 0.25, 0.60, 0.5),
        ],
    ),
    task(
        "Peel",
        6,
        7.81,
        12.13,
        &[
            ("right_upper_arm_flexion", 0.45, 0.12, 1.40, 0.0),
            ("right_forearm_flexion", 1.40, 0.30, 1.40, 0.5),
            ("right_hand_flexion", 0.10, 0.30, 1.40, 0.3),
            ("left_upper_arm_flexion", 0.45, 0.05, 0.20, 0.0),
            ("left_forearm_flexion", 1.40, 0.08, 0.20, 0.0),
            ("left_forearm_pronation", 0.10, 0.70, 0.25, 0.0),
        ],
    ),
    task(
        "Pour",
        14,
        5.41,
        9.85,
        &[
            ("right_upper_arm_flexion", 0.80, 0.25, 0.22, 0.0),
            ("right_upper_arm_abduction", 0.35, 0.25, 0.22, 0.3),
            ("right_forearm_flexion", 1.00, 0.20, 0.22, 0.5),
            ("right_forearm_pronation", 0.50, 0.80, 0.30, 0.0),
            ("left_upper_arm_flexion", 0.55, 0.08, 0.22, 0.5),
            ("left_forearm_flexion", 1.10, 0.08, 0.22, 0.0),
        ],
    ),
    task(
        "Rollout",
        8,
        7.69,
        11.21,
        &[
            ("right_upper_arm_flexion", 0.75, 0.40, 0.65, 0.0),
            ("left_upper_arm_flexion", 0.75, 0.40, 0.65, 0.02),
            ("right_forearm_flexion", 0.90, 0.45, 0.65, 0.5),
            ("left_forearm_flexion", 0.90, 0.45, 0.65, 0.52),
            ("chest_pitch", 0.20, 0.12, 0.65, 0.0),
        ],
    ),
    task(
        "Scoop",
        16,
        5.93,
        8.33,
        &[
            ("right_upper_arm_flexion", 0.85, 0.35, 0.45, 0.0),
            ("right_upper_arm_rotation", 0.10, 0.40, 0.45, 0.3),
            ("right_forearm_flexion", 0.95, 0.35, 0.45, 0.55),
            ("right_forearm_pronation", 0.10, 0.60, 0.45, 0.75),
            ("right_hand_flexion", 0.00, 0.30, 0.45, 0.2),
            ("left_upper_arm_flexion", 0.55, 0.05, 0.25, 0.0),
            ("left_forearm_flexion", 1.15, 0.08, 0.25, 0.0),
        ],
    ),
    task(
        "Stir",
        16,
        3.81,
        10.69,
        &[
            ("right_upper_arm_flexion", 0.65, 0.16, 1.20, 0.0),
            ("right_upper_arm_abduction", 0.25, 0.20, 1.20, 0.25),
            ("right_forearm_flexion", 1.15, 0.18, 1.20, 0.5),
            ("right_hand_flexion", 0.00, 0.20, 1.20, 0.3),
            ("left_upper_arm_flexion", 0.55, 0.04, 0.30, 0.0),
            ("left_forearm_flexion", 1.15, 0.05, 0.30, 0.0),
        ],
    ),
    task(
        "Sweep",
        7,
        10.29,
        13.17,
        &[
            ("right_upper_arm_flexion", 0.60, 0.30, 0.55, 0.0),
            ("right_upper_arm_rotation", 0.20, 0.50, 0.55, 0.2),
            ("right_forearm_flexion", 0.80, 0.25, 0.55, 0.5),
            ("left_upper_arm_flexion", 0.75, 0.30, 0.55, 0.1),
            ("left_upper_arm_rotation", 0.20, 0.45, 0.55, 0.7),
            ("left_forearm_flexion", 0.90, 0.20, 0.55, 0.6),
            ("chest_yaw", 0.00, 0.30, 0.55, 0.1),
            ("chest_pitch", 0.20, 0.06, 0.55, 0.0),
        ],
    ),
    task(
        "Transfer",
        8,
        5.53,
        6.81,
        &[
            ("right_upper_arm_flexion", 0.90, 0.25, 0.35, 0.0),
            ("right_upper_arm_abduction", 0.20, 0.35, 0.35, 0.25),
            ("right_upper_arm_rotation", 0.00, 0.45, 0.35, 0.25),
            ("right_forearm_flexion", 0.80, 0.30, 0.35, 0.5),
            ("left_upper_arm_flexion", 0.85, 0.25, 0.35, 0.0),
            ("left_upper_arm_abduction", 0.15, 0.30, 0.35, 0.75),
            ("left_forearm_flexion", 0.85, 0.30, 0.35, 0.5),
            ("chest_yaw", 0.00, 0.30, 0.35, 0.25),
        ],
    ),
    task(
        "Wipe",
        8,
        5.69,
        8.73,
        &[
            ("right_upper_arm_flexion", 0.80, 0.25, 0.90, 0.25),
            ("right_upper_arm_abduction", 0.25, 0.15, 0.90, 0.0),
            ("right_upper_arm_rotation", 0.10, 0.60, 0.90, 0.0),
            ("right_forearm_flexion", 0.80, 0.30, 0.90, 0.75),
            ("chest_pitch", 0.25, 0.06, 0.90, 0.25),
            ("left_upper_arm_flexion", 0.35, 0.05, 0.25, 0.0),
            ("left_forearm_flexion", 0.70, 0.08, 0.25, 0.0),
        ],
    ),
];

/// What a joint does while the hands work.
pub(super) struct Pattern {
    pub joint: &'static str,
    center: f64,
    amplitude: f64,
    frequency_hz: f64,
    phase: f64,
}

impl Pattern {
    /// Angle from standing \[rad\].
    pub fn at(&self, t: f64) -> f64 {
        self.center + self.amplitude * (TAU * (self.frequency_hz * t + self.phase)).sin()
    }
}

impl Task {
    /// The task's pattern as one person does it once; trunk, girdle and head go with it.
    pub(super) fn patterns(&self, random: &mut ChaCha8Rng) -> Vec<Pattern> {
        let (reach, speed) = (1.0 + 0.15 * normal(random), (0.12 * normal(random)).exp());
        let start = random.random::<f64>();
        let mut patterns: Vec<Pattern> = self
            .pattern
            .iter()
            .map(|&(joint, center, amplitude, frequency, phase)| Pattern {
                joint,
                center: center * reach + 0.06 * normal(random),
                amplitude: amplitude * (1.0 + 0.2 * normal(random)),
                frequency_hz: frequency * speed,
                phase: phase + start,
            })
            .collect();
        // People look down at what they do, and no joint is quite still.
        let along = [
            ("neck_pitch", 0.35, 0.05),
            ("neck_yaw", -0.05, 0.12),
            ("head_nod", 0.15, 0.04),
            ("chest_pitch", 0.08, 0.03),
            ("chest_yaw", -0.03, 0.06),
            ("chest_roll", 0.0, 0.02),
            ("left_clavicle_protraction", 0.05, 0.04),
            ("right_clavicle_protraction", 0.08, 0.05),
            ("left_clavicle_elevation", 0.03, 0.03),
            ("right_clavicle_elevation", 0.05, 0.04),
            ("pelvis_x", 0.0, 0.01),
            ("pelvis_y", 0.0, 0.012),
            ("pelvis_yaw", 0.0, 0.04),
        ];
        patterns.extend(along.map(|(joint, center, amplitude)| Pattern {
            joint,
            center: center * (1.0 + 0.3 * normal(random)),
            amplitude: amplitude * (1.0 + 0.3 * normal(random)),
            frequency_hz: 0.15 + 0.35 * random.random::<f64>(),
            phase: random.random(),
        }));
        patterns
    }
}

/// The angle of a joint of a person who stands with arms hanging \[rad\].
pub(super) fn standing(joint: &str) -> f64 {
    match joint {
        "left_forearm_flexion" | "right_forearm_flexion" => 0.25,
        "left_upper_arm_abduction" | "right_upper_arm_abduction" => 0.15,
        "left_upper_arm_flexion" | "right_upper_arm_flexion" => 0.05,
        _ => 0.0,
    }
}

/// A number of the standard normal distribution.
pub(super) fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}
