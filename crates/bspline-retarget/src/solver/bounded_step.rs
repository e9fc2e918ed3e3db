//! A damped Gauss-Newton step that stays inside bounds.

use super::Arrow;
use phiw_dynamics::dense::dot;

/// How often the variables at their bounds are revised for a step.
const REVISIONS: usize = 3;
/// The largest number of variables that are pulled to their bounds for a step; what is still outside is cut
/// off.
const MOST_PULLS: usize = 24;
/// Added to the diagonal where a variable is to stay.
const STIFF: f64 = 1e12;
/// Added to every diagonal element, in case one is zero.
const LEAST: f64 = 1e-12;

/// Finds steps, and knows what they promise.
pub(super) struct BoundedStep {
    /// Bounds of the first variables; there are none for the others.
    pub bounds: Vec<(f64, f64)>,
    /// The step; the variables go against it.
    pub step: Vec<f64>,
    /// g'·s and s'·H·s.
    slope: f64,
    curvature: f64,
    factor: Arrow,
    damped: Vec<f64>,
    held: Vec<bool>,
    /// Variables that are pulled to a bound, and how far they are from there.
    pulled: Vec<(usize, f64)>,
    /// What a unit pull at each does to all variables, one after the other.
    pulls: Vec<f64>,
}

impl BoundedStep {
    pub fn new(like: &Arrow, variables: usize, bounds: Vec<(f64, f64)>) -> Self {
        BoundedStep {
            step: vec![0.0; variables],
            slope: 0.0,
            curvature: 0.0,
            factor: like.clone(),
            damped: vec![0.0; variables],
            held: vec![false; bounds.len()],
            bounds,
            pulled: Vec::new(),
            pulls: Vec::new(),
        }
    }

    /// The decrease of the cost that a share of the step promises.
    pub fn predicted(&self, share: f64) -> f64 {
        share * (2.0 * self.slope - share * self.curvature)
    }

    /// Finds the step for J'J and J'r at `variables`; false if there is none.
    ///
    /// Variables that the gradient pushes against a bound stay there. Others that the step would carry out go
    /// to their bound, and the rest is found again around them: the same factor serves, with a pull at each
    /// of them.
    pub fn find(&mut self, arrow: &Arrow, variables: &[f64], gradient: &[f64], damping: f64) -> bool {
        self.factor.copy_from(arrow);
        self.step.copy_from_slice(gradient);
        for (variable, &value) in variables.iter().enumerate() {
            let diagonal = self.factor.diagonal_mut(variable);
            self.damped[variable] = damping * *diagonal + LEAST;
            *diagonal += self.damped[variable];
            let Some(&(lower, upper)) = self.bounds.get(variable) else { continue };
            let slope = gradient[variable];
            self.held[variable] = (value <= lower && slope > 0.0) || (value >= upper && slope < 0.0);
            if self.held[variable] {
                *diagonal += STIFF;
                self.step[variable] = 0.0;
            }
        }
        if !self.factor.factor() {
            return false;
        }
        self.factor.solve(&mut self.step);
        let forces = self.pull_inside(variables);
        self.slope = dot(&self.step, gradient);
        // H·s is what is left of the right-hand side without the damping.
        self.curvature = self.slope;
        for (step, damped) in self.step.iter().zip(&self.damped) {
            self.curvature -= damped * step * step;
        }
        for (&(variable, _), force) in self.pulled.iter().zip(forces) {
            self.curvature += force * self.step[variable];
        }
        true
    }

    /// Pulls variables that the step would carry out to their bounds; gives the forces.
    fn pull_inside(&mut self, variables: &[f64]) -> Vec<f64> {
        let size = self.step.len();
        self.pulled.clear();
        self.pulls.clear();
        let mut total = Vec::new();
        for _ in 0..REVISIONS {
            let known = self.pulled.len();
            for (variable, &(lower, upper)) in self.bounds.iter().enumerate() {
                let value = variables[variable] - self.step[variable];
                let outside = !(lower..=upper).contains(&value) && !self.held[variable];
                if outside && self.pulled.len() < MOST_PULLS {
                    self.held[variable] = true;
                    self.pulled.push((variable, variables[variable] - value.max(lower).min(upper)));
                }
            }
            let count = self.pulled.len();
            if count == known {
                break;
            }
            self.pulls.resize(count * size, 0.0);
            for (&(variable, _), pull) in
                self.pulled.iter().zip(self.pulls.chunks_exact_mut(size)).skip(known)
            {
                pull[variable] = 1.0;
                self.factor.solve(pull);
            }
            let pulls = || self.pulls.chunks_exact(size);
            let mut forces: Vec<f64> = self.pulled.iter().map(|&(v, to)| to - self.step[v]).collect();
            let mut answers = Arrow::new(0, 0, 0, count);
            for (row, &(variable, _)) in self.pulled.iter().enumerate() {
                for (column, pull) in pulls().enumerate().skip(row) {
                    answers.add_corner(row, column, pull[variable]);
                }
            }
            if !answers.factor() {
                break;
            }
            answers.solve(&mut forces);
            for (pull, force) in pulls().zip(&forces) {
                self.step.iter_mut().zip(pull).for_each(|(step, value)| *step += force * value);
            }
            total.resize(count, 0.0);
            total.iter_mut().zip(forces).for_each(|(sum, force)| *sum += force);
        }
        total
    }
}
