//! One factor for each torque.
//!
//! The torque of joint j feels only the bodies that j moves: its factor holds only their columns, which is
//! smaller and quicker than one factor of all columns, and lets the joints' weights change without going back
//! to the rows.

use crate::RegressorError;
use crate::factor::{Factor, FactorBuilder};
use phiw_dynamics::check::{check_index, check_size};
use rayon::prelude::*;

/// The rows of one torque.
#[derive(Clone, Debug)]
pub struct Group {
    /// For each column of the factor (right-hand side left out), the parameter that it belongs to.
    pub parameters: Vec<usize>,
    /// R of the group's \[Φ f\].
    pub factor: Factor,
}

/// The factors of all torques.
#[derive(Clone, Debug)]
#[must_use = "merging makes a new factor, and leaves both as they are"]
pub struct GroupedFactor {
    parameter_count: usize,
    groups: Vec<Group>,
}

impl GroupedFactor {
    /// Factors over `parameter_count` parameters in all.
    ///
    /// # Errors
    /// A group's columns do not match its factor, or name a parameter that does not exist.
    pub fn new(parameter_count: usize, groups: Vec<Group>) -> Result<Self, RegressorError> {
        for group in &groups {
            check_size("parameters of a group", group.parameters.len(), group.factor.parameters())?;
            for &parameter in &group.parameters {
                check_index("parameter", parameter, parameter_count)?;
            }
        }
        Ok(GroupedFactor { parameter_count, groups })
    }

    /// Number of parameters.
    pub fn parameter_count(&self) -> usize {
        self.parameter_count
    }

    /// The groups.
    pub fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// Number of rows of all groups.
    pub fn rows(&self) -> u64 {
        self.groups.iter().map(|group| group.factor.rows()).sum()
    }

    /// The factor over all parameters with group k's rows times `weights[k]`.
    ///
    /// # Errors
    /// There is not one weight for each group.
    pub fn combine(&self, weights: &[f64]) -> Result<Factor, RegressorError> {
        check_size("weights", weights.len(), self.groups.len())?;
        let mut builder = FactorBuilder::new(self.parameter_count + 1);
        for (group, weight) in self.groups.iter().zip(weights) {
            let mut columns = group.parameters.clone();
            columns.push(self.parameter_count);
            builder.push_factor(&group.factor, &columns, *weight)?;
        }
        Ok(builder.factor())
    }

    /// ‖Φw − f‖² of each group.
    ///
    /// # Errors
    /// `w` has the wrong length.
    pub fn residual_sums_of_squares(&self, w: &[f64]) -> Result<Vec<f64>, RegressorError> {
        check_size("parameters", w.len(), self.parameter_count)?;
        self.groups
            .iter()
            .map(|group| {
                let own: Vec<f64> = group.parameters.iter().map(|&parameter| w[parameter]).collect();
                group.factor.residual_sum_of_squares(&own)
            })
            .collect()
    }

    /// The groups' factors restricted to `kept` parameters (renumbered in that order).
    ///
    /// # Errors
    /// A parameter does not exist.
    pub fn select(&self, kept: &[usize]) -> Result<Self, RegressorError> {
        let mut renumbered = vec![None; self.parameter_count];
        for (new, &old) in kept.iter().enumerate() {
            check_index("parameter", old, self.parameter_count)?;
            renumbered[old] = Some(new);
        }
        let restrict = |group: &Group| {
            let mut columns: Vec<(usize, usize)> = group
                .parameters
                .iter()
                .enumerate()
                .filter_map(|(column, &parameter)| renumbered[parameter].map(|new| (new, column)))
                .collect();
            columns.sort_unstable();
            let parameters = columns.iter().map(|&(new, _)| new).collect();
            let named: Vec<usize> =
                columns.iter().map(|&(_, column)| column).chain([group.factor.parameters()]).collect();
            Ok(Group { parameters, factor: group.factor.select(&named)? })
        };
        let groups: Result<Vec<Group>, RegressorError> = self.groups.par_iter().map(restrict).collect();
        Self::new(kept.len(), groups?)
    }

    /// The same with a prior: in group k a row of `weight(k, parameter)` times each of its parameters, where
    /// there is a weight, which says that the parameter is nothing. These are no rows of the torque, and are
    /// not counted.
    ///
    /// # Errors
    /// A weight is not finite.
    pub fn drawn_to_nothing(
        &self,
        weight: impl Fn(usize, usize) -> Option<f64>,
    ) -> Result<Self, RegressorError> {
        let with_prior = |(place, group): (usize, &Group)| {
            let size = group.parameters.len() + 1;
            let mut builder = FactorBuilder::new(size);
            builder.push_factor(&group.factor, &(0..size).collect::<Vec<usize>>(), 1.0)?;
            for (column, &parameter) in group.parameters.iter().enumerate() {
                if let Some(weight) = weight(place, parameter) {
                    let mut row = vec![0.0; size];
                    row[column] = weight;
                    builder.push_row(&row)?;
                }
            }
            let factor = builder.factor().standing_for(group.factor.rows());
            Ok(Group { parameters: group.parameters.clone(), factor })
        };
        let groups: Result<Vec<Group>, RegressorError> =
            self.groups.iter().enumerate().map(with_prior).collect();
        Self::new(self.parameter_count, groups?)
    }

    /// The rows of both.
    ///
    /// # Errors
    /// They do not have the same groups.
    pub fn merge(&self, other: &Self) -> Result<Self, RegressorError> {
        check_size("groups", other.groups.len(), self.groups.len())?;
        check_size("parameters", other.parameter_count, self.parameter_count)?;
        let groups: Result<Vec<Group>, RegressorError> = self
            .groups
            .par_iter()
            .zip(&other.groups)
            .map(|(mine, theirs)| {
                check_size("parameters of a group", theirs.parameters.len(), mine.parameters.len())?;
                Ok(Group { parameters: mine.parameters.clone(), factor: mine.factor.merge(&theirs.factor)? })
            })
            .collect();
        Self::new(self.parameter_count, groups?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prior_draws_where_it_has_a_weight_and_adds_no_row() {
        // f = 3·x over four rows of one, of two torques with a parameter each.
        let factor = Factor::of_rows(2, &[1.0, 3.0].repeat(4)).unwrap();
        let groups = (0..2).map(|own| Group { parameters: vec![own], factor: factor.clone() });
        let plain = GroupedFactor::new(2, groups.collect()).unwrap();
        let drawn = plain.drawn_to_nothing(|torque, _| (torque == 1).then_some(2.0)).unwrap();
        assert_eq!(drawn.rows(), plain.rows());
        let found = drawn.combine(&[1.0, 1.0]).unwrap().solve().unwrap().parameters;
        // Ridge regression in closed form: Σxf / (Σx² + 2²).
        assert!((found[0] - 3.0).abs() < 1e-12 && (found[1] - 12.0 / 8.0).abs() < 1e-12, "{found:?}");
    }
}
