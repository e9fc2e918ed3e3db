//! Inverse kinematics of one pose: damped Gauss-Newton inside bounds.

use crate::solver::{Arrow, Pattern};
use phiw_dynamics::scalar::Lanes;

/// Damping at first, and what it is multiplied with after a step that was good or bad.
const DAMPING: f64 = 1e-3;
const GOOD: f64 = 0.2;
const BAD: f64 = 10.0;
/// The relative decrease of the cost at which a pose is found.
const TOLERANCE: f64 = 1e-3;
/// Added to the diagonal where a coordinate is to stay.
const STIFF: f64 = 1e12;

const ONE: Lanes<1> = Lanes([1.0]);

/// J'J (row by row, both triangles) and J'r of a pose.
pub(crate) struct Slopes {
    pub normal: Vec<f64>,
    pub gradient: Vec<f64>,
}

/// A search over poses of one size.
pub(crate) struct PoseSearch {
    bounds: Vec<(f64, f64)>,
    slopes: Slopes,
    arrow: Arrow,
    pattern: Pattern,
    step: Vec<f64>,
    trial: Vec<f64>,
}

impl PoseSearch {
    /// A search inside bounds, one pair for each coordinate.
    pub fn new(bounds: Vec<(f64, f64)>) -> Self {
        let size = bounds.len();
        PoseSearch {
            slopes: Slopes { normal: vec![0.0; size * size], gradient: vec![0.0; size] },
            arrow: Arrow::new(size, 1, 0, 0),
            pattern: Pattern::dense(size, 0),
            step: vec![0.0; size],
            trial: vec![0.0; size],
            bounds,
        }
    }

    /// The bounds.
    pub fn bounds(&self) -> &[(f64, f64)] {
        &self.bounds
    }

    /// Improves a pose by at most so many steps; returns its cost. `evaluate` gives the cost of a pose and,
    /// if asked, its slopes.
    pub fn run(
        &mut self,
        pose: &mut [f64],
        steps: usize,
        mut evaluate: impl FnMut(&[f64], Option<&mut Slopes>) -> f64,
    ) -> f64 {
        let mut damping = DAMPING;
        let mut cost = evaluate(pose, Some(&mut self.slopes));
        for _ in 0..steps {
            self.arrow.clear();
            self.arrow.add_windows(0, &self.pattern, &[ONE], &[ONE], [&self.slopes.normal[..]]);
            for (coordinate, (&value, &(lower, upper))) in pose.iter().zip(&self.bounds).enumerate() {
                let slope = self.slopes.gradient[coordinate];
                let pushed = (value <= lower && slope > 0.0) || (value >= upper && slope < 0.0);
                *self.arrow.diagonal_mut(coordinate) += if pushed { STIFF } else { damping };
            }
            if !self.arrow.factor() {
                break;
            }
            self.step.copy_from_slice(&self.slopes.gradient);
            self.arrow.solve(&mut self.step);
            for (index, value) in self.trial.iter_mut().enumerate() {
                let (lower, upper) = self.bounds[index];
                *value = (pose[index] - self.step[index]).max(lower).min(upper);
            }
            let after = evaluate(&self.trial, None);
            if after >= cost {
                damping *= BAD;
                continue;
            }
            let done = cost - after < TOLERANCE * cost;
            pose.copy_from_slice(&self.trial);
            cost = after;
            if done {
                break;
            }
            cost = evaluate(pose, Some(&mut self.slopes));
            damping *= GOOD;
        }
        cost
    }
}
