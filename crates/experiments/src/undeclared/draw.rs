//! Draws the form of an effect: which joints, which constants.

use super::distortion::Distortion;
use super::friction::Friction;
use super::kind::{Kind, Stranger};
use super::load::{HeldBody, WorldForce};
use super::mechanism::Mechanism;
use super::pull::{Carried, Pull};
use super::rng::CaseRng;
use super::secret::Form;
use super::suite::NewForm;
use super::trajectory::Reach;
use phiw_dynamics::{JointType, Tree};
use std::f64::consts::{PI, TAU};

/// What is known of the motions when a secret is drawn.
pub struct Survey<'a> {
    /// The robot.
    pub tree: &'a Tree,
    /// Lowest and highest position that every log reaches, joint by joint.
    pub range: Vec<[f64; 2]>,
    /// Lowest and highest position that any log reaches, joint by joint.
    pub arc: Vec<[f64; 2]>,
    /// Root mean square of the speed.
    pub speed: Vec<f64>,
    /// Root mean square of the torque.
    pub torque: Vec<f64>,
    /// Speed over which signs are smoothed.
    pub width: f64,
    /// Which joint the motions bring near a limit.
    pub reach: Option<Reach>,
    /// Beginning and end of each log in session time \[s\].
    pub spans: Vec<[f64; 2]>,
}

impl Survey<'_> {
    fn travel(&self, joint: usize) -> f64 {
        self.range[joint][1] - self.range[joint][0]
    }

    fn is_prismatic(&self, joint: usize) -> bool {
        self.tree.joint(joint).joint_type == JointType::Prismatic
    }

    fn inside(&self, joint: usize, rng: &mut CaseRng) -> f64 {
        rng.uniform(self.range[joint][0], self.range[joint][1])
    }

    /// Whether the effect on this joint gives, to the last digit, the torques of another one: then there is
    /// no right name.
    fn is_ambiguous(&self, kind: Kind, joint: usize) -> bool {
        let body = self.tree.joint(joint);
        let is_root = body.parent.is_none();
        match kind {
            // A force that keeps its direction, on the first link: a sinusoid of its angle, as a balancer's.
            Kind::ExternalForce => is_root,
            // A body on the first link: what turns about the axis, as a rotor does, and a sinusoid if the
            // axis is level.
            Kind::Payload => is_root,
            // All angles from the first joint on are turned alike: the base is tilted.
            Kind::EncoderOffset => is_root,
            // The same seen from the other side, where all axes are parallel and level.
            Kind::GravityTilt => {
                let first = self.tree.joint(0).axis;
                let level = |body: &phiw_dynamics::Body| body.axis == first && body.axis.0[2] == 0.0;
                self.tree.bodies().iter().all(level)
            }
            _ => false,
        }
    }

    /// Lengths along a slide are a tenth of angles.
    fn distance(&self, joint: usize, rng: &mut CaseRng, low: f64, high: f64) -> f64 {
        rng.log_uniform(low, high) * if self.is_prismatic(joint) { 0.1 } else { 1.0 }
    }

    /// A joint and the one before it in the tree.
    fn neighbours(&self, rng: &mut CaseRng) -> Option<Vec<usize>> {
        let bodies = self.tree.bodies();
        let pairs: Vec<[usize; 2]> = bodies
            .iter()
            .enumerate()
            .filter_map(|(body, inner)| {
                inner.parent.map(|outer| [bodies[outer].velocity_index, bodies[body].velocity_index])
            })
            .collect();
        (!pairs.is_empty()).then(|| rng.pick(&pairs).to_vec())
    }
}

