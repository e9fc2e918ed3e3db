//! The joint torque regressor φ(q, q̇, q̈): τ = φ · π with π the standard parameters of all bodies (paper,
//! equation 2).

use phiw_dynamics::body_kinematics::{BodyJoint, BodyMotion};
use phiw_dynamics::check::check_size;
use phiw_dynamics::inertia::PARAMETERS_PER_BODY;
use phiw_dynamics::scalar::{Lanes, Scalar};
use phiw_dynamics::{BodyKinematics, DimensionError, Spatial};

/// Which bodies act on which torque, and the kernel that fills in their numbers.
///
/// Row r of φ is non-zero only for the bodies that coordinate r moves, so φ is stored as *pairs*: for each
/// row in order, for each such body in order, ten numbers. [`JointTorqueRegressor::scatter`] makes the dense
/// matrix of it.
#[derive(Clone, Debug)]
pub struct JointTorqueRegressor {
    /// The joint before each body.
    joints: Vec<BodyJoint>,
    velocity_size: usize,
    /// `row_bodies[row]`: the bodies that coordinate `row` moves, ascending.
    row_bodies: Vec<Vec<usize>>,
    /// `row_offsets[row]`: index of the row's first pair; one more at the end.
    row_offsets: Vec<usize>,
    /// `chains[body]`: axes that move the body, from the root down, each with the pair that it adds to.
    chains: Vec<Vec<ChainAxis>>,
}

#[derive(Clone, Copy, Debug)]
struct ChainAxis {
    pair: usize,
    /// Whether an earlier axis of the chain has written to the pair already (a mimic joint behind its
    /// leader).
    accumulate: bool,
}

/// Working memory of [`JointTorqueRegressor`].
#[derive(Clone, Debug)]
pub struct RegressorScratch<T> {
    motions: Vec<BodyMotion<T>>,
    /// For each body the axes of its chain, in its own frame.
    axes: Vec<Vec<Spatial<T>>>,
}

impl JointTorqueRegressor {
    /// The structure of φ for a robot: `&tree`, or whatever else knows how the robot's bodies hang together.
    ///
    /// # Panics
    /// A body comes before its parent, which [`BodyKinematics`] rules out.
    pub fn new(robot: impl BodyKinematics) -> Self {
        let joints: Vec<BodyJoint> = (0..robot.body_count()).map(|body| robot.body_joint(body)).collect();
        // Coordinates of each body's chain, from the root down.
        let mut coordinates: Vec<Vec<usize>> = Vec::with_capacity(joints.len());
        for joint in &joints {
            let mut chain = joint.parent.map(|parent| coordinates[parent].clone()).unwrap_or_default();
            chain.extend(joint.velocity_index..joint.velocity_index + joint.motion_subspace.dimension());
            coordinates.push(chain);
        }
        let velocity_size = coordinates.iter().flatten().max().map_or(0, |last| last + 1);
        let mut row_bodies = vec![Vec::new(); velocity_size];
        for (body, chain) in coordinates.iter().enumerate() {
            for &row in chain {
                if row_bodies[row].last() != Some(&body) {
                    row_bodies[row].push(body);
                }
            }
        }
        let mut row_offsets = vec![0];
        for bodies in &row_bodies {
            row_offsets.push(row_offsets[row_offsets.len() - 1] + bodies.len());
        }
        let chains = coordinates
            .iter()
            .enumerate()
            .map(|(body, chain)| {
                chain
                    .iter()
                    .enumerate()
                    .map(|(position, &row)| ChainAxis {
                        pair: row_offsets[row] + row_bodies[row].partition_point(|&other| other < body),
                        accumulate: chain[..position].contains(&row),
                    })
                    .collect()
            })
            .collect();
        JointTorqueRegressor { joints, velocity_size, row_bodies, row_offsets, chains }
    }

    /// Number of rows: one for each velocity coordinate (a floating base's wrench first).
    pub fn rows(&self) -> usize {
        self.velocity_size
    }

    /// Number of columns: ten for each body.
    pub fn columns(&self) -> usize {
        PARAMETERS_PER_BODY * self.joints.len()
    }

    /// The bodies whose parameters act on `row`, ascending.
    pub fn row_bodies(&self, row: usize) -> &[usize] {
        &self.row_bodies[row]
    }

    /// Number of (row, body) pairs with non-zero entries.
    pub fn pair_count(&self) -> usize {
        self.row_offsets[self.velocity_size]
    }

    /// The pairs of `row`, as a range of the buffer that [`Self::compute`] fills: `PARAMETERS_PER_BODY`
    /// numbers each.
    pub fn row_range(&self, row: usize) -> std::ops::Range<usize> {
        PARAMETERS_PER_BODY * self.row_offsets[row]..PARAMETERS_PER_BODY * self.row_offsets[row + 1]
    }

    /// Length of the buffer that [`Self::compute`] fills.
    pub fn buffer_size(&self) -> usize {
        PARAMETERS_PER_BODY * self.pair_count()
    }

    /// Working memory for scalars of type `T`.
    pub fn scratch<T: Scalar>(&self) -> RegressorScratch<T> {
        RegressorScratch {
            motions: vec![BodyMotion::rest(); self.joints.len()],
            axes: self.chains.iter().map(|chain| vec![Spatial::zero(); chain.len()]).collect(),
        }
    }

