//! Where the human starts: the markers followed pose by pose, one control point after the other.
//!
//! Lengths and markers' places are held at rough values: a shoulder may be centimetres off. The orientation
//! of a segment follows from its markers' positions relative to each other, which do not depend on that
//! error, so they have full weight and the markers' common position has little. Joints stay inside anatomical
//! ranges, since a wrist that is turned once around fits a hand's markers, too. The solver thus starts near
//! the right minimum.

use crate::human::HumanScratch;
use crate::pose_search::PoseSearch;
use crate::problem::Problem;
use crate::start::through;
use phiw_dynamics::{Spatial, Vec3};

/// Steps for the first pose, and for each that goes on from the one before.
const STEPS: (usize, usize) = (40, 8);
/// Weight of staying where it was, against the markers' errors \[m²/rad²\].
const STAY: f64 = 1e-4;
/// Weight of where the markers of a segment are as a whole, against where they are to each other.
const WHOLE: f64 = 0.05;

/// The variables with the human's part replaced. The first pose moves joints that keep still over the
/// recording, too.
pub(crate) fn human_start(problem: &Problem<'_>, mut variables: Vec<f64>) -> Vec<f64> {
    let (n, points) = (problem.coordinates(), problem.basis().control_points());
    let body = problem.body;
    let humans = body.trajectories.len();
    let tail = n * points;
    let mut follow = Follow::new(problem, &variables);
    let range = |&column: &usize| match body.trajectories.get(column) {
        Some(coordinate) => coordinate.range,
        None => body.parameters[column - n].range,
    };
    let moving: Vec<usize> = (0..humans).collect();
    let all: Vec<usize> =
        moving.iter().copied().chain(body.still.clone().map(|parameter| n + parameter)).collect();
    let mut first = PoseSearch::new(all.iter().map(range).collect());
    let mut search = PoseSearch::new(moving.iter().map(range).collect());
    let mut poses = Vec::new();
    for point in 0..points {
        follow.sample(problem.sample_near(point));
        if point == 0 {
            follow.run(&mut first, &all, STEPS.0);
        }
        follow.run(&mut search, &moving, STEPS.1);
        poses.push(follow.columns[..humans].to_vec());
    }
    for parameter in body.still.clone() {
        variables[tail + parameter] = follow.columns[n + parameter];
    }
    through(problem, &poses, &mut variables, 0);
    variables
}

/// A body that follows the markers of one sample after the other.
struct Follow<'a> {
    problem: &'a Problem<'a>,
    /// Coordinates, then parameters.
    columns: Vec<f64>,
    human: HumanScratch<f64>,
    /// For each segment that has any, its node and its markers.
    segments: Vec<(usize, Vec<usize>)>,
    measured: Vec<Vec3<f64>>,
    seen: Vec<f64>,
    gradient: Vec<f64>,
    normal: Vec<f64>,
}

impl<'a> Follow<'a> {
    fn new(problem: &'a Problem<'a>, variables: &[f64]) -> Self {
        let n = problem.coordinates();
        let mut columns = variables[..n].to_vec();
        columns.extend(&variables[n * problem.basis().control_points()..]);
        let kinematics = &problem.body.kinematics;
        let mut segments: Vec<(usize, Vec<usize>)> = Vec::new();
        for (index, point) in kinematics.points().iter().enumerate() {
            let node = kinematics.turner(point.node).unwrap_or(point.node);
            match segments.iter_mut().find(|(other, _)| *other == node) {
                Some((_, points)) => points.push(index),
                None => segments.push((node, vec![index])),
            }
        }
        let (size, points) = (columns.len(), kinematics.points().len());
        Follow {
            problem,
            human: kinematics.scratch(),
            segments,
            measured: vec![Vec3([0.0; 3]); points],
            seen: vec![0.0; points],
            gradient: vec![0.0; size],
            normal: vec![0.0; size * size],
            columns,
        }
    }