/// The form of a catalogue's effect, the joints that it acts on and the sign of its scale.
///
/// `None`: these motions leave no room for it.
pub fn catalogue(
    kind: Kind,
    joint: usize,
    survey: &Survey,
    rng: &mut CaseRng,
) -> Option<(Vec<usize>, Form, f64)> {
    if survey.is_ambiguous(kind, joint) {
        return None;
    }
    let speed = survey.speed[joint];
    let one = |friction: Friction| Some((vec![joint], Form::Friction(friction), 1.0));
    let mechanism = |mechanism: Mechanism, sign: f64| Some((vec![joint], Form::Mechanism(mechanism), sign));
    match kind {
        Kind::ViscousFriction => one(Friction::Viscous),
        Kind::CoulombFriction if rng.chance(0.35) => {
            one(Friction::CoulombLuGre { distance: survey.distance(joint, rng, 1e-5, 1e-4) })
        }
        Kind::CoulombFriction => one(Friction::Coulomb),
        Kind::AsymmetricFriction => {
            let coulomb = if rng.chance(0.5) { 0.0 } else { rng.uniform(0.1, 1.0) * speed };
            one(Friction::Asymmetric { positive: rng.chance(0.5), coulomb })
        }
        Kind::StribeckFriction => {
            // Not so narrow that the smoothed sign hides it.
            let speed = (speed * rng.log_uniform(0.08, 0.4)).max(2.0 * survey.width);
            let exponent = rng.uniform(0.5, 2.0);
            if rng.chance(0.5) {
                return one(Friction::Stribeck { speed, exponent });
            }
            one(Friction::StribeckLuGre {
                speed,
                exponent,
                distance: survey.distance(joint, rng, 1e-5, 1e-4),
            })
        }
        Kind::QuadraticFriction => one(Friction::Quadratic),
        Kind::LoadDependentFriction => one(Friction::LoadDependent),
        Kind::DriveEfficiency => one(efficiency(rng)),
        Kind::PositionMap => mechanism(position_map(joint, survey, rng)?, rng.sign()),
        Kind::PositionDependentFriction => mechanism(position_friction(joint, survey, rng), 1.0),
        Kind::ThermalDrift => one(Friction::Thermal {
            time_constant: rng.log_uniform(10.0, 60.0),
            viscous: rng.uniform(0.2, 2.0) / speed,
            cold_again: false,
        }),
        Kind::Hysteresis => one(hysteresis(joint, survey, rng)),
        Kind::RotorInertia => mechanism(Mechanism::Rotor, 1.0),
        Kind::TorqueOffset => mechanism(Mechanism::Offset, rng.sign()),
        Kind::JointSpring => mechanism(Mechanism::Spring { center: survey.inside(joint, rng) }, 1.0),
        Kind::GravityBalancer if survey.is_prismatic(joint) => None,
        Kind::GravityBalancer => {
            let rest = if rng.chance(0.5) { 0.0 } else { rng.uniform(0.1, 0.4) };
            let balancer =
                Mechanism::Balancer { zero: rng.uniform(-PI, PI), arm: rng.uniform(0.2, 0.5), rest };
            mechanism(balancer, rng.sign())
        }
        Kind::TorqueRipple => mechanism(ripple(joint, survey, rng)?, 1.0),
        Kind::EndStop => {
            let reach = survey.reach.filter(|reach| reach.joint == joint)?;
            let limits = survey.tree.joint(joint).limits;
            let depth = rng.uniform(0.05, 0.14) * (limits.upper - limits.lower);
            let threshold = if reach.upper { limits.upper - depth } else { limits.lower + depth };
            let exponent = if rng.chance(0.7) { 1.0 } else { rng.uniform(1.0, 1.6) };
            mechanism(Mechanism::EndStop { threshold, upper: reach.upper, depth, exponent }, 1.0)
        }
        Kind::TransmissionCoupling => coupling(survey, rng),
        Kind::ExternalForce => {
            let (heading, rise) = (rng.uniform(0.0, TAU), rng.uniform(-0.6, 0.6));
            let direction = [heading.cos() * rise.cos(), heading.sin() * rise.cos(), rise.sin()];
            let point = [0; 3].map(|_| rng.uniform(-0.15, 0.15));
            Some((vec![joint], Form::Force(WorldForce { body: joint, point, direction }), 1.0))
        }
        Kind::Payload => Some((vec![joint], Form::Payload(held_body(joint, rng)), 1.0)),
        Kind::GravityTilt => Some((Vec::new(), Form::Tilt { heading: rng.uniform(0.0, TAU) }, 1.0)),
        Kind::EncoderOffset => Some((vec![joint], Form::EncoderOffset, rng.sign())),
        Kind::TorqueGain => Some((vec![joint], Form::Gain, rng.sign())),
        Kind::TimeDelay if rng.chance(0.4) => Some(((0..survey.speed.len()).collect(), Form::Delay, 1.0)),
        Kind::TimeDelay => Some((vec![joint], Form::Delay, 1.0)),
        Kind::JointElasticity => Some((vec![joint], Form::Elasticity, 1.0)),
        Kind::ActuatorSaturation => Some((vec![joint], Form::Saturation, 1.0)),
    }
}

