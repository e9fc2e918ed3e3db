//! How much of an effect the declared model cannot absorb: an effect that it swallows whole is no case.

use super::draw::Survey;
use super::kind::Kind;
use super::plant::{Ordinary, Record, States, rigid_torque};
use phiw_dynamics::Tree;

/// What a declared model can do with a record.
pub struct Absorber {
    joints: usize,
    /// Orthonormal columns, each samples × joints.
    basis: Vec<Vec<f64>>,
    weights: Vec<f64>,
}

impl Absorber {
    /// The columns of the rigid body and the declared effects along a record, weighted by one over the noise.
    pub fn new(
        tree: &Tree,
        ordinary: &Ordinary,
        declared: &[Kind],
        records: &[Record],
        noise: &[f64],
    ) -> Self {
        let joints = tree.joint_count();
        let weights: Vec<f64> = noise.iter().map(|noise| 1.0 / noise).collect();
        let mut absorber = Absorber { joints, basis: Vec::new(), weights };
        let mut single = tree.clone();
        for parameter in 0..tree.inertial_parameters().len() {
            let mut parameters = vec![0.0; tree.inertial_parameters().len()];
            parameters[parameter] = 1.0;
            if single.set_inertial_parameters(&parameters).is_ok() {
                absorber.add(
                    records.iter().flat_map(|record| rigid_torque(&record.states, |_| &single)).collect(),
                );
            }
        }
        for kind in declared {
            let shape: &dyn Fn(&States, usize, usize) -> f64 = match kind {
                Kind::ViscousFriction => &|states, sample, joint| states.v(sample, joint),
                Kind::CoulombFriction => &|states, sample, joint| ordinary.sign(states.v(sample, joint)),
                Kind::RotorInertia => &|states, sample, joint| states.a(sample, joint),
                _ => &|_, _, _| 1.0,
            };
            for joint in 0..joints {
                absorber.add_shape(records, joint, shape);
            }
        }
        absorber
    }

    /// Also what a simpler effect could pass for: an offset, a spring, or a sinusoid of the angle.
    pub fn add_simpler(&mut self, kind: Kind, joint: usize, records: &[Record]) {
        use Kind::{
            AsymmetricFriction, EncoderOffset, ExternalForce, GravityBalancer, GravityTilt, Hysteresis,
            JointSpring, Payload, PositionMap,
        };
        let offsets = match kind {
            GravityBalancer | JointSpring | Hysteresis | AsymmetricFriction | PositionMap => joint..joint + 1,
            // Felt along the chain: an offset on any of its joints.
            ExternalForce | Payload | GravityTilt | EncoderOffset => 0..self.joints,
            _ => 0..0,
        };
        for joint in offsets {
            self.add_shape(records, joint, &|_, _, _| 1.0);
        }
        if matches!(kind, GravityBalancer | Hysteresis | PositionMap) {
            self.add_shape(records, joint, &|states, sample, joint| states.q(sample, joint));
        }
        if kind == PositionMap {
            self.add_shape(records, joint, &|states, sample, joint| states.q(sample, joint).sin());
            self.add_shape(records, joint, &|states, sample, joint| states.q(sample, joint).cos());
        }
    }

    /// Also a shape of a joint's state, on that joint's torque.
    pub fn add_shape(
        &mut self,
        records: &[Record],
        joint: usize,
        shape: &dyn Fn(&States, usize, usize) -> f64,
    ) {
        let joints = self.joints;
        let column = records.iter().flat_map(|record| {
            let value = move |row: usize| {
                if row % joints == joint { shape(&record.states, row / joints, joint) } else { 0.0 }
            };
            (0..record.times.len() * joints).map(value)
        });
        let column = column.collect();
        self.add(column);
    }

    /// Also this column, samples × joints. Gram-Schmidt, twice, which is enough (Giraud et al. 2005).
    pub fn add(&mut self, column: Vec<f64>) {
        let mut column = self.weighted(column);
        let before = norm(&column);
        for _ in 0..2 {
            self.project_out(&mut column);
        }
        let after = norm(&column);
        if after > 1e-8 * before {
            column.iter_mut().for_each(|value| *value /= after);
            self.basis.push(column);
        }
    }

    fn weighted(&self, mut column: Vec<f64>) -> Vec<f64> {
        for (row, value) in column.iter_mut().enumerate() {
            *value *= self.weights[row % self.joints];
        }
        column
    }

    fn project_out(&self, column: &mut [f64]) {
        for basis in &self.basis {
            let along: f64 = basis.iter().zip(&*column).map(|(a, b)| a * b).sum();
            column.iter_mut().zip(basis).for_each(|(value, basis)| *value -= along * basis);
        }
    }

    /// RMS of what is left of the records' effect, in units of the noise, for the joint where most is left.
    pub fn visible(&self, records: &[Record]) -> f64 {
        let effect =
            records.iter().flat_map(|record| record.torque.iter().zip(&record.ideal).map(|(a, b)| a - b));
        let mut column = self.weighted(effect.collect());
        self.project_out(&mut column);
        let samples = column.len() / self.joints;
        let mean_square = |joint| {
            column.iter().skip(joint).step_by(self.joints).map(|value| value * value).sum::<f64>()
                / samples as f64
        };
        (0..self.joints).map(mean_square).fold(0.0, f64::max).sqrt()
    }

    /// What is left of a column, weighted by one over the noise.
    pub fn residual(&self, column: Vec<f64>) -> Vec<f64> {
        let mut column = self.weighted(column);
        for _ in 0..2 {
            self.project_out(&mut column);
        }
        column
    }

    /// No declared model: what is held absorbs nothing.
    pub fn held(survey: &Survey, noise: &[f64]) -> Self {
        let weights = noise.iter().map(|noise| 1.0 / noise).collect();
        Absorber { joints: survey.speed.len(), basis: Vec::new(), weights }
    }
}

fn norm(column: &[f64]) -> f64 {
    column.iter().map(|value| value * value).sum::<f64>().sqrt()
}
