//! Secrets: which joint, which form, which size.

use super::case::{Robot, Sample};
use clap::ValueEnum;
use phiw_dynamics::{Placement, Vec3};
use phiw_plant::{Coupling, Effect, Friction, Mechanism, Presliding};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// A kind of secret, named as in `report.json`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "snake_case")]
#[value(rename_all = "snake_case")]
#[allow(missing_docs, reason = "the names are those of the fixed formats")]
pub enum SecretKind {
    CoulombFriction,
    AsymmetricFriction,
    StribeckFriction,
    QuadraticFriction,
    LoadDependentFriction,
    RotorInertia,
    JointSpring,
    TorqueRipple,
    TransmissionCoupling,
    Hysteresis,
    ThermalDrift,
    JointElasticity,
    GravityBalancer,
    ExternalForce,
    EndStop,
    TimeDelay,
    Payload,
    GravityTilt,
}

/// The experiment of the issue: twelve kinds that show in logs of one motion each, without a model from before.
pub const TWELVE: [SecretKind; 12] = [
    SecretKind::CoulombFriction,
    SecretKind::AsymmetricFriction,
    SecretKind::StribeckFriction,
    SecretKind::QuadraticFriction,
    SecretKind::LoadDependentFriction,
    SecretKind::RotorInertia,
    SecretKind::JointSpring,
    SecretKind::TorqueRipple,
    SecretKind::TransmissionCoupling,
    SecretKind::Hysteresis,
    SecretKind::ThermalDrift,
    SecretKind::JointElasticity,
];

/// Size of a secret: RMS of its torque over that of the joint's.
const SIZES: [f64; 2] = [0.12, 0.3];

impl SecretKind {
    /// All kinds.
    pub const ALL: [SecretKind; 18] = [
        SecretKind::CoulombFriction,
        SecretKind::AsymmetricFriction,
        SecretKind::StribeckFriction,
        SecretKind::QuadraticFriction,
        SecretKind::LoadDependentFriction,
        SecretKind::RotorInertia,
        SecretKind::JointSpring,
        SecretKind::TorqueRipple,
        SecretKind::TransmissionCoupling,
        SecretKind::Hysteresis,
        SecretKind::ThermalDrift,
        SecretKind::JointElasticity,
        SecretKind::GravityBalancer,
        SecretKind::ExternalForce,
        SecretKind::EndStop,
        SecretKind::TimeDelay,
        SecretKind::Payload,
        SecretKind::GravityTilt,
    ];

    /// The name in files.
    pub fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// Whether an identification of the rigid body swallows it, so that it shows against a held model only.
    pub fn needs_held_model(self) -> bool {
        matches!(self, SecretKind::Payload | SecretKind::GravityTilt)
    }

