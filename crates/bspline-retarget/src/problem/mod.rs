//! Problem (15): its variables, its cost, gradient and normal equations.

mod correspondence;
mod poses;
mod priors;

pub(crate) use correspondence::robot_vector;

use crate::bspline::Basis;
use crate::human::{HumanBody, HumanScratch};
use crate::recording::MarkerRecording;
use crate::robot::RobotModel;
use crate::solver::Arrow;
use crate::weights::{Cost, Weights};
use phiw_dynamics::{Placement, Vec3};

/// Retargeting of one recording: variables are the control points (each: human coordinates, then robot coordinates), then the
/// parameters ξ^h.
pub struct Problem<'a> {
    pub(crate) body: &'a HumanBody,
    pub(crate) robot: Option<&'a RobotModel>,
    pub(crate) weights: Weights,
    basis: Basis,
    /// Positions of the body's points, sample by sample \[m\].
    measured: Vec<[f64; 3]>,
    samples: usize,
    rate_hz: f64,
    /// For each sample, its first control point, and its weights.
    firsts: Vec<usize>,
    values: Vec<f64>,
    /// Σ b̈_i b̈_j over the samples for control point i and those from i − degree to i \[1/s⁴\].
    accelerations: Vec<f64>,
    /// Vectors that replace the human's in a correspondence, sample by sample.
    targets: Vec<(usize, Vec<Vec3<f64>>)>,
}

/// Room for one sample.
pub struct Scratch {
    columns: Vec<f64>,
    human: HumanScratch,
    placements: Vec<Placement<f64>>,
    jacobians: [Vec<f64>; 2],
    /// Columns of one correspondence that are not zero, and their derivatives.
    derivative: Vec<(usize, Vec3<f64>)>,
    normal: Vec<f64>,
    gradient: Vec<f64>,
}

