//! Grouped factors as numbers that a run is saved with, and back, to the last bit.

use phiw_identification::{FactorRows, IdentificationError};
use phiw_regressor::least_squares::{Group, GroupedFactor};
use serde::{Deserialize, Serialize};

/// A grouped factor, written out.
#[derive(Serialize, Deserialize)]
pub(super) struct StoredFactor {
    parameter_count: usize,
    groups: Vec<FactorRows>,
}

impl From<&GroupedFactor> for StoredFactor {
    fn from(factor: &GroupedFactor) -> Self {
        let rows = |group: &Group| FactorRows::of(&group.factor, group.parameters.clone());
        let groups = factor.groups().iter().map(rows).collect();
        StoredFactor { parameter_count: factor.parameter_count(), groups }
    }
}

impl TryFrom<StoredFactor> for GroupedFactor {
    type Error = IdentificationError;

    fn try_from(stored: StoredFactor) -> Result<Self, IdentificationError> {
        let group = |rows: FactorRows| Ok(Group { factor: rows.factor()?, parameters: rows.parameters });
        let groups: Result<Vec<Group>, IdentificationError> = stored.groups.into_iter().map(group).collect();
        Ok(GroupedFactor::new(stored.parameter_count, groups?)?)
    }
}
