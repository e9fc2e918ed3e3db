//! Where the robot starts: inverse kinematics along the human's motion, one control point after the other.

use crate::problem::{Problem, robot_vector};
use crate::robot::RobotModel;
use crate::solver::Arrow;
use phiw_dynamics::{Placement, Vec3};

/// Postures that the first pose is sought from.
const FIRST_TRIES: usize = 12;
/// Steps for the first pose, and for each that goes on from the one before.
const STEPS: (usize, usize) = (40, 8);
/// Weight of staying where the robot was, against a vector's error \[m²/rad²\].
const STAY: f64 = 1e-3;
/// Weight of staying at the middle of the limits while the first pose is sought \[m²/rad²\].
const MIDDLE: f64 = 1e-4;

/// The variables with the robot's part replaced: at each control point it follows the human as well as it can.
pub(crate) fn robot_start(problem: &Problem<'_>, robot: &RobotModel, mut variables: Vec<f64>) -> Vec<f64> {
    let (n, joints) = (problem.coordinates(), robot.tree().joint_count());
    let first_joint = n - joints;
    let points = problem.basis().control_points();
    let mut scratch = problem.scratch();
    let goals: Vec<Vec<Vec3<f64>>> = (0..points)
        .map(|point| problem.human_vectors(robot, &variables, problem.sample_near(point), &mut scratch))
        .collect();
    let mut search = Search::new(robot);
    let mut pose = search.first(&goals[0]);
    for (point, goal) in goals.iter().enumerate() {
        let stay = pose.clone();
        search.run(&mut pose, goal, &stay, STAY, STEPS.1);
        variables[point * n + first_joint..][..joints].copy_from_slice(&pose);
    }
    variables
}

/// Damped Gauss-Newton on one pose.
struct Search<'a> {
    robot: &'a RobotModel,
    limits: Vec<(f64, f64)>,
    placements: Vec<Placement<f64>>,
    jacobians: [Vec<f64>; 2],
    normal: Vec<f64>,
    gradient: Vec<f64>,
    arrow: Arrow,
}

impl<'a> Search<'a> {
    fn new(robot: &'a RobotModel) -> Self {
        let joints = robot.tree().joint_count();
        let limits = |joint| {
            let limits = robot.tree().joint(joint).limits;
            (limits.lower, limits.upper)
        };
        Search {
            robot,
            limits: (0..joints).map(limits).collect(),
            placements: vec![Placement::identity(); robot.tree().bodies().len()],
            jacobians: [vec![0.0; 6 * joints], vec![0.0; 6 * joints]],
            normal: vec![0.0; joints * joints],
            gradient: vec![0.0; joints],
            arrow: Arrow::new(joints, 1, 0, 0),
        }
    }

    /// The best pose from several postures inside the limits.
    fn first(&mut self, goal: &[Vec3<f64>]) -> Vec<f64> {
        let middle: Vec<f64> = self.limits.iter().map(|&limits| between(limits, 0.5)).collect();
        let mut best = (f64::INFINITY, middle.clone());
        for attempt in 0..FIRST_TRIES {
            // The first from the middle, the others from an even sequence (multiples of irrational numbers).
            let mut pose: Vec<f64> = match attempt {
                0 => middle.clone(),
                _ => {
                    let share = |joint: usize| (attempt as f64 * ((joint + 2) as f64).sqrt()).fract();
                    self.limits
                        .iter()
                        .enumerate()
                        .map(|(joint, &l)| between(l, 0.2 + 0.6 * share(joint)))
                        .collect()
                }
            };
            let cost = self.run(&mut pose, goal, &middle, MIDDLE, STEPS.0);
            if cost < best.0 {
                best = (cost, pose);
            }
        }
        best.1
    }

    /// Improves a pose; returns its cost.
    fn run(&mut self, pose: &mut [f64], goal: &[Vec3<f64>], stay: &[f64], weight: f64, steps: usize) -> f64 {
        let mut damping = 1e-3;
        let mut cost = self.evaluate(pose, goal, stay, weight, true);
        let mut trial = pose.to_vec();
        for _ in 0..steps {
            self.arrow.clear();
            self.arrow.add_sample(0, &[1.0], 1.0, &self.normal, &self.gradient);
            for (joint, (&value, &(lower, upper))) in pose.iter().zip(&self.limits).enumerate() {
                let slope = self.gradient[joint];
                let pushed = (value <= lower && slope > 0.0) || (value >= upper && slope < 0.0);
                *self.arrow.diagonal_mut(joint) += if pushed { 1e12 } else { damping };
            }
            if !self.arrow.solve() {
                break;
            }
            for (joint, value) in trial.iter_mut().enumerate() {
                let (lower, upper) = self.limits[joint];
                *value = (pose[joint] - self.arrow.gradient[joint]).max(lower).min(upper);
            }
            let after = self.evaluate(&trial, goal, stay, weight, false);
            if after < cost {
                let done = cost - after < 1e-6 * cost;
                pose.copy_from_slice(&trial);
                cost = self.evaluate(pose, goal, stay, weight, true);
                damping *= 0.2;
                if done {
                    break;
                }
            } else {
                damping *= 10.0;
            }
        }
        cost
    }

    fn evaluate(
        &mut self,
        pose: &[f64],
        goal: &[Vec3<f64>],
        stay: &[f64],
        weight: f64,
        derivatives: bool,
    ) -> f64 {
        let tree = self.robot.tree();
        let joints = pose.len();
        // The sizes are those of this robot.
        let _ = tree.forward_kinematics(pose, &mut self.placements);
        let mut cost: f64 = pose.iter().zip(stay).map(|(q, stay)| weight * (q - stay) * (q - stay)).sum();
        if derivatives {
            self.normal.fill(0.0);
            for joint in 0..joints {
                self.gradient[joint] = weight * (pose[joint] - stay[joint]);
                self.normal[joint * (joints + 1)] = weight;
            }
        }
        for (line, goal) in self.robot.correspondences.iter().zip(goal) {
            let residual = robot_vector(line, &self.placements) - *goal;
            cost += line.weight * residual.dot(residual);
            if !derivatives {
                continue;
            }
            for (point, jacobian) in [line.to, line.from].into_iter().zip(&mut self.jacobians) {
                match point.body {
                    Some(body) => {
                        let _ = tree.point_jacobian(&self.placements, body, point.local, jacobian);
                    }
                    None => jacobian.fill(0.0),
                }
            }
            let [to, from] = &self.jacobians;
            for row in 0..3 {
                let change = |joint: usize| to[row * joints + joint] - from[row * joints + joint];
                for joint in 0..joints {
                    let weighted = line.weight * change(joint);
                    if weighted != 0.0 {
                        self.gradient[joint] += weighted * residual.0[row];
                        (0..joints).for_each(|other| {
                            self.normal[joint * joints + other] += weighted * change(other)
                        });
                    }
                }
            }
        }
        cost
    }
}

/// A value between limits; between −π and π where there are none.
fn between((lower, upper): (f64, f64), share: f64) -> f64 {
    let lower = lower.max(-std::f64::consts::PI);
    let upper = upper.min(std::f64::consts::PI);
    lower + share * (upper - lower)
}