/// What a pass over the samples collects.
enum Collect<'a> {
    Cost,
    Gradient(&'a mut [f64]),
    Normal(&'a mut Arrow),
}

impl<'a> Problem<'a> {
    /// The problem for a recording that `body` was made for; the basis' domain is in seconds from the first frame.
    pub fn new(
        body: &'a HumanBody,
        robot: Option<&'a RobotModel>,
        recording: &MarkerRecording,
        basis: Basis,
        weights: Weights,
    ) -> Self {
        let samples = recording.frames();
        let degree = basis.degree();
        let mut problem = Problem {
            body,
            robot,
            weights,
            measured: Vec::with_capacity(samples * body.markers.len()),
            samples,
            rate_hz: recording.rate_hz,
            firsts: Vec::with_capacity(samples),
            values: vec![0.0; samples * (degree + 1)],
            accelerations: vec![0.0; basis.control_points() * (degree + 1)],
            targets: Vec::new(),
            basis,
        };
        let mut second = vec![0.0; degree + 1];
        for sample in 0..samples {
            problem.measured.extend(body.markers.iter().map(|&marker| recording.position_m(sample, marker)));
            let t = sample as f64 / recording.rate_hz;
            let range = sample * (degree + 1)..(sample + 1) * (degree + 1);
            problem.firsts.push(problem.basis.derivative(0, t, &mut problem.values[range]));
            let first = problem.basis.derivative(2, t, &mut second);
            for i in 0..=degree {
                let row = &mut problem.accelerations[(first + i) * (degree + 1)..][..degree + 1];
                for j in 0..=i {
                    row[degree + j - i] += second[i] * second[j];
                }
            }
        }
        problem
    }

    /// Number of samples T.
    pub fn samples(&self) -> usize {
        self.samples
    }
    /// Samples per second \[Hz\].
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }
    /// Time of a sample \[s\].
    pub(crate) fn time_s(&self, sample: usize) -> f64 {
        sample as f64 / self.rate_hz
    }
    /// Measured positions of the body's points in a sample \[m\].
    pub(crate) fn measured_at(&self, sample: usize) -> &[[f64; 3]] {
        let points = self.body.markers.len();
        &self.measured[sample * points..][..points]
    }
    /// The basis b(t).
    pub fn basis(&self) -> &Basis {
        &self.basis
    }
    /// Coordinates of a control point: human, then robot.
    pub fn coordinates(&self) -> usize {
        self.body.trajectories.len() + self.robot_coordinates()
    }
    /// Number of variables n = N·n_θ + n_ξ.
    pub fn variables(&self) -> usize {
        self.coordinates() * self.basis.control_points() + self.body.parameters.len()
    }
    fn robot_coordinates(&self) -> usize {
        self.robot.map_or(0, |robot| robot.tree.joint_count())
    }
    pub(crate) fn arrow(&self) -> Arrow {
        let control_points = self.basis.control_points();
        Arrow::new(self.coordinates(), control_points, self.basis.degree(), self.body.parameters.len())
    }
    /// Replaces the human's vector of a correspondence, one for each sample.
    pub(crate) fn set_target(&mut self, correspondence: usize, vectors: Vec<Vec3<f64>>) {
        self.targets.retain(|(index, _)| *index != correspondence);
        self.targets.push((correspondence, vectors));
    }

    /// Everything at rest: the human's coordinates and lengths at their means, the robot's at zero or the limit next to it.
    pub fn rest(&self) -> Vec<f64> {
        let robot = self.robot.map(|robot| {
            (0..robot.tree.joint_count()).map(|joint| {
                let limits = robot.tree.joint(joint).limits;
                0.0f64.max(limits.lower).min(limits.upper)
            })
        });
        let point: Vec<f64> =
            self.body.trajectories.iter().map(|c| c.mean).chain(robot.into_iter().flatten()).collect();
        let mut variables = point.repeat(self.basis.control_points());
        variables.extend(self.body.parameters.iter().map(|parameter| parameter.mean));
        variables
    }

    pub(crate) fn scratch(&self) -> Scratch {
        let size = self.coordinates() + self.body.parameters.len();
        let bodies = self.robot.map_or(0, |robot| robot.tree.bodies().len());
        let jacobian = vec![0.0; 6 * self.robot_coordinates()];
        Scratch {
            columns: vec![0.0; size],
            human: self.body.kinematics.scratch(),
            placements: vec![Placement::identity(); bodies],
            jacobians: [jacobian.clone(), jacobian],
            derivative: Vec::with_capacity(size),
            normal: vec![0.0; size * size],
            gradient: vec![0.0; size],
        }
    }

    /// The objective (15).
    pub fn cost(&self, variables: &[f64]) -> Cost {
        self.pass(variables, 1, &mut self.scratch(), Collect::Cost)
    }

    /// The objective and its gradient, into a slice of [`Problem::variables`] elements.
    pub fn gradient(&self, variables: &[f64], gradient: &mut [f64]) -> Cost {
        gradient.fill(0.0);
        let cost = self.pass(variables, 1, &mut self.scratch(), Collect::Gradient(&mut *gradient));
        gradient.iter_mut().for_each(|value| *value *= 2.0);
        cost
    }

    /// The objective on every `stride`-th sample, each counted `stride` times.
    pub(crate) fn strided_cost(&self, variables: &[f64], stride: usize, scratch: &mut Scratch) -> Cost {
        self.pass(variables, stride, scratch, Collect::Cost)
    }

    /// The same with its normal equations: J'J and J'r.
    pub(crate) fn normal_equations(
        &self,
        variables: &[f64],
        stride: usize,
        scratch: &mut Scratch,
        arrow: &mut Arrow,
    ) -> Cost {
        arrow.clear();
        self.pass(variables, stride, scratch, Collect::Normal(arrow))
    }

    fn pass(
        &self,
        variables: &[f64],
        stride: usize,
        scratch: &mut Scratch,
        mut collect: Collect<'_>,
    ) -> Cost {
        let (n, order) = (self.coordinates(), self.basis.degree() + 1);
        let parameters = &variables[n * self.basis.control_points()..];
        let mut cost = Cost::default();
        scratch.columns[n..].copy_from_slice(parameters);
        scratch.normal.fill(0.0);
        for sample in (0..self.samples).step_by(stride) {
            let first = self.firsts[sample];
            let weights = &self.values[sample * order..][..order];
            self.coordinates_at(variables, first, weights, &mut scratch.columns[..n]);
            let wants_normal = matches!(collect, Collect::Normal(_));
            let part = self.sample(sample, scratch, !matches!(collect, Collect::Cost), wants_normal);
            let count = stride as f64;
            cost.markers += count * part.markers;
            cost.correspondence += count * part.correspondence;
            cost.prior += count * part.prior;
            match &mut collect {
                Collect::Cost => {}
                Collect::Gradient(gradient) => {
                    for (i, &weight) in weights.iter().enumerate() {
                        let target = &mut gradient[(first + i) * n..][..n];
                        for (sum, value) in target.iter_mut().zip(&scratch.gradient) {
                            *sum += count * weight * value;
                        }
                    }
                    let target = &mut gradient[n * self.basis.control_points()..];
                    for (sum, value) in target.iter_mut().zip(&scratch.gradient[n..]) {
                        *sum += count * value;
                    }
                }
                Collect::Normal(arrow) => {
                    arrow.add_sample(first, weights, count, &scratch.normal, &scratch.gradient);
                }
            }
        }
        if let Collect::Normal(arrow) = &mut collect {
            arrow.add_corner(stride as f64, &scratch.normal);
        }
        cost.limits += self.limits(variables, &mut collect);
        cost.prior += self.parameter_prior(parameters, &mut collect);
        cost.prior += self.accelerations(variables, &mut collect);
        cost
    }

    fn coordinates_at(&self, variables: &[f64], first: usize, weights: &[f64], columns: &mut [f64]) {
        let n = columns.len();
        columns.fill(0.0);
        for (i, &weight) in weights.iter().enumerate() {
            for (sum, value) in columns.iter_mut().zip(&variables[(first + i) * n..][..n]) {
                *sum += weight * value;
            }
        }
    }

    /// Cost of one sample; its gradient and normal equations with respect to `scratch.columns`.
    fn sample(&self, sample: usize, scratch: &mut Scratch, gradient: bool, normal: bool) -> Cost {
        let measured = self.measured_at(sample);
        let kinematics = &self.body.kinematics;
        let size = scratch.columns.len();
        kinematics.place(&scratch.columns, &mut scratch.human);
        let mut cost = Cost::default();
        if gradient {
            scratch.gradient.fill(0.0);
            kinematics.twist(&mut scratch.human);
            // What parameters have with parameters is the sum over all samples: only the rest is of this one.
            if normal {
                let rows = self.coordinates() * size;
                scratch.normal[..rows].fill(0.0);
            }
            let target = normal.then_some((&mut scratch.normal[..], size));
            cost.markers =
                kinematics.normal_equations(measured, &mut scratch.human, &mut scratch.gradient, target);
        } else {
            cost.markers = kinematics.cost(measured, &scratch.human);
        }
        if let Some(robot) = self.robot {
            cost.correspondence = self.correspondence(robot, sample, scratch, gradient, normal);
        }
        cost.prior = self.posture(scratch, gradient, normal);
        if normal {
            // Only the upper triangle has been filled.
            for row in 0..self.coordinates() {
                for column in 0..row {
                    scratch.normal[row * size + column] = scratch.normal[column * size + row];
                }
            }
        }
        cost
    }
}
