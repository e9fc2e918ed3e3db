//! The analytic backend: this crate's algorithms behind [`DynamicsBackend`], [`SimulationBackend`] and
//! [`BodyKinematics`].

use crate::backend::check_finite;
use crate::body_kinematics::BodyJoint;
use crate::check::check_size;
use crate::configuration::{normalised, quaternion_product};
use crate::motion::BodyMotion;
use crate::motion::floating_placement;
use crate::{
    BackendError, BodyKinematics, DimensionError, DynamicsBackend, SimulationBackend, Tree, Vec3, Workspace,
    World,
};

/// Weight of each stage, and how far into the step its rate is followed to get to the next.
const RUNGE_KUTTA: [(f64, f64); 4] = [(1.0 / 6.0, 0.5), (1.0 / 3.0, 0.5), (1.0 / 3.0, 1.0), (1.0 / 6.0, 0.0)];

/// A [`Tree`] in empty space: a floating base falls freely.
///
/// [`step`](SimulationBackend::step) is one step of the classical Runge-Kutta method of order four. The
/// friction and the limits that the URDF declares are not part of it.
#[derive(Clone, Debug)]
pub struct AnalyticBackend {
    tree: Tree,
    /// One for each joint, or empty.
    rotor_inertia: Vec<f64>,
    joint_names: Vec<String>,
    workspace: Workspace<f64>,
    q: Vec<f64>,
    v: Vec<f64>,
    base_wrench: [f64; 6],
    stages: Stages,
}

/// Scratch of a Runge-Kutta step.
#[derive(Clone, Debug)]
struct Stages {
    force: Vec<f64>,
    q: Vec<f64>,
    v: Vec<f64>,
    /// Derivative of the configuration at this stage, and the weighted sum of all.
    q_rate: Vec<f64>,
    q_sum: Vec<f64>,
    a: Vec<f64>,
    a_sum: Vec<f64>,
    bias: Vec<f64>,
}

impl AnalyticBackend {
    /// The robot, at rest in its neutral configuration.
    pub fn new(tree: Tree) -> Self {
        let (nq, nv) = (tree.configuration_size(), tree.velocity_size());
        let (q, v) = (|| vec![0.0; nq], || vec![0.0; nv]);
        AnalyticBackend {
            joint_names: tree.joint_names().map(str::to_owned).collect(),
            workspace: Workspace::new(&tree),
            q: tree.neutral_configuration(),
            v: v(),
            base_wrench: [0.0; 6],
            rotor_inertia: Vec::new(),
            stages: Stages {
                force: v(),
                q: q(),
                v: v(),
                q_rate: q(),
                q_sum: q(),
                a: v(),
                a_sum: v(),
                bias: v(),
            },
            tree,
        }
    }

    /// The robot in a world of which this backend can do the rotors alone: they add their inertia to the mass
    /// matrix's diagonal, and their reaction on the base is left out, as in physics engines ("armature").
    ///
    /// # Errors
    /// The world does not fit the robot, or has feet or position limits, which need contacts.
    pub fn in_world(tree: Tree, world: &World) -> Result<Self, BackendError> {
        world.check(&tree)?;
        let contacts =
            [(!world.feet.is_empty(), "feet"), (world.position_limits, "position limits of joints")];
        if let Some((_, what)) = contacts.into_iter().find(|(wanted, _)| *wanted) {
            let message = format!("it has no contacts, so a world with {what} needs a physics engine");
            return Err(BackendError::Backend { backend: "analytic", message });
        }
        Ok(AnalyticBackend { rotor_inertia: world.rotor_inertia.clone(), ..AnalyticBackend::new(tree) })
    }

    /// The robot.
    pub fn tree(&self) -> &Tree {
        &self.tree
    }
}

/// The acceleration under a generalised force.
fn accelerate(
    tree: &Tree,
    rotor_inertia: &[f64],
    [q, v, force]: [&[f64]; 3],
    workspace: &mut Workspace<f64>,
    acceleration: &mut [f64],
) -> Result<(), DimensionError> {
    if rotor_inertia.is_empty() {
        return tree.forward_dynamics(q, v, force, workspace, acceleration);
    }
    tree.check_state(q, v)?;
    check_size("the generalised force", force.len(), tree.velocity_size())?;
    check_size("the acceleration", acceleration.len(), tree.velocity_size())?;
    tree.solve_mass_matrix([q, v, force], rotor_inertia, workspace, acceleration);
    Ok(())
}

impl DynamicsBackend for AnalyticBackend {
    fn name(&self) -> &str {
        "analytic"
    }

    fn joint_names(&self) -> &[String] {
        &self.joint_names
    }

    fn velocity_size(&self) -> usize {
        self.tree.velocity_size()
    }

    fn configuration_size(&self) -> usize {
        self.tree.configuration_size()
    }

    fn inverse_dynamics(
        &mut self,
        q: &[f64],
        v: &[f64],
        a: &[f64],
        force: &mut [f64],
    ) -> Result<(), BackendError> {
        self.tree.inverse_dynamics(q, v, a, &mut self.workspace, force)?;
        self.base_wrench = self.tree.base_wrench(&self.workspace);
        let first_joint = force.len() - self.joint_names.len();
        for (joint, inertia) in self.rotor_inertia.iter().enumerate() {
            force[first_joint + joint] += inertia * a[first_joint + joint];
        }
        Ok(())
    }

