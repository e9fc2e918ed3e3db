//! What the noise of one period does to the motion in it.
//!
//! Over a period T a torque δ that is held moves a robot with inertia A and damping F by Δq̇/T = A⁻¹·φ₁(X)·δ
//! and Δq/T = F⁻¹·(1 − φ₁(X))·δ, X = T·A⁻¹F, φ₁(x) = (1 − e^−x)/x. These are in the columns, and the mean of
//! a column's product with δ is what the log-determinant must have for its slope: log det A + Σ p(x) over the
//! eigenvalues x of X, p′(x) = (1 − φ₁(x))/x. A forearm behind a large gear has an x of a half. Half a period
//! of friction alone, log(1 + x/2), is then so far off that a thousand rows take the difference for friction.

use super::sensitivity::{Sensitivity, element, packed, place};
use super::turning_response::{TurningAxis, TurningResponse};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par, Side};
use phiw_dynamics::dense::{Cholesky, dot};

/// Up to here p is summed as a series; beyond, e^−x is nothing beside 1.
const LARGE: f64 = 8.0;
const TERMS: i32 = 40;

/// p: Σ (−1)ⁿ·xⁿ⁺¹/((n+1)·(n+2)!).
fn damped(x: f64) -> f64 {
    if x > LARGE {
        return damped(LARGE) + (x / LARGE).ln() + 1.0 / x - 1.0 / LARGE;
    }
    let mut power = 0.5 * x;
    let mut sum = power;
    for n in 1..TERMS {
        power *= -x / f64::from(n + 2);
        sum += power / f64::from(n + 1);
    }
    sum
}

/// p′: Σ (−1)ⁿ·xⁿ/(n+2)!.
fn damped_slope(x: f64) -> f64 {
    if x.abs() < 1e-2 {
        0.5 - x / 6.0 + x * x / 24.0 - x.powi(3) / 120.0
    } else {
        (1.0 + (-x).exp_m1() / x) / x
    }
}

/// Derivatives of the log-determinant of an instant.
pub(super) struct Response {
    /// Its derivatives by A and by T·F, packed like their columns.
    pub slopes: [Mat<f64>; 2],
    /// Cholesky's factor of A + ½T·F, near enough for a curvature.
    pub factor: Cholesky,
    /// Of frictions that turn.
    turning: Option<TurningResponse>,
}

/// Inertia and damping of an instant as their eigenvectors see them: Cholesky's factor of A, x and the
/// vectors in its frame.
pub(super) struct Modes {
    factor: Cholesky,
    values: Vec<f64>,
    vectors: Mat<f64>,
    /// Cholesky's factor of A + ½T·F; none where that is no inertia.
    half_damped: Option<Cholesky>,
    /// Of frictions that turn.
    turning: Option<TurningResponse>,
}

impl Modes {
    /// None where the inertia is not one.
    pub fn of(sensitivity: &Sensitivity, w: &Mat<f64>) -> Option<Self> {
        let n = sensitivity.directions;
        let (inertia, mut damping) = (&sensitivity.inertia * w, &sensitivity.damping * w);
        let factor = factor(n, inertia.col_as_slice(0))?;
        let half_damped = self::factor(n, (inertia + &damping * faer::Scale(0.5)).col_as_slice(0));
        reduce(&factor, damping.col_as_slice_mut(0));
        let reduced = damping.col_as_slice(0);
        let entry = |row: usize, column: usize| element(reduced, row.max(column), row.min(column));
        let eigen = Mat::from_fn(n, n, entry).self_adjoint_eigen(Side::Lower).ok()?;
        let values = (0..n).map(|mode| eigen.S()[mode]).collect();
        let vectors = eigen.U().to_owned();
        let mut modes = Modes { factor, values, vectors, half_damped, turning: None };
        if !sensitivity.turned.slopes.is_empty() {
            let axes = &sensitivity.turned.axes;
            let axes = axes.iter().map(|axis| modes.axis(&sensitivity.toward(axis)));
            let axes: Vec<TurningAxis> = axes.collect::<Option<_>>()?;
            modes.turning = Some(TurningResponse::of(&sensitivity.turned, &axes, w, sensitivity.weight));
        }
        Some(modes)
    }

    /// What a torque on an axis that moves by `toward` with each direction does; none where G is no inertia.
    pub fn axis(&self, toward: &[f64]) -> Option<TurningAxis> {
        let mut reduced = toward.to_vec();
        self.factor.solve_lower(&mut reduced);
        let along = |mode: usize| dot(self.vectors.col_as_slice(mode), &reduced).powi(2);
        let share = |(mode, x): (usize, &f64)| along(mode) * (1.0 - x * damped_slope(*x));
        let velocity = self.values.iter().enumerate().map(share).sum();
        let acceleration = dot(&reduced, &reduced);
        let half_damped = self.half_damped.as_ref()?;
        let mut moved = toward.to_vec();
        half_damped.solve_lower(&mut moved);
        half_damped.solve_upper(&mut moved);
        Some(TurningAxis { velocity, acceleration, moved, toward: toward.to_vec() })
    }

