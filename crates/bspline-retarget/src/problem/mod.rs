//! Problem (15): its variables, its cost, gradient and normal equations.
//!
//! `pass.rs` and `correspondence.rs` are methods of [`Problem`] and name it; it names their scratch and their
//! lines: one type in three files.

mod correspondence;
mod pass;
mod poses;
mod priors;
mod samples;

pub(crate) use correspondence::robot_vector;
pub(crate) use pass::Scratch;

use crate::bspline::Basis;
use crate::human::HumanBody;
use crate::recording::MarkerRecording;
use crate::robot::RobotModel;
use crate::solver::{Arrow, Pattern};
use crate::weights::{Cost, Weights};
use correspondence::Line;
use phiw_dynamics::Vec3;
use samples::{Samples, Windows};

/// Retargeting of one recording: variables are the control points (each: human coordinates, then robot
/// coordinates), then the parameters ξ^h.
pub struct Problem<'a> {
    pub(crate) body: &'a HumanBody,
    pub(crate) robot: Option<&'a RobotModel>,
    pub(crate) weights: Weights,
    basis: Basis,
    samples: Samples,
    windows: Windows,
    /// Σ b̈_i b̈_j over the samples for control point i and those from i − degree to i \[1/s⁴\].
    accelerations: Vec<f64>,
    lines: Vec<Line>,
    pattern: Pattern,
    /// Where each coordinate rests, and with what weight.
    posture: Vec<(f64, f64)>,
    /// Vectors that replace the human's in a correspondence, sample by sample.
    targets: Vec<(usize, Vec<Vec3<f64>>)>,
}

impl<'a> Problem<'a> {
    /// The problem for a recording that `body` was made for; the basis' domain is in seconds from the first
    /// frame.
    pub fn new(
        body: &'a HumanBody,
        robot: Option<&'a RobotModel>,
        recording: &MarkerRecording,
        basis: Basis,
        weights: Weights,
    ) -> Self {
        let samples = Samples::new(body, recording, &basis);
        let windows = Windows::new(&samples);
        let mut problem = Problem {
            body,
            robot,
            weights,
            accelerations: accelerations(&samples, &basis),
            samples,
            windows,
            basis,
            lines: robot.map_or(Vec::new(), |robot| Line::all(body, robot, weights.correspondence)),
            posture: Vec::new(),
            pattern: Pattern::dense(0, 0),
            targets: Vec::new(),
        };
        let humans = body.trajectories.iter().map(|c| (c.mean, problem.certainty(c.spread)));
        let robots = (0..problem.robot_coordinates()).map(|_| (0.0, weights.robot_posture));
        problem.posture = humans.chain(robots).collect();
        problem.pattern = problem.meetings();
        problem
    }

    /// What meets in a sample: what moves the same marker, or is in the same correspondence.
    fn meetings(&self) -> Pattern {
        let (point, border) = (self.coordinates(), self.body.parameters.len());
        let size = point + border;
        let mut meet = vec![false; size * size];
        let mut mark = |a: usize, b: usize| {
            meet[a * size + b] = true;
            meet[b * size + a] = true;
        };
        let nodes = self.body.kinematics.nodes().iter().filter(|node| node.carries);
        for (node, column) in nodes.filter_map(|node| Some((node, node.source.column()?))) {
            node.above.iter().for_each(|&(_, other)| mark(column, other));
        }
        for line in &self.lines {
            let columns: Vec<usize> = line.columns(self.body.trajectories.len()).collect();
            columns.iter().for_each(|&a| columns.iter().for_each(|&b| mark(a, b)));
        }
        Pattern::of(point, border, |a, b| meet[a * size + b])
    }

    /// Number of samples T.
    pub fn samples(&self) -> usize {
        self.samples.count()
    }
    /// Samples per second \[Hz\].
    pub fn rate_hz(&self) -> f64 {
        self.samples.rate_hz
    }
    /// Time of a sample \[s\].
    pub(crate) fn time_s(&self, sample: usize) -> f64 {
        sample as f64 / self.samples.rate_hz
    }
    /// Measured position of a point of the body in a sample \[m\]; `None` if it is not seen.
    pub(crate) fn measured_at(&self, sample: usize, point: usize) -> Option<Vec3<f64>> {
        self.samples.measured_at(sample, point)
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
    fn target(&self, correspondence: usize) -> Option<&[Vec3<f64>]> {
        let replaced = self.targets.iter().find(|(index, _)| *index == correspondence);
        replaced.map(|(_, vectors)| &vectors[..])
    }

    /// Everything at rest: the human's coordinates and lengths at their means, the robot's at zero or the
    /// limit next to it.
    pub fn rest(&self) -> Vec<f64> {
        let robot = self.robot.map(RobotModel::rest);
        let point: Vec<f64> =
            self.body.trajectories.iter().map(|c| c.mean).chain(robot.into_iter().flatten()).collect();
        let mut variables = point.repeat(self.basis.control_points());
        variables.extend(self.body.parameters.iter().map(|parameter| parameter.mean));
        variables
    }

    /// The objective (15).
    pub fn cost(&self, variables: &[f64]) -> Cost {
        self.evaluate(variables, &mut self.scratch(), None)
    }

    /// The objective and its gradient, into a slice of [`Problem::variables`] elements.
    pub fn gradient(&self, variables: &[f64], gradient: &mut [f64]) -> Cost {
        let cost = self.evaluate(variables, &mut self.scratch(), Some(gradient));
        gradient.iter_mut().for_each(|value| *value *= 2.0);
        cost
    }

    /// The objective and, if wanted, half its gradient J'r.
    pub(crate) fn evaluate(
        &self,
        variables: &[f64],
        scratch: &mut Scratch,
        gradient: Option<&mut [f64]>,
    ) -> Cost {
        let mut collect = match gradient {
            Some(gradient) => Collect::Gradient(gradient),
            None => Collect::Cost,
        };
        let mut cost = self.over_samples(variables, scratch, &mut collect);
        self.beside_samples(variables, &mut cost, &mut collect);
        cost
    }

    /// J'J, with the derivatives taken at one sample of each window.
    ///
    /// The basis is exact in every sample: only that the pose within a window is that of its middle. J
    /// changes little there, the gradient does not come from here, and so the minimum is the same.
    pub(crate) fn normal_equations(&self, variables: &[f64], scratch: &mut Scratch, arrow: &mut Arrow) {
        arrow.clear();
        self.over_windows(variables, scratch, arrow);
        self.beside_samples(variables, &mut Cost::default(), &mut Collect::Normal(arrow));
    }

    fn beside_samples(&self, variables: &[f64], cost: &mut Cost, collect: &mut Collect<'_>) {
        let parameters = &variables[self.coordinates() * self.basis.control_points()..];
        cost.limits += self.limits(variables, collect);
        cost.prior += self.parameter_prior(parameters, collect);
        cost.prior += self.accelerations(variables, collect);
    }
}

/// What is collected on the way.
enum Collect<'a> {
    Cost,
    Gradient(&'a mut [f64]),
    Normal(&'a mut Arrow),
}

fn accelerations(samples: &Samples, basis: &Basis) -> Vec<f64> {
    let degree = basis.degree();
    let mut sums = vec![0.0; basis.control_points() * (degree + 1)];
    let mut second = vec![0.0; degree + 1];
    for sample in 0..samples.count() {
        let first = basis.derivative(2, sample as f64 / samples.rate_hz, &mut second);
        for i in 0..=degree {
            let row = &mut sums[(first + i) * (degree + 1)..][..degree + 1];
            for j in 0..=i {
                row[degree + j - i] += second[i] * second[j];
            }
        }
    }
    sums
}
