//! What is compared, and this workspace's side of it.

use phiw_dynamics::random_tree::{RandomNumbers, random_state};
use phiw_dynamics::{DimensionError, PARAMETERS_PER_BODY, Placement, Tree, Workspace};
use phiw_regressor::JointTorqueRegressor;

/// What is compared: total mass and standard parameters as read from the URDF; joint torque regressor,
/// inverse dynamics, mass matrix, forward dynamics and centre of mass in every state.
pub const QUANTITIES: [&str; 7] = ["mass", "parameters", "regressor", "rnea", "crba", "aba", "com"];

/// Numbers, row by row: a row is what one state (or one body) has.
pub struct Answer {
    /// Length of a row.
    pub row_length: usize,
    /// All rows.
    pub values: Vec<f64>,
}

/// Random states, one after another, and the generalised force to accelerate under.
pub struct States {
    /// How many.
    pub count: usize,
    /// Configurations.
    pub q: Vec<f64>,
    /// Velocities.
    pub v: Vec<f64>,
    /// Accelerations.
    pub a: Vec<f64>,
    /// Generalised forces: those of another random acceleration, so that each suits the robot.
    pub force: Vec<f64>,
}

impl States {
    /// Random states inside the joint limits.
    ///
    /// # Errors
    /// None for a tree that was read.
    pub fn random(tree: &Tree, count: usize, seed: u64) -> Result<Self, DimensionError> {
        let rng = &mut RandomNumbers::new(seed);
        let mut workspace = Workspace::new(tree);
        let mut force = vec![0.0; tree.velocity_size()];
        let mut states = States { count, q: Vec::new(), v: Vec::new(), a: Vec::new(), force: Vec::new() };
        for _ in 0..count {
            let state = random_state(tree, rng);
            let other = random_state(tree, rng);
            tree.inverse_dynamics(&state.q, &state.v, &other.a, &mut workspace, &mut force)?;
            states.q.extend(state.q);
            states.v.extend(state.v);
            states.a.extend(state.a);
            states.force.extend(&force);
        }
        Ok(states)
    }
}

/// This workspace's answers, one for each of [`QUANTITIES`].
///
/// # Errors
/// None for states of this tree.
pub fn answers(tree: &Tree, states: &States) -> Result<[Answer; QUANTITIES.len()], DimensionError> {
    let (positions, size) = (tree.configuration_size(), tree.velocity_size());
    let regressor = JointTorqueRegressor::new(tree);
    let mut scratch = regressor.scratch();
    let mut workspace = Workspace::new(tree);
    let mut pairs = vec![0.0; regressor.buffer_size()];
    let mut placements = vec![Placement::identity(); tree.bodies().len()];
    let rows = |row_length| Answer { row_length, values: vec![0.0; states.count * row_length] };
    let mut phi = rows(regressor.rows() * regressor.columns());
    let (mut rnea, mut crba, mut aba, mut com) = (rows(size), rows(size * size), rows(size), rows(3));

    for state in 0..states.count {
        let q = &states.q[state * positions..][..positions];
        let [v, a, force] = [&states.v, &states.a, &states.force].map(|all| &all[state * size..][..size]);
        regressor.compute(tree, q, v, a, &mut scratch, &mut pairs)?;
        regressor.scatter(&pairs, phi.row(state))?;
        tree.inverse_dynamics(q, v, a, &mut workspace, rnea.row(state))?;
        tree.mass_matrix(q, &mut workspace, crba.row(state))?;
        tree.forward_dynamics(q, v, force, &mut workspace, aba.row(state))?;
        tree.forward_kinematics(q, &mut placements)?;
        com.row(state).copy_from_slice(&tree.center_of_mass(&placements)?.0);
    }
    let mass = Answer { row_length: 1, values: vec![tree.mass()] };
    let parameters = Answer { row_length: PARAMETERS_PER_BODY, values: tree.inertial_parameters() };
    Ok([mass, parameters, phi, rnea, crba, aba, com])
}

impl Answer {
    fn row(&mut self, row: usize) -> &mut [f64] {
        &mut self.values[row * self.row_length..][..self.row_length]
    }
}
