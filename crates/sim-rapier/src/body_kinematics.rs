//! How bodies move, by the engine's own kinematics: the poses of its links and their Jacobians.
//!
//! The engine keeps the accelerations of its links to itself. Here they follow from what it shows: a link's
//! velocity is its Jacobian times the joints' velocities, and what a joint adds to the motion of its parent
//! is its own column of that Jacobian.

use crate::articulation::Articulation;
use crate::base_frame::{self, engine_acceleration};
use phiw_dynamics::body_kinematics::{BodyJoint, BodyMotion, MotionSubspace};
use phiw_dynamics::{BackendError, Mat3, Placement, Spatial, Tree, Vec3};

/// The joints before the bodies, and scratch.
pub(crate) struct LinkMotions {
    joints: Vec<BodyJoint>,
    gravity: [f64; 3],
    /// Velocities and accelerations of the engine's coordinates.
    rates: [Vec<f64>; 2],
    bodies: Vec<InWorld>,
}

/// The motion of a body's frame, along the world's axes.
#[derive(Clone, Copy)]
struct InWorld {
    placement: Placement<f64>,
    angular_velocity: Vec3<f64>,
    angular_acceleration: Vec3<f64>,
    /// Of the frame's origin.
    acceleration: Vec3<f64>,
}

impl InWorld {
    /// The world itself.
    fn still() -> Self {
        InWorld {
            placement: Placement::identity(),
            angular_velocity: Vec3::zero(),
            angular_acceleration: Vec3::zero(),
            acceleration: Vec3::zero(),
        }
    }
}

impl LinkMotions {
    /// Asks the engine, which is left in another state, for the axes of its joints.
    pub(crate) fn new(tree: &Tree, engine: &mut Articulation) -> Result<Self, BackendError> {
        let (q, v) = (tree.neutral_configuration(), vec![0.0; tree.velocity_size()]);
        engine.set_state(&q, &v)?;
        engine.place_links()?;
        let mut joints = Vec::with_capacity(tree.bodies().len());
        for (index, body) in tree.bodies().iter().enumerate() {
            let motion_subspace = match engine.joint_of(index) {
                None => MotionSubspace::Floating,
                Some(joint) => {
                    let link = Link::of(engine, index)?;
                    let along = link.own_motion(joint.velocity).scale(joint.ratio);
                    MotionSubspace::Axis(Spatial {
                        linear: link.rotation.transpose_mul(along.linear),
                        angular: link.rotation.transpose_mul(along.angular),
                    })
                }
            };
            let (parent, velocity_index) = (body.parent, body.velocity_index);
            joints.push(BodyJoint { parent, velocity_index, motion_subspace });
        }
        let rates = || vec![0.0; engine.engine_size()];
        Ok(LinkMotions {
            bodies: vec![InWorld::still(); joints.len()],
            joints,
            gravity: tree.gravity,
            rates: [rates(), rates()],
        })
    }

    pub(crate) fn joints(&self) -> &[BodyJoint] {
        &self.joints
    }

    /// The motions of all bodies. Sizes are the caller's duty; the engine is left in the state asked for.
    pub(crate) fn compute(
        &mut self,
        engine: &mut Articulation,
        [q, v, a]: [&[f64]; 3],
        motions: &mut [BodyMotion<f64>],
    ) -> Result<(), BackendError> {
        engine.set_state(q, v)?;
        engine.place_links()?;
        let LinkMotions { joints, gravity, rates: [velocities, accelerations], bodies } = self;
        velocities.copy_from_slice(engine.multibody()?.generalized_velocity().as_slice());
        engine.spread(engine.joint_part(a, 6), accelerations);
        for (index, joint) in joints.iter().enumerate() {
            let link = Link::of(engine, index)?;
            bodies[index] = match (engine.joint_of(index), engine.base_center()) {
                (Some(own), _) => {
                    let parent = joint.parent.map_or(InWorld::still(), |parent| bodies[parent]);
                    let rates = [velocities[own.velocity], accelerations[own.velocity]];
                    link.motion_behind(&parent, own.velocity, velocities, rates)
                }
                (None, Some(center)) => floating_motion(&link, center, v, a),
                (None, None) => InWorld::still(),
            };
        }
        for (motion, (body, joint)) in motions.iter_mut().zip(bodies.iter().zip(joints.iter())) {
            let own = body.placement.rotation;
            *motion = BodyMotion {
                placement: match joint.parent {
                    Some(parent) => bodies[parent].placement.inverse().compose(body.placement),
                    None => body.placement,
                },
                angular_velocity: own.transpose_mul(body.angular_velocity),
                angular_acceleration: own.transpose_mul(body.angular_acceleration),
                proper_acceleration: own.transpose_mul(body.acceleration - Vec3(*gravity)),
            };
        }
        Ok(())
    }
}

