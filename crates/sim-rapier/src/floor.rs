//! Soles on a floor: shapes for the engine, and the wrench that its contacts gave.

use crate::articulation::Articulation;
use crate::mass_properties::center_of_mass;
use phiw_dynamics::{Body, Placement, Tree, Vec3, World};
use rapier3d_f64::math::Vector;
use rapier3d_f64::na::Unit;
use rapier3d_f64::prelude::*;
use rapier3d_f64::utils::{CrossProduct, OrthonormalBasis};

/// Each corner of a sole is a ball of this radius \[m\] about the corner, and the floor lies as much below `z
/// = 0`: a corner touches when it is at `z = 0`, however the foot is turned.
const CORNER_RADIUS: f64 = 1e-3;

/// Corners touch the floor, not each other.
const CORNERS: Group = Group::GROUP_1;
const FLOOR: Group = Group::GROUP_2;

/// The corners in the engine.
pub(crate) struct Soles {
    corners: Vec<Corner>,
}

struct Corner {
    foot: usize,
    body: usize,
    collider: ColliderHandle,
}

impl Soles {
    /// Puts a floor under the robot and corners under its feet.
    pub(crate) fn new(articulation: &mut Articulation, tree: &Tree, world: &World) -> Self {
        let mut corners = Vec::new();
        if world.feet.is_empty() {
            return Soles { corners };
        }
        let PhysicsWorld { bodies, colliders, .. } = &mut articulation.world;
        let between = |own, other| InteractionGroups::new(own, other, InteractionTestMode::And);
        let floor = ColliderBuilder::halfspace(Unit::new_unchecked(Vector::Z))
            .translation(Vector::new(0.0, 0.0, -CORNER_RADIUS))
            .friction(world.floor_friction)
            .collision_groups(between(FLOOR, CORNERS));
        colliders.insert(floor);
        for (index, foot) in world.feet.iter().enumerate() {
            let body = &tree.bodies()[foot.body];
            let shift = if foot.body == 0 { center_of_mass(body) } else { Vec3::zero() };
            for &corner in &foot.sole {
                let ball = ColliderBuilder::ball(CORNER_RADIUS)
                    .translation(Vector::from_array((Vec3(corner) - shift).0))
                    .density(0.0)
                    .friction(world.floor_friction)
                    .collision_groups(between(CORNERS, FLOOR));
                let collider = colliders.insert_with_parent(ball, articulation.bodies[foot.body], bodies);
                corners.push(Corner { foot: index, body: foot.body, collider });
            }
        }
        Soles { corners }
    }

    /// Force, then moment about the world's origin, that the contacts gave to each foot on average over the
    /// last step of `dt`, which began with the bodies at `placements`.
    ///
    /// The engine gives impulses, added up over its iterations, along the normal and along two tangents that
    /// follow from it, and the lever arms that it used from the body's centre of mass.
    pub(crate) fn wrenches(
        &self,
        articulation: &Articulation,
        bodies: &[Body],
        placements: &[Placement<f64>],
        dt: f64,
        wrenches: &mut [[f64; 6]],
    ) {
        wrenches.fill([0.0; 6]);
        for corner in &self.corners {
            let center = placements[corner.body].point(center_of_mass(&bodies[corner.body]));
            for pair in articulation.world.narrow_phase.contact_pairs_with(corner.collider) {
                let first = pair.collider1 == corner.collider;
                for manifold in pair.manifolds() {
                    // What pushes the first body of the pair.
                    let away = -manifold.data.normal;
                    let aside = away.orthonormal_vector();
                    let across = away.gcross(aside);
                    for contact in &manifold.points {
                        let data = &contact.data;
                        let impulse = away * data.impulse
                            + aside * data.tangent_impulse.x
                            + across * data.tangent_impulse.y;
                        let (force, arm) = if first {
                            (impulse / dt, data.solver_dp1)
                        } else {
                            (-impulse / dt, data.solver_dp2)
                        };
                        let point = Vector::from_array(center.0) + arm;
                        let moment = point.cross(force);
                        let wrench = &mut wrenches[corner.foot];
                        for axis in 0..3 {
                            wrench[axis] += force[axis];
                            wrench[axis + 3] += moment[axis];
                        }
                    }
                }
            }
        }
    }
}
