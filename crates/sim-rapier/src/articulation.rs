//! A robot as a Rapier multibody: built from the tree, its state put in and read out.

use crate::base_frame::{self, engine_velocity, own_velocity};
use crate::error;
use crate::mass_properties::{center_of_mass, mass_properties};
use phiw_dynamics::{BackendError, Body, JointType, Mat3, Placement, Spatial, Tree, Vec3};
use rapier3d_f64::math::{Matrix, Pose, Rotation, Vector};
use rapier3d_f64::prelude::*;
use rapier3d_f64::utils::OrthonormalBasis;

/// Stiffness of the springs that carry joint torques \[N·m/rad, N/m\].
///
/// The engine takes no generalised force, but it has springs, `−k·(q − rest)`. One that is very soft and
/// stretched very far pulls with the same force wherever the joint goes: over 100 rad it loses 1e-7 N·m.
const SPRING: f64 = 1e-9;

/// The engine's axes that joints slide along and turn about.
const SLIDE: usize = JointAxis::LinX as usize;
const TURN: usize = JointAxis::AngX as usize;

/// A multibody in a physics world of its own.
pub(crate) struct Articulation {
    pub(crate) world: PhysicsWorld,
    index: MultibodyIndex,
    root: RigidBodyHandle,
    /// The rigid body of each body of the tree.
    pub(crate) bodies: Vec<RigidBodyHandle>,
    /// Link of each body of the tree.
    links: Vec<usize>,
    joints: Vec<Joint>,
    /// A floating base's centre of mass in its own frame, where the engine has its origin.
    base_center: Option<Vec3<f64>>,
}

/// One joint of the tree in the engine; those that follow a leader have coordinates of their own here.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Joint {
    link: usize,
    /// [`SLIDE`] or [`TURN`].
    axis: usize,
    /// Its index among the engine's velocities.
    pub(crate) velocity: usize,
    /// The coordinate of the tree that moves it, floating base left out.
    coordinate: usize,
    /// Position = ratio · coordinate + offset.
    pub(crate) ratio: f64,
    offset: f64,
    /// Whether it follows a leader.
    mimic: bool,
}

impl Articulation {
    /// The robot in empty space, with rotors, and with stops at its position limits if wanted.
    pub(crate) fn new(tree: &Tree, rotor_inertia: &[f64], limits: bool) -> Result<Self, BackendError> {
        if tree.joint_count() == 0 {
            return Err(error("a robot without joints is no multibody"));
        }
        let mut world = PhysicsWorld { gravity: Vector::from_array(tree.gravity), ..PhysicsWorld::default() };
        let parameters = &mut world.integration_parameters;
        parameters.max_ccd_substeps = 0;
        parameters.normalized_max_linear_velocity = f64::MAX;
        // Lever arms of this very step, one friction for each contact point.
        parameters.contact_recycling = false;
        parameters.contact_clustering = false;
        parameters.friction_model = FrictionModel::Coulomb;

        let base_center = tree.is_floating().then(|| center_of_mass(&tree.bodies()[0]));
        let ground = match base_center {
            Some(_) => None,
            None => Some(world.bodies.insert(RigidBodyBuilder::fixed())),
        };
        let mut bodies = Vec::with_capacity(tree.bodies().len());
        for body in tree.bodies() {
            let floats = body.joint_type == JointType::Floating;
            let center = if floats { Vec3::zero() } else { center_of_mass(body) };
            let builder = RigidBodyBuilder::dynamic()
                .can_sleep(false)
                .additional_mass_properties(mass_properties(body, center)?);
            let handle = world.bodies.insert(builder);
            world.bodies[handle].recompute_mass_properties_from_colliders(&world.colliders);
            bodies.push(handle);
            if floats {
                continue;
            }
            // Children of a floating base are seen from its centre of mass.
            let (parent, shift) = match body.parent {
                Some(0) => (bodies[0], base_center.unwrap_or(Vec3::zero())),
                Some(parent) => (bodies[parent], Vec3::zero()),
                None => (ground.ok_or_else(|| error("two roots under a floating base"))?, Vec3::zero()),
            };
            let joint = generic_joint(body, shift, limits);
            world
                .multibody_joints
                .insert(parent, handle, joint, true)
                .ok_or_else(|| error(format!("the multibody does not take {}", body.joint)))?;
        }
        let root = ground.unwrap_or(bodies[0]);
        let index = link_of(&world, root)?.multibody;
        let links = bodies
            .iter()
            .map(|&body| link_of(&world, body).map(|link| link.id))
            .collect::<Result<Vec<_>, _>>()?;
        let mut articulation =
            Articulation { world, index, root, bodies, links, joints: Vec::new(), base_center };
        articulation.settle(tree, rotor_inertia)?;
        Ok(articulation)
    }

