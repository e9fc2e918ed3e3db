//! What a rigid body with friction leaves of a log that is read in one way or another.

use super::reading::Reading;
use super::samples::Samples;
use crate::IdentificationError;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use phiw_dynamics::Tree;
use phiw_regressor::{BaseParameters, JointTorqueRegressor};

/// Columns of a joint's own, in this order: offset, rotor inertia, viscous and Coulomb friction; then its
/// torque.
const OWN: usize = 4;
const VISCOUS: usize = 2;
const COULOMB: usize = 3;
/// A friction's sign turns over this share of the RMS speed.
const SIGN_SHARE: f64 = 0.05;
/// Part of a column that must be left beside others for it to be taken.
const DETERMINED: f64 = 1e-9;
/// What is added to the diagonal of the normal equations, of columns of norm one.
const RIDGE: f64 = 1e-9;
/// Fits, each with the torques weighted by what the one before left of them.
pub(super) const FITS: usize = 3;
/// No torque is taken to be told better than to this share (RMS).
pub(super) const LEAST_LEFT: f64 = 1e-3;

/// What is left of each torque, RMS over its own.
pub(super) struct Left {
    pub relative: Vec<f64>,
    /// The base parameters of the fit.
    pub parameters: Vec<f64>,
}

impl Left {
    /// The sum of the logarithms.
    pub fn total(&self) -> f64 {
        self.relative.iter().map(|relative| relative.max(LEAST_LEFT).ln()).sum()
    }
}

/// A fit, and what it was made of.
pub(super) struct Fitted {
    pub left: Left,
    /// For each torque the products of what is fitted to it.
    own: Vec<Products>,
    /// 1/squares of each torque.
    weights: Vec<f64>,
}

/// Products of a torque's columns: base parameters, then those of its own that are free, then the torque.
pub(super) struct Products {
    matrix: Mat<f64>,
    base: usize,
}

/// Fits base parameters and every joint's own columns to the samples as they are read, and says what is left.
///
/// A friction that would drive its joint is left out: friction takes power, whatever the signs in a log.
pub(super) fn fitted(
    tree: &Tree,
    base: &BaseParameters,
    samples: &Samples,
    reading: &Reading,
) -> Result<Fitted, IdentificationError> {
    let products = products(tree, base, samples, reading)?;
    let count = base.count();
    let torque: Vec<f64> = products.iter().map(|own| own.torque_squares().max(f64::MIN_POSITIVE)).collect();
    let free: Vec<Products> = products.iter().map(|own| own.without(&[0, 1, VISCOUS, COULOMB])).collect();
    let frictionless: Vec<Products> = products.iter().map(|own| own.without(&[0, 1])).collect();
    let mut drives = vec![false; products.len()];
    let first_weights: Vec<f64> = torque.iter().map(|torque| 1.0 / torque).collect();
    let mut weights = first_weights.clone();
    let mut parameters = vec![0.0; count];
    let of = |joint: usize, drives: &[bool]| match drives[joint] {
        true => &frictionless[joint],
        false => &free[joint],
    };
    for _ in 0..FITS {
        let all: Vec<&Products> = (0..products.len()).map(|joint| of(joint, &drives)).collect();
        parameters = fit(&all, &weights, count);
        for joint in 0..products.len() {
            drives[joint] =
                drives[joint] || frictionless[joint].friction_drives(&products[joint], &parameters);
            let squares = of(joint, &drives).squares(&parameters);
            weights[joint] = 1.0 / squares.max(LEAST_LEFT * LEAST_LEFT * torque[joint]);
        }
    }
    let relative =
        (0..products.len()).map(|joint| (of(joint, &drives).squares(&parameters) / torque[joint]).sqrt());
    let left = Left { relative: relative.collect(), parameters };
    let own = frictionless.into_iter().zip(free).zip(drives);
    let own = own.map(|((frictionless, free), drives)| if drives { frictionless } else { free });
    // A torque of another scale may have turned the weights against those that it disturbs.
    Ok(Fitted { left, own: own.collect(), weights: first_weights })
}

/// Products beside each joint's own columns: offset, rotor inertia and friction are fitted.
pub(super) fn free_products(
    tree: &Tree,
    base: &BaseParameters,
    samples: &Samples,
    reading: &Reading,
) -> Result<Vec<Products>, IdentificationError> {
    let products = products(tree, base, samples, reading)?;
    Ok(products.iter().map(|own| own.without(&[0, 1, VISCOUS, COULOMB])).collect())
}

