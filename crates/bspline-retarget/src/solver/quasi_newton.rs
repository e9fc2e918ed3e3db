//! The paper's method: quasi-Newton (limited-memory BFGS, by argmin), which does not use the structure.

use super::{Solution, Stop};
use crate::problem::Problem;
use argmin::core::{CostFunction, Error, Executor, Gradient, State, TerminationReason, TerminationStatus};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::LBFGS;

/// When a quasi-Newton method stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuasiNewton {
    /// Steps that the inverse Hessian is made from.
    pub memory: usize,
    /// Largest number of steps.
    pub most: u64,
    /// Norm of the gradient at which it stops.
    pub gradient: f64,
    /// Decrease of the cost at which it stops.
    pub decrease: f64,
}

impl Default for QuasiNewton {
    /// As minFunc, which the paper used: 100 steps of memory, optimality 1e-5, progress 1e-9, 500 steps.
    fn default() -> Self {
        QuasiNewton { memory: 100, most: 500, gradient: 1e-5, decrease: 1e-9 }
    }
}

struct Objective<'a> {
    problem: &'a Problem<'a>,
    seen: &'a dyn Fn(f64),
}

impl CostFunction for Objective<'_> {
    type Param = Vec<f64>;
    type Output = f64;
    fn cost(&self, variables: &Vec<f64>) -> Result<f64, Error> {
        let cost = self.problem.cost(variables).total();
        (self.seen)(cost);
        Ok(cost)
    }
}

impl Gradient for Objective<'_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;
    fn gradient(&self, variables: &Vec<f64>) -> Result<Vec<f64>, Error> {
        let mut gradient = vec![0.0; variables.len()];
        self.problem.gradient(variables, &mut gradient);
        Ok(gradient)
    }
}

/// Solves (15) from `start` by L-BFGS with the line search of Moré and Thuente. Over the control points of a
/// spline it is the paper's method; over a basis of degree 1 with a control point for each sample it is the
/// one without splines.
///
/// `seen` is called with the objective whenever it is computed, so that its decrease over time can be
/// recorded.
pub fn quasi_newton(
    problem: &Problem<'_>,
    start: Vec<f64>,
    options: &QuasiNewton,
    seen: &dyn Fn(f64),
) -> Solution {
    let search = MoreThuenteLineSearch::new();
    let solver = LBFGS::new(search, options.memory)
        .with_tolerance_grad(options.gradient)
        .and_then(|solver| solver.with_tolerance_cost(options.decrease));
    let first = start.clone();
    let run = solver.and_then(|solver| {
        Executor::new(Objective { problem, seen }, solver)
            .configure(|state| state.param(start).max_iters(options.most))
            .run()
    });
    let (variables, iterations, stop) = match run {
        Ok(result) => {
            let state = result.state();
            let stop = match state.get_termination_status() {
                TerminationStatus::Terminated(TerminationReason::MaxItersReached) => Stop::MostIterations,
                _ => Stop::Converged,
            };
            (state.get_best_param().cloned().unwrap_or(first), state.get_iter() as usize, stop)
        }
        // A line search that finds no step leaves the start as the result.
        Err(_) => (first, 0, Stop::NoDecrease),
    };
    Solution { cost: problem.cost(&variables), variables, iterations, stop }
}