/// The form of an effect from outside the catalogue, as [`catalogue`].
pub fn outside(
    stranger: Stranger,
    joint: usize,
    survey: &Survey,
    rng: &mut CaseRng,
) -> Option<(Vec<usize>, Form, f64)> {
    let joints = survey.speed.len();
    let mechanism = |mechanism: Mechanism| Some((vec![joint], Form::Mechanism(mechanism), 1.0));
    match stranger {
        Stranger::TimeSinusoid => mechanism(Mechanism::TimeSinusoid {
            frequency: TAU * rng.log_uniform(0.2, 3.0),
            phase: rng.uniform(0.0, TAU),
        }),
        Stranger::PositionCoupling => {
            let pair = survey.neighbours(rng)?;
            let center = pair.iter().map(|&joint| survey.inside(joint, rng)).sum();
            Some((pair, Form::Mechanism(Mechanism::PositionCoupling { center }), 1.0))
        }
        Stranger::DeadZoneSpring => {
            let [low, high] = survey.range[joint];
            let center = 0.5 * (low + high) + rng.uniform(-0.1, 0.1) * (high - low);
            mechanism(Mechanism::DeadZoneSpring { center, half: rng.uniform(0.15, 0.25) * (high - low) })
        }
        Stranger::RandomWalk => {
            let (step, end) = (0.05, survey.spans.iter().map(|span| span[1]).fold(0.0, f64::max));
            let mut level = 0.0;
            let mut velocity = 0.0;
            let walk = |_| {
                // A walk smoothed over a second or so: a wandering offset, not noise.
                velocity += 0.05 * (rng.normal() - velocity);
                level += velocity;
                level *= 0.998;
                level
            };
            mechanism(Mechanism::RandomWalk {
                path: (0..(end / step) as usize + 2).map(walk).collect(),
                step,
            })
        }
        Stranger::SensorDeadBand => Some((vec![joint], Form::DeadBand, 0.3 * survey.torque[joint])),
        Stranger::LoadStep => {
            let when = survey
                .spans
                .iter()
                .map(|[from, to]| [rng.uniform(from + 5.0, to - 5.0), *to + 1.0])
                .collect();
            Some((vec![joint], Form::LoadStep { held: held_body(joint, rng), when }, 1.0))
        }
        Stranger::SpeedProduct => {
            let other = another(joint, joints, rng)?;
            let pair = vec![joint.min(other), joint.max(other)];
            Some((pair, Form::Mechanism(Mechanism::SpeedProduct { felt: joint, other }), rng.sign()))
        }
        Stranger::PositionFriction => mechanism(waves_of_friction(joint, survey, rng)),
        Stranger::LoadRipple => {
            let cycles = TAU * rng.log_uniform(3.0, 20.0) / survey.travel(joint);
            distortion(joint, Distortion::Ripple { cycles, phase: rng.uniform(0.0, TAU) })
        }
        Stranger::FallingTorqueConstant => {
            distortion(joint, Distortion::OfTorque { large: survey.torque[joint] })
        }
        Stranger::SpeedGain => distortion(joint, Distortion::OfSpeed { fast: survey.speed[joint] }),
        Stranger::Crosstalk => {
            distortion(joint, Distortion::Crosstalk { other: another(joint, joints, rng)? })
        }
        Stranger::FrictionJump => {
            let after = |[from, to]: &[f64; 2]| [rng.uniform(from + 5.0, to - 5.0), *to + 1.0];
            mechanism(Mechanism::FrictionJump { when: survey.spans.iter().map(after).collect() })
        }
        Stranger::ClockDrift => Some(((0..joints).collect(), Form::ClockDrift, 1.0)),
        Stranger::Hose | Stranger::SwingingLoad => {
            let point = [0; 3].map(|_| rng.uniform(-0.1, 0.1));
            let carried = match stranger {
                Stranger::Hose => Carried::Hose {
                    anchor: [0; 3].map(|_| rng.uniform(-0.6, 0.6)),
                    slack: rng.uniform(0.0, 0.3),
                },
                _ => {
                    Carried::Load { omega: TAU * rng.log_uniform(0.7, 3.0), damping: rng.uniform(0.01, 0.1) }
                }
            };
            Some((vec![joint], Form::Pull(Pull { body: joint, point, carried }), 1.0))
        }
    }
}