fn products(
    tree: &Tree,
    base: &BaseParameters,
    samples: &Samples,
    reading: &Reading,
) -> Result<Vec<Products>, IdentificationError> {
    let joints = samples.joints;
    let mut robot = tree.clone();
    robot.gravity = reading.gravity;
    let regressor = JointTorqueRegressor::new(&robot);
    let mut scratch = regressor.scratch();
    let (mut pairs, mut phi) =
        (vec![0.0; regressor.buffer_size()], vec![0.0; regressor.rows() * regressor.columns()]);
    let width = base.count() + OWN + 1;
    let rows = samples.len();
    let mut columns: Vec<Mat<f64>> = (0..joints).map(|_| Mat::zeros(rows, width)).collect();
    let speeds: Vec<f64> = (0..joints)
        .map(|joint| {
            let column = reading.position_of[joint];
            let squares = samples.qd.iter().skip(column).step_by(joints).map(|speed| speed * speed);
            (squares.sum::<f64>() / rows.max(1) as f64).sqrt().max(f64::MIN_POSITIVE)
        })
        .collect();
    let (mut q, mut v, mut a) = (vec![0.0; joints], vec![0.0; joints], vec![0.0; joints]);
    for row in 0..rows {
        for joint in 0..joints {
            let at = row * joints + reading.position_of[joint];
            let sign = reading.position_sign[joint];
            (q[joint], v[joint], a[joint]) =
                (sign * samples.q[at], sign * samples.qd[at], sign * samples.qdd[at]);
        }
        regressor.compute(&robot, &q, &v, &a, &mut scratch, &mut pairs)?;
        regressor.scatter(&pairs, &mut phi)?;
        for (joint, columns) in columns.iter_mut().enumerate() {
            let own = &phi[joint * regressor.columns()..];
            for (place, &column) in base.independent().iter().enumerate() {
                columns[(row, place)] = own[column];
            }
            let sign = (v[joint] / (SIGN_SHARE * speeds[joint])).tanh();
            let torque = reading.torque_factor[joint] * samples.tau[row * joints + reading.torque_of[joint]];
            for (place, value) in [1.0, a[joint], v[joint], sign, torque].into_iter().enumerate() {
                columns[(row, base.count() + place)] = value;
            }
        }
    }
    let product = |columns: &Mat<f64>| Products { matrix: columns.transpose() * columns, base: base.count() };
    Ok(columns.iter().map(product).collect())
}

impl Fitted {
    /// The factor on a torque with which the others foretell it best: its square is fitted with the base
    /// parameters, as one more unknown. None where they do not tell.
    pub fn scale(&self, joint: usize) -> Option<f64> {
        let Fitted { left, own: all, weights } = self;
        let own = &all[joint];
        let square = own.torque_squares();
        if square <= 0.0 {
            return None;
        }
        let count = left.parameters.len();
        let matrix = Mat::from_fn(count, count, |row, column| {
            let sum: f64 =
                all.iter().zip(weights).map(|(other, weight)| weight * other.at(row, column)).sum();
            sum - weights[joint] * own.share(row) * own.share(column) / square
        });
        let others = || all.iter().zip(weights).enumerate().filter(|(other, _)| *other != joint);
        let parameters =
            solved(&matrix, |row| others().map(|(_, (other, weight))| weight * other.share(row)).sum());
        let along: f64 = parameters.iter().enumerate().map(|(row, value)| own.share(row) * value).sum();
        Some(along / square).filter(|scale| scale.is_finite() && *scale != 0.0)
    }
}

impl Products {
    /// The product of two columns.
    pub fn at(&self, row: usize, column: usize) -> f64 {
        self.matrix[(row, column)]
    }

    fn torque(&self) -> usize {
        self.matrix.nrows() - 1
    }

    /// The torque's squares.
    pub fn torque_squares(&self) -> f64 {
        self.at(self.torque(), self.torque())
    }

    /// The product of a base parameter's column and the torque.
    pub fn share(&self, row: usize) -> f64 {
        self.at(row, self.torque())
    }

    /// The squares of the torque that base parameters foretell.
    pub fn squares_of_model(&self, parameters: &[f64]) -> f64 {
        self.product_of_models(parameters, parameters).max(0.0)
    }

