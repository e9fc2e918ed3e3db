//! Secrets: which joint, which form, which size.

use super::case::{Robot, Sample};
use clap::ValueEnum;
use phiw_dynamics::{Placement, Vec3};
use phiw_plant::{Coupling, Friction, Mechanism, PlantEffect, Presliding};
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
    /// Coulomb friction of every joint: a family.
    FrictionFamily,
}

/// The experiment of the issue: twelve kinds that show in logs of one motion each, without a model from
/// before.
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
    /// All kinds of one effect.
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

    /// The kind of its effects in `report.json`.
    pub fn effect_kind(self) -> String {
        match self {
            SecretKind::FrictionFamily => SecretKind::CoulombFriction.name(),
            _ => self.name(),
        }
    }

    /// Whether it is one kind on each of several joints.
    pub fn is_family(self) -> bool {
        self == SecretKind::FrictionFamily
    }

    /// Whether an identification of the rigid body swallows it, so that it shows against a held model only.
    pub fn needs_held_model(self) -> bool {
        matches!(self, SecretKind::Payload | SecretKind::GravityTilt)
    }

    /// Draws its effects for motions that go through `samples` (`[q, v, a, torque]` of all joints, from the
    /// references): one, or of a family one for each joint.
    pub fn draw(self, robot: &Robot, samples: &[Sample], rng: &mut ChaCha8Rng) -> Vec<PlantEffect> {
        if !self.is_family() {
            return vec![self.draw_one(&Place::draw(robot, samples, rng), rng)];
        }
        let on = |joint: usize| {
            let place = Place { joint, ..Place::draw(robot, samples, rng) };
            PlantEffect::Friction { joint, law: self.friction(&place, rng) }
        };
        (0..robot.tree.joint_count()).map(on).collect()
    }

    fn draw_one(self, place: &Place<'_>, rng: &mut ChaCha8Rng) -> PlantEffect {
        match self {
            SecretKind::CoulombFriction
            | SecretKind::AsymmetricFriction
            | SecretKind::StribeckFriction
            | SecretKind::QuadraticFriction
            | SecretKind::LoadDependentFriction
            | SecretKind::ThermalDrift
            | SecretKind::FrictionFamily => {
                PlantEffect::Friction { joint: place.joint, law: self.friction(place, rng) }
            }
            SecretKind::JointSpring
            | SecretKind::TorqueRipple
            | SecretKind::GravityBalancer
            | SecretKind::EndStop => {
                PlantEffect::Mechanism { joint: place.joint, law: self.mechanism(place, rng) }
            }
            SecretKind::Hysteresis
            | SecretKind::RotorInertia
            | SecretKind::TransmissionCoupling
            | SecretKind::JointElasticity
            | SecretKind::TimeDelay => self.drive(place, rng),
            SecretKind::ExternalForce | SecretKind::Payload | SecretKind::GravityTilt => {
                self.load(place, rng)
            }
        }
    }

    /// A law of friction, of the wanted size.
    fn friction(self, place: &Place<'_>, rng: &mut ChaCha8Rng) -> Friction {
        let (speed, width) = (place.speed(), place.robot.sign_width);
        match self {
            SecretKind::AsymmetricFriction => {
                let positive = rng.random_bool(0.5);
                let law = |size: f64| Friction::Asymmetric {
                    positive,
                    coefficient: size / speed,
                    torque: 0.0,
                    width,
                };
                law(place.friction_scale(&law(1.0)))
            }
            SecretKind::StribeckFriction => {
                let fall = (speed * rng.random_range(0.1..0.3)).max(2.0 * width);
                let law = |torque: f64| Friction::Stribeck { torque, speed: fall, exponent: 1.5, width };
                law(place.friction_scale(&law(1.0)))
            }
            SecretKind::QuadraticFriction => {
                let law = |coefficient: f64| Friction::Quadratic { coefficient };
                law(place.friction_scale(&law(1.0)))
            }
            SecretKind::LoadDependentFriction => {
                let law = |coefficient: f64| Friction::LoadDependent { coefficient, width };
                law(place.friction_scale(&law(1.0)))
            }
            SecretKind::ThermalDrift => {
                let time_constant_s = rng.random_range(15.0..40.0);
                let law = |size: f64| Friction::Thermal {
                    coefficient: size / speed,
                    torque: size,
                    time_constant_s,
                    width,
                };
                law(place.friction_scale(&law(1.0)))
            }
            _ => {
                let law = |torque: f64| Friction::Coulomb { torque, width };
                law(place.friction_scale(&law(1.0)))
            }
        }
    }

    /// What pulls at a joint by its angle, of the wanted size.
    fn mechanism(self, place: &Place<'_>, rng: &mut ChaCha8Rng) -> Mechanism {
        let joint = place.joint;
        let [lowest, highest] = place.range();
        match self {
            SecretKind::TorqueRipple => {
                // At least two periods in the range, at most 6 Hz at usual speed.
                let (fewest, most) = (2.0 * TAU / (highest - lowest), (6.0 * TAU / place.speed()).min(40.0));
                let cycles = (fewest + (most - fewest).max(0.0) * rng.random::<f64>()).ceil();
                let torque = place.wanted() * 2.0_f64.sqrt();
                Mechanism::Ripple { torque, cycles, phase: rng.random_range(0.0..TAU) }
            }
            SecretKind::GravityBalancer => {
                let zero = rng.random_range(-3.0..3.0);
                let law = |torque: f64| Mechanism::Balancer { torque, zero, arm: 0.35, rest: 0.25 };
                law(place.scale(&|sample| law(1.0).torque(sample.q[joint])))
            }
            SecretKind::EndStop => {
                let upper = rng.random_bool(0.5);
                let depth = 0.15 * (highest - lowest);
                let threshold = if upper { highest - depth } else { lowest + depth };
                let law = |torque: f64| Mechanism::EndStop { threshold, upper, torque, depth, exponent: 1.0 };
                law(place.scale(&|sample| law(1.0).torque(sample.q[joint])))
            }
            _ => {
                let rest = rng.random_range(lowest..highest);
                Mechanism::Spring { stiffness: place.scale(&|sample| sample.q[joint] - rest), rest }
            }
        }
    }

    /// What is in the drive of a joint, or of two.
    fn drive(self, place: &Place<'_>, rng: &mut ChaCha8Rng) -> PlantEffect {
        let (robot, joint) = (place.robot, place.joint);
        match self {
            SecretKind::Hysteresis => {
                let ([lowest, highest], wanted) = (place.range(), place.wanted());
                let way = rng.random_range(0.05..0.2) * (highest - lowest);
                let elements = [[0.3 * way, 0.4 * wanted], [way, 0.6 * wanted]];
                PlantEffect::Presliding {
                    joint,
                    law: Presliding::MaxwellSlip { elements: elements.to_vec() },
                }
            }
            SecretKind::RotorInertia => {
                PlantEffect::RotorInertia { joint, inertia: place.scale(&|sample| sample.a[joint]) }
            }
            SecretKind::TransmissionCoupling => {
                let pairs: Vec<[usize; 2]> = (1..robot.tree.joint_count())
                    .filter_map(|joint| robot.parent(joint).map(|parent| [parent, joint]))
                    .collect();
                let pair = pairs[rng.random_range(0..pairs.len())];
                let torque = pair.map(|joint| place.rms(&|sample| sample.torque[joint]));
                let sum = place.rms(&|sample| sample.v[pair[0]] + sample.v[pair[1]]);
                // As large as the smaller of both torques bears.
                let size = place.share * torque[0].min(torque[1]);
                PlantEffect::Coupling(Coupling::SharedFriction {
                    joints: pair,
                    coefficient: 0.6 * size / sum,
                    torque: 0.6 * size,
                    width: robot.sign_width,
                })
            }
            SecretKind::JointElasticity => {
                // The spring turns by some hundredths of a radian under the joint's torque.
                let twist = rng.random_range(0.02..0.06);
                let stiffness = place.rms(&|sample| sample.torque[joint]) / twist;
                let inertia = robot.world.rotor_inertia[joint];
                let damping = 0.1 * (stiffness * inertia).sqrt();
                PlantEffect::Flexibility { joint, stiffness, damping, backlash: 0.0 }
            }
            _ => PlantEffect::TimeDelay { joints: vec![joint], delay_s: rng.random_range(0.006..0.015) },
        }
    }

    /// What pulls at the bodies.
    fn load(self, place: &Place<'_>, rng: &mut ChaCha8Rng) -> PlantEffect {
        let robot = place.robot;
        let joints = robot.tree.joint_count();
        match self {
            SecretKind::ExternalForce => {
                // Not on the first link, where it is a balancer as well.
                let body = rng.random_range(1..joints);
                let (heading, rise) = (rng.random_range(0.0..TAU), rng.random_range(-0.6..0.6_f64));
                let direction = [heading.cos() * rise.cos(), heading.sin() * rise.cos(), rise.sin()];
                let point = [0; 3].map(|_| rng.random_range(-0.1..0.1));
                let felt = |sample: &Sample| moment(robot, body, point, direction, &sample.q);
                let force =
                    place.share * place.rms(&|sample| sample.torque[body]) / place.rms(&felt).max(1e-3);
                PlantEffect::ExternalForce { body, point, force: direction.map(|x| x * force) }
            }
            SecretKind::Payload => {
                let body = rng.random_range(1..joints);
                let own = robot.tree.bodies()[body].inertial[0];
                let center = [0; 3].map(|_| rng.random_range(-0.08..0.08));
                let mass = own * rng.random_range(0.2..0.5);
                PlantEffect::Payload { body, mass, center, radii: [0.03, 0.035, 0.04] }
            }
            _ => PlantEffect::GravityTilt {
                heading: rng.random_range(0.0..TAU),
                angle: rng.random_range(0.03..0.1),
            },
        }
    }
}