    /// Damping, armature and indices, once the engine has found out which coordinates there are.
    fn settle(&mut self, tree: &Tree, rotor_inertia: &[f64]) -> Result<(), BackendError> {
        let multibody = multibody_mut(&mut self.world.multibody_joints, self.index)?;
        // Until now a fixed root has six coordinates.
        multibody.forward_kinematics(&self.world.bodies, true);
        multibody.damping_mut().fill(0.0);
        let first_joint = tree.velocity_size() - tree.joint_count();
        for (body, &link) in tree.bodies().iter().zip(&self.links) {
            if body.joint_type == JointType::Floating {
                continue;
            }
            let axis = if body.joint_type == JointType::Prismatic { SLIDE } else { TURN };
            let velocity = multibody
                .link(link)
                .ok_or_else(|| error(format!("the multibody has lost {}", body.link)))?
                .assembly_id();
            let coordinate = body.velocity_index - first_joint;
            if let (false, Some(&inertia)) = (body.mimic, rotor_inertia.get(coordinate)) {
                multibody.armature_mut()[velocity] = inertia;
            }
            let Body { ratio, offset, mimic, .. } = *body;
            self.joints.push(Joint { link, axis, velocity, coordinate, ratio, offset, mimic });
        }
        let coordinates = first_joint + self.joints.len();
        if multibody.ndofs() != coordinates {
            let found = multibody.ndofs();
            return Err(error(format!("the multibody has {found} coordinates, not {coordinates}")));
        }
        Ok(())
    }

    /// Lets mimic joints follow their leaders in steps, by constraints that the engine solves iteratively.
    pub(crate) fn couple_followers(&mut self) -> Result<(), BackendError> {
        let multibody = multibody_mut(&mut self.world.multibody_joints, self.index)?;
        for follower in self.joints.iter().filter(|joint| joint.mimic) {
            let leader = self
                .joints
                .iter()
                .find(|joint| joint.coordinate == follower.coordinate && !joint.mimic)
                .ok_or_else(lost)?;
            multibody.add_dof_coupling(MultibodyDofCoupling {
                link1: leader.link,
                dof1: 0,
                axis1: leader.axis,
                link2: follower.link,
                dof2: 0,
                axis2: follower.axis,
                coeff: follower.ratio,
                offset: follower.offset,
            });
        }
        Ok(())
    }

    /// Whether some joints follow others.
    pub(crate) fn has_followers(&self) -> bool {
        self.joints.iter().any(|joint| joint.mimic)
    }

    /// Number of the engine's coordinates.
    pub(crate) fn engine_size(&self) -> usize {
        self.joints.len() + self.base_center.map_or(0, |_| 6)
    }

    /// The engine's multibody.
    pub(crate) fn multibody(&self) -> Result<&Multibody, BackendError> {
        self.world.multibody_joints.get_multibody(self.index).ok_or_else(lost)
    }

    /// An error if the mass matrix of the last step was singular: the engine goes on with numbers that mean
    /// nothing.
    pub(crate) fn check_mass(&self) -> Result<(), BackendError> {
        let factors = self.multibody()?.inv_augmented_mass().lu_internal();
        let pivots = (0..factors.nrows()).map(|index| factors[(index, index)].abs());
        let (least, most) =
            pivots.fold((f64::INFINITY, 0.0_f64), |(low, high), pivot| (low.min(pivot), high.max(pivot)));
        // Springs leave a trace where there is no mass.
        if least > 1e-15 * most { Ok(()) } else { Err(BackendError::Singular) }
    }

    /// Adds to the inertia of every coordinate of the engine.
    pub(crate) fn add_armature(&mut self, inertia: f64) -> Result<(), BackendError> {
        multibody_mut(&mut self.world.multibody_joints, self.index)?.armature_mut().add_scalar_mut(inertia);
        Ok(())
    }

