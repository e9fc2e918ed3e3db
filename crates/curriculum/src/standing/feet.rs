//! Feet that stay on the floor: the loop that they close, and what they carry.

use crate::CurriculumError;
use faer::Mat;
use faer::prelude::Solve;
use phiw_dynamics::{BodyMotion, DimensionError, Foot, Mat3, Placement, Tree, Vec3, check_index, check_size};

/// Newton steps at most, and the gap between sole and floor at which the loop counts as closed \[m, rad\].
const MOST_STEPS: usize = 30;
const CLOSED: f64 = 1e-13;
/// What rounding may leave of it.
const NEARLY_CLOSED: f64 = 1e-10;
/// Longest Newton step \[m, rad\].
const LONGEST: f64 = 0.3;
/// Lever by which moments at a foot count beside its forces when a load is shared \[m\]: half of a foot's
/// width.
const LEVER_M: f64 = 0.05;

/// A foot that stays where it is.
#[derive(Clone, Debug)]
pub struct StandingFoot {
    /// Its body in the tree with virtual joints.
    pub body: usize,
    /// Middle of its sole, in the body's frame \[m\].
    pub sole: Vec3<f64>,
    /// Where the body is.
    pub placement: Placement<f64>,
}

/// All feet of a robot that stands.
#[derive(Clone, Debug)]
pub struct Feet {
    tree: Tree,
    feet: Vec<StandingFoot>,
}

impl Feet {
    /// `feet` (their bodies counted in `tree`, which has virtual joints) where the configuration `q` puts
    /// them.
    ///
    /// # Errors
    /// The configuration does not fit the tree, or a foot's body is none of it.
    pub fn new(tree: &Tree, feet: &[Foot], q: &[f64]) -> Result<Self, DimensionError> {
        let mut placements = vec![Placement::identity(); tree.bodies().len()];
        tree.forward_kinematics(q, &mut placements)?;
        feet.iter().try_for_each(|foot| check_index("body", foot.body, placements.len()))?;
        let standing = |foot: &Foot| {
            let sum = foot.sole.iter().fold(Vec3::zero(), |sum, &corner| sum + Vec3(corner));
            let sole = sum.scale(1.0 / foot.sole.len().max(1) as f64);
            StandingFoot { body: foot.body, sole, placement: placements[foot.body] }
        };
        Ok(Feet { tree: tree.clone(), feet: feet.iter().map(standing).collect() })
    }

    /// The feet.
    pub fn all(&self) -> &[StandingFoot] {
        &self.feet
    }

    /// The tree that they belong to.
    pub fn tree(&self) -> &Tree {
        &self.tree
    }

    /// The joints between the base and a foot.
    pub fn leg(&self, foot: usize) -> Vec<usize> {
        let mut joints = Vec::new();
        let mut next = Some(self.feet[foot].body);
        while let Some(body) = next.filter(|&body| body > 5) {
            joints.push(self.tree.bodies()[body].velocity_index);
            next = self.tree.bodies()[body].parent;
        }
        joints.reverse();
        joints
    }

    /// Velocity of the soles' middles and angular velocity of the feet (six rows a foot, along the world's
    /// axes) for unit velocities of all joints.
    fn jacobian(&self, placements: &[Placement<f64>], feet: &[usize]) -> Result<Mat<f64>, DimensionError> {
        let size = self.tree.velocity_size();
        let mut rows = vec![0.0; 6 * size];
        let mut jacobian = Mat::zeros(6 * feet.len(), size);
        for (place, &foot) in feet.iter().enumerate() {
            let StandingFoot { body, sole, .. } = self.feet[foot];
            self.tree.point_jacobian(placements, body, sole, &mut rows)?;
            for row in 0..6 {
                for column in 0..size {
                    jacobian[(6 * place + row, column)] = rows[row * size + column];
                }
            }
        }
        Ok(jacobian)
    }

