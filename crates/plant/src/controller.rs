//! The computed-torque controller, equation (13).

use crate::PlantError;
use crate::error::check_value;
use crate::step_solver::inverse;
use phiw_dynamics::{DimensionError, Tree, Workspace, check_size};

/// What a controller believes that a motion needs.
pub trait TorqueModel {
    /// Writes the torque of each joint for positions `q` \[rad, m\], velocities `v` and accelerations `a` of the joints.
    ///
    /// # Errors
    /// A slice does not fit the model.
    fn torque(&mut self, q: &[f64], v: &[f64], a: &[f64], torque: &mut [f64]) -> Result<(), DimensionError>;
}

/// Rigid bodies with viscous friction: φ(q, q̇, q̈)·w of the paper. A floating base is believed to stand still, upright.
#[derive(Clone, Debug)]
pub struct RigidBodyModel {
    tree: Tree,
    viscous: Vec<f64>,
    workspace: Workspace<f64>,
    /// Coordinates of base and joints: q, v, a, force.
    full: [Vec<f64>; 4],
}

impl RigidBodyModel {
    /// The tree's own parameters, which may be as wrong as one likes, and a coefficient of viscous friction for each joint
    /// \[N·m·s/rad, N·s/m\]; none if empty.
    ///
    /// # Errors
    /// The coefficients are not one for each joint.
    pub fn new(tree: Tree, viscous: Vec<f64>) -> Result<Self, DimensionError> {
        if !viscous.is_empty() {
            check_size("the model's viscous friction", viscous.len(), tree.joint_count())?;
        }
        let zeros = || vec![0.0; tree.velocity_size()];
        let full = [tree.neutral_configuration(), zeros(), zeros(), zeros()];
        Ok(RigidBodyModel { workspace: Workspace::new(&tree), tree, viscous, full })
    }
}

impl TorqueModel for RigidBodyModel {
    fn torque(&mut self, q: &[f64], v: &[f64], a: &[f64], torque: &mut [f64]) -> Result<(), DimensionError> {
        let joints = self.tree.joint_count();
        let names = ["the model's q", "the model's v", "the model's a"];
        for ((full, part), name) in self.full.iter_mut().zip([q, v, a]).zip(names) {
            check_size(name, part.len(), joints)?;
            let first_joint = full.len() - joints;
            full[first_joint..].copy_from_slice(part);
        }
        check_size("the model's torque", torque.len(), joints)?;
        let [full_q, full_v, full_a, force] = &mut self.full;
        self.tree.inverse_dynamics(full_q, full_v, full_a, &mut self.workspace, force)?;
        torque.copy_from_slice(&force[force.len() - joints..]);
        for ((torque, viscous), speed) in torque.iter_mut().zip(&self.viscous).zip(v) {
            *torque += viscous * speed;
        }
        Ok(())
    }
}

/// Gains of a controller, one for each joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Gains {
    /// Position gains Kp \[N·m/rad, N/m\].
    pub position: Vec<f64>,
    /// Velocity gains Kd \[N·m·s/rad, N·s/m\].
    pub velocity: Vec<f64>,
}

impl Gains {
    /// Gains that would make each joint a critically damped oscillator of `bandwidth` \[rad/s\], with its
    /// [`apparent_inertia`] in configuration `q`.
    ///
    /// The paper's gains are small: 3 to 6 rad/s track poorly.
    ///
    /// # Errors
    /// A list does not fit the robot.
    pub fn critically_damped(
        tree: &Tree,
        rotor_inertia: &[f64],
        q: &[f64],
        bandwidth: f64,
    ) -> Result<Self, DimensionError> {
        let inertia = apparent_inertia(tree, rotor_inertia, q)?;
        Ok(Gains {
            position: inertia.iter().map(|inertia| bandwidth * bandwidth * inertia).collect(),
            velocity: inertia.iter().map(|inertia| 2.0 * bandwidth * inertia).collect(),
        })
    }
}

/// What each joint feels of the robot when all other joints are free and the base is held \[kg·m², kg\]: 1/(M⁻¹)ⱼⱼ, with
/// `rotor_inertia` on the mass matrix's diagonal (none if empty).
///
/// It is never more than what the joint feels when the others are locked, and often much less. A velocity gain that is held for
/// a control period must stay below twice this inertia over the period, or the loop is unstable.
///
/// # Errors
/// A list does not fit the robot.
pub fn apparent_inertia(tree: &Tree, rotor_inertia: &[f64], q: &[f64]) -> Result<Vec<f64>, DimensionError> {
    let (size, joints) = (tree.velocity_size(), tree.joint_count());
    if !rotor_inertia.is_empty() {
        check_size("the rotor inertias", rotor_inertia.len(), joints)?;
    }
    let mut matrix = vec![0.0; size * size];
    tree.mass_matrix(q, &mut Workspace::new(tree), &mut matrix)?;
    let first = size - joints;
    for (joint, inertia) in rotor_inertia.iter().enumerate() {
        matrix[(first + joint) * (size + 1)] += inertia;
    }
    let mobility = inverse(&matrix, size, first);
    Ok((0..joints).map(|joint| 1.0 / mobility[joint * (joints + 1)]).collect())
}

/// Equation (13): the model's torque for the reference, and a PD on what the encoders say.
pub struct ComputedTorque {
    model: Box<dyn TorqueModel>,
    gains: Gains,
}

impl ComputedTorque {
    /// A controller with this model and these gains.
    pub fn new(model: impl TorqueModel + 'static, gains: Gains) -> Self {
        ComputedTorque { model: Box::new(model), gains }
    }

    pub(crate) fn check(&self, joints: usize) -> Result<(), PlantError> {
        for (name, gains) in [("Kp", &self.gains.position), ("Kd", &self.gains.velocity)] {
            check_size(
                if name == "Kp" { "the position gains" } else { "the velocity gains" },
                gains.len(),
                joints,
            )?;
            for &gain in gains {
                check_value(|| name.to_owned(), gain, "≥ 0", |gain| gain >= 0.0)?;
            }
        }
        Ok(())
    }

    /// The torque command for a reference `[q*, q̇*, q̈*]` and the state `[q, q̇]` as measured.
    pub(crate) fn command(
        &mut self,
        [q_ref, v_ref, a_ref]: [&[f64]; 3],
        [q, v]: [&[f64]; 2],
        command: &mut [f64],
    ) -> Result<(), DimensionError> {
        self.model.torque(q_ref, v_ref, a_ref, command)?;
        for (joint, command) in command.iter_mut().enumerate() {
            *command += self.gains.position[joint] * (q_ref[joint] - q[joint])
                + self.gains.velocity[joint] * (v_ref[joint] - v[joint]);
        }
        Ok(())
    }
}
