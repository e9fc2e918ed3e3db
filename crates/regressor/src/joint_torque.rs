//! The joint torque regressor φ(q, q̇, q̈): τ = φ · π with π the standard parameters of all bodies (paper, equation 2).

use phiw_dynamics::{
    BodyMotion, DimensionError, Lanes, PARAMETERS_PER_BODY, Scalar, Spatial, Tree, check_size,
};

/// Which bodies act on which torque, and the kernel that fills in their numbers.
///
/// Row r of φ is non-zero only for the bodies that coordinate r moves, so φ is stored as *pairs*: for each row in order,
/// for each such body in order, ten numbers. [`JointTorqueRegressor::scatter`] makes the dense matrix of it.
#[derive(Clone, Debug)]
pub struct JointTorqueRegressor {
    bodies: usize,
    velocity_size: usize,
    configuration_size: usize,
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
    /// Whether an earlier axis of the chain has written to the pair already (a mimic joint behind its leader).
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
    /// The structure of φ for a robot.
    pub fn new(tree: &Tree) -> Self {
        let bodies = tree.bodies();
        // Coordinates of each body's chain, from the root down.
        let mut coordinates: Vec<Vec<usize>> = Vec::with_capacity(bodies.len());
        for body in bodies {
            let mut chain = body.parent.map(|parent| coordinates[parent].clone()).unwrap_or_default();
            let own = if body.joint_type == phiw_dynamics::JointType::Floating { 6 } else { 1 };
            chain.extend(body.velocity_index..body.velocity_index + own);
            coordinates.push(chain);
        }
        let mut row_bodies = vec![Vec::new(); tree.velocity_size()];
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
                let axis = |(position, &row): (usize, &usize)| ChainAxis {
                    pair: row_offsets[row] + row_bodies[row].partition_point(|&other| other < body),
                    accumulate: chain[..position].contains(&row),
                };
                chain.iter().enumerate().map(axis).collect()
            })
            .collect();
        JointTorqueRegressor {
            bodies: bodies.len(),
            velocity_size: tree.velocity_size(),
            configuration_size: tree.configuration_size(),
            row_bodies,
            row_offsets,
            chains,
        }
    }

    /// Number of rows: one for each velocity coordinate (a floating base's wrench first).
    pub fn rows(&self) -> usize {
        self.velocity_size
    }

    /// Number of columns: ten for each body.
    pub fn columns(&self) -> usize {
        PARAMETERS_PER_BODY * self.bodies
    }

    /// The bodies whose parameters act on `row`, ascending.
    pub fn row_bodies(&self, row: usize) -> &[usize] {
        &self.row_bodies[row]
    }

    /// Number of (row, body) pairs with non-zero entries.
    pub fn pair_count(&self) -> usize {
        self.row_offsets[self.velocity_size]
    }

    /// The pairs of `row`, as a range of the buffer that [`Self::compute`] fills: `PARAMETERS_PER_BODY` numbers each.
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
            motions: vec![BodyMotion::rest(); self.bodies],
            axes: self.chains.iter().map(|chain| vec![Spatial::zero(); chain.len()]).collect(),
        }
    }

    /// φ for one state, as pairs.
    ///
    /// `q` \[rad, m\], `v`, `a` as in [`Tree::body_motions`]; `pairs` has [`Self::buffer_size`] numbers. Allocates nothing.
    ///
    /// # Errors
    /// A slice of the wrong length.
    pub fn compute<T: Scalar>(
        &self,
        tree: &Tree,
        q: &[T],
        v: &[T],
        a: &[T],
        scratch: &mut RegressorScratch<T>,
        pairs: &mut [T],
    ) -> Result<(), DimensionError> {
        check_size("bodies of the tree", tree.bodies().len(), self.bodies)?;
        check_size("configuration", q.len(), self.configuration_size)?;
        check_size("velocity", v.len(), self.velocity_size)?;
        check_size("acceleration", a.len(), self.velocity_size)?;
        check_size("regressor buffer", pairs.len(), self.buffer_size())?;
        self.kernel(tree, q, v, a, scratch, pairs);
        Ok(())
    }

    /// φ for `N` states at once, with the widest vector instructions that the processor has.
    ///
    /// As [`Self::compute`]; lane k of every number belongs to state k.
    ///
    /// # Errors
    /// A slice of the wrong length.
    pub fn compute_lanes<const N: usize>(
        &self,
        tree: &Tree,
        q: &[Lanes<N>],
        v: &[Lanes<N>],
        a: &[Lanes<N>],
        scratch: &mut RegressorScratch<Lanes<N>>,
        pairs: &mut [Lanes<N>],
    ) -> Result<(), DimensionError> {
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || self.compute(tree, q, v, a, scratch, pairs),
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

    /// Each axis is pushed down to the bodies that it moves and multiplied there with the body's own 6×10 regressor: one
    /// product for each (axis, body) pair and none for the zeros.
    #[inline(always)]
    fn kernel<T: Scalar>(
        &self,
        tree: &Tree,
        q: &[T],
        v: &[T],
        a: &[T],
        scratch: &mut RegressorScratch<T>,
        pairs: &mut [T],
    ) {
        tree.body_motions(q, v, a, &mut scratch.motions);
        for (index, body) in tree.bodies().iter().enumerate() {
            let motion = scratch.motions[index];
            let (before, rest) = scratch.axes.split_at_mut(index);
            let axes = &mut rest[0];
            let inherited: &[Spatial<T>] = body.parent.map_or(&[], |parent| &before[parent]);
            for (axis, outer) in axes.iter_mut().zip(inherited) {
                *axis = motion.placement.motion_inverse(*outer);
            }
            if body.joint_type == phiw_dynamics::JointType::Floating {
                for (coordinate, axis) in axes.iter_mut().enumerate() {
                    *axis = Spatial::zero();
                    if coordinate < 3 {
                        axis.linear.0[coordinate] = T::one();
                    } else {
                        axis.angular.0[coordinate - 3] = T::one();
                    }
                }
            } else if let Some(own) = axes.last_mut() {
                *own = body.motion_axis();
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
    // Transposed cross products: s·(α × x) = (s × α)·x, s·(ω × (ω × x)) = ((s × ω) × ω)·x, s·(x × a) = (a × s)·x.
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