    /// Puts the robot into a state, without any force.
    pub(crate) fn set_state(&mut self, q: &[f64], v: &[f64]) -> Result<(), BackendError> {
        let (positions, velocities) = (self.joint_part(q, 7), self.joint_part(v, 6));
        let PhysicsWorld { bodies, multibody_joints, .. } = &mut self.world;
        let multibody = multibody_mut(multibody_joints, self.index)?;
        if let Some(center) = self.base_center {
            let Placement { rotation, translation } = base_frame::placement(q);
            let origin = translation + rotation * center;
            let turn = Rotation::from_xyzw(q[3], q[4], q[5], q[6]).normalize();
            let root = bodies.get_mut(self.root).ok_or_else(lost)?;
            root.set_position(Pose::from_parts(Vector::from_array(origin.0), turn), true);
            root.reset_forces(false);
            root.reset_torques(false);
            let velocity = engine_velocity(rotation, center, base_frame::spatial(v));
            base_frame::store(velocity, multibody.generalized_velocity_mut().as_mut_slice());
        }
        for joint in &self.joints {
            let link = multibody.link_mut(joint.link).ok_or_else(lost)?;
            // A new joint starts at zero, so that its position comes out to the bit.
            link.joint = MultibodyJoint::new(link.joint.data, false);
            link.joint.apply_displacement(&[joint.ratio * positions[joint.coordinate] + joint.offset]);
            multibody.generalized_velocity_mut()[joint.velocity] = joint.ratio * velocities[joint.coordinate];
        }
        Ok(())
    }

    /// What follows the `base` elements of a floating base.
    pub(crate) fn joint_part<'a>(&self, all: &'a [f64], base: usize) -> &'a [f64] {
        &all[self.base_center.map_or(0, |_| base)..]
    }

    /// Takes the bodies to where the joints put them. A step does so by itself, but for the shapes that they
    /// carry.
    pub(crate) fn place_bodies(&mut self) -> Result<(), BackendError> {
        self.place_links()?;
        let PhysicsWorld { bodies, multibody_joints, .. } = &mut self.world;
        let multibody = multibody_mut(multibody_joints, self.index)?;
        for link in multibody.links() {
            if let Some(body) = bodies.get_mut(link.rigid_body_handle()) {
                body.set_position(*link.local_to_world(), true);
            }
        }
        Ok(())
    }

    /// The engine's forward kinematics: the poses of its links, and their Jacobians.
    pub(crate) fn place_links(&mut self) -> Result<(), BackendError> {
        let PhysicsWorld { bodies, multibody_joints, .. } = &mut self.world;
        multibody_mut(multibody_joints, self.index)?.forward_kinematics(bodies, true);
        Ok(())
    }

    /// The joint before a body of the tree; none before a floating base.
    pub(crate) fn joint_of(&self, body: usize) -> Option<&Joint> {
        match self.base_center {
            None => self.joints.get(body),
            Some(_) => body.checked_sub(1).and_then(|joint| self.joints.get(joint)),
        }
    }

    /// Pose of a body's link, its centre of mass in the link's frame, and its Jacobian: 6 × the engine's
    /// coordinates, column by column, the velocity of the centre of mass first. All are those of the last
    /// [`Self::place_links`].
    pub(crate) fn link_state(&self, body: usize) -> Result<(&Pose, Vector, &[f64]), BackendError> {
        let (multibody, link) = (self.multibody()?, self.links[body]);
        let pose = multibody.link(link).ok_or_else(lost)?.local_to_world();
        let center = self.world.bodies[self.bodies[body]].local_center_of_mass();
        Ok((pose, center, multibody.body_jacobian(link).as_slice()))
    }

    /// Copies the state out.
    pub(crate) fn state(&self, q: &mut [f64], v: &mut [f64]) -> Result<(), BackendError> {
        let multibody = self.multibody()?;
        let velocities = multibody.generalized_velocity();
        let (first_position, first_joint) = self.base_center.map_or((0, 0), |_| (7, 6));
        if let Some(center) = self.base_center {
            let pose = multibody.root().local_to_world();
            let turn = pose.rotation.normalize();
            let rotation = Mat3::from_quaternion([turn.x, turn.y, turn.z, turn.w]);
            let origin = Vec3(pose.translation.to_array()) - rotation * center;
            q[..3].copy_from_slice(&origin.0);
            q[3..7].copy_from_slice(&[turn.x, turn.y, turn.z, turn.w]);
            let velocity = own_velocity(rotation, center, base_frame::spatial(velocities.as_slice()));
            base_frame::store(velocity, v);
        }
        for joint in self.joints.iter().filter(|joint| !joint.mimic) {
            let link = multibody.link(joint.link).ok_or_else(lost)?;
            q[first_position + joint.coordinate] = link.joint().coords()[joint.axis];
            v[first_joint + joint.coordinate] = velocities[joint.velocity];
        }
        Ok(())
    }

    /// The joints' torques from now on, one for each joint \[N·m, N\].
    pub(crate) fn set_torque(&mut self, torque: &[f64]) -> Result<(), BackendError> {
        let multibody = multibody_mut(&mut self.world.multibody_joints, self.index)?;
        for joint in self.joints.iter().filter(|joint| !joint.mimic) {
            let link = multibody.link_mut(joint.link).ok_or_else(lost)?;
            let rest = link.joint.coords()[joint.axis] + torque[joint.coordinate] / SPRING;
            if !rest.is_finite() {
                return Err(BackendError::Singular);
            }
            link.joint.set_spring(joint.axis, SPRING, rest);
        }
        Ok(())
    }

    /// Pushes a floating base: force and moment about its centre of mass, along the world's axes.
    pub(crate) fn push_base(&mut self, force: Spatial<f64>) -> Result<(), BackendError> {
        let root = self.world.bodies.get_mut(self.root).ok_or_else(lost)?;
        root.add_force(Vector::from_array(force.linear.0), false);
        root.add_torque(Vector::from_array(force.angular.0), false);
        Ok(())
    }

    /// The centre of mass of a floating base, in its frame.
    pub(crate) fn base_center(&self) -> Option<Vec3<f64>> {
        self.base_center
    }

    /// Joint velocities or accelerations for the engine, which has one for followers too.
    pub(crate) fn spread(&self, joints: &[f64], engine: &mut [f64]) {
        for joint in &self.joints {
            engine[joint.velocity] = joint.ratio * joints[joint.coordinate];
        }
    }

    /// Forces on the joint coordinates from the engine's: a leader's with those of its followers.
    pub(crate) fn gather(&self, engine: &[f64], joints: &mut [f64]) {
        joints.fill(0.0);
        for joint in &self.joints {
            joints[joint.coordinate] += joint.ratio * engine[joint.velocity];
        }
    }

    /// Every body with its link.
    pub(crate) fn rigid_bodies(&self) -> impl Iterator<Item = (usize, &RigidBody)> {
        self.links.iter().zip(&self.bodies).map(|(&link, &body)| (link, &self.world.bodies[body]))
    }
}