    /// Changes the coordinates `unknown` of `[q, v, a]` so that these `feet` stay where they are: six
    /// coordinates for each. What is in them at first is where the search begins.
    ///
    /// # Errors
    /// The feet can not be there.
    pub fn close(
        &self,
        unknown: &[usize],
        feet: &[usize],
        [q, v, a]: [&mut [f64]; 3],
    ) -> Result<(), CurriculumError> {
        check_size("coordinates that close a loop", unknown.len(), 6 * feet.len())?;
        let mut placements = vec![Placement::identity(); self.tree.bodies().len()];
        let mut last = f64::INFINITY;
        let (mut jacobian, mut own);
        let mut step = 0;
        loop {
            self.tree.forward_kinematics(q, &mut placements)?;
            jacobian = self.jacobian(&placements, feet)?;
            own = Mat::from_fn(unknown.len(), unknown.len(), |row, column| jacobian[(row, unknown[column])])
                .partial_piv_lu();
            let gap = self.gap(&placements, feet);
            let size = gap.norm_max();
            if size < CLOSED || (size >= last && size < NEARLY_CLOSED) {
                break;
            }
            if step == MOST_STEPS || !size.is_finite() {
                let problem = format!("its feet can not stay on the floor: {size:.1e} m or rad are left");
                return Err(CurriculumError::Motion { name: "of a robot on its feet".to_owned(), problem });
            }
            let change = own.solve(&gap);
            let shorter = (LONGEST / change.norm_max()).min(1.0);
            unknown.iter().enumerate().for_each(|(row, &joint)| q[joint] += shorter * change[(row, 0)]);
            last = size;
            step += 1;
        }
        unknown.iter().for_each(|&joint| (v[joint], a[joint]) = (0.0, 0.0));
        let column = |values: &[f64]| Mat::from_fn(values.len(), 1, |row, _| values[row]);
        let speeds = own.solve(&jacobian * column(v));
        unknown.iter().enumerate().for_each(|(row, &joint)| v[joint] = -speeds[(row, 0)]);
        let accelerations = own.solve(self.acceleration(&placements, feet, [q, v, a]));
        unknown.iter().enumerate().for_each(|(row, &joint)| a[joint] = -accelerations[(row, 0)]);
        Ok(())
    }

    /// Speed of the fastest sole \[m/s\] and of the fastest turn of a foot \[rad/s\].
    ///
    /// # Errors
    /// A slice does not fit the robot.
    pub fn speeds(&self, q: &[f64], v: &[f64]) -> Result<[f64; 2], DimensionError> {
        check_size("the velocity v", v.len(), self.tree.velocity_size())?;
        let mut placements = vec![Placement::identity(); self.tree.bodies().len()];
        self.tree.forward_kinematics(q, &mut placements)?;
        let feet: Vec<usize> = (0..self.feet.len()).collect();
        let velocity = Mat::from_fn(v.len(), 1, |row, _| v[row]);
        let moving = self.jacobian(&placements, &feet)? * velocity;
        let mut fastest = [0.0_f64; 2];
        for half in 0..2 * feet.len() {
            let speed = (0..3).map(|axis| moving[(3 * half + axis, 0)].powi(2)).sum::<f64>().sqrt();
            fastest[half % 2] = fastest[half % 2].max(speed);
        }
        Ok(fastest)
    }

    /// How far the feet are from their places.
    fn gap(&self, placements: &[Placement<f64>], feet: &[usize]) -> Mat<f64> {
        let mut gap = Mat::zeros(6 * feet.len(), 1);
        for (place, &foot) in feet.iter().enumerate() {
            let StandingFoot { body, sole, placement } = self.feet[foot];
            let shift = placement.point(sole) - placements[body].point(sole);
            let Mat3(turn) = placement.rotation * placements[body].rotation.transpose();
            let turn = [turn[2][1] - turn[1][2], turn[0][2] - turn[2][0], turn[1][0] - turn[0][1]];
            for axis in 0..3 {
                gap[(6 * place + axis, 0)] = shift.0[axis];
                gap[(6 * place + 3 + axis, 0)] = 0.5 * turn[axis];
            }
        }
        gap
    }

