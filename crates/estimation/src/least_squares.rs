//! Equation (4), and the same with each torque weighted by its own residual.

use super::{Estimate, Estimator, Evidence};
use crate::{EstimationError, RobotModel};
use phiw_identification::Design;
use phiw_regressor::RegressorError;
use phiw_regressor::factor::Factor;
use phiw_regressor::least_squares::{Group, GroupedFactor, ordinary_least_squares, weighted_least_squares};

/// Equation (4): least squares with all rows alike.
///
/// Right where the noise is in the logged torque. Where it is in the delivered one, and moves the robot, the
/// columns of Φ are correlated with it, and the estimate is biased however long the log: inertia towards
/// zero, friction towards the controller's own gains.
#[derive(Clone, Copy, Debug, Default)]
pub struct LeastSquares;

/// Least squares with each torque's rows weighted by the inverse of its own residual, iterated: what a robot
/// wants whose torques differ by a factor of fifty. Biased like [`LeastSquares`] where the noise moves the
/// robot.
#[derive(Clone, Copy, Debug, Default)]
pub struct WeightedLeastSquares;

impl Estimator for LeastSquares {
    fn name(&self) -> &'static str {
        "least_squares"
    }

    fn estimate(
        &self,
        _: &Design,
        evidence: &Evidence,
        _: &RobotModel,
        present: &[f64],
    ) -> Result<Estimate, EstimationError> {
        let Determined { kept, factor } = Determined::of(evidence.factor(), present)?;
        let combined = factor.combine(&vec![1.0; factor.groups().len()])?;
        let solution = ordinary_least_squares(&factor)?;
        let deviations = combined.standard_deviations(solution.residual_std())?;
        Ok(spread(&kept, present, &solution.parameters, &deviations))
    }
}

impl Estimator for WeightedLeastSquares {
    fn name(&self) -> &'static str {
        "weighted_least_squares"
    }

    fn estimate(
        &self,
        _: &Design,
        evidence: &Evidence,
        _: &RobotModel,
        present: &[f64],
    ) -> Result<Estimate, EstimationError> {
        let Determined { kept, factor } = Determined::of(evidence.factor(), present)?;
        let solution = weighted_least_squares(&factor)?;
        Ok(spread(&kept, present, &solution.parameters, &solution.standard_deviations))
    }
}

/// The columns that the rows determine, the others taken to the right-hand side with their present values.
pub(super) struct Determined {
    /// The parameters that are left.
    pub kept: Vec<usize>,
    /// The rows over them.
    pub factor: GroupedFactor,
}

impl Determined {
    /// `present` are the values of all parameters.
    pub fn of(factor: &GroupedFactor, present: &[f64]) -> Result<Self, RegressorError> {
        let equal = vec![1.0; factor.groups().len()];
        let undetermined = factor.combine(&equal)?.undetermined_columns();
        let kept: Vec<usize> =
            (0..factor.parameter_count()).filter(|column| !undetermined.contains(column)).collect();
        if undetermined.is_empty() {
            return Ok(Determined { kept, factor: factor.clone() });
        }
        let hold = |group: &Group| {
            let columns = group.factor.columns();
            let held =
                group.parameters.iter().enumerate().filter(|(_, parameter)| undetermined.contains(parameter));
            let mut entries = group.factor.triangle();
            let mut end = 0;
            for row in 0..columns {
                end += columns - row;
                let known: f64 = held
                    .clone()
                    .filter(|(column, _)| *column >= row)
                    .map(|(column, &parameter)| group.factor.entry(row, column) * present[parameter])
                    .sum();
                entries[end - 1] -= known;
            }
            let factor = Factor::of_triangle(columns, group.factor.rows(), &entries)?;
            Ok(Group { parameters: group.parameters.clone(), factor })
        };
        let groups: Result<Vec<Group>, RegressorError> = factor.groups().iter().map(hold).collect();
        let held = GroupedFactor::new(factor.parameter_count(), groups?)?;
        Ok(Determined { factor: held.select(&kept)?, kept })
    }
}

/// Values of the kept parameters among the present ones.
fn spread(kept: &[usize], present: &[f64], parameters: &[f64], deviations: &[f64]) -> Estimate {
    let mut estimate = Estimate {
        parameters: present.to_vec(),
        standard_deviations: vec![f64::NAN; present.len()],
        covariance: None,
        noise: None,
    };
    for ((&parameter, value), deviation) in kept.iter().zip(parameters).zip(deviations) {
        estimate.parameters[parameter] = *value;
        estimate.standard_deviations[parameter] = *deviation;
    }
    estimate
}