/// The joint before a body, whose parent's frame is `shift` away from the tree's.
fn generic_joint(body: &Body, shift: Vec3<f64>, limits: bool) -> GenericJoint {
    let (locked, axis) = match body.joint_type {
        JointType::Prismatic => (JointAxesMask::LOCKED_PRISMATIC_AXES, JointAxis::LinX),
        _ => (JointAxesMask::LOCKED_REVOLUTE_AXES, JointAxis::AngX),
    };
    // Both frames have the joint's axis for their x axis.
    let along = Vector::from_array(body.axis.0);
    let [aside, across] = along.orthonormal_basis();
    let turn = Rotation::from_mat3(&Matrix::from_cols(along, aside, across)).normalize();
    let [a, b, c] = body.origin.rotation.transpose().0.map(Vector::from_array);
    let origin = Rotation::from_mat3(&Matrix::from_cols(a, b, c)).normalize();
    let place = Vector::from_array((body.origin.translation - shift).0);
    let mut joint = GenericJoint {
        local_frame1: Pose::from_parts(place, (origin * turn).normalize()),
        local_frame2: Pose::from_rotation(turn),
        locked_axes: locked,
        contacts_enabled: false,
        ..GenericJoint::default()
    };
    let (lower, upper) = (body.limits.lower.max(-f64::MAX), body.limits.upper.min(f64::MAX));
    if limits && body.joint_type != JointType::Continuous && (lower > -f64::MAX || upper < f64::MAX) {
        joint.set_limits(axis, [lower, upper]);
    }
    joint
}

fn link_of(world: &PhysicsWorld, body: RigidBodyHandle) -> Result<MultibodyLinkId, BackendError> {
    world.multibody_joints.rigid_body_link(body).copied().ok_or_else(lost)
}

fn multibody_mut(
    joints: &mut MultibodyJointSet,
    index: MultibodyIndex,
) -> Result<&mut Multibody, BackendError> {
    joints.get_multibody_mut(index).ok_or_else(lost)
}

fn lost() -> BackendError {
    error("the multibody is not in its world")
}