    /// That of a row, in the mean of those that the instant stands for.
    pub fn log_determinant(&self) -> f64 {
        self.factor.log_determinant()
            + self.values.iter().map(|&x| damped(x)).sum::<f64>()
            + self.turning.as_ref().map_or(0.0, |turning| turning.log_determinant)
    }
}

/// The log-determinant alone; none where the inertia is not one.
pub(super) fn log_determinant(sensitivity: &Sensitivity, w: &Mat<f64>) -> Option<f64> {
    Modes::of(sensitivity, w).map(|modes| modes.log_determinant())
}

impl Response {
    /// None where the inertia is not one.
    pub fn of(sensitivity: &Sensitivity, w: &Mat<f64>) -> Option<Self> {
        Self::of_modes(sensitivity, &Modes::of(sensitivity, w)?)
    }

    /// The same where the modes are known. None where A + ½T·F is no inertia.
    pub fn of_modes(sensitivity: &Sensitivity, modes: &Modes) -> Option<Self> {
        let n = sensitivity.directions;
        // Columns of L⁻ᵀU.
        let mut vectors = modes.vectors.clone();
        for mode in 0..n {
            modes.factor.solve_upper(vectors.col_as_slice_mut(mode));
        }
        let sum = |share: &dyn Fn(f64) -> f64| {
            let mut slope = Mat::zeros(packed(n), 1);
            for (mode, &x) in modes.values.iter().enumerate() {
                let (vector, share) = (vectors.col_as_slice(mode), share(x));
                for row in 0..n {
                    for column in 0..=row {
                        let scale = if row == column { 1.0 } else { std::f64::consts::SQRT_2 };
                        slope[(place(row, column), 0)] += scale * share * vector[row] * vector[column];
                    }
                }
            }
            slope
        };
        let mut slopes = [sum(&|x| 1.0 - x * damped_slope(x)), sum(&damped_slope)];
        if let Some(turning) = &modes.turning {
            turning.add_slopes(&mut slopes);
        }
        Some(Response { slopes, factor: modes.half_damped.clone()?, turning: modes.turning.clone() })
    }

    /// Derivatives of the log-determinant by the parameters from `first` on.
    pub fn gradient(&self, sensitivity: &Sensitivity, first: usize) -> Mat<f64> {
        let [by_inertia, by_damping] = &self.slopes;
        let mut gradient = sensitivity.inertia.get(.., first..).transpose() * by_inertia
            + sensitivity.damping.get(.., first..).transpose() * by_damping;
        if let Some(turning) = &self.turning {
            turning.add_gradient(first, &mut gradient);
        }
        gradient
    }

    /// Adds `weight` times tr(G⁻¹ S_k G⁻¹ S_l) to element (k, l − `first`), for all parameters k and those l
    /// from `first` on: G = A + ½T·F under the parameters, S_k what parameter k adds to it.
    pub fn add_curvature(
        &self,
        sensitivity: &Sensitivity,
        first: usize,
        weight: f64,
        curvature: &mut Mat<f64>,
    ) {
        let columns = &sensitivity.inertia + &sensitivity.damping * faer::Scale(0.5);
        let moved = self.squeezed() * columns.get(.., first..);
        matmul(&mut *curvature, Accum::Add, columns.transpose(), &moved, weight, Par::Seq);
        if let Some(turning) = &self.turning {
            turning.add_curvature(&columns, first, weight, curvature);
        }
    }

    /// The matrix that makes G⁻¹ S G⁻¹ of a packed S.
    fn squeezed(&self) -> Mat<f64> {
        let n = self.factor.size();
        let inverse = self.factor.inverse();
        let row_of = |index: usize| &inverse[index * n..(index + 1) * n];
        let mut map = Mat::zeros(packed(n), packed(n));
        for k in 0..n {
            for l in 0..=k {
                let (by_k, by_l) = (row_of(k), row_of(l));
                let from = if k == l { std::f64::consts::FRAC_1_SQRT_2 } else { 1.0 };
                let column = map.col_as_slice_mut(place(k, l));
                for row in 0..n {
                    let [own_k, own_l] = [by_k[row], by_l[row]].map(|value| from * value);
                    let to = &mut column[place(row, 0)..=place(row, row)];
                    for ((to, k), l) in to.iter_mut().zip(by_k).zip(by_l) {
                        *to = own_k * l + own_l * k;
                    }
                    to[row] *= std::f64::consts::FRAC_1_SQRT_2;
                }
            }
        }
        map
    }
}

