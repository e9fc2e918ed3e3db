//! An effect that all joints have, each in its own size: friction, rotors, offsets.

use super::friction::{Sign, lugre_along};
use super::kind::Kind;
use super::plant::{Ordinary, Scene};
use super::rng::CaseRng;

/// One kind of effect on several joints.
#[derive(Clone, Debug)]
pub struct Family {
    /// Its size on each joint of the robot; 0 where a joint has none.
    pub values: Vec<f64>,
    /// Its form.
    pub shape: Shape,
}

/// The form of a family. None is the catalogue's to the letter.
#[derive(Clone, Debug)]
pub enum Shape {
    /// v₀·sign(v)·|v/v₀|^power: grease thins or thickens with speed.
    Viscous { power: f64, reference: Vec<f64> },
    /// A sign that is smoothed over each joint's own width \[rad/s\].
    Coulomb { smoothing: Sign, widths: Vec<f64> },
    /// Bristles, each joint's bending this far \[rad, m\]: at rest they hold what they held.
    Bristles { distances: Vec<f64> },
    /// Held by a soft constraint, as MuJoCo's friction loss: −(q̈ + q̇/`lead`) times a constant until it
    /// slips, which at constant speed it does at each joint's own width \[s; rad/s, m/s\].
    Constraint { lead: f64, widths: Vec<f64> },
    /// q̈.
    Rotor,
    /// 1.
    Offset,
}

/// How dry friction turns where the motion does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turning {
    /// Over a speed.
    OverASpeed,
    /// As bristles that bend no further than any joint notices that moves, 10 to 100 µrad or µm, all as far.
    StiffBristles,
    /// As bristles that bend 0.1 to 1 mrad or mm, those of each joint by themselves.
    SoftBristles,
    /// As a simulator's soft constraint, of one time constant for all joints.
    SoftConstraint,
}

impl Family {
    /// The family of a kind, in the sizes of `ordinary`, on the joints of `members`. `speed`: each joint's
    /// root mean square.
    pub fn draw(
        kind: Kind,
        ordinary: &Ordinary,
        members: &[usize],
        speed: &[f64],
        turning: Turning,
        rng: &mut CaseRng,
    ) -> Self {
        let (values, shape) = match kind {
            Kind::ViscousFriction => {
                let power = if rng.chance(0.4) { rng.uniform(0.92, 1.08) } else { 1.0 };
                (&ordinary.viscous, Shape::Viscous { power, reference: speed.to_vec() })
            }
            Kind::CoulombFriction if turning == Turning::StiffBristles => {
                let distances = vec![rng.log_uniform(1e-5, 1e-4); speed.len()];
                (&ordinary.coulomb, Shape::Bristles { distances })
            }
            Kind::CoulombFriction if turning == Turning::SoftBristles => {
                let distances = speed.iter().map(|_| rng.log_uniform(1e-4, 1e-3)).collect();
                (&ordinary.coulomb, Shape::Bristles { distances })
            }
            Kind::CoulombFriction if turning == Turning::SoftConstraint => {
                let lead = rng.log_uniform(3e-3, 0.02);
                // The lighter the joint, the wider: from as good as stiff to one that hardly slips.
                let widths = speed.iter().map(|speed| speed * rng.log_uniform(3e-3, 0.5)).collect();
                (&ordinary.coulomb, Shape::Constraint { lead, widths })
            }
            Kind::CoulombFriction => {
                let apart = if rng.chance(0.5) { 2.0 } else { 1.0 };
                let widths = speed.iter().map(|_| ordinary.width * rng.log_uniform(1.0 / apart, apart));
                let widths = widths.collect();
                let smoothing = rng.pick(&[Sign::Tanh, Sign::Algebraic, Sign::Arctan]);
                (&ordinary.coulomb, Shape::Coulomb { smoothing, widths })
            }
            Kind::RotorInertia => (&ordinary.rotor, Shape::Rotor),
            _ => (&ordinary.offset, Shape::Offset),
        };
        let values = values.iter().enumerate();
        let values = values.map(|(joint, value)| if members.contains(&joint) { *value } else { 0.0 });
        Family { values: values.collect(), shape }
    }

    /// Torque on a joint at the scene's times.
    pub fn torque(&self, scene: &Scene, joint: usize) -> Vec<f64> {
        let value = self.values[joint];
        if value == 0.0 {
            return vec![0.0; scene.times.len()];
        }
        if let Shape::Bristles { distances } = &self.shape {
            return lugre_along(scene, joint, distances[joint], value);
        }
        let states = &scene.motor;
        let shape = |sample: usize| {
            let v = states.v(sample, joint);
            match &self.shape {
                Shape::Viscous { power, .. } if *power == 1.0 => v,
                Shape::Viscous { power, reference } => {
                    let reference = reference[joint].max(f64::MIN_POSITIVE);
                    reference * (v / reference).abs().powf(*power) * v.signum()
                }
                Shape::Coulomb { smoothing, widths } => smoothing.of(v, widths[joint]),
                Shape::Constraint { lead, widths } => {
                    ((v + lead * states.a(sample, joint)) / widths[joint]).clamp(-1.0, 1.0)
                }
                Shape::Rotor => states.a(sample, joint),
                Shape::Offset | Shape::Bristles { .. } => 1.0,
            }
        };
        (0..scene.times.len()).map(|sample| value * shape(sample)).collect()
    }
}