fn distortion(joint: usize, distortion: Distortion) -> Option<(Vec<usize>, Form, f64)> {
    Some((vec![joint], Form::Distortion(distortion), 1.0))
}

/// Another joint than this one; `None` if there is none.
fn another(joint: usize, joints: usize, rng: &mut CaseRng) -> Option<usize> {
    (joints > 1).then(|| (joint + 1 + rng.index(joints - 1)) % joints)
}

fn hysteresis(joint: usize, survey: &Survey, rng: &mut CaseRng) -> Friction {
    let distance = survey.distance(joint, rng, 0.02, 0.3).min(0.25 * survey.travel(joint));
    if rng.chance(0.4) {
        return Friction::Dahl { distance, exponent: rng.uniform(1.0, 2.0) };
    }
    let count = 1 + rng.index(5);
    let weights: Vec<f64> = (0..count).map(|_| rng.uniform(0.3, 1.0)).collect();
    let total: f64 = weights.iter().sum();
    let element =
        |(number, weight): (usize, &f64)| [distance * (number + 1) as f64 / count as f64, weight / total];
    Friction::Maxwell { elements: weights.iter().enumerate().map(element).collect() }
}

/// The same losses both ways are friction of the load: here they differ, or are those of one number (over
/// it, or times it).
fn efficiency(rng: &mut CaseRng) -> Friction {
    let (well, badly) = (rng.uniform(0.9, 1.0), rng.uniform(0.4, 0.75));
    match rng.index(3) {
        0 => Friction::Efficiency { driving: well, driven: badly },
        1 => Friction::Efficiency { driving: badly, driven: well },
        _ => Friction::Efficiency { driving: badly, driven: badly },
    }
}

/// Smooth over the arc that the logs show, and felt where all of them are.
fn position_map(joint: usize, survey: &Survey, rng: &mut CaseRng) -> Option<Mechanism> {
    let [low, high] = survey.range[joint];
    let arc = survey.arc[joint][1] - survey.arc[joint][0];
    if survey.travel(joint) < 0.4 * arc {
        return None;
    }
    let count = 2 + rng.index(3);
    if rng.chance(0.5) {
        let mut bump = || {
            let width = rng.uniform(0.08, 0.2) * arc;
            [rng.uniform(low, high), width, rng.sign() * rng.uniform(0.4, 1.0)]
        };
        return Some(Mechanism::Bumps { bumps: (0..count).map(|_| bump()).collect() });
    }
    let mut wave = || [TAU * rng.uniform(0.6, 2.5) / arc, rng.uniform(0.0, TAU), rng.uniform(0.4, 1.0)];
    Some(Mechanism::Beats { waves: (0..count).map(|_| wave()).collect() })
}

/// Waves of friction, or one tight spot that is felt where all logs are.
fn position_friction(joint: usize, survey: &Survey, rng: &mut CaseRng) -> Mechanism {
    if rng.chance(0.6) {
        return waves_of_friction(joint, survey, rng);
    }
    let width = rng.uniform(0.15, 0.4) * survey.travel(joint);
    Mechanism::TightSpot { center: survey.inside(joint, rng), width }
}

fn waves_of_friction(joint: usize, survey: &Survey, rng: &mut CaseRng) -> Mechanism {
    let cycles = TAU * rng.uniform(1.5, 4.0) / survey.travel(joint);
    Mechanism::PositionFriction { cycles, phase: rng.uniform(0.0, TAU) }
}

