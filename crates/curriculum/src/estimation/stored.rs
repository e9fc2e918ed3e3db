//! Grouped factors as numbers that a run is saved with, and back, to the last bit.

use phiw_regressor::RegressorError;
use phiw_regressor::factor::Factor;
use phiw_regressor::least_squares::{Group, GroupedFactor};
use serde::{Deserialize, Serialize};

/// The triangle of one torque.
#[derive(Serialize, Deserialize)]
struct StoredGroup {
    parameters: Vec<usize>,
    rows: u64,
    triangle: Vec<f64>,
}

/// A grouped factor, written out.
#[derive(Serialize, Deserialize)]
pub(super) struct StoredFactor {
    parameter_count: usize,
    groups: Vec<StoredGroup>,
}

impl From<&GroupedFactor> for StoredFactor {
    fn from(factor: &GroupedFactor) -> Self {
        let group = |group: &Group| StoredGroup {
            parameters: group.parameters.clone(),
            rows: group.factor.rows(),
            triangle: group.factor.triangle(),
        };
        StoredFactor {
            parameter_count: factor.parameter_count(),
            groups: factor.groups().iter().map(group).collect(),
        }
    }
}

impl TryFrom<StoredFactor> for GroupedFactor {
    type Error = RegressorError;

    fn try_from(stored: StoredFactor) -> Result<Self, RegressorError> {
        let group = |group: StoredGroup| {
            let factor = Factor::of_triangle(group.parameters.len() + 1, group.rows, &group.triangle)?;
            Ok(Group { parameters: group.parameters, factor })
        };
        let groups: Result<Vec<Group>, RegressorError> = stored.groups.into_iter().map(group).collect();
        GroupedFactor::new(stored.parameter_count, groups?)
    }
}
