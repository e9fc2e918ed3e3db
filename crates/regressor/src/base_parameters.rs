//! Base parameters: the combinations of standard parameters that motion can tell apart.
//!
//! Found numerically: φ over random states, a rank-revealing (column-pivoted) QR, and the dependent columns
//! written in the independent ones (Gautier, "Numerical calculation of the base inertial parameters of
//! robots", 1991).

use crate::{JointTorqueRegressor, RegressorError, factor::FactorBuilder};
use faer::linalg::solvers::ColPivQr;
use faer::prelude::{Solve, SolveLstsq};
use faer::{Mat, MatRef};
use phiw_dynamics::check::check_size;
use phiw_dynamics::inertia::PARAMETERS_PER_BODY;
use phiw_dynamics::{JointType, Tree};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// How base parameters are found.
#[derive(Clone, Copy, Debug)]
pub struct BaseParametersOptions {
    /// Seed of the random states.
    pub seed: u64,
    /// A column whose independent part is smaller than this share of the largest is dependent. Angles in a
    /// URDF are often rounded to eight digits, which leaves 1e-9 of a column that is dependent in truth.
    pub tolerance: f64,
}

impl Default for BaseParametersOptions {
    fn default() -> Self {
        BaseParametersOptions { seed: 1, tolerance: 1e-7 }
    }
}

/// One base parameter: a standard parameter plus multiples of others that act exactly alike.
#[derive(Clone, Debug, PartialEq)]
pub struct Regrouping {
    /// Index of the standard parameter that gives the base parameter its column of φ.
    pub leading: usize,
    /// The others, with their factors.
    pub others: Vec<(usize, f64)>,
}

/// The base parameters of a robot and the map between them and the standard ones.
#[derive(Clone, Debug)]
pub struct BaseParameters {
    standard_size: usize,
    /// Columns of φ that are kept, ascending.
    independent: Vec<usize>,
    /// w = `map` · π, `independent.len()` × `standard_size`.
    map: Mat<f64>,
    rank_gap: f64,
}

impl BaseParameters {
    /// The base parameters of a robot, from random states inside its joint limits.
    ///
    /// # Errors
    /// The tree has numbers that are not finite.
    pub fn of_tree(tree: &Tree, options: BaseParametersOptions) -> Result<Self, RegressorError> {
        let regressor = JointTorqueRegressor::new(tree);
        let columns = regressor.columns();
        let mut builder = FactorBuilder::new(columns);
        let mut random = ChaCha8Rng::seed_from_u64(options.seed);
        let mut scratch = regressor.scratch();
        let mut pairs = vec![0.0; regressor.buffer_size()];
        let mut phi = vec![0.0; regressor.rows() * columns];
        let samples = (4 * columns).div_ceil(regressor.rows().max(1)).max(50);
        for _ in 0..samples {
            let (q, v, a) = random_state(tree, &mut random);
            regressor.compute(tree, &q, &v, &a, &mut scratch, &mut pairs)?;
            regressor.scatter(&pairs, &mut phi)?;
            builder.push_rows(&phi)?;
        }
        let factor = builder.factor();
        Self::of_columns(factor.as_mat(), options.tolerance)
    }

    /// The base parameters of a robot that can not move as it likes, from states `[q, v, a]` that it can be
    /// in: one whose feet stay on the floor, for one. States must be many and all over what is possible, and
    /// hold the constraint to many digits.
    ///
    /// Bodies in `without` have no parameters, as the links of a chain of virtual joints: their columns are
    /// left out.
    ///
    /// # Errors
    /// A state does not fit the robot, or has numbers that are not finite.
    pub fn of_states<'a>(
        tree: &Tree,
        states: impl IntoIterator<Item = [&'a [f64]; 3]>,
        without: &[usize],
        options: BaseParametersOptions,
    ) -> Result<Self, RegressorError> {
        let regressor = JointTorqueRegressor::new(tree);
        let columns = regressor.columns();
        let mut builder = FactorBuilder::new(columns);
        let mut scratch = regressor.scratch();
        let mut pairs = vec![0.0; regressor.buffer_size()];
        let mut phi = vec![0.0; regressor.rows() * columns];
        for [q, v, a] in states {
            regressor.compute(tree, q, v, a, &mut scratch, &mut pairs)?;
            regressor.scatter(&pairs, &mut phi)?;
            for row in phi.chunks_exact_mut(columns) {
                for &body in without {
                    row[body * PARAMETERS_PER_BODY..(body + 1) * PARAMETERS_PER_BODY].fill(0.0);
                }
            }
            builder.push_rows(&phi)?;
        }
        Self::of_columns(builder.factor().as_mat(), options.tolerance)
    }

