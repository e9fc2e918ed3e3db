//! One factor for each torque.
//!
//! The torque of joint j feels only the bodies that j moves: its factor holds only their columns, which is
//! smaller and quicker than one factor of all columns, and lets the joints' weights change without going back
//! to the rows.

use crate::RegressorError;
use crate::factor::{Factor, FactorBuilder};
use phiw_dynamics::check::{check_index, check_size};

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
        let groups: Result<Vec<Group>, RegressorError> = self.groups.iter().map(restrict).collect();
        Self::new(kept.len(), groups?)
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
            .iter()
            .zip(&other.groups)
            .map(|(mine, theirs)| {
                check_size("parameters of a group", theirs.parameters.len(), mine.parameters.len())?;
                Ok(Group { parameters: mine.parameters.clone(), factor: mine.factor.merge(&theirs.factor)? })
            })
            .collect();
        Self::new(self.parameter_count, groups?)
    }
}