    /// Draws an effect for motions that go through `samples` (`[q, v, a, torque]` of all joints, from the references).
    pub fn draw(self, robot: &Robot, samples: &[Sample], random: &mut ChaCha8Rng) -> Effect {
        let joints = robot.tree.joint_count();
        let joint = random.random_range(0..joints);
        let share = random.random_range(SIZES[0]..SIZES[1]);
        let rms = |value: &dyn Fn(&Sample) -> f64| {
            (samples.iter().map(|sample| value(sample).powi(2)).sum::<f64>() / samples.len() as f64).sqrt()
        };
        let wanted = share * rms(&|sample| sample.torque[joint]);
        let speed = rms(&|sample| sample.v[joint]);
        // The size that makes an effect of size 1 as large as wanted.
        let scale = |unit: &dyn Fn(&Sample) -> f64| wanted / rms(unit).max(1e-12);
        let friction_scale =
            |law: &Friction| scale(&|sample| law.torque(sample.v[joint], sample.t_s, sample.torque[joint]));
        let angles = || samples.iter().map(|sample| sample.q[joint]);
        let (lowest, highest) =
            (angles().fold(f64::INFINITY, f64::min), angles().fold(f64::NEG_INFINITY, f64::max));
        let width = robot.sign_width;
        let friction = |law| Effect::Friction { joint, law };
        match self {
            SecretKind::CoulombFriction => {
                let torque = friction_scale(&Friction::Coulomb { torque: 1.0, width });
                friction(Friction::Coulomb { torque, width })
            }
            SecretKind::AsymmetricFriction => {
                let positive = random.random_bool(0.5);
                let law = |size: f64| Friction::Asymmetric {
                    positive,
                    coefficient: size / speed,
                    torque: 0.0,
                    width,
                };
                friction(law(friction_scale(&law(1.0))))
            }
            SecretKind::StribeckFriction => {
                let fall = speed * random.random_range(0.1..0.3);
                let law = |torque: f64| Friction::Stribeck {
                    torque,
                    speed: fall.max(2.0 * width),
                    exponent: 1.5,
                    width,
                };
                friction(law(friction_scale(&law(1.0))))
            }
            SecretKind::QuadraticFriction => {
                let coefficient = friction_scale(&Friction::Quadratic { coefficient: 1.0 });
                friction(Friction::Quadratic { coefficient })
            }
            SecretKind::LoadDependentFriction => {
                let coefficient = friction_scale(&Friction::LoadDependent { coefficient: 1.0, width });
                friction(Friction::LoadDependent { coefficient, width })
            }
            SecretKind::ThermalDrift => {
                let time_constant_s = random.random_range(15.0..40.0);
                let law = |size: f64| Friction::Thermal {
                    coefficient: size / speed,
                    torque: size,
                    time_constant_s,
                    width,
                };
                friction(law(friction_scale(&law(1.0))))
            }
            SecretKind::Hysteresis => {
                let way = random.random_range(0.05..0.2) * (highest - lowest);
                let elements = [[0.3 * way, 0.4 * wanted], [way, 0.6 * wanted]];
                Effect::Presliding { joint, law: Presliding::MaxwellSlip { elements: elements.to_vec() } }
            }
            SecretKind::RotorInertia => {
                Effect::RotorInertia { joint, inertia: scale(&|sample| sample.a[joint]) }
            }
            SecretKind::JointSpring => {
                let rest = random.random_range(lowest..highest);
                let stiffness = scale(&|sample| sample.q[joint] - rest);
                Effect::Mechanism { joint, law: Mechanism::Spring { stiffness, rest } }
            }
            SecretKind::TorqueRipple => {
                // At least two periods in the range, at most 6 Hz at usual speed.
                let (fewest, most) = (2.0 * TAU / (highest - lowest), (6.0 * TAU / speed).min(40.0));
                let cycles = (fewest + (most - fewest).max(0.0) * random.random::<f64>()).ceil();
                let law = Mechanism::Ripple {
                    torque: wanted * 2.0_f64.sqrt(),
                    cycles,
                    phase: random.random_range(0.0..TAU),
                };
                Effect::Mechanism { joint, law }
            }
            SecretKind::GravityBalancer => {
                let zero = random.random_range(-3.0..3.0);
                let law = |torque: f64| Mechanism::Balancer { torque, zero, arm: 0.35, rest: 0.25 };
                let torque = scale(&|sample| law(1.0).torque(sample.q[joint]));
                Effect::Mechanism { joint, law: law(torque) }
            }
            SecretKind::EndStop => {
                let upper = random.random_bool(0.5);
                let depth = 0.15 * (highest - lowest);
                let threshold = if upper { highest - depth } else { lowest + depth };
                let law = |torque: f64| Mechanism::EndStop { threshold, upper, torque, depth, exponent: 1.0 };
                let torque = scale(&|sample| law(1.0).torque(sample.q[joint]));
                Effect::Mechanism { joint, law: law(torque) }
            }
            SecretKind::TransmissionCoupling => {
                let pairs: Vec<[usize; 2]> = (1..joints)
                    .filter_map(|joint| robot.parent(joint).map(|parent| [parent, joint]))
                    .collect();
                let pair = pairs[random.random_range(0..pairs.len())];
                let torque = pair.map(|joint| rms(&|sample| sample.torque[joint]));
                let sum = rms(&|sample| sample.v[pair[0]] + sample.v[pair[1]]);
                // As large as the smaller of both torques bears.
                let size = share * torque[0].min(torque[1]);
                Effect::Coupling(Coupling::SharedFriction {
                    joints: pair,
                    coefficient: 0.6 * size / sum,
                    torque: 0.6 * size,
                    width,
                })
            }
            SecretKind::JointElasticity => {
                // The spring turns by some hundredths of a radian under the joint's torque.
                let twist = random.random_range(0.02..0.06);
                let stiffness = rms(&|sample| sample.torque[joint]) / twist;
                let inertia = robot.world.rotor_inertia[joint];
                Effect::Flexibility {
                    joint,
                    stiffness,
                    damping: 0.1 * (stiffness * inertia).sqrt(),
                    backlash: 0.0,
                }
            }
            SecretKind::ExternalForce => {
                // Not on the first link, where it is a balancer as well.
                let body = random.random_range(1..joints);
                let (heading, rise) = (random.random_range(0.0..TAU), random.random_range(-0.6..0.6_f64));
                let direction = [heading.cos() * rise.cos(), heading.sin() * rise.cos(), rise.sin()];
                let point = [0; 3].map(|_| random.random_range(-0.1..0.1));
                let felt = |sample: &Sample| moment(robot, body, point, direction, &sample.q);
                let force = share * rms(&|sample| sample.torque[body]) / rms(&felt).max(1e-3);
                Effect::ExternalForce { body, point, force: direction.map(|x| x * force) }
            }
            SecretKind::TimeDelay => {
                Effect::TimeDelay { joints: vec![joint], delay_s: random.random_range(0.006..0.015) }
            }
            SecretKind::Payload => {
                let body = random.random_range(1..joints);
                let own = robot.tree.bodies()[body].inertial[0];
                let center = [0; 3].map(|_| random.random_range(-0.08..0.08));
                Effect::Payload {
                    body,
                    mass: own * random.random_range(0.2..0.5),
                    center,
                    radii: [0.03, 0.035, 0.04],
                }
            }
            SecretKind::GravityTilt => Effect::GravityTilt {
                heading: random.random_range(0.0..TAU),
                angle: random.random_range(0.03..0.1),
            },
        }
    }
}

/// What a unit force asks of the joint that carries its body.
fn moment(robot: &Robot, body: usize, point: [f64; 3], direction: [f64; 3], q: &[f64]) -> f64 {
    let joints = robot.tree.joint_count();
    let mut placements = vec![Placement::identity(); robot.tree.bodies().len()];
    let mut jacobian = vec![0.0; 6 * joints];
    let placed = robot.tree.forward_kinematics(q, &mut placements);
    let moved = robot.tree.point_jacobian(&placements, body, Vec3(point), &mut jacobian);
    debug_assert!(placed.is_ok() && moved.is_ok(), "the sizes come from the tree itself");
    (0..3).map(|row| jacobian[row * joints + body] * direction[row]).sum()
}