/// Cholesky's factor of a packed column; none if it is not positive definite.
fn factor(n: usize, column: &[f64]) -> Option<Cholesky> {
    Cholesky::of(n, |row, col| element(column, row, col))
}

/// S → L⁻¹ S L⁻ᵀ, packed, in place.
fn reduce(factor: &Cholesky, column: &mut [f64]) {
    let n = factor.size();
    if column.iter().all(|value| *value == 0.0) {
        return;
    }
    let mut full = vec![0.0; n * n];
    for row in 0..n {
        for col in 0..=row {
            let value = element(column, row, col);
            full[row * n + col] = value;
            full[col * n + row] = value;
        }
    }
    // Rows are columns of a symmetric matrix: solve each, transpose, solve each again.
    for _ in 0..2 {
        full.chunks_exact_mut(n).for_each(|row| factor.solve_lower(row));
        for row in 0..n {
            for col in 0..row {
                full.swap(row * n + col, col * n + row);
            }
        }
    }
    for row in 0..n {
        for col in 0..=row {
            let scale = if row == col { 1.0 } else { std::f64::consts::SQRT_2 };
            column[place(row, col)] = scale * full[row * n + col];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::turning::Turned;
    use super::*;
    use faer::prelude::Solve;
    use phiw_identification::effect::VelocitySum;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Columns A_k and T·F_k of random symmetric matrices, the first of both near the identity.
    fn sensitivity(rng: &mut ChaCha8Rng, n: usize, parameters: usize) -> Sensitivity {
        let mut columns = |size: f64| {
            Mat::from_fn(packed(n), parameters, |row, parameter| {
                let diagonal = (0..n).any(|k| place(k, k) == row);
                let own = if parameter == 0 && diagonal { 1.0 } else { 0.0 };
                own + size * rng.random_range(-1.0..1.0)
            })
        };
        let (inertia, damping) = (columns(0.05), columns(0.05));
        let toward = (0..n).map(|joint| (0..n).map(|k| f64::from(u8::from(k == joint))).collect()).collect();
        Sensitivity { weight: 1.0, directions: n, inertia, damping, toward, turned: Turned::default() }
    }

    /// The same with two more parameters, of frictions that turn in three of the four rows that it stands
    /// for.
    fn turning(rng: &mut ChaCha8Rng, n: usize, parameters: usize) -> Sensitivity {
        let mut with = sensitivity(rng, n, parameters);
        for columns in [&mut with.inertia, &mut with.damping] {
            columns.resize_with(packed(n), parameters + 2, |_, _| 0.0);
        }
        let slopes = (0..6).map(|_| rng.random_range(0.0..1.5)).collect();
        let offsets = (0..6).map(|_| rng.random_range(0.0..0.2)).collect();
        // The first joint, and a shaft between it and the last where there are two.
        let shaft = (n > 1).then(|| VelocitySum { terms: vec![(0, 1.0), (n - 1, -0.7)] });
        let axes: Vec<VelocitySum> = std::iter::once(VelocitySum::of_joint(0)).chain(shaft).collect();
        let columns = vec![(parameters, 0), (parameters + 1, axes.len() - 1)];
        let turned = Turned { axes, columns, slopes, offsets };
        Sensitivity { weight: 4.0, turned, ..with }
    }

    #[test]
    fn slopes_are_those_of_the_log_determinant() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for n in [1, 2, 5] {
            for sensitivity in [sensitivity(&mut rng, n, 4), turning(&mut rng, n, 4)] {
                let parameters = sensitivity.inertia.ncols();
                let w = Mat::from_fn(parameters, 1, |k, _| [1.0, 0.4, -0.3, 0.2, 0.7, 0.3][k]);
                let gradient = Response::of(&sensitivity, &w).unwrap().gradient(&sensitivity, 0);
                for parameter in 0..parameters {
                    let at = |step: f64| {
                        let mut moved = w.clone();
                        moved[(parameter, 0)] += step;
                        log_determinant(&sensitivity, &moved).unwrap()
                    };
                    let (slope, found) = ((at(1e-5) - at(-1e-5)) / 2e-5, gradient[(parameter, 0)]);
                    // How a joint that turns moves is counted near enough by the parameters of the inertia.
                    let near = if parameter < 4 && parameters > 4 { 1e-2 } else { 1e-7 };
                    assert!(
                        (slope - found).abs() < near * (1.0 + slope.abs()),
                        "{n} {parameter}: {slope} {found}"
                    );
                }
            }
        }
    }

    /// The slopes' own slopes are the oracle, of the parameters of frictions that turn.
    #[test]
    fn a_curvature_of_frictions_that_turn_is_that_of_the_log_determinant() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for n in [1, 2, 5] {
            let sensitivity = turning(&mut rng, n, 4);
            let w = Mat::from_fn(6, 1, |k, _| [1.0, 0.4, -0.3, 0.2, 0.7, 0.3][k]);
            for first in [0, 4] {
                let mut curvature = Mat::zeros(6, 6 - first);
                let response = Response::of(&sensitivity, &w).unwrap();
                response.add_curvature(&sensitivity, first, 1.0, &mut curvature);
                for parameter in 4..6 {
                    let at = |step: f64| {
                        let mut moved = w.clone();
                        moved[(parameter, 0)] += step;
                        Response::of(&sensitivity, &moved).unwrap().gradient(&sensitivity, 0)
                    };
                    let slopes = (at(1e-5) - at(-1e-5)) * faer::Scale(-1.0 / 2e-5);
                    // Of two joints the curvature is left out.
                    for other in (0..6).filter(|other| *other < 4 || *other == parameter) {
                        let (found, expected) = (curvature[(other, parameter - first)], slopes[(other, 0)]);
                        let near = if other < 4 { 1e-2 } else { 1e-7 };
                        assert!(
                            (found - expected).abs() < near * (1.0 + expected.abs()),
                            "{n} {parameter} {other}: {found} {expected}"
                        );
                    }
                }
            }
        }
    }

    /// Whole matrices are the oracle.
    #[test]
    fn a_curvature_is_the_trace_of_four_matrices() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for n in [1, 2, 5] {
            let sensitivity = sensitivity(&mut rng, n, 4);
            let w = Mat::from_fn(4, 1, |k, _| [1.0, 0.4, -0.3, 0.2][k]);
            let whole = |column: &Mat<f64>| {
                Mat::from_fn(n, n, |row, col| element(column.col_as_slice(0), row.max(col), row.min(col)))
            };
            let both = &sensitivity.inertia + &sensitivity.damping * faer::Scale(0.5);
            let inverse = whole(&(&both * &w)).llt(Side::Lower).unwrap().solve(Mat::<f64>::identity(n, n));
            let part = |k: usize| &inverse * whole(&both.get(.., k..k + 1).to_owned());
            for first in [0, 3] {
                let mut curvature = Mat::zeros(4, 4 - first);
                let response = Response::of(&sensitivity, &w).unwrap();
                response.add_curvature(&sensitivity, first, 2.0, &mut curvature);
                for k in 0..4 {
                    for l in first..4 {
                        let product = part(k) * part(l);
                        let expected: f64 = (0..n).map(|index| 2.0 * product[(index, index)]).sum();
                        let found = curvature[(k, l - first)];
                        assert!(
                            (found - expected).abs() < 1e-9 * (1.0 + expected.abs()),
                            "{found} {expected}"
                        );
                    }
                }
            }
        }
    }

    /// One joint with noise and nothing else, its motion solved in closed form: at the truth the slopes are
    /// the means of the columns' products with the noise.
    #[test]
    fn slopes_are_the_means_of_what_the_noise_does_to_the_columns() {
        for (inertia, damping, period_s) in [(0.002, 0.125, 0.01), (3.0, 0.01, 0.01), (0.01, 20.0, 0.01)] {
            let column = |value: f64| Mat::from_fn(1, 1, |_, _| value);
            let sensitivity = Sensitivity {
                weight: 1.0,
                directions: 1,
                inertia: column(1.0),
                damping: column(period_s * damping / inertia),
                toward: Vec::new(),
                turned: Turned::default(),
            };
            // A = 1·w with w = inertia, and T·F in proportion.
            let response = Response::of(&sensitivity, &column(inertia)).unwrap();
            let x: f64 = period_s * damping / inertia;
            let change = -(-x).exp_m1() / damping;
            let way = (period_s - inertia * change) / damping;
            for (slope, mean) in
                [(&response.slopes[0], change / period_s), (&response.slopes[1], way / period_s / period_s)]
            {
                assert!((slope[(0, 0)] / mean - 1.0).abs() < 1e-6, "{}, not {mean}", slope[(0, 0)]);
            }
        }
    }

    #[test]
    fn the_series_goes_on_smoothly_beyond_its_end() {
        for x in [-3.0, -0.02, -0.005, 0.0, 0.005, 0.02, 0.6, 3.0, 7.9, 8.1, 50.0] {
            let slope = (damped(x + 1e-4) - damped(x - 1e-4)) / 2e-4;
            assert!((slope - damped_slope(x)).abs() < 1e-5, "{x}: {slope}, not {}", damped_slope(x));
        }
    }
}