fn ripple(joint: usize, survey: &Survey, rng: &mut CaseRng) -> Option<Mechanism> {
    // At least a turn and a half over the travel, or it is a spring; at most 8 Hz at usual speed, or filters
    // take it away.
    let (fewest, most) = (1.5 * TAU / survey.travel(joint), 8.0 * TAU / survey.speed[joint]);
    // A harmonic drive of 1:160 ripples 320 times a turn.
    let most = if survey.is_prismatic(joint) { most } else { most.min(320.0) };
    if fewest * 1.2 > most {
        return None;
    }
    let mut cycles = rng.log_uniform(fewest, most);
    if !survey.is_prismatic(joint) {
        cycles = cycles.ceil();
    }
    let second = if rng.chance(0.5) { rng.uniform(0.1, 0.5) } else { 0.0 };
    let [phase, second_phase] = [0; 2].map(|_| rng.uniform(0.0, TAU));
    Some(Mechanism::Ripple { cycles, phase, second, second_phase })
}

fn coupling(survey: &Survey, rng: &mut CaseRng) -> Option<(Vec<usize>, Form, f64)> {
    let pair = survey.neighbours(rng)?;
    let alike = survey.is_prismatic(pair[0]) == survey.is_prismatic(pair[1]);
    let speed = survey.speed[pair[0]].hypot(survey.speed[pair[1]]);
    let (mechanism, sign) = match rng.index(4) {
        0 | 1 if alike => {
            let share = rng.pick(&[0.0, 0.3, 0.6, 1.0]);
            (Mechanism::SumFriction { viscous: (1.0 - share) / speed, coulomb: share, ratio: 1.0 }, 1.0)
        }
        2 => (Mechanism::AccelerationCoupling, rng.sign()),
        _ => {
            let forward = rng.chance(0.5);
            let [driven, driver] = if forward { [pair[0], pair[1]] } else { [pair[1], pair[0]] };
            (Mechanism::OneWay { driven, driver, coulomb: rng.chance(0.4) }, rng.sign())
        }
    };
    Some((pair, Form::Mechanism(mechanism), sign))
}

/// What makes the form of a kind a new one, if the kind has it here.
pub fn renewed(form: Form, new: NewForm, rng: &mut CaseRng) -> Option<Form> {
    match (new, form) {
        (NewForm::ColdAgain, Form::Friction(Friction::Thermal { viscous, .. })) => {
            let time_constant = rng.log_uniform(5.0, 15.0);
            Some(Form::Friction(Friction::Thermal { time_constant, viscous, cold_again: true }))
        }
        (NewForm::LongSince, form @ Form::Friction(Friction::Thermal { .. })) => Some(form),
        (NewForm::GearedSum, Form::Mechanism(Mechanism::SumFriction { viscous, coulomb, .. })) => {
            let ratio = rng.sign() * rng.log_uniform(0.5, 2.0);
            // Viscous friction of any such shaft is that of the sum and of each joint by itself.
            let coulomb = coulomb.max(LEAST_OF_GEARED);
            Some(Form::Mechanism(Mechanism::SumFriction { viscous, coulomb, ratio }))
        }
        (NewForm::LoadAndSpeed, _) => Some(Form::Friction(Friction::LoadAndSpeed)),
        (NewForm::OverTwoJoints, _) => {
            Some(Form::Mechanism(Mechanism::PositionCoupling { center: rng.uniform(-0.5, 0.5) }))
        }
        _ => None,
    }
}

/// Share of Coulomb friction in that of a geared shaft, at least.
const LEAST_OF_GEARED: f64 = 0.3;

fn held_body(body: usize, rng: &mut CaseRng) -> HeldBody {
    let radius = rng.uniform(0.02, 0.07);
    HeldBody {
        body,
        center: [0; 3].map(|_| rng.uniform(-0.12, 0.12)),
        // Near enough to each other that any such body exists.
        radii: [0; 3].map(|_| radius * rng.uniform(0.85, 1.15)),
    }
}
