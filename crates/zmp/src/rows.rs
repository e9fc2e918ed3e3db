//! The balance as a linear map of the parameters: what they are uncertain by, the ZMP is uncertain by.

use crate::workspace::{base_motion, parameter_count};
use crate::{Balance, ZmpModel, ZmpWorkspace};
use phiw_dynamics::body_kinematics::BodyMotion;
use phiw_dynamics::check::check_size;
use phiw_dynamics::inertia::PARAMETERS_PER_BODY;
use phiw_dynamics::{BodyKinematics, DimensionError, Placement, Spatial, Vec3};

/// Rows of first moment, force and moment.
const ROWS: usize = 9;

/// Y of one sample: mass, first moment and the floor's wrench are Y·w, with w the standing parameters.
///
/// Rows, each of [`BalanceRows::parameter_count`] numbers: first moment x, y, z \[kg·m\]; then the wrench
/// about the world's origin, force x, y, z \[N\] and moment x, y, z \[N·m\]. (The mass needs no row: it is
/// the sum of every tenth parameter.)
#[derive(Clone, Debug)]
pub struct BalanceRows {
    parameters: usize,
    rows: Vec<f64>,
    gravity: [f64; 3],
}

impl BalanceRows {
    /// Room for the rows of one sample of a robot: `&tree`, or whatever else knows how the robot's bodies
    /// hang together.
    pub fn new(robot: impl BodyKinematics) -> Self {
        let parameters = parameter_count(&robot);
        BalanceRows { parameters, rows: vec![0.0; ROWS * parameters], gravity: robot.gravity() }
    }

    /// Number of standing parameters: ten for each body, and ten for the base link unless the base floats.
    pub fn parameter_count(&self) -> usize {
        self.parameters
    }

    /// The rows of the wrench, row by row: 6 × [`Self::parameter_count`].
    pub fn wrench(&self) -> &[f64] {
        &self.rows[3 * self.parameters..]
    }

    /// The rows of the first moment \[kg·m\], row by row: 3 × [`Self::parameter_count`].
    pub fn first_moment(&self) -> &[f64] {
        &self.rows[..3 * self.parameters]
    }

    /// Fills in the rows of the motion `(q, v, a)`, as in [`ZmpWorkspace::evaluate`]; allocates nothing.
    ///
    /// # Errors
    /// A slice, the workspace or these rows do not fit the robot, or the robot's motion can not be computed.
    pub fn compute<K: BodyKinematics>(
        &mut self,
        mut robot: K,
        q: &[f64],
        v: &[f64],
        a: &[f64],
        workspace: &mut ZmpWorkspace,
    ) -> Result<(), K::Error> {
        workspace.check(&robot)?;
        check_size("the balance rows", self.parameters, workspace.parameter_count())?;
        workspace.place(&mut robot, q, v, a)?;
        self.gravity = robot.gravity();
        self.fill(workspace);
        Ok(())
    }

    /// The rows of the motion that is in the workspace.
    fn fill(&mut self, workspace: &ZmpWorkspace) {
        let mut start = 0;
        if !workspace.has_floating_base() {
            self.body(start, Placement::identity(), &base_motion(self.gravity));
            start += PARAMETERS_PER_BODY;
        }
        for (placement, motion) in workspace.placements.iter().zip(&workspace.motions) {
            self.body(start, *placement, motion);
            start += PARAMETERS_PER_BODY;
        }
    }

    /// The ten columns of a body: in its frame force = m a + α × mc + ω × (ω × mc), moment = mc × a + I α + ω
    /// × I ω.
    #[inline(always)]
    fn body(&mut self, start: usize, placement: Placement<f64>, motion: &BodyMotion<f64>) {
        let (omega, alpha) = (motion.angular_velocity, motion.angular_acceleration);
        let acceleration = motion.proper_acceleration;
        let zero = Vec3::zero();
        let unit = |axis: usize| {
            let mut unit = [0.0; 3];
            unit[axis] = 1.0;
            Vec3(unit)
        };
        self.column(start, placement.translation, placement, acceleration, zero);
        for axis in 0..3 {
            let e = unit(axis);
            let force = alpha.cross(e) + omega.cross(omega.cross(e));
            self.column(start + 1 + axis, placement.rotation * e, placement, force, e.cross(acceleration));
        }
        // Ixx, Ixy, Iyy, Ixz, Iyz, Izz.
        for (element, [row, column]) in
            [[0, 0], [0, 1], [1, 1], [0, 2], [1, 2], [2, 2]].into_iter().enumerate()
        {
            let times = |x: Vec3<f64>| {
                let mut product = [0.0; 3];
                product[row] = x.0[column];
                product[column] = x.0[row];
                Vec3(product)
            };
            let moment = times(alpha) + omega.cross(times(omega));
            self.column(start + 4 + element, zero, placement, zero, moment);
        }
    }

