//! One pass over the bodies: from a motion and inertial parameters to the balance.

use crate::Balance;
use phiw_dynamics::{
    BodyMotion, DimensionError, Inertia, InertialParameters, JointType, PARAMETERS_PER_BODY, Placement,
    Spatial, Tree, Vec3, check_size,
};

/// The parameters of everything that stands, in one vector: those of the base link, then those of the moving bodies.
///
/// Joint torques of a robot on a fixed base do not feel its base link, so a [`Tree`] on a fixed base does not hold it; the ZMP does
/// feel it. `base_link` are its ten standard parameters in the world frame, which is the base's frame; whoever has the URDF
/// finds them as body 0 of the tree that is read with `floating_base`. For a tree that floats, the base is a body like any other: give the
/// parameters of its bodies as they are, this function is not needed.
pub fn standing_parameters(base_link: &InertialParameters, bodies: &[f64]) -> Vec<f64> {
    [base_link, bodies].concat()
}

/// Scratch of the evaluation, for one robot: make it once per thread, use it for every sample.
#[derive(Clone, Debug)]
pub struct ZmpWorkspace {
    pub(crate) motions: Vec<BodyMotion<f64>>,
    pub(crate) placements: Vec<Placement<f64>>,
    loads: Vec<Load>,
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

/// How many parameters the balance of a robot takes: ten for each body, and ten for the base link unless the base floats.
pub(crate) fn parameter_count(tree: &Tree) -> usize {
    PARAMETERS_PER_BODY * (tree.bodies().len() + usize::from(!tree.is_floating()))
}

/// The base link at rest, as a motion.
pub(crate) fn base_motion(tree: &Tree) -> BodyMotion<f64> {
    let mut motion = BodyMotion::rest();
    motion.proper_acceleration = -Vec3(tree.gravity);
    motion
}

pub(crate) fn check_motion(tree: &Tree, q: &[f64], v: &[f64], a: &[f64]) -> Result<(), DimensionError> {
    check_size("the configuration q", q.len(), tree.configuration_size())?;
    check_size("the velocity v", v.len(), tree.velocity_size())?;
    check_size("the acceleration a", a.len(), tree.velocity_size())
}

impl ZmpWorkspace {
    /// Scratch for `tree`.
    pub fn new(tree: &Tree) -> Self {
        let bodies = tree.bodies().len();
        ZmpWorkspace {
            motions: vec![BodyMotion::rest(); bodies],
            placements: vec![Placement::identity(); bodies],
            loads: vec![Load::NONE; bodies],
        }
    }

    /// The balance of the motion `(q, v, a)` \[rad, m, s\] for the standard parameters `parameters`.
    ///
    /// `q`, `v`, `a` are those of [`Tree::inverse_dynamics`]. `parameters` are in the order and frames of [`Tree::inertial_parameters`],
    /// with the base link's ten before them on a fixed base ([`standing_parameters`]); those of `tree` itself are
    /// not looked at. One inverse dynamics that carries mass and first moment along; allocates nothing.
    ///
    /// # Errors
    /// A slice or this workspace does not fit the robot.
    pub fn evaluate(
        &mut self,
        tree: &Tree,
        parameters: &[f64],
        q: &[f64],
        v: &[f64],
        a: &[f64],
    ) -> Result<Balance, DimensionError> {
        check_motion(tree, q, v, a)?;
        check_size("the standing parameters", parameters.len(), parameter_count(tree))?;
        self.check(tree)?;
        tree.body_motions(q, v, a, &mut self.motions);
        let (mut total, bodies) = if tree.is_floating() {
            (Load::NONE, parameters)
        } else {
            let (base, bodies) = parameters.split_at(PARAMETERS_PER_BODY);
            (Load::of_body(base, &base_motion(tree)), bodies)
        };
        let parts = bodies.chunks_exact(PARAMETERS_PER_BODY).zip(&self.motions);
        for (load, (parameters, motion)) in self.loads.iter_mut().zip(parts) {
            *load = Load::of_body(parameters, motion);
        }
        for (index, body) in tree.bodies().iter().enumerate().rev() {
            let carried = self.loads[index];
            let outer = match body.parent {
                Some(parent) => &mut self.loads[parent],
                None => &mut total,
            };
            outer.add(self.motions[index].placement, carried);
        }
        let ([fx, fy, fz], [mx, my, mz]) = (total.wrench.linear.0, total.wrench.angular.0);
        Ok(Balance::of_sums(total.mass, total.moment.0, [fx, fy, fz, mx, my, mz], tree.gravity))
    }

    pub(crate) fn check(&self, tree: &Tree) -> Result<(), DimensionError> {
        check_size("the ZMP workspace", self.motions.len(), tree.bodies().len())
    }

    /// Motions and world placements of all bodies.
    pub(crate) fn place(&mut self, tree: &Tree, q: &[f64], v: &[f64], a: &[f64]) {
        tree.body_motions(q, v, a, &mut self.motions);
        for (index, body) in tree.bodies().iter().enumerate() {
            let local = self.motions[index].placement;
            debug_assert!(body.joint_type != JointType::Floating || body.parent.is_none());
            self.placements[index] = match body.parent {
                Some(parent) => self.placements[parent].compose(local),
                None => local,
            };
        }
    }
}