    fn mass_matrix(&mut self, q: &[f64], matrix: &mut [f64]) -> Result<(), BackendError> {
        self.tree.mass_matrix(q, &mut self.workspace, matrix)?;
        let size = self.tree.velocity_size();
        let first_joint = size - self.joint_names.len();
        for (joint, inertia) in self.rotor_inertia.iter().enumerate() {
            matrix[(first_joint + joint) * (size + 1)] += inertia;
        }
        Ok(())
    }

    fn forward_dynamics(
        &mut self,
        q: &[f64],
        v: &[f64],
        force: &[f64],
        acceleration: &mut [f64],
    ) -> Result<(), BackendError> {
        accelerate(&self.tree, &self.rotor_inertia, [q, v, force], &mut self.workspace, acceleration)?;
        check_finite("the acceleration", acceleration).map_err(|_| BackendError::Singular)
    }

    fn base_wrench(&self) -> [f64; 6] {
        self.base_wrench
    }
}

impl SimulationBackend for AnalyticBackend {
    fn state(&self, q: &mut [f64], v: &mut [f64]) -> Result<(), BackendError> {
        self.tree.check_state(q, v)?;
        q.copy_from_slice(&self.q);
        v.copy_from_slice(&self.v);
        Ok(())
    }

    fn set_state(&mut self, q: &[f64], v: &[f64]) -> Result<(), BackendError> {
        self.check_state(q, v)?;
        self.q.copy_from_slice(q);
        self.v.copy_from_slice(v);
        Ok(())
    }

    fn step(&mut self, torque: &[f64], dt: f64) -> Result<(), BackendError> {
        self.check_step(torque, dt)?;
        let AnalyticBackend { tree, rotor_inertia, workspace, stages, .. } = self;
        let Stages { force, q, v, q_rate, q_sum, a, a_sum, bias } = stages;
        let first_joint = force.len() - torque.len();
        force[..first_joint].fill(0.0);
        force[first_joint..].copy_from_slice(torque);
        q.copy_from_slice(&self.q);
        v.copy_from_slice(&self.v);
        q_sum.fill(0.0);
        a_sum.fill(0.0);
        let mut base_wrench = None;
        for (weight, reach) in RUNGE_KUTTA {
            accelerate(tree, rotor_inertia, [q, v, force], workspace, a)?;
            if base_wrench.is_none() {
                tree.inverse_dynamics(q, v, a, workspace, bias)?;
                base_wrench = Some(tree.base_wrench(workspace));
            }
            configuration_rate(tree, q, v, q_rate);
            add_scaled(q_sum, weight, q_rate);
            add_scaled(a_sum, weight, a);
            advance(tree, &self.q, reach * dt, q_rate, q);
            v.copy_from_slice(&self.v);
            add_scaled(v, reach * dt, a);
        }
        advance(tree, &self.q, dt, q_sum, q);
        v.copy_from_slice(&self.v);
        add_scaled(v, dt, a_sum);
        if !q.iter().chain(v.iter()).all(|x| x.is_finite()) {
            return Err(BackendError::Singular);
        }
        self.q.copy_from_slice(q);
        self.v.copy_from_slice(v);
        self.base_wrench = base_wrench.unwrap_or(self.base_wrench);
        Ok(())
    }
}

impl BodyKinematics for AnalyticBackend {
    type Error = DimensionError;

    fn body_count(&self) -> usize {
        self.tree.bodies().len()
    }

    fn body_joint(&self, body: usize) -> BodyJoint {
        BodyKinematics::<f64>::body_joint(&&self.tree, body)
    }

    fn gravity(&self) -> [f64; 3] {
        self.tree.gravity
    }

    fn body_motions(
        &mut self,
        q: &[f64],
        v: &[f64],
        a: &[f64],
        motions: &mut [BodyMotion<f64>],
    ) -> Result<(), DimensionError> {
        BodyKinematics::body_motions(&mut &self.tree, q, v, a, motions)
    }
}

fn add_scaled(sum: &mut [f64], factor: f64, addend: &[f64]) {
    sum.iter_mut().zip(addend).for_each(|(sum, addend)| *sum += factor * addend);
}

/// Time derivative of the configuration's coordinates. For the base's quaternion ½·quaternion ∘ (ω, 0).
fn configuration_rate(tree: &Tree, q: &[f64], v: &[f64], rate: &mut [f64]) {
    if !tree.is_floating() {
        rate.copy_from_slice(v);
        return;
    }
    let linear = floating_placement(q).rotation * Vec3([v[0], v[1], v[2]]);
    let turning = quaternion_product([q[3], q[4], q[5], q[6]], [v[3], v[4], v[5], 0.0]);
    rate[..3].copy_from_slice(&linear.0);
    rate[3..7].copy_from_slice(&turning.map(|x| 0.5 * x));
    rate[7..].copy_from_slice(&v[6..]);
}

/// `result = start + duration · rate`, with a floating base's quaternion put back on the unit sphere.
///
/// Stages evaluate the rate at unit quaternions only, so the method sees one smooth field around the sphere
/// and keeps its order.
fn advance(tree: &Tree, start: &[f64], duration: f64, rate: &[f64], result: &mut [f64]) {
    result.copy_from_slice(start);
    add_scaled(result, duration, rate);
    if tree.is_floating() {
        let quaternion = normalised([result[3], result[4], result[5], result[6]]);
        result[3..7].copy_from_slice(&quaternion);
    }
}