    /// The independent columns of any matrix, and the others in terms of them.
    fn of_columns(matrix: MatRef<'_, f64>, tolerance: f64) -> Result<Self, RegressorError> {
        let standard_size = matrix.ncols();
        let norms: Vec<f64> = matrix.col_iter().map(|column| column.norm_l2()).collect();
        let largest = norms.iter().copied().fold(0.0, f64::max);
        // Columns of unit length, so that kg and kg·m² are judged alike; columns that no torque feels stay
        // zero.
        let unit = |norm: f64| if norm > tolerance * largest { 1.0 / norm } else { 0.0 };
        let scaled = Mat::from_fn(matrix.nrows(), standard_size, |row, column| {
            matrix[(row, column)] * unit(norms[column])
        });
        let pivoted = ColPivQr::new(scaled.as_ref());
        let r = pivoted.thin_R();
        let diagonal: Vec<f64> = (0..standard_size).map(|index| r[(index, index)].abs()).collect();
        let first = diagonal.first().copied().unwrap_or_default();
        let rank = diagonal.iter().take_while(|value| first > 0.0 && **value > tolerance * first).count();
        let next = diagonal.get(rank).copied().unwrap_or_default().max(f64::EPSILON * first);
        let rank_gap = if rank == 0 { 1.0 } else { diagonal[rank - 1] / next };

        let mut independent: Vec<usize> = pivoted.P().arrays().0[..rank].to_vec();
        independent.sort_unstable();
        let kept = Mat::from_fn(matrix.nrows(), rank, |row, column| matrix[(row, independent[column])]);
        let mut map = kept.qr().solve_lstsq(matrix.cloned());
        for column in 0..standard_size {
            let scale = |row: usize| norms[independent[row]] / norms[column].max(f64::MIN_POSITIVE);
            for row in 0..rank {
                let felt = unit(norms[column]) > 0.0;
                // Rounding leaves factors of 1e-12 where there are none.
                if !felt || (map[(row, column)] * scale(row)).abs() < 1e-9 {
                    map[(row, column)] = 0.0;
                }
            }
        }
        for (row, &column) in independent.iter().enumerate() {
            for other in 0..rank {
                map[(other, column)] = f64::from(u8::from(other == row));
            }
        }
        Ok(BaseParameters { standard_size, independent, map, rank_gap })
    }

    /// Number of base parameters: the rank of φ.
    pub fn count(&self) -> usize {
        self.independent.len()
    }

    /// Columns of φ that stand for the base parameters, ascending: φ·π = φ\[independent\]·w.
    pub fn independent(&self) -> &[usize] {
        &self.independent
    }

    /// Last diagonal element of the pivoted R that counts over the first that does not: how clear the rank
    /// is.
    pub fn rank_gap(&self) -> f64 {
        self.rank_gap
    }

