//! One pass over the bodies: from a motion and inertial parameters to the balance.

use crate::Balance;
use phiw_dynamics::body_kinematics::BodyMotion;
use phiw_dynamics::check::check_size;
use phiw_dynamics::inertia::{Inertia, InertialParameters, PARAMETERS_PER_BODY};
use phiw_dynamics::{BodyKinematics, DimensionError, Placement, Spatial, Vec3};

/// The parameters of everything that stands, in one vector: those of the base link, then those of the moving
/// bodies.
///
/// Joint torques of a robot on a fixed base do not feel its base link, so a [`Tree`](phiw_dynamics::Tree) on
/// a fixed base does not hold it; the ZMP does feel it. `base_link` are its ten standard parameters in the
/// world frame, which is the base's frame; whoever has the URDF finds them as body 0 of the tree that is read
/// with `floating_base`. For a tree that floats, the base is a body like any other: give the parameters of
/// its bodies as they are, this function is not needed.
pub fn standing_parameters(base_link: &InertialParameters, bodies: &[f64]) -> Vec<f64> {
    [base_link, bodies].concat()
}

/// Scratch of the evaluation, for one robot: make it once per thread, use it for every sample.
#[derive(Clone, Debug)]
pub struct ZmpWorkspace {
    pub(crate) motions: Vec<BodyMotion<f64>>,
    pub(crate) placements: Vec<Placement<f64>>,
    loads: Vec<Load>,
    parents: Vec<Option<usize>>,
    floating: bool,
}

/// What a body and all that it carries add up to, in the body's frame.
#[derive(Clone, Copy, Debug)]
struct Load {
    wrench: Spatial<f64>,
    mass: f64,
    /// First moment about the frame's origin.
    moment: Vec3<f64>,
}

impl Load {
    const NONE: Load = Load {
        wrench: Spatial { linear: Vec3([0.0; 3]), angular: Vec3([0.0; 3]) },
        mass: 0.0,
        moment: Vec3([0.0; 3]),
    };

    #[inline(always)]
    fn of_body(parameters: &[f64], motion: &BodyMotion<f64>) -> Self {
        let mut ten = [0.0; PARAMETERS_PER_BODY];
        ten.copy_from_slice(parameters);
        let inertia = Inertia::from_parameters(&ten);
        Load { wrench: inertia.wrench(motion), mass: inertia.mass, moment: inertia.moment }
    }

    /// Adds what a frame inside this one carries.
    #[inline(always)]
    fn add(&mut self, placement: Placement<f64>, inner: Load) {
        self.wrench = self.wrench + placement.force(inner.wrench);
        self.mass += inner.mass;
        self.moment += placement.rotation * inner.moment + placement.translation.scale(inner.mass);
    }
}

/// How many parameters the balance of a robot takes: ten for each body, and ten for the base link unless the
/// base floats.
pub(crate) fn parameter_count(robot: &impl BodyKinematics) -> usize {
    PARAMETERS_PER_BODY * (robot.body_count() + usize::from(!robot.has_floating_base()))
}

/// The base link at rest, as a motion.
pub(crate) fn base_motion(gravity: [f64; 3]) -> BodyMotion<f64> {
    let mut motion = BodyMotion::rest();
    motion.proper_acceleration = -Vec3(gravity);
    motion
}

impl ZmpWorkspace {
    /// Scratch for a robot: `&tree`, or whatever else knows how the robot's bodies hang together.
    pub fn new(robot: impl BodyKinematics) -> Self {
        let bodies = robot.body_count();
        ZmpWorkspace {
            motions: vec![BodyMotion::rest(); bodies],
            placements: vec![Placement::identity(); bodies],
            loads: vec![Load::NONE; bodies],
            parents: (0..bodies).map(|body| robot.body_joint(body).parent).collect(),
            floating: robot.has_floating_base(),
        }
    }

    /// The balance of the motion `(q, v, a)` \[rad, m, s\] for the standard parameters `parameters`.
    ///
    /// `robot` is the one that this scratch is for: `&tree`, or `&mut backend` of another library, whose own
    /// kinematics are then used. `q`, `v`, `a` are its coordinates (see [`BodyKinematics`]). `parameters` are
    /// ten for each body, in the order and frames of the robot's bodies (for a tree: of
    /// [`Tree::inertial_parameters`](phiw_dynamics::Tree::inertial_parameters)), with the base link's ten
    /// before them on a fixed base ([`standing_parameters`]); those that the robot itself may hold are not
    /// looked at. One inverse dynamics that carries mass and first moment along; allocates nothing.
    ///
    /// # Errors
    /// A slice or this workspace does not fit the robot, or the robot's motion can not be computed.
    pub fn evaluate<K: BodyKinematics>(
        &mut self,
        mut robot: K,
        parameters: &[f64],
        q: &[f64],
        v: &[f64],
        a: &[f64],
    ) -> Result<Balance, K::Error> {
        self.check(&robot)?;
        check_size("the standing parameters", parameters.len(), self.parameter_count())?;
        robot.body_motions(q, v, a, &mut self.motions)?;
        Ok(self.sum(parameters, robot.gravity()))
    }

    /// The balance of the motions that are in the scratch.
    fn sum(&mut self, parameters: &[f64], gravity: [f64; 3]) -> Balance {
        let (mut total, bodies) = if self.floating {
            (Load::NONE, parameters)
        } else {
            let (base, bodies) = parameters.split_at(PARAMETERS_PER_BODY);
            (Load::of_body(base, &base_motion(gravity)), bodies)
        };
        let parts = bodies.chunks_exact(PARAMETERS_PER_BODY).zip(&self.motions);
        for (load, (parameters, motion)) in self.loads.iter_mut().zip(parts) {
            *load = Load::of_body(parameters, motion);
        }
        for index in (0..self.loads.len()).rev() {
            let carried = self.loads[index];
            let outer = match self.parents[index] {
                Some(parent) => &mut self.loads[parent],
                None => &mut total,
            };
            outer.add(self.motions[index].placement, carried);
        }
        let ([fx, fy, fz], [mx, my, mz]) = (total.wrench.linear.0, total.wrench.angular.0);
        Balance::of_sums(total.mass, total.moment.0, [fx, fy, fz, mx, my, mz], gravity)
    }

    /// How many parameters the balance takes, as [`parameter_count`].
    pub(crate) fn parameter_count(&self) -> usize {
        PARAMETERS_PER_BODY * (self.motions.len() + usize::from(!self.floating))
    }

    pub(crate) fn has_floating_base(&self) -> bool {
        self.floating
    }

    pub(crate) fn check(&self, robot: &impl BodyKinematics) -> Result<(), DimensionError> {
        check_size("the ZMP workspace", self.motions.len(), robot.body_count())
    }

    /// Motions and world placements of all bodies.
    pub(crate) fn place<K: BodyKinematics>(
        &mut self,
        robot: &mut K,
        q: &[f64],
        v: &[f64],
        a: &[f64],
    ) -> Result<(), K::Error> {
        robot.body_motions(q, v, a, &mut self.motions)?;
        self.place_in_world();
        Ok(())
    }

    fn place_in_world(&mut self) {
        for (index, parent) in self.parents.iter().enumerate() {
            let local = self.motions[index].placement;
            self.placements[index] = parent.map_or(local, |parent| self.placements[parent].compose(local));
        }
    }
}