    /// φ for one state, as pairs.
    ///
    /// `robot` is the one that this structure was made for: `&tree`, or `&mut backend` of another library,
    /// whose own kinematics are then used. `q` \[rad, m\], `v`, `a` are its coordinates (see
    /// [`BodyKinematics`]); `pairs` has [`Self::buffer_size`] numbers. Allocates nothing.
    ///
    /// # Errors
    /// A slice of the wrong length, or the robot's motion can not be computed.
    pub fn compute<T: Scalar, K: BodyKinematics<T>>(
        &self,
        mut robot: K,
        q: &[T],
        v: &[T],
        a: &[T],
        scratch: &mut RegressorScratch<T>,
        pairs: &mut [T],
    ) -> Result<(), K::Error> {
        check_size("bodies of the robot", robot.body_count(), self.joints.len())?;
        check_size("regressor buffer", pairs.len(), self.buffer_size())?;
        robot.body_motions(q, v, a, &mut scratch.motions)?;
        self.kernel(scratch, pairs);
        Ok(())
    }

    /// φ for `N` states at once, with the widest vector instructions that the processor has.
    ///
    /// As [`Self::compute`]; lane k of every number belongs to state k.
    ///
    /// # Errors
    /// As [`Self::compute`].
    pub fn compute_lanes<const N: usize, K: BodyKinematics<Lanes<N>>>(
        &self,
        robot: K,
        q: &[Lanes<N>],
        v: &[Lanes<N>],
        a: &[Lanes<N>],
        scratch: &mut RegressorScratch<Lanes<N>>,
        pairs: &mut [Lanes<N>],
    ) -> Result<(), K::Error> {
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || self.compute(robot, q, v, a, scratch, pairs),
        )
    }

    /// The dense φ of the pairs: row-major, [`Self::rows`] × [`Self::columns`].
    ///
    /// # Errors
    /// A slice of the wrong length.
    pub fn scatter<T: Scalar>(&self, pairs: &[T], phi: &mut [T]) -> Result<(), DimensionError> {
        check_size("regressor buffer", pairs.len(), self.buffer_size())?;
        check_size("dense regressor", phi.len(), self.rows() * self.columns())?;
        phi.fill(T::zero());
        let columns = self.columns();
        let mut blocks = pairs.chunks_exact(PARAMETERS_PER_BODY);
        for (row, bodies) in self.row_bodies.iter().enumerate() {
            for (body, block) in bodies.iter().zip(&mut blocks) {
                let start = row * columns + body * PARAMETERS_PER_BODY;
                phi[start..start + PARAMETERS_PER_BODY].copy_from_slice(block);
            }
        }
        Ok(())
    }

    /// Each axis is pushed down to the bodies that it moves and multiplied there with the body's own 6×10
    /// regressor: one product for each (axis, body) pair and none for the zeros.
    #[inline(always)]
    fn kernel<T: Scalar>(&self, scratch: &mut RegressorScratch<T>, pairs: &mut [T]) {
        for (index, joint) in self.joints.iter().enumerate() {
            let motion = scratch.motions[index];
            let (before, rest) = scratch.axes.split_at_mut(index);
            let axes = &mut rest[0];
            let inherited: &[Spatial<T>] = joint.parent.map_or(&[], |parent| &before[parent]);
            for (axis, outer) in axes.iter_mut().zip(inherited) {
                *axis = motion.placement.motion_inverse(*outer);
            }
            if let Some(own) = axes.get_mut(inherited.len()..) {
                joint.motion_subspace.axes(own);
            }
            for (axis, target) in axes.iter().zip(&self.chains[index]) {
                let start = target.pair * PARAMETERS_PER_BODY;
                let block = &mut pairs[start..start + PARAMETERS_PER_BODY];
                let row = axis_row(*axis, &motion);
                if target.accumulate {
                    for (entry, value) in block.iter_mut().zip(row) {
                        *entry += value;
                    }
                } else {
                    block.copy_from_slice(&row);
                }
            }
        }
    }
}

/// sᵀ · A, where A (6×10) maps a body's parameters to the wrench that its motion takes:
///
/// force  = m a + α × mc + ω × (ω × mc), moment = mc × a + I α + ω × I ω.
#[inline(always)]
fn axis_row<T: Scalar>(axis: Spatial<T>, motion: &BodyMotion<T>) -> [T; PARAMETERS_PER_BODY] {
    let Spatial { linear: force_axis, angular: moment_axis } = axis;
    let (omega, alpha, acceleration) =
        (motion.angular_velocity, motion.angular_acceleration, motion.proper_acceleration);
    // Transposed cross products: s·(α × x) = (s × α)·x, s·(ω × (ω × x)) = ((s × ω) × ω)·x, s·(x × a) = (a ×
    // s)·x.
    let first_moment =
        force_axis.cross(alpha) + force_axis.cross(omega).cross(omega) + acceleration.cross(moment_axis);
    let gyroscopic = moment_axis.cross(omega);
    let (u, x) = (moment_axis.0, alpha.0);
    let (g, w) = (gyroscopic.0, omega.0);
    [
        force_axis.dot(acceleration),
        first_moment.0[0],
        first_moment.0[1],
        first_moment.0[2],
        u[0] * x[0] + g[0] * w[0],
        u[0] * x[1] + u[1] * x[0] + g[0] * w[1] + g[1] * w[0],
        u[1] * x[1] + g[1] * w[1],
        u[0] * x[2] + u[2] * x[0] + g[0] * w[2] + g[2] * w[0],
        u[1] * x[2] + u[2] * x[1] + g[1] * w[2] + g[2] * w[1],
        u[2] * x[2] + g[2] * w[2],
    ]
}
