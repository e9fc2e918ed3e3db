//! A secret: one undeclared effect with its form, its joints and its size.

use super::distortion::Distortion;
use super::elasticity::softest;
use super::family::Family;
use super::friction::Friction;
use super::kind::Name;
use super::load::{HeldBody, WorldForce};
use super::mechanism::Mechanism;
use super::plant::{Ordinary, Scene, record};
use super::pull::Pull;
use super::trajectory::Trajectory;
use phiw_dynamics::Tree;

/// How an effect comes about. [`Secret::scale`] is its one size.
#[derive(Clone, Debug)]
pub enum Form {
    /// A friction of one joint.
    Friction(Friction),
    /// The same on several joints, each in its own size.
    Family(Family),
    /// A torque of state or time.
    Mechanism(Mechanism),
    /// A force on a link \[N\].
    Force(WorldForce),
    /// What pulls at a link and moves with it \[N/m, kg\].
    Pull(Pull),
    /// A body held at a link \[kg\].
    Payload(HeldBody),
    /// Gravity turned about a horizontal axis \[rad\].
    Tilt {
        /// Direction of the axis \[rad\].
        heading: f64,
    },
    /// A body that is held part of the time \[kg\].
    LoadStep {
        /// The body.
        held: HeldBody,
        /// From when to when, in session time \[s\].
        when: Vec<[f64; 2]>,
    },
    /// Compliance of the transmission \[rad/(N·m)\].
    Elasticity,
    /// The logged torque is this share too large.
    Gain,
    /// The logged torque is this old \[s\].
    Delay,
    /// The true angle is the logged one plus this \[rad\].
    EncoderOffset,
    /// The sensor reads 0 below this torque \[N·m\].
    DeadBand,
    /// The logged torque is too large by a share that follows the state.
    Distortion(Distortion),
    /// The logged torque's clock is this much slower than the positions' \[s/s\]: a delay that grows from the
    /// beginning of each log.
    ClockDrift,
    /// The actuator delivers no more than this \[N·m\].
    Saturation,
}

/// One undeclared effect.
#[derive(Clone, Debug)]
pub struct Secret {
    /// What it is called.
    pub name: Name,
    /// The joints that it acts on, ascending; empty for a tilt of the base.
    pub joints: Vec<usize>,
    /// How it comes about.
    pub form: Form,
    /// Its size, in the form's unit.
    pub scale: f64,
}

impl Form {
    /// Smallest and largest scale that is plausible.
    fn bounds(&self) -> [f64; 2] {
        match self {
            Form::Delay => [0.002, 0.015],
            Form::EncoderOffset => [0.003, 0.35],
            Form::Tilt { .. } => [0.005, 0.35],
            Form::Gain => [0.02, 0.4],
            Form::ClockDrift => [1e-4, 1e-2],
            Form::Payload(_) | Form::LoadStep { .. } => [1e-3, 30.0],
            Form::Pull(_) => [1e-3, 1e5],
            // Its softest depends on what it carries: see [`super::elasticity::softest`].
            Form::Elasticity => [1e-7, 0.2],
            _ => [1e-9, 1e9],
        }
    }
}

impl Secret {
    /// Adds the secret's torque at all samples, if it is one that adds torque.
    pub fn add_torque(&self, scene: &Scene, torque: &mut [f64]) {
        let joints = scene.tree.joint_count();
        match &self.form {
            Form::Friction(friction) => {
                for &joint in &self.joints {
                    for (sample, added) in friction.torque(scene, joint, self.scale).into_iter().enumerate() {
                        torque[sample * joints + joint] += added;
                    }
                }
            }
            Form::Family(family) => {
                for &joint in &self.joints {
                    for (sample, added) in family.torque(scene, joint).into_iter().enumerate() {
                        torque[sample * joints + joint] += self.scale * added;
                    }
                }
            }
            Form::Mechanism(mechanism) => {
                for sample in 0..scene.times.len() {
                    for &joint in &self.joints {
                        let added = self.scale * mechanism.torque(scene, &self.joints, joint, sample);
                        torque[sample * joints + joint] += added;
                    }
                }
            }
            Form::Force(force) => force.add_torque(scene, self.scale, torque),
            Form::Pull(pull) => pull.add_torque(scene, self.scale, torque),
            _ => {}
        }
    }

    /// Root mean square of the effect over that of the joint's torque without it, for the joint that feels it
    /// most.
    pub fn size(&self, tree: &Tree, ordinary: &Ordinary, motions: &[Trajectory], times: &[Vec<f64>]) -> f64 {
        let mut squares = vec![[0.0; 2]; tree.joint_count()];
        for (motion, times) in motions.iter().zip(times) {
            let record = record(tree, ordinary, &[self], motion, times);
            for (joint, squares) in squares.iter_mut().enumerate() {
                squares[0] += record.effect(joint).map(|effect| effect * effect).sum::<f64>();
                squares[1] +=
                    record.ideal.iter().skip(joint).step_by(tree.joint_count()).map(|t| t * t).sum::<f64>();
            }
        }
        squares.into_iter().map(|[effect, ideal]| (effect / ideal).sqrt()).fold(0.0, f64::max)
    }

    /// Sets the scale so that the size is as asked, within what is plausible; returns the size reached.
    pub fn calibrate(
        &mut self,
        wanted: f64,
        tree: &Tree,
        ordinary: &Ordinary,
        motions: &[Trajectory],
        times: &[Vec<f64>],
    ) -> f64 {
        let [lowest, mut highest] = self.form.bounds();
        if let (Form::Elasticity, [joint]) = (&self.form, self.joints.as_slice()) {
            highest = highest.min(softest(tree, motions, times, *joint));
        }
        let sign = self.scale.signum();
        let mut magnitude = self.scale.abs().clamp(lowest, highest);
        // Almost all sizes grow in proportion to the scale, the others still with it: a damped fixed point
        // finds them.
        for trial in 0..24 {
            self.scale = sign * magnitude;
            let size = self.size(tree, ordinary, motions, times);
            if (size / wanted - 1.0).abs() < 0.01 || !size.is_finite() {
                return size;
            }
            let step = (wanted / size.max(1e-12)).clamp(1e-6, 1e6).powf(if trial < 3 { 1.0 } else { 0.6 });
            let next = (magnitude * step).clamp(lowest, highest);
            if next == magnitude {
                return size;
            }
            magnitude = next;
        }
        self.scale = sign * magnitude;
        self.size(tree, ordinary, motions, times)
    }
}
