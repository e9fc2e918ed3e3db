//! Levenberg and Marquardt's method on the arrow structure.

use super::Arrow;
use super::bounded_step::BoundedStep;
use crate::problem::{Problem, Scratch};
use crate::weights::Cost;

/// When to stop, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iterations {
    /// Largest number of steps.
    pub most: usize,
    /// The relative decrease of the cost at which it is found.
    pub tolerance: f64,
    /// Whether the robot's control points are held inside the joint limits, on top of η: then the motion
    /// never leaves them.
    pub hard_limits: bool,
}

impl Default for Iterations {
    fn default() -> Self {
        Iterations { most: 60, tolerance: 1e-3, hard_limits: true }
    }
}

/// Why a solver stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The cost does not decrease any more.
    Converged,
    /// The number of steps is used up.
    MostIterations,
    /// No step decreases the cost.
    NoDecrease,
}

/// What a solver gives.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Control points and parameters, as [`Problem`] orders them.
    pub variables: Vec<f64>,
    /// The objective there.
    pub cost: Cost,
    /// Steps.
    pub iterations: usize,
    /// Why it stopped.
    pub stop: Stop,
}

/// Distance of the robot's control points from their limits \[rad, m\].
const MARGIN: f64 = 1e-9;
/// Steps that are found, one more damped than the other, before it gives up.
const TRIES: usize = 8;
/// What is left of a step that was too long.
const SHORTENED: f64 = 0.4;
/// Damping at first, as a share of the diagonal, and the least that it comes down to and goes up from.
const FIRST_DAMPING: f64 = 1e-5;
const LEAST_DAMPING: f64 = 1e-8;
const LEAST_RISE: f64 = 1e-6;
/// A step whose decrease is less of what it promised than the first share was bad, one with more than the
/// second was good.
const BAD_GOOD: (f64, f64) = (0.25, 0.7);

/// Solves (15) from `start` by damped Gauss-Newton steps, O(N) each.
pub fn solve(problem: &Problem<'_>, start: Vec<f64>, iterations: &Iterations) -> Solution {
    let mut descent = Descent::new(problem, start, iterations);
    let stop = descent.run(iterations.most, iterations.tolerance);
    Solution { variables: descent.variables, cost: descent.cost, iterations: descent.steps, stop }
}

struct Descent<'a> {
    problem: &'a Problem<'a>,
    variables: Vec<f64>,
    cost: Cost,
    /// Half the gradient at `variables`.
    gradient: Vec<f64>,
    trial: Vec<f64>,
    trial_gradient: Vec<f64>,
    arrow: Arrow,
    bounded: BoundedStep,
    scratch: Scratch,
    damping: f64,
    steps: usize,
}

impl<'a> Descent<'a> {
    fn new(problem: &'a Problem<'a>, start: Vec<f64>, iterations: &Iterations) -> Self {
        let arrow = problem.arrow();
        let bounds = if iterations.hard_limits { bounds(problem) } else { Vec::new() };
        let mut variables = start;
        clamp(&mut variables, &bounds);
        let (mut gradient, mut scratch) = (vec![0.0; variables.len()], problem.scratch());
        let cost = problem.evaluate(&variables, &mut scratch, Some(&mut gradient));
        Descent {
            problem,
            cost,
            trial: variables.clone(),
            trial_gradient: gradient.clone(),
            bounded: BoundedStep::new(&arrow, variables.len(), bounds),
            gradient,
            variables,
            arrow,
            scratch,
            damping: FIRST_DAMPING,
            steps: 0,
        }
    }

    fn run(&mut self, most: usize, tolerance: f64) -> Stop {
        for _ in 0..most {
            let before = self.cost.total();
            self.problem.normal_equations(&self.variables, &mut self.scratch, &mut self.arrow);
            let Some(promised) = self.step() else { return Stop::NoDecrease };
            self.steps += 1;
            // Convergence is judged by the decrease that the full step predicts, since a short step is small
            // anyway.
            if promised.max(before - self.cost.total()) <= tolerance * before {
                return Stop::Converged;
            }
        }
        Stop::MostIterations
    }

    /// One step that decreases the cost, and what the whole of it promised; `None` if there is none.
    fn step(&mut self) -> Option<f64> {
        for _ in 0..TRIES {
            if self.bounded.find(&self.arrow, &self.variables, &self.gradient, self.damping) {
                // A shorter step needs no new factorisation.
                for share in [1.0, SHORTENED] {
                    let Some(kept) = self.go(share) else { continue };
                    if share < 1.0 || kept < BAD_GOOD.0 {
                        self.damping = (8.0 * self.damping).max(LEAST_RISE);
                    } else if kept > BAD_GOOD.1 {
                        self.damping = (0.1 * self.damping).max(LEAST_DAMPING);
                    }
                    return Some(self.bounded.predicted(1.0));
                }
            }
            self.damping = (20.0 * self.damping).max(LEAST_RISE);
        }
        None
    }

    /// Goes a share of the step if that decreases the cost: by how much of what it promised.
    fn go(&mut self, share: f64) -> Option<f64> {
        for ((trial, value), step) in self.trial.iter_mut().zip(&self.variables).zip(&self.bounded.step) {
            *trial = value - share * step;
        }
        clamp(&mut self.trial, &self.bounded.bounds);
        let cost = self.problem.evaluate(&self.trial, &mut self.scratch, Some(&mut self.trial_gradient));
        let decrease = self.cost.total() - cost.total();
        // NaN is not a decrease.
        if decrease.is_nan() || decrease <= 0.0 {
            return None;
        }
        std::mem::swap(&mut self.variables, &mut self.trial);
        std::mem::swap(&mut self.gradient, &mut self.trial_gradient);
        self.cost = cost;
        Some(decrease / self.bounded.predicted(share))
    }
}

/// Bounds of the control points; none without a robot.
fn bounds(problem: &Problem<'_>) -> Vec<(f64, f64)> {
    let Some(robot) = problem.robot else { return Vec::new() };
    let joints = (0..robot.tree.joint_count()).map(|joint| {
        let limits = robot.tree.joint(joint).limits;
        // The margin keeps the curve inside in spite of rounding.
        (limits.lower + MARGIN, limits.upper - MARGIN)
    });
    let free = (f64::NEG_INFINITY, f64::INFINITY);
    let human = std::iter::repeat_n(free, problem.body.trajectories.len());
    let point: Vec<(f64, f64)> = human.chain(joints).collect();
    point.repeat(problem.basis().control_points())
}

fn clamp(variables: &mut [f64], bounds: &[(f64, f64)]) {
    for (value, &(lower, upper)) in variables.iter_mut().zip(bounds) {
        *value = value.max(lower).min(upper);
    }
}
