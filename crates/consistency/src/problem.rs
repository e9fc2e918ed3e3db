//! The problem: data, priors, and what is asked of the parameters.

use crate::constraint::{Equality, MatrixConstraint};
use crate::pseudo_inertia::gradient_of;
use crate::small_matrix::Square;
use crate::{ConsistencyError, PARAMETERS_PER_BODY, PseudoInertia, Settings, Solution, interior_point};
use faer::Mat;

/// A least-squares problem over possible bodies and extras.
///
/// Unknowns are the standard parameters, ten for each body, and then the extras. Built step by step: priors,
/// data, constraints.
#[derive(Clone, Debug)]
pub struct Problem {
    pub(crate) priors: Vec<PseudoInertia>,
    /// P⁰⁻¹ of each body.
    pub(crate) prior_inverses: Vec<Square>,
    pub(crate) extras: usize,
    /// A, rows × unknowns, and b.
    pub(crate) matrix: Mat<f64>,
    pub(crate) target: Vec<f64>,
    /// AᵀA.
    pub(crate) gram: Mat<f64>,
    pub(crate) constraints: Vec<MatrixConstraint>,
    pub(crate) equalities: Vec<Equality>,
    /// Where the search starts for bodies whose prior breaks a constraint.
    pub(crate) body_starts: Vec<PseudoInertia>,
}

/// The least weight of the prior over ½‖b‖².
const LEAST_WEIGHT: f64 = 1e-10;

/// What an extra adds to a symmetric matrix that has to be positive semidefinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatrixTerm {
    /// Index of the extra.
    pub extra: usize,
    /// Row of the matrix.
    pub row: usize,
    /// Column of the matrix; the mirrored entry gets the same.
    pub column: usize,
    /// What one unit of the extra adds.
    pub factor: f64,
}

/// An ellipsoid with its axes along the body's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    /// Its centre in the body's frame \[m\].
    pub center: [f64; 3],
    /// Its half axes \[m\].
    pub half_axes: [f64; 3],
}

impl Problem {
    /// Bodies with their priors (standard parameters of possible bodies), and a number of extras.
    ///
    /// # Errors
    /// A prior is no possible body.
    pub fn new(priors: &[[f64; PARAMETERS_PER_BODY]], extras: usize) -> Result<Self, ConsistencyError> {
        let priors: Vec<PseudoInertia> = priors.iter().map(PseudoInertia::of_parameters).collect();
        let inverse = |(body, prior): (usize, &PseudoInertia)| {
            let lower = prior.0.cholesky().ok_or(ConsistencyError::ImpossiblePrior { body })?;
            Ok(lower.inverse_of_lower().transposed().congruence(&Square::identity(4)))
        };
        let unknowns = PARAMETERS_PER_BODY * priors.len() + extras;
        Ok(Problem {
            prior_inverses: priors.iter().enumerate().map(inverse).collect::<Result<_, _>>()?,
            body_starts: priors.clone(),
            priors,
            extras,
            matrix: Mat::zeros(0, unknowns),
            target: Vec::new(),
            gram: Mat::zeros(unknowns, unknowns),
            constraints: Vec::new(),
            equalities: Vec::new(),
        })
    }

    /// Number of unknowns: ten for each body, and the extras.
    pub fn unknowns(&self) -> usize {
        PARAMETERS_PER_BODY * self.priors.len() + self.extras
    }

    /// The same with these data instead of what it had: `matrix` is A row by row, one column for each
    /// unknown, and `target` is b. Both are divided by the standard deviation of the row's noise.
    ///
    /// # Errors
    /// `matrix` is not one row for each number of `target`, or a number is not finite.
    pub fn with_data(mut self, matrix: &[f64], target: &[f64]) -> Result<Self, ConsistencyError> {
        let unknowns = self.unknowns();
        check_size("the matrix", matrix.len(), target.len() * unknowns)?;
        if let Some(&value) = matrix.iter().chain(target).find(|value| !value.is_finite()) {
            return Err(ConsistencyError::Number {
                what: "an entry of the data",
                value,
                wrong: "not finite",
            });
        }
        self.matrix = Mat::from_fn(target.len(), unknowns, |row, column| matrix[row * unknowns + column]);
        self.gram = self.matrix.transpose() * &self.matrix;
        self.target = target.to_vec();
        Ok(self)
    }

