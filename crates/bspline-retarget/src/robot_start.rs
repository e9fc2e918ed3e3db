//! Where the robot starts: inverse kinematics along the human's motion, one control point after the other.

use crate::pose_search::{PoseSearch, Slopes};
use crate::problem::{Problem, robot_vector};
use crate::robot::RobotModel;
use crate::start::through;
use phiw_dynamics::{Placement, Vec3};

/// Postures that the first pose is sought from.
const FIRST_TRIES: usize = 12;
/// Steps for the first pose, and for each that goes on from the one before.
const STEPS: (usize, usize) = (40, 8);
/// Weights of joints that stay where they were, and that are near zero, against a vector's error \[m²/rad²\].
const STAY: f64 = 1e-4;
const REST: f64 = 1e-4;

/// The variables with the robot's part replaced: at each control point it follows the human as well as it
/// can.
pub(crate) fn robot_start(problem: &Problem<'_>, robot: &RobotModel, mut variables: Vec<f64>) -> Vec<f64> {
    let (n, joints) = (problem.coordinates(), robot.tree().joint_count());
    let mut scratch = problem.pose_scratch();
    let mut search = Search::new(robot);
    let mut pose = Vec::new();
    let mut poses = Vec::new();
    for point in 0..problem.basis().control_points() {
        let sample = problem.sample_near(point);
        problem.pose(&variables, sample, &mut scratch);
        let goal = problem.human_vectors(robot, sample, &scratch);
        if point == 0 {
            pose = search.first(&goal);
        }
        let goes_on = pose.clone();
        search.run(&mut pose, &goal, &goes_on, STAY, STEPS.1);
        poses.push(pose.clone());
    }
    through(problem, &poses, &mut variables, n - joints);
    variables
}

struct Search<'a> {
    poses: PoseSearch,
    follow: Follow<'a>,
}

impl<'a> Search<'a> {
    fn new(robot: &'a RobotModel) -> Self {
        let joints = robot.tree().joint_count();
        let bounds = (0..joints).map(|joint| {
            let limits = robot.tree().joint(joint).limits;
            (limits.lower, limits.upper)
        });
        let jacobian = vec![0.0; 6 * joints];
        Search {
            poses: PoseSearch::new(bounds.collect()),
            follow: Follow {
                robot,
                rest: robot.rest().collect(),
                placements: vec![Placement::identity(); robot.tree().bodies().len()],
                jacobians: [jacobian.clone(), jacobian],
            },
        }
    }

    /// The best pose from several postures inside the limits.
    fn first(&mut self, goal: &[Vec3<f64>]) -> Vec<f64> {
        let bounds = self.poses.bounds().to_vec();
        let middle: Vec<f64> = bounds.iter().map(|&limits| between(limits, 0.5)).collect();
        let mut best = (f64::INFINITY, middle.clone());
        for attempt in 0..FIRST_TRIES {
            // The first from the middle, the others from an even sequence (multiples of irrational numbers).
            let mut pose: Vec<f64> = match attempt {
                0 => middle.clone(),
                _ => {
                    let share = |joint: usize| (attempt as f64 * ((joint + 2) as f64).sqrt()).fract();
                    bounds
                        .iter()
                        .enumerate()
                        .map(|(joint, &l)| between(l, 0.2 + 0.6 * share(joint)))
                        .collect()
                }
            };
            let from = pose.clone();
            let cost = self.run(&mut pose, goal, &from, 0.0, STEPS.0);
            if cost < best.0 {
                best = (cost, pose);
            }
        }
        best.1
    }

    /// Improves a pose; returns its cost.
    fn run(&mut self, pose: &mut [f64], goal: &[Vec3<f64>], stay: &[f64], weight: f64, steps: usize) -> f64 {
        let Search { poses, follow } = self;
        poses.run(pose, steps, |pose, slopes| follow.evaluate(pose, goal, stay, weight, slopes))
    }
}

/// The cost of a pose of the robot: how far its vectors are from the goal, and it from where it should stay.
struct Follow<'a> {
    robot: &'a RobotModel,
    /// Zero, or the limit next to it.
    rest: Vec<f64>,
    placements: Vec<Placement<f64>>,
    jacobians: [Vec<f64>; 2],
}

impl Follow<'_> {
    fn evaluate(
        &mut self,
        pose: &[f64],
        goal: &[Vec3<f64>],
        stay: &[f64],
        weight: f64,
        mut slopes: Option<&mut Slopes>,
    ) -> f64 {
        let tree = self.robot.tree();
        let joints = pose.len();
        // The sizes are those of this robot.
        let _ = tree.forward_kinematics(pose, &mut self.placements);
        let away = |joint: usize| (pose[joint] - stay[joint], pose[joint] - self.rest[joint]);
        let mut cost = 0.0;
        for (moved, bent) in (0..joints).map(away) {
            cost += weight * moved * moved + REST * bent * bent;
        }
        if let Some(Slopes { normal, gradient }) = &mut slopes {
            normal.fill(0.0);
            for joint in 0..joints {
                let (moved, bent) = away(joint);
                gradient[joint] = weight * moved + REST * bent;
                normal[joint * (joints + 1)] = weight + REST;
            }
        }
        for (line, goal) in self.robot.correspondences.iter().zip(goal) {
            let residual = robot_vector(line, &self.placements) - *goal;
            cost += line.weight * residual.dot(residual);
            let Some(Slopes { normal, gradient }) = &mut slopes else { continue };
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
                        gradient[joint] += weighted * residual.0[row];
                        let normal = &mut normal[joint * joints..][..joints];
                        normal.iter_mut().enumerate().for_each(|(o, sum)| *sum += weighted * change(o));
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