    /// The product of the torques that two sets of base parameters foretell.
    pub fn product_of_models(&self, one: &[f64], other: &[f64]) -> f64 {
        let along = |row: usize| -> f64 {
            other.iter().enumerate().map(|(column, value)| self.at(row, column) * value).sum()
        };
        one.iter().enumerate().map(|(row, value)| value * along(row)).sum()
    }

    /// What is left beside some of the joint's own columns: they are fitted, whatever the others are.
    fn without(&self, own: &[usize]) -> Self {
        let mut matrix = self.matrix.clone();
        let size = matrix.nrows();
        for &own in own {
            let pivot_at = self.base + own;
            let pivot = matrix[(pivot_at, pivot_at)];
            if pivot > DETERMINED * self.at(pivot_at, pivot_at) {
                let shares: Vec<f64> = (0..size).map(|row| matrix[(row, pivot_at)] / pivot).collect();
                for column in 0..size {
                    let value = matrix[(pivot_at, column)];
                    (0..size).for_each(|row| matrix[(row, column)] -= shares[row] * value);
                }
            }
            leave_out(&mut matrix, pivot_at);
        }
        for at in 0..size {
            // What the joint's own columns can stand for is nothing but rounding now.
            if matrix[(at, at)] <= DETERMINED * self.at(at, at) {
                leave_out(&mut matrix, at);
            }
        }
        Products { matrix, base: self.base }
    }

    /// The sum of squares that base parameters leave of the torque.
    fn squares(&self, parameters: &[f64]) -> f64 {
        let product: f64 = parameters.iter().enumerate().map(|(row, value)| self.share(row) * value).sum();
        (self.torque_squares() - 2.0 * product + self.product_of_models(parameters, parameters)).max(0.0)
    }

    /// Whether the friction that suits these base parameters best would drive its joint. `self` has offset
    /// and rotor inertia fitted, `whole` nothing.
    fn friction_drives(&self, whole: &Products, parameters: &[f64]) -> bool {
        let [v, s] = [VISCOUS, COULOMB].map(|own| self.base + own);
        let right = |row: usize| {
            let taken: f64 =
                parameters.iter().enumerate().map(|(column, value)| self.at(row, column) * value).sum();
            self.share(row) - taken
        };
        let (first, second) = (right(v), right(s));
        let determinant = self.at(v, v) * self.at(s, s) - self.at(v, s).powi(2);
        let (viscous, coulomb) = match determinant > DETERMINED * self.at(v, v) * self.at(s, s) {
            true => (
                (self.at(s, s) * first - self.at(v, s) * second) / determinant,
                (self.at(v, v) * second - self.at(v, s) * first) / determinant,
            ),
            false => (first / self.at(v, v).max(f64::MIN_POSITIVE), 0.0),
        };
        // Power: viscous·v² + coulomb·v·sign(v).
        viscous * whole.at(v, v) + coulomb * whole.at(v, s) < 0.0
    }
}

/// Makes a column one of zeros.
fn leave_out(products: &mut Mat<f64>, at: usize) {
    for other in 0..products.nrows() {
        products[(at, other)] = 0.0;
        products[(other, at)] = 0.0;
    }
}

/// The base parameters at which the weighted squares that are left are smallest.
fn fit(all: &[&Products], weights: &[f64], count: usize) -> Vec<f64> {
    let sum = |row: usize, column: usize| -> f64 {
        all.iter().zip(weights).map(|(own, weight)| weight * own.at(row, column)).sum()
    };
    solved(&Mat::from_fn(count, count, sum), |row| {
        all.iter().zip(weights).map(|(own, weight)| weight * own.share(row)).sum()
    })
}

/// The solution of normal equations, columns scaled to norm one; zeros where it has none.
pub(super) fn solved(matrix: &Mat<f64>, right: impl Fn(usize) -> f64) -> Vec<f64> {
    let count = matrix.nrows();
    let scale = |at: usize| if matrix[(at, at)] > 0.0 { matrix[(at, at)].sqrt() } else { 1.0 };
    let scales: Vec<f64> = (0..count).map(scale).collect();
    let scaled = Mat::from_fn(count, count, |row, column| {
        let ridge = if row == column { RIDGE } else { 0.0 };
        matrix[(row, column)] / scales[row] / scales[column] + ridge
    });
    let right = Mat::from_fn(count, 1, |row, _| right(row) / scales[row]);
    match scaled.llt(Side::Lower) {
        Ok(factor) => {
            let solution = factor.solve(&right);
            (0..count).map(|row| solution[(row, 0)] / scales[row]).collect()
        }
        Err(_) => vec![0.0; count],
    }
}