    /// The same with an extra between two values, either of which may be infinite: a friction is not
    /// negative.
    ///
    /// # Errors
    /// There is no such extra, or nothing lies strictly between the bounds.
    pub fn with_bounds(mut self, extra: usize, lower: f64, upper: f64) -> Result<Self, ConsistencyError> {
        let unknown = self.extra(extra)?;
        if lower.is_nan() || upper.is_nan() || lower >= upper {
            let constraint = self.constraints.len();
            return Err(ConsistencyError::Empty {
                constraint,
                why: "its lower bound is not below its upper bound",
            });
        }
        if lower.is_finite() {
            self.constraints.push(MatrixConstraint::bound(unknown, 1.0, -lower));
        }
        if upper.is_finite() {
            self.constraints.push(MatrixConstraint::bound(unknown, -1.0, upper));
        }
        Ok(self)
    }

    /// The same with a symmetric matrix of extras that has to be positive semidefinite: viscous friction that
    /// is coupled between joints takes energy in every motion.
    ///
    /// # Errors
    /// A term names an extra that does not exist, or a place outside of the matrix.
    pub fn with_dissipative(mut self, size: usize, terms: &[MatrixTerm]) -> Result<Self, ConsistencyError> {
        let mut added: Vec<(usize, Square)> = Vec::new();
        for term in terms {
            let unknown = self.extra(term.extra)?;
            check_index("row or column of a dissipative matrix", term.row.max(term.column), size)?;
            check_finite("a term of a dissipative matrix", term.factor)?;
            let place = added.iter().position(|(known, _)| *known == unknown).unwrap_or_else(|| {
                added.push((unknown, Square::zeros(size)));
                added.len() - 1
            });
            let matrix = &mut added[place].1;
            for (row, column) in [(term.row, term.column), (term.column, term.row)] {
                let value = matrix.at(row, column);
                let is_diagonal = row == column;
                matrix.set(row, column, value + if is_diagonal { 0.5 * term.factor } else { term.factor });
            }
        }
        self.constraints.push(MatrixConstraint {
            offset: Square::zeros(size),
            terms: added,
            is_bound: false,
        });
        Ok(self)
    }

    /// The same with all of a body's mass inside an ellipsoid (Wensing, Kim & Slotine 2018, equation 21).
    ///
    /// # Errors
    /// There is no such body, or a half axis is not positive.
    pub fn with_ellipsoid(mut self, body: usize, ellipsoid: &Ellipsoid) -> Result<Self, ConsistencyError> {
        check_index("body", body, self.priors.len())?;
        let Ellipsoid { center, half_axes } = *ellipsoid;
        for value in center.into_iter().chain(half_axes) {
            check_finite("a number of an ellipsoid", value)?;
        }
        if let Some(&value) = half_axes.iter().find(|half| **half <= 0.0) {
            return Err(ConsistencyError::Number { what: "a half axis", value, wrong: "not positive" });
        }
        // tr(PQ) = ∫ 1 − Σ ((r − c)/a)² dm
        let shape = half_axes.map(|half| 1.0 / (half * half));
        let reach: f64 = center.iter().zip(shape).map(|(center, shape)| center * center * shape).sum();
        let q = Square::from_fn(4, |row, column| match (row, column) {
            (3, 3) => 1.0 - reach,
            (3, axis) | (axis, 3) => center[axis] * shape[axis],
            _ if row == column => -shape[row],
            _ => 0.0,
        });
        self.ask_of_moments(body, &q, ellipsoid);
        Ok(self)
    }

    /// The same with all of a body's mass inside a box along the axes of its frame, from its lowest corner to
    /// its highest \[m\]: ∫ (x − lower)(upper − x) dm ≥ 0 along each axis.
    ///
    /// # Errors
    /// There is no such body, or a corner is not below the other.
    pub fn with_box(
        mut self,
        body: usize,
        lower: [f64; 3],
        upper: [f64; 3],
    ) -> Result<Self, ConsistencyError> {
        check_index("body", body, self.priors.len())?;
        for value in lower.into_iter().chain(upper) {
            check_finite("a number of a box", value)?;
        }
        let half_axes: [f64; 3] = std::array::from_fn(|axis| 0.5 * (upper[axis] - lower[axis]));
        if let Some(&value) = half_axes.iter().find(|half| **half <= 0.0) {
            return Err(ConsistencyError::Number { what: "half an edge", value, wrong: "not positive" });
        }
        let center: [f64; 3] = std::array::from_fn(|axis| 0.5 * (upper[axis] + lower[axis]));
        for axis in 0..3 {
            let shape = 1.0 / (half_axes[axis] * half_axes[axis]);
            let q = Square::from_fn(4, |row, column| match (row, column) {
                (3, 3) => -lower[axis] * upper[axis] * shape,
                (3, own) | (own, 3) if own == axis => center[axis] * shape,
                (row, column) if row == axis && column == axis => -shape,
                _ => 0.0,
            });
            self.ask_of_moments(body, &q, &Ellipsoid { center, half_axes });
        }
        Ok(self)
    }