    /// The map from standard to base parameters, `count` × standard parameters.
    pub fn map(&self) -> MatRef<'_, f64> {
        self.map.as_ref()
    }

    /// Which standard parameters a base parameter regroups.
    pub fn regrouping(&self, base_parameter: usize) -> Regrouping {
        let leading = self.independent[base_parameter];
        let others = (0..self.standard_size)
            .filter(|&column| column != leading && self.map[(base_parameter, column)] != 0.0)
            .map(|column| (column, self.map[(base_parameter, column)]))
            .collect();
        Regrouping { leading, others }
    }

    /// Standard parameters that no torque feels: they are in no base parameter.
    pub fn unidentifiable(&self) -> Vec<usize> {
        let felt = |column: usize| (0..self.count()).any(|row| self.map[(row, column)] != 0.0);
        (0..self.standard_size).filter(|&column| !felt(column)).collect()
    }

    /// Base parameters of standard ones.
    ///
    /// # Errors
    /// `standard` has the wrong length.
    pub fn from_standard(&self, standard: &[f64]) -> Result<Vec<f64>, RegressorError> {
        check_size("standard parameters", standard.len(), self.standard_size)?;
        Ok((0..self.count())
            .map(|row| (0..self.standard_size).map(|column| self.map[(row, column)] * standard[column]).sum())
            .collect())
    }

    /// The standard parameters nearest to `reference` that have the base parameters `base` exactly.
    ///
    /// Distances are weighed by `reference`'s own magnitudes body by body, so that a heavy link takes up more
    /// than a light one.
    ///
    /// # Errors
    /// A slice has the wrong length.
    pub fn to_standard(&self, base: &[f64], reference: &[f64]) -> Result<Vec<f64>, RegressorError> {
        check_size("base parameters", base.len(), self.count())?;
        let held = self.from_standard(reference)?;
        let weighted = self.weighted(reference);
        let gram = &weighted * self.map.transpose();
        let missing = Mat::from_fn(self.count(), 1, |row, _| base[row] - held[row]);
        let multipliers = gram.full_piv_lu().solve(&missing);
        let change = weighted.transpose() * multipliers;
        Ok(reference.iter().enumerate().map(|(column, value)| value + change[(column, 0)]).collect())
    }

    /// The gradient with respect to the base parameters of something whose gradient with respect to the
    /// standard ones is `gradient`, where these follow the base parameters as in [`Self::to_standard`].
    ///
    /// # Errors
    /// A slice has the wrong length.
    pub fn gradient_of_base(&self, gradient: &[f64], reference: &[f64]) -> Result<Vec<f64>, RegressorError> {
        check_size("the gradient", gradient.len(), self.standard_size)?;
        check_size("standard parameters", reference.len(), self.standard_size)?;
        let weighted = self.weighted(reference);
        let gram = &weighted * self.map.transpose();
        let gradient = Mat::from_fn(self.standard_size, 1, |row, _| gradient[row]);
        let solution = gram.full_piv_lu().solve(&weighted * gradient);
        Ok((0..self.count()).map(|row| solution[(row, 0)]).collect())
    }

    /// The covariance of the standard parameters, row by row and symmetric, where these follow the base
    /// parameters as in [`Self::to_standard`]: `of_base` is the covariance of those (`count` × `count`), and
    /// what they leave open is as uncertain as `share` of the magnitudes of `reference` (the posterior of a
    /// Gaussian belief of that size). A row and column of `of_base` that `determined` denies is that of the
    /// belief itself; with none determined all is the belief's.
    ///
    /// # Errors
    /// A size does not fit.
    pub fn covariance_of_standard(
        &self,
        (of_base, determined): (MatRef<'_, f64>, &[bool]),
        reference: &[f64],
        share: f64,
    ) -> Result<Mat<f64>, RegressorError> {
        check_size("standard parameters", reference.len(), self.standard_size)?;
        check_size("determined base parameters", determined.len(), self.count())?;
        check_size("the covariance of base parameters", of_base.nrows().min(of_base.ncols()), self.count())?;
        let scales = parameter_scales(reference);
        let believed = |k: usize| (share * scales[k]).powi(2);
        let weighted = self.weighted(reference);
        let gram = &weighted * self.map.transpose();
        // Of the belief: standard parameters on base parameters, and the base parameters' own covariance.
        let follow = gram.full_piv_lu().solve(&weighted);
        let of_base = Mat::from_fn(self.count(), self.count(), |row, column| {
            match (determined[row], determined[column]) {
                (true, true) => of_base[(row, column)],
                (false, false) => share * share * gram[(row, column)],
                _ => 0.0,
            }
        });
        let known = follow.transpose() * (of_base - &gram * faer::Scale(share * share)) * &follow;
        Ok(Mat::from_fn(self.standard_size, self.standard_size, |row, column| {
            let own = if row == column { believed(row) } else { 0.0 };
            own + 0.5 * (known[(row, column)] + known[(column, row)])
        }))
    }

    /// A belief about the standard parameters, as rows for a factor: each is `reference`, give or take
    /// `share` of [`parameter_scales`].
    ///
    /// Rows of \[Φ f\] with unit variance, row by row: `count` rows of `count` + 1 numbers. They hold all
    /// that this belief says of the base parameters; once these are found, [`Self::to_standard`] gives the
    /// standard parameters that are then the likeliest.
    ///
    /// # Errors
    /// `reference` has the wrong length.
    pub fn prior_rows(&self, reference: &[f64], share: f64) -> Result<Vec<f64>, RegressorError> {
        let mean = self.from_standard(reference)?;
        let (count, scales) = (self.count(), parameter_scales(reference));
        // Their covariance is map · scales² · mapᵀ = RᵀR, and R⁻ᵀ w has unit variance.
        let spread = Mat::from_fn(self.standard_size, count, |standard, base| {
            share * scales[standard] * self.map[(base, standard)]
        });
        let mut inverse = Mat::<f64>::identity(count, count);
        let qr = spread.qr();
        faer::linalg::triangular_solve::solve_upper_triangular_in_place(
            qr.thin_R(),
            inverse.as_mut(),
            faer::Par::Seq,
        );
        let mut rows = Vec::with_capacity(count * (count + 1));
        for row in 0..count {
            let entries = (0..count).map(|column| inverse[(column, row)]);
            rows.extend(entries.clone());
            rows.push(entries.zip(&mean).map(|(entry, mean)| entry * mean).sum());
        }
        Ok(rows)
    }

    /// The map with each column times the square of its parameter's magnitude in `reference`.
    fn weighted(&self, reference: &[f64]) -> Mat<f64> {
        let weights = parameter_scales(reference);
        Mat::from_fn(self.count(), self.standard_size, |row, column| {
            self.map[(row, column)] * weights[column] * weights[column]
        })
    }
}