    #[inline(always)]
    fn column(
        &mut self,
        index: usize,
        first_moment: Vec3<f64>,
        placement: Placement<f64>,
        force: Vec3<f64>,
        moment: Vec3<f64>,
    ) {
        let wrench = placement.force(Spatial { linear: force, angular: moment });
        for axis in 0..3 {
            self.rows[axis * self.parameters + index] = first_moment.0[axis];
            self.rows[(3 + axis) * self.parameters + index] = wrench.linear.0[axis];
            self.rows[(6 + axis) * self.parameters + index] = wrench.angular.0[axis];
        }
    }

    /// The balance of this sample for the standing parameters `parameters`: the same as
    /// [`ZmpWorkspace::evaluate`], quicker where many parameters are tried on one sample.
    ///
    /// # Errors
    /// `parameters` do not fit the robot.
    pub fn balance(&self, parameters: &[f64]) -> Result<Balance, DimensionError> {
        check_size("the standing parameters", parameters.len(), self.parameters)?;
        let mut sums = [0.0; ROWS];
        for (sum, row) in sums.iter_mut().zip(self.rows.chunks_exact(self.parameters)) {
            *sum = row.iter().zip(parameters).map(|(y, w)| y * w).sum();
        }
        let mass = parameters.iter().step_by(PARAMETERS_PER_BODY).sum();
        let [hx, hy, hz, fx, fy, fz, mx, my, mz] = sums;
        Ok(Balance::of_sums(mass, [hx, hy, hz], [fx, fy, fz, mx, my, mz], self.gravity))
    }

    /// ∂ZMP/∂w at the balance `balance` of this sample: row x, then row y, each of [`Self::parameter_count`]
    /// numbers \[m per unit of the parameter\], into `gradient`. Returns the ZMP; none, with `gradient` zero,
    /// where there is none.
    ///
    /// The floor is `z = floor_height` \[m\]. Allocates nothing.
    ///
    /// # Errors
    /// `gradient` does not fit.
    pub fn zmp_gradient(
        &self,
        model: ZmpModel,
        balance: &Balance,
        floor_height: f64,
        gradient: &mut [f64],
    ) -> Result<Option<[f64; 2]>, DimensionError> {
        check_size("the ZMP's gradient", gradient.len(), 2 * self.parameters)?;
        gradient.fill(0.0);
        let Some(zmp) = balance.zmp(model, floor_height) else { return Ok(None) };
        let force_z = balance.wrench[2];
        let row = |row: usize| &self.rows[row * self.parameters..(row + 1) * self.parameters];
        for (axis, gradient) in gradient.chunks_exact_mut(self.parameters).enumerate() {
            match model {
                // f_z·x = l_z f_x − m_y, f_z·y = l_z f_y + m_x.
                ZmpModel::MultiBody => {
                    let (sign, moment) = if axis == 0 { (-1.0, row(7)) } else { (1.0, row(6)) };
                    for (index, entry) in gradient.iter_mut().enumerate() {
                        let level = floor_height * row(3 + axis)[index] + sign * moment[index];
                        *entry = (level - zmp[axis] * row(5)[index]) / force_z;
                    }
                }
                // x = c_x − (c_z − l_z) s with s = f_x / f_z, and c = (first moment) / M.
                ZmpModel::PointMass => {
                    let center = balance.center_of_mass;
                    let slope = balance.wrench[axis] / force_z;
                    let height = center.position[2] - floor_height;
                    for (index, entry) in gradient.iter_mut().enumerate() {
                        let mass = if index % PARAMETERS_PER_BODY == 0 { 1.0 } else { 0.0 };
                        let shift =
                            |axis: usize| (row(axis)[index] - center.position[axis] * mass) / center.mass;
                        let lean = (row(3 + axis)[index] - slope * row(5)[index]) / force_z;
                        *entry = shift(axis) - shift(2) * slope - height * lean;
                    }
                }
            }
        }
        Ok(Some(zmp))
    }
}

/// Standard deviation of a number that has this gradient with respect to the parameters, when these have this
/// covariance (row by row): √(gᵀ Σ g), to first order.
///
/// # Errors
/// The covariance is not square of the gradient's size.
pub fn standard_deviation(gradient: &[f64], covariance: &[f64]) -> Result<f64, DimensionError> {
    check_size("the covariance", covariance.len(), gradient.len() * gradient.len())?;
    let rows = covariance.chunks_exact(gradient.len().max(1));
    let variance: f64 = gradient
        .iter()
        .zip(rows)
        .map(|(g, row)| g * row.iter().zip(gradient).map(|(s, g)| s * g).sum::<f64>())
        .sum();
    Ok(variance.max(0.0).sqrt())
}