    /// From now on it follows this sample.
    fn sample(&mut self, sample: usize) {
        for (point, (measured, seen)) in self.measured.iter_mut().zip(&mut self.seen).enumerate() {
            let found = self.problem.measured_at(sample, point);
            *seen = if found.is_some() { 1.0 } else { 0.0 };
            *measured = found.unwrap_or(Vec3([0.0; 3]));
        }
    }

    /// Moves some columns so that the markers fit.
    fn run(&mut self, search: &mut PoseSearch, moving: &[usize], steps: usize) {
        let mut pose: Vec<f64> = moving.iter().map(|&column| self.columns[column]).collect();
        let stay = pose.clone();
        let prior: Vec<(f64, f64)> = moving.iter().map(|&column| self.problem.known(column)).collect();
        let size = self.columns.len();
        search.run(&mut pose, steps, |pose, slopes| {
            self.move_to(moving, pose);
            let mut cost = self.pull(slopes.is_some());
            for ((value, stay), (mean, weight)) in pose.iter().zip(&stay).zip(&prior) {
                cost += STAY * (value - stay) * (value - stay) + weight * (value - mean) * (value - mean);
            }
            let Some(slopes) = slopes else { return cost };
            for (i, &row) in moving.iter().enumerate() {
                let (mean, weight) = prior[i];
                slopes.gradient[i] =
                    self.gradient[row] + STAY * (pose[i] - stay[i]) + weight * (pose[i] - mean);
                for (j, &column) in moving.iter().enumerate() {
                    let value = self.normal[row.min(column) * size + row.max(column)];
                    slopes.normal[i * moving.len() + j] = value;
                }
                slopes.normal[i * (moving.len() + 1)] += STAY + weight;
            }
            cost
        });
        self.move_to(moving, &pose);
    }

    fn move_to(&mut self, moving: &[usize], pose: &[f64]) {
        for (&column, &value) in moving.iter().zip(pose) {
            self.columns[column] = value;
        }
        self.problem.body.kinematics.place(&self.columns, &mut self.human);
    }

    /// The markers' cost and, if wanted, J'r and J'J of all columns.
    fn pull(&mut self, slopes: bool) -> f64 {
        let kinematics = &self.problem.body.kinematics;
        let human = &mut self.human;
        if slopes {
            human.wrenches.fill(Spatial::zero());
            kinematics.load(&self.seen, human);
        }
        let mut cost = 0.0;
        for (node, points) in &self.segments {
            let (mut count, mut center, mut mean) = (0.0, Vec3([0.0; 3]), Vec3([0.0; 3]));
            for &point in points.iter().filter(|&&point| self.seen[point] != 0.0) {
                let position = kinematics.position(point, human);
                let residual = position - self.measured[point];
                cost += residual.dot(residual);
                count += 1.0;
                center += position;
                mean += residual;
            }
            if count == 0.0 {
                continue;
            }
            let (center, mean) = (center.scale(1.0 / count), mean.scale(1.0 / count));
            let less = 1.0 - WHOLE;
            cost -= less * count * mean.dot(mean);
            if slopes {
                // Most of the weight of the centroid's residual is removed from J'J and J'r.
                human.masses[*node].add_point(center, -less * count);
                for &point in points.iter().filter(|&&point| self.seen[point] != 0.0) {
                    let position = kinematics.position(point, human);
                    let force = position - self.measured[point] - mean.scale(less);
                    let wrench = &mut human.wrenches[kinematics.points()[point].node];
                    wrench.linear += force;
                    wrench.angular += position.cross(force);
                }
            }
        }
        if slopes {
            self.gradient.fill(0.0);
            self.normal.fill(0.0);
            kinematics.twist(human);
            kinematics.gradient(human, &mut self.gradient);
            kinematics.normal_equations(human, &mut self.normal, self.columns.len());
        }
        cost
    }
}