/// A typical magnitude for each standard parameter, ten for each body: its mass, and that mass 0.2 m away.
pub fn parameter_scales(standard: &[f64]) -> Vec<f64> {
    let bodies = standard.len() / PARAMETERS_PER_BODY;
    let total: f64 = standard.chunks_exact(PARAMETERS_PER_BODY).map(|body| body[0].abs()).sum();
    let mean_mass = if total > 0.0 { total / bodies.max(1) as f64 } else { 1.0 };
    let scales = |body: &[f64]| {
        let mass = body[0].abs().max(0.05 * mean_mass);
        let length = 0.2;
        let mut scale = [mass * length * length; PARAMETERS_PER_BODY];
        scale[0] = mass;
        scale[1..4].fill(mass * length);
        scale
    };
    standard.chunks_exact(PARAMETERS_PER_BODY).flat_map(scales).collect()
}

/// A random state: positions inside the limits (a turn where there are none), speeds and accelerations of
/// some rad/s.
fn random_state(tree: &Tree, random: &mut ChaCha8Rng) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let mut q = Vec::with_capacity(tree.configuration_size());
    if tree.is_floating() {
        let quaternion: [f64; 4] = std::array::from_fn(|_| random.random_range(-1.0..1.0));
        let norm = quaternion.iter().map(|value| value * value).sum::<f64>().sqrt().max(1e-3);
        q.extend([0.0; 3]);
        q.extend(quaternion.map(|value| value / norm));
    }
    for joint in 0..tree.joint_count() {
        let body = tree.joint(joint);
        let span = if body.joint_type == JointType::Prismatic { 1.0 } else { std::f64::consts::PI };
        let (lower, upper) = (body.limits.lower.max(-span), body.limits.upper.min(span));
        // A range too narrow to excite anything (or upside down) is taken as absent.
        q.push(if upper - lower > 1e-3 {
            random.random_range(lower..upper)
        } else {
            random.random_range(-span..span)
        });
    }
    let mut rates = |size: usize| {
        (0..tree.velocity_size()).map(|_| random.random_range(-1.0..1.0) * size as f64).collect()
    };
    let (v, a) = (rates(3), rates(10));
    (q, v, a)
}
