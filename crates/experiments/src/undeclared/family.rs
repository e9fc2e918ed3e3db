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
    /// q̈.
    Rotor,
    /// 1.
    Offset,
}

/// Whether dry friction is that of bristles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bristles {
    /// Its sign turns over a speed.
    None,
    /// They bend no further than any joint notices that moves, 10 to 100 µrad or µm, and all as far.
    Stiff,
    /// They bend 0.1 to 1 mrad or mm, those of each joint by themselves.
    Soft,
}

impl Family {
    /// The family of a kind, in the sizes of `ordinary`, on the joints of `members`. `speed`: each joint's
    /// root mean square.
    pub fn draw(
        kind: Kind,
        ordinary: &Ordinary,
        members: &[usize],
        speed: &[f64],
        bristles: Bristles,
        rng: &mut CaseRng,
    ) -> Self {
        let (values, shape) = match kind {
            Kind::ViscousFriction => {
                let power = if rng.chance(0.4) { rng.uniform(0.92, 1.08) } else { 1.0 };
                (&ordinary.viscous, Shape::Viscous { power, reference: speed.to_vec() })
            }
            Kind::CoulombFriction if bristles == Bristles::Stiff => {
                let distances = vec![rng.log_uniform(1e-5, 1e-4); speed.len()];
                (&ordinary.coulomb, Shape::Bristles { distances })
            }
            Kind::CoulombFriction if bristles == Bristles::Soft => {
                let distances = speed.iter().map(|_| rng.log_uniform(1e-4, 1e-3)).collect();
                (&ordinary.coulomb, Shape::Bristles { distances })
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
                Shape::Rotor => states.a(sample, joint),
                Shape::Offset | Shape::Bristles { .. } => 1.0,
            }
        };
        (0..scene.times.len()).map(|sample| value * shape(sample)).collect()
    }
}