    /// Acceleration of the soles' middles and angular acceleration of the feet, along the world's axes.
    fn acceleration(
        &self,
        placements: &[Placement<f64>],
        feet: &[usize],
        [q, v, a]: [&[f64]; 3],
    ) -> Mat<f64> {
        let mut motions = vec![BodyMotion::rest(); self.tree.bodies().len()];
        self.tree.body_motions(q, v, a, &mut motions);
        let mut accelerations = Mat::zeros(6 * feet.len(), 1);
        for (place, &foot) in feet.iter().enumerate() {
            let StandingFoot { body, sole, .. } = self.feet[foot];
            let BodyMotion {
                angular_velocity: omega, angular_acceleration: alpha, proper_acceleration, ..
            } = motions[body];
            let own = proper_acceleration + alpha.cross(sole) + omega.cross(omega.cross(sole));
            let rotation = placements[body].rotation;
            let (linear, angular) = (rotation * own + Vec3(self.tree.gravity), rotation * alpha);
            for axis in 0..3 {
                accelerations[(6 * place + axis, 0)] = linear.0[axis];
                accelerations[(6 * place + 3 + axis, 0)] = angular.0[axis];
            }
        }
        accelerations
    }

    /// Adds J_cᵀ·f to the generalised force `force`, for what the floor gives to each foot: force, then
    /// moment about the world's origin.
    ///
    /// # Errors
    /// A slice does not fit the robot.
    pub fn add_load(
        &self,
        q: &[f64],
        wrenches: &[[f64; 6]],
        force: &mut [f64],
    ) -> Result<(), DimensionError> {
        check_size("wrenches of the feet", wrenches.len(), self.feet.len())?;
        check_size("the generalised force", force.len(), self.tree.velocity_size())?;
        let mut placements = vec![Placement::identity(); self.tree.bodies().len()];
        self.tree.forward_kinematics(q, &mut placements)?;
        let feet: Vec<usize> = (0..self.feet.len()).collect();
        let jacobian = self.jacobian(&placements, &feet)?;
        for (index, (foot, &[fx, fy, fz, mx, my, mz])) in self.feet.iter().zip(wrenches).enumerate() {
            let about = placements[foot.body].point(foot.sole);
            let push = Vec3([fx, fy, fz]);
            let turn = Vec3([mx, my, mz]) - about.cross(push);
            for (joint, force) in force.iter_mut().enumerate() {
                for axis in 0..3 {
                    *force += jacobian[(6 * index + axis, joint)] * push.0[axis]
                        + jacobian[(6 * index + 3 + axis, joint)] * turn.0[axis];
                }
            }
        }
        Ok(())
    }

    /// Takes from the generalised force `force` what the feet carry of it: the virtual joints keep nothing,
    /// and of all shares between the feet that is taken which asks least of them, moments counted over half
    /// of a foot's width. What is left is the torque of the motors.
    ///
    /// # Errors
    /// A slice does not fit the robot.
    pub fn take_load(&self, q: &[f64], force: &mut [f64]) -> Result<(), DimensionError> {
        check_size("the generalised force", force.len(), self.tree.velocity_size())?;
        let mut placements = vec![Placement::identity(); self.tree.bodies().len()];
        self.tree.forward_kinematics(q, &mut placements)?;
        let feet: Vec<usize> = (0..self.feet.len()).collect();
        let jacobian = self.jacobian(&placements, &feet)?;
        let cheapness = |row: usize| if row % 6 < 3 { 1.0 } else { LEVER_M * LEVER_M };
        let weighted =
            Mat::from_fn(jacobian.nrows(), 6, |row, column| cheapness(row) * jacobian[(row, column)]);
        let gram = jacobian.get(.., ..6).transpose() * &weighted;
        let needed = Mat::from_fn(6, 1, |row, _| force[row]);
        let load = weighted * gram.partial_piv_lu().solve(needed);
        let carried = jacobian.transpose() * load;
        force.iter_mut().enumerate().for_each(|(row, force)| *force -= carried[(row, 0)]);
        Ok(())
    }
}