/// Where a secret is, and what there is to measure its size by.
struct Place<'a> {
    robot: &'a Robot,
    samples: &'a [Sample],
    joint: usize,
    /// RMS of the secret's torque over that of the joint's.
    share: f64,
}

impl<'a> Place<'a> {
    fn draw(robot: &'a Robot, samples: &'a [Sample], rng: &mut ChaCha8Rng) -> Self {
        let joint = rng.random_range(0..robot.tree.joint_count());
        Place { robot, samples, joint, share: rng.random_range(SIZES[0]..SIZES[1]) }
    }

    fn rms(&self, value: &dyn Fn(&Sample) -> f64) -> f64 {
        let sum = self.samples.iter().map(|sample| value(sample).powi(2)).sum::<f64>();
        (sum / self.samples.len() as f64).sqrt()
    }

    /// RMS that the secret's torque is to have \[N·m\].
    fn wanted(&self) -> f64 {
        self.share * self.rms(&|sample| sample.torque[self.joint])
    }

    /// RMS speed of the joint \[rad/s\].
    fn speed(&self) -> f64 {
        self.rms(&|sample| sample.v[self.joint])
    }

    /// Lowest and highest angle of the joint \[rad\].
    fn range(&self) -> [f64; 2] {
        let angles = || self.samples.iter().map(|sample| sample.q[self.joint]);
        [angles().fold(f64::INFINITY, f64::min), angles().fold(f64::NEG_INFINITY, f64::max)]
    }

    /// The size that makes an effect of size 1 as large as wanted.
    fn scale(&self, unit: &dyn Fn(&Sample) -> f64) -> f64 {
        self.wanted() / self.rms(unit).max(1e-12)
    }

    fn friction_scale(&self, law: &Friction) -> f64 {
        let joint = self.joint;
        self.scale(&|sample| law.torque(sample.v[joint], sample.t_s, sample.torque[joint]))
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
