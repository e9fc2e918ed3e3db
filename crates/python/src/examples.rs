//! Robots that come with the package.

use pyo3::prelude::*;

/// URDFs by name.
const URDFS: [(&str, &str); 6] = [
    ("arm7", include_str!("../../../models/arm7.urdf")),
    ("humanoid30", include_str!("../../../models/humanoid30.urdf")),
    ("planar2", include_str!("../../../models/planar2.urdf")),
    ("puma560", include_str!("../../../models/puma560.urdf")),
    ("scara4", include_str!("../../../models/scara4.urdf")),
    ("upper_body18", include_str!("../../../models/upper_body18.urdf")),
];

/// The URDFs that come with the package, by name.
#[pyfunction]
pub fn example_urdfs() -> Vec<(&'static str, &'static str)> {
    URDFS.to_vec()
}