    /// Asks that tr(PQ) of a body is positive; a start for which it is not becomes `within`, filled evenly.
    fn ask_of_moments(&mut self, body: usize, q: &Square, within: &Ellipsoid) {
        let one = |value| Square { size: 1, entries: vec![value] };
        let own = gradient_of(q).into_iter().enumerate();
        let terms = own.map(|(index, value)| (PARAMETERS_PER_BODY * body + index, one(value))).collect();
        if self.body_starts[body].0.dot(q) <= 0.0 {
            let (mass, Ellipsoid { center, half_axes }) = (self.priors[body].entry(3, 3), *within);
            let moment = |row: usize, column: usize| {
                let own = if row == column { 0.2 * half_axes[row] * half_axes[row] } else { 0.0 };
                own + center[row] * center[column]
            };
            self.body_starts[body] = PseudoInertia(Square::from_fn(4, |row, column| match (row, column) {
                (3, 3) => mass,
                (3, axis) | (axis, 3) => mass * center[axis],
                _ => mass * moment(row, column),
            }));
        }
        self.constraints.push(MatrixConstraint { offset: one(0.0), terms, is_bound: false });
    }

    /// The same with Σ coefficient·unknown = `value`: a known mass is one coefficient, a known total mass one
    /// for each body, equal limbs one and minus one. Equations must not contradict or repeat one another.
    ///
    /// # Errors
    /// An unknown does not exist, or a number is not finite.
    pub fn with_equality(
        mut self,
        coefficients: &[(usize, f64)],
        value: f64,
    ) -> Result<Self, ConsistencyError> {
        for (unknown, coefficient) in coefficients {
            check_index("unknown", *unknown, self.unknowns())?;
            check_finite("a coefficient of an equation", *coefficient)?;
        }
        check_finite("the value of an equation", value)?;
        self.equalities.push(Equality { coefficients: coefficients.to_vec(), value });
        Ok(self)
    }

    /// The optimum for the prior's weight λ > 0, which is in units of ½‖Ax − b‖².
    ///
    /// A weight below 1e-10 of ½‖b‖² is raised to that: the prior would be lost in the rounding of the
    /// misfit.
    ///
    /// # Errors
    /// The weight is not positive, or nothing lies strictly within the constraints.
    pub fn solve(&self, weight: f64, settings: &Settings) -> Result<Solution, ConsistencyError> {
        if !(weight.is_finite() && weight > 0.0) {
            return Err(ConsistencyError::Number {
                what: "the prior's weight",
                value: weight,
                wrong: "not positive",
            });
        }
        interior_point::solve(self, weight.max(self.least_weight()), settings)
    }

    /// The least weight that [`Self::solve`] solves for.
    pub fn least_weight(&self) -> f64 {
        LEAST_WEIGHT * 0.5 * self.target.iter().map(|value| value * value).sum::<f64>()
    }

    /// Σ D(P ‖ P⁰) of standard parameters, ten for each body.
    ///
    /// # Errors
    /// The list has the wrong length.
    pub fn divergence(&self, standard: &[f64]) -> Result<f64, ConsistencyError> {
        check_size("standard parameters", standard.len(), PARAMETERS_PER_BODY * self.priors.len())?;
        let bodies = standard.as_chunks::<PARAMETERS_PER_BODY>().0.iter().map(PseudoInertia::of_parameters);
        Ok(bodies.zip(&self.priors).map(|(body, prior)| body.divergence(prior)).sum())
    }

    fn extra(&self, extra: usize) -> Result<usize, ConsistencyError> {
        check_index("extra", extra, self.extras)?;
        Ok(PARAMETERS_PER_BODY * self.priors.len() + extra)
    }
}

fn check_size(what: &'static str, found: usize, expected: usize) -> Result<(), ConsistencyError> {
    if found == expected { Ok(()) } else { Err(ConsistencyError::Size { what, expected, found }) }
}

fn check_index(what: &'static str, index: usize, count: usize) -> Result<(), ConsistencyError> {
    if index < count { Ok(()) } else { Err(ConsistencyError::Index { what, index, count }) }
}

fn check_finite(what: &'static str, value: f64) -> Result<(), ConsistencyError> {
    if value.is_finite() {
        Ok(())
    } else {
        Err(ConsistencyError::Number { what, value, wrong: "not finite" })
    }
}