/// A link of the engine where it stands.
struct Link<'a> {
    rotation: Mat3<f64>,
    origin: Vec3<f64>,
    /// From the origin to the centre of mass, about which the engine takes its Jacobian, along the world's
    /// axes.
    lever: Vec3<f64>,
    /// 6 × the engine's coordinates, column by column, linear first.
    jacobian: &'a [f64],
}

impl<'a> Link<'a> {
    fn of(engine: &'a Articulation, body: usize) -> Result<Self, BackendError> {
        let (pose, center, jacobian) = engine.link_state(body)?;
        let turn = pose.rotation;
        let rotation = Mat3::from_quaternion([turn.x, turn.y, turn.z, turn.w]);
        let origin = Vec3(pose.translation.to_array());
        Ok(Link { rotation, origin, lever: rotation * Vec3(center.to_array()), jacobian })
    }

    fn column(&self, coordinate: usize) -> Spatial<f64> {
        base_frame::spatial(&self.jacobian[6 * coordinate..])
    }

    /// What a coordinate's unit velocity gives to the frame's origin, along the world's axes.
    fn own_motion(&self, coordinate: usize) -> Spatial<f64> {
        let Spatial { linear, angular } = self.column(coordinate);
        Spatial { linear: linear - angular.cross(self.lever), angular }
    }

    /// The motion of the link behind its joint, whose velocity and acceleration are `rates`.
    fn motion_behind(
        &self,
        parent: &InWorld,
        coordinate: usize,
        velocities: &[f64],
        [velocity, acceleration]: [f64; 2],
    ) -> InWorld {
        let angular_velocity = (0..velocities.len())
            .fold(Vec3::zero(), |sum, column| sum + self.column(column).angular.scale(velocities[column]));
        let own = self.own_motion(coordinate);
        let arm = self.origin - parent.placement.translation;
        let carried = parent.angular_velocity;
        InWorld {
            placement: Placement { rotation: self.rotation, translation: self.origin },
            angular_velocity,
            angular_acceleration: parent.angular_acceleration
                + own.angular.scale(acceleration)
                + carried.cross(own.angular.scale(velocity)),
            acceleration: parent.acceleration
                + parent.angular_acceleration.cross(arm)
                + carried.cross(carried.cross(arm))
                + carried.cross(own.linear.scale(2.0 * velocity))
                + own.linear.scale(acceleration),
        }
    }
}

/// The motion of a floating base: the engine's origin is its centre of mass, `center` in the base's frame.
fn floating_motion(link: &Link<'_>, center: Vec3<f64>, v: &[f64], a: &[f64]) -> InWorld {
    let (velocity, acceleration) = (base_frame::spatial(v), base_frame::spatial(a));
    let moved = engine_acceleration(link.rotation, center, velocity, acceleration);
    let angular_velocity = link.rotation * velocity.angular;
    let back = -(link.rotation * center);
    InWorld {
        placement: Placement { rotation: link.rotation, translation: link.origin + back },
        angular_velocity,
        angular_acceleration: moved.angular,
        acceleration: moved.linear
            + moved.angular.cross(back)
            + angular_velocity.cross(angular_velocity.cross(back)),
    }
}
