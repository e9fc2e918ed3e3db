//! Levenberg and Marquardt's method on the arrow structure.

use crate::problem::{Problem, Scratch};
use crate::solver::Arrow;
use crate::weights::Cost;

/// When to stop, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iterations {
    /// Largest number of steps.
    pub most: usize,
    /// The relative decrease of the cost at which it is found.
    pub tolerance: f64,
    /// Whether the robot's control points are held inside the joint limits, on top of η: then the motion never leaves them.
    pub hard_limits: bool,
    /// Whether first steps look at a few samples of each span only.
    pub coarse_first: bool,
    /// Whether it stays at that: a good start for another problem, at a fraction of the cost.
    pub coarse_only: bool,
}

impl Default for Iterations {
    fn default() -> Self {
        Iterations { most: 60, tolerance: 1e-3, hard_limits: true, coarse_first: true, coarse_only: false }
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
/// Samples that a coarse pass takes of a span.
const COARSE_SAMPLES: usize = 4;

/// Solves (15) from `start` by damped Gauss-Newton steps, O(N) each.
pub fn solve(problem: &Problem<'_>, start: Vec<f64>, iterations: &Iterations) -> Solution {
    let spans = problem.basis().control_points().saturating_sub(problem.basis().degree()).max(1);
    let stride = problem.samples() / (COARSE_SAMPLES * spans);
    let mut descent = Descent::new(problem, start, iterations);
    if iterations.coarse_first && stride > 1 {
        let stop = descent.run(stride, iterations.most, 10.0 * iterations.tolerance);
        if iterations.coarse_only {
            return descent.finish(stop);
        }
    }
    let stop = descent.run(1, iterations.most, iterations.tolerance);
    descent.finish(stop)
}

struct Descent<'a> {
    problem: &'a Problem<'a>,
    variables: Vec<f64>,
    trial: Vec<f64>,
    cost: Cost,
    arrow: Arrow,
    factor: Arrow,
    scratch: Scratch,
    /// Bounds of variables; only robot coordinates have any.
    bounds: Option<Vec<(f64, f64)>>,
    damping: f64,
    steps: usize,
}

impl<'a> Descent<'a> {
    fn new(problem: &'a Problem<'a>, start: Vec<f64>, iterations: &Iterations) -> Self {
        let arrow = problem.arrow();
        let bounds = iterations.hard_limits.then(|| bounds(problem)).flatten();
        let mut variables = start;
        clamp(&mut variables, bounds.as_deref());
        Descent {
            problem,
            trial: variables.clone(),
            variables,
            cost: Cost::default(),
            factor: arrow.clone(),
            arrow,
            scratch: problem.scratch(),
            bounds,
            damping: 1e-4,
            steps: 0,
        }
    }

    fn finish(self, stop: Stop) -> Solution {
        Solution { variables: self.variables, cost: self.cost, iterations: self.steps, stop }
    }

    fn run(&mut self, stride: usize, most: usize, tolerance: f64) -> Stop {
        let Descent { problem, .. } = *self;
        self.cost = problem.normal_equations(&self.variables, stride, &mut self.scratch, &mut self.arrow);
        for _ in 0..most {
            let before = self.cost.total();
            let Some(after) = self.step(stride) else { return Stop::NoDecrease };
            let decrease = before - after.total();
            self.cost = after;
            self.steps += 1;
            if decrease <= tolerance * before {
                return Stop::Converged;
            }
            self.cost = problem.normal_equations(&self.variables, stride, &mut self.scratch, &mut self.arrow);
        }
        Stop::MostIterations
    }

    /// One step that decreases the cost, or none.
    fn step(&mut self, stride: usize) -> Option<Cost> {
        for _ in 0..12 {
            self.factor.copy_from(&self.arrow);
            for variable in 0..self.variables.len() {
                let diagonal = self.factor.diagonal_mut(variable);
                *diagonal += self.damping * *diagonal + 1e-12;
            }
            self.freeze();
            if self.factor.solve() {
                for ((trial, value), step) in
                    self.trial.iter_mut().zip(&self.variables).zip(&self.factor.gradient)
                {
                    *trial = value - step;
                }
                clamp(&mut self.trial, self.bounds.as_deref());
                let cost = self.problem.strided_cost(&self.trial, stride, &mut self.scratch);
                if cost.total() < self.cost.total() {
                    std::mem::swap(&mut self.variables, &mut self.trial);
                    self.damping = (self.damping * 0.1).max(1e-9);
                    return Some(cost);
                }
            }
            self.damping *= 8.0;
        }
        None
    }

    /// Variables at a bound that the gradient pushes against stay there.
    fn freeze(&mut self) {
        let Some(bounds) = &self.bounds else { return };
        for (variable, &(lower, upper)) in bounds.iter().enumerate() {
            let (value, slope) = (self.variables[variable], self.arrow.gradient[variable]);
            if (value <= lower && slope > 0.0) || (value >= upper && slope < 0.0) {
                *self.factor.diagonal_mut(variable) += 1e12;
            }
        }
    }
}

fn bounds(problem: &Problem<'_>) -> Option<Vec<(f64, f64)>> {
    let robot = problem.robot?;
    let joints = (0..robot.tree.joint_count()).map(|joint| {
        let limits = robot.tree.joint(joint).limits;
        // So far inside that rounding does not carry a curve out again.
        (limits.lower + MARGIN, limits.upper - MARGIN)
    });
    let free = (f64::NEG_INFINITY, f64::INFINITY);
    let human = std::iter::repeat_n(free, problem.body.trajectories.len());
    let point: Vec<(f64, f64)> = human.chain(joints).collect();
    Some(point.repeat(problem.basis().control_points()))
}

fn clamp(variables: &mut [f64], bounds: Option<&[(f64, f64)]>) {
    for (value, &(lower, upper)) in variables.iter_mut().zip(bounds.unwrap_or_default()) {
        *value = value.max(lower).min(upper);
    }
}
