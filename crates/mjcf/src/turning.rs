//! How friction turns at rest.
//!
//! MuJoCo holds friction loss by a soft constraint: near rest it is a damper, whose force reaches the
//! friction at the speed `friction·R/b`, with `b = 2/(d·timeconst)`, `R = (1 − d)/d·A`, impedance d, and A
//! the acceleration along the constraint under a unit of force (MuJoCo's documentation, "Computation",
//! "Constraint model" and "Solver parameters"). With its defaults (0.02 s, 0.9) that speed is `floss·A/950`:
//! on the wrist of a 30-kg arm 0.2 rad/s, as fast as it ever is. So d is chosen for the width that the
//! friction truly has.

use crate::RobotModel;
use crate::write::TIMESTEP;
use phiw_dynamics::dense::Cholesky;
use phiw_dynamics::{DimensionError, Workspace};

/// Time constant of the constraint \[s\] where friction is strong: the shortest that MuJoCo takes for its
/// step.
const TIME_CONSTANT: f64 = 2.0 * TIMESTEP;
/// What friction that turns at once is given \[rad/s, m/s\].
const LEAST_WIDTH: f64 = 1e-3;
/// The hardest impedance that MuJoCo takes, and the softest that is given.
const HARDEST: f64 = 0.9999;
const SOFTEST: f64 = 0.01;

/// M(q)⁻¹ in the configuration of zeros, with armature.
pub(crate) struct Mobility {
    /// Of the mass matrix; none where it is not positive definite.
    factor: Option<Cholesky>,
    size: usize,
    joints: usize,
}

impl Mobility {
    pub fn of(robot: &RobotModel<'_>) -> Result<Self, DimensionError> {
        let tree = robot.tree;
        let (size, joints) = (tree.velocity_size(), tree.joint_count());
        let mut matrix = vec![0.0; size * size];
        tree.mass_matrix(&tree.neutral_configuration(), &mut Workspace::new(tree), &mut matrix)?;
        let first = size - joints;
        for (joint, model) in robot.joints.iter().enumerate() {
            matrix[(first + joint) * (size + 1)] += model.armature;
        }
        for tendon in &robot.tendons {
            for (row, by_row) in tendon.joints {
                for (column, by_column) in tendon.joints {
                    matrix[(first + row) * size + first + column] += tendon.armature * by_row * by_column;
                }
            }
        }
        Ok(Mobility { factor: Cholesky::of(size, |row, column| matrix[row * size + column]), size, joints })
    }

    /// Acceleration of Σ factor·q under a unit of force along it; none where it is not a positive number.
    pub fn along(&self, sum: &[(usize, f64)]) -> Option<f64> {
        let mut direction = vec![0.0; self.size];
        sum.iter().for_each(|(joint, factor)| direction[self.size - self.joints + joint] += factor);
        self.factor.as_ref()?.solve_lower(&mut direction);
        let mobility: f64 = direction.iter().map(|x| x * x).sum();
        (mobility.is_finite() && mobility > 0.0).then_some(mobility)
    }
}

/// The attributes of a joint or tendon whose friction turns within `width` \[rad/s, m/s\] as tanh(v/width);
/// nothing without friction.
///
/// MuJoCo's turns in a straight line. Its end is where both leave out the same area under the full friction:
/// ∫(1 − tanh(v/w))dv = w·ln 2, and half the width of the line.
pub(crate) fn turning(friction: f64, width: f64, mobility: Option<f64>) -> String {
    let Some(mobility) = mobility.filter(|_| friction > 0.0) else { return String::new() };
    let end = (2.0 * std::f64::consts::LN_2 * width).max(LEAST_WIDTH);
    // friction·(1 − d)/d·A·d·T/2 = end. The softer d, the less of the joint's acceleration is in the
    // friction; T is longer only where no d would do: a heavy joint, that such friction takes long to stop.
    let reach = friction * mobility;
    let time_constant = (2.0 * end / (reach * (1.0 - SOFTEST))).max(TIME_CONSTANT);
    let impedance = (1.0 - 2.0 * end / (reach * time_constant)).min(HARDEST);
    format!(" solreffriction=\"{time_constant} 1\" solimpfriction=\"{impedance} {impedance} 0.001 0.5 2\"")
}
