//! Lower bounds of cond of a stack, for the price of a few products with each candidate.

use super::Triangle;
use faer::{Mat, Side};
use phiw_dynamics::dense::dot;
use std::cmp::Ordering;

/// Directions in which what has been measured is weakest. More make the bound closer and each bound dearer.
const WEAKEST: usize = 16;

/// Directions in which it is strongest.
const STRONGEST: usize = 4;

/// Products with the operator, or with its inverse, that turn directions towards the ends of the spectrum.
/// A bound holds for any directions; these make it close.
const TURNS: usize = 4;

/// Share of the largest diagonal element below which one counts as this much where R is inverted: R may be
/// singular, and directions need not be exact.
const LEAST_DIAGONAL: f64 = 1e-6;

/// Share of a direction's length that must be new beside others.
const DEPENDENT: f64 = 1e-14;

/// What has been measured, in the directions in which it is weakest and strongest.
///
/// σ_min of a stack is at most the smallest Ritz value over any subspace, and σ_max at least the largest over
/// another. In the few directions that what has been measured determines worst, σ_min nearly lies; in those
/// that it determines best, σ_max.
#[derive(Debug)]
pub(super) struct ConditionBound {
    weakest: Directions,
    strongest: Directions,
}

/// Orthonormal directions v that what has been measured does not mix, each with ‖R·v‖²; at least one.
#[derive(Debug)]
struct Directions {
    all: Vec<(f64, Vec<f64>)>,
}

impl ConditionBound {
    /// Of what has been measured; none if no directions can be found.
    pub fn of(measured: &Triangle) -> Option<Self> {
        let steady = measured.with_least_diagonal(LEAST_DIAGONAL);
        let mut weakest = Directions::towards(measured, WEAKEST, |x| {
            steady.solve_transposed(x);
            steady.solve(x);
        })?;
        let mut product = vec![0.0; measured.size()];
        let mut strongest = Directions::towards(measured, STRONGEST, |x| {
            measured.multiply(x, &mut product);
            x.copy_from_slice(&product);
            measured.multiply_transposed(x);
        })?;
        weakest.sort(f64::total_cmp);
        strongest.sort(|a, b| b.total_cmp(a));
        Some(ConditionBound { weakest, strongest })
    }

    /// A bound from two products: those with the weakest and the strongest direction.
    pub fn first(&self, candidate: &Triangle) -> f64 {
        let square = |directions: &Directions| {
            let (square, vector) = &directions.all[0];
            square + candidate.product_squared(vector)
        };
        bound(square(&self.strongest), square(&self.weakest))
    }

    /// A closer bound, from products with all directions.
    pub fn close(&self, candidate: &Triangle) -> f64 {
        let ends = |directions: &Directions| {
            let values = directions.ritz_values(candidate)?;
            Some([*values.first()?, *values.last()?])
        };
        match (ends(&self.weakest), ends(&self.strongest)) {
            (Some([smallest, _]), Some([_, largest])) => bound(largest, smallest),
            _ => 0.0,
        }
    }
}

/// √(largest/smallest), a little less: rounding must not rule out the best.
fn bound(largest: f64, smallest: f64) -> f64 {
    const MARGIN: f64 = 1.0 - 1e-6;
    if smallest > 0.0 { MARGIN * (largest / smallest).sqrt() } else { 0.0 }
}

impl Directions {
    /// Some of the directions that `turn` makes longest, in no order; none where they can not be found.
    fn towards(measured: &Triangle, count: usize, mut turn: impl FnMut(&mut [f64])) -> Option<Self> {
        let size = measured.size();
        // Fixed vectors with a part along every direction, so that the result is always the same.
        let start =
            |which: usize| (0..size).map(|k| ((1.7 + 2.3 * which as f64) * k as f64 + 0.3).sin()).collect();
        let mut basis: Vec<Vec<f64>> = (0..count.min(size)).map(start).collect();
        for _ in 0..TURNS {
            basis.iter_mut().for_each(|vector| turn(vector));
            orthonormalise(&mut basis)?;
        }
        let values = squares(&basis, measured, |_| 0.0).self_adjoint_eigen(Side::Lower).ok()?;
        let (rotation, values) = (values.U(), values.S().column_vector());
        let rotated = |which: usize| -> (f64, Vec<f64>) {
            let mut vector = vec![0.0; size];
            for (k, direction) in basis.iter().enumerate() {
                let share = rotation[(k, which)];
                vector.iter_mut().zip(direction).for_each(|(sum, value)| *sum += share * value);
            }
            (values[which].max(0.0), vector)
        };
        (!basis.is_empty()).then(|| Directions { all: (0..basis.len()).map(rotated).collect() })
    }

    fn sort(&mut self, order: impl Fn(&f64, &f64) -> Ordering) {
        self.all.sort_by(|a, b| order(&a.0, &b.0));
    }

    /// Squared Ritz values of the stack of what has been measured and `candidate`, ascending.
    fn ritz_values(&self, candidate: &Triangle) -> Option<Vec<f64>> {
        let vectors: Vec<&[f64]> = self.all.iter().map(|(_, vector)| &vector[..]).collect();
        squares(&vectors, candidate, |k| self.all[k].0).self_adjoint_eigenvalues(Side::Lower).ok()
    }
}

/// The lower half of VᵀRᵀRV of the vectors V, and `own` beside it on the diagonal.
fn squares<V: AsRef<[f64]>>(vectors: &[V], r: &Triangle, own: impl Fn(usize) -> f64) -> Mat<f64> {
    let image = |vector: &V| {
        let mut product = vec![0.0; r.size()];
        r.multiply(vector.as_ref(), &mut product);
        product
    };
    let images: Vec<Vec<f64>> = vectors.iter().map(image).collect();
    Mat::from_fn(vectors.len(), vectors.len(), |row, column| match row.cmp(&column) {
        Ordering::Less => 0.0,
        Ordering::Equal => dot(&images[row], &images[row]) + own(row),
        Ordering::Greater => dot(&images[row], &images[column]),
    })
}

/// Makes vectors orthonormal, by Gram and Schmidt, twice, and leaves out those that depend on others. None
/// where they are not finite.
fn orthonormalise(vectors: &mut Vec<Vec<f64>>) -> Option<()> {
    let mut orthonormal: Vec<Vec<f64>> = Vec::with_capacity(vectors.len());
    for mut own in vectors.drain(..) {
        let length = dot(&own, &own).sqrt();
        for _ in 0..2 {
            for direction in &orthonormal {
                let along = dot(&own, direction);
                own.iter_mut().zip(direction).for_each(|(value, unit)| *value -= along * unit);
            }
        }
        let left = dot(&own, &own).sqrt();
        if !left.is_finite() {
            return None;
        }
        if left > DEPENDENT * length {
            own.iter_mut().for_each(|value| *value /= left);
            orthonormal.push(own);
        }
    }
    *vectors = orthonormal;
    Some(())
}

#[cfg(test)]
mod tests {
    use super::ConditionBound;
    use crate::selection::Triangle;
    use phiw_regressor::factor::Factor;
    use proptest::prelude::*;

    /// R of some rows of numbers, each column in a unit of its own.
    fn triangle(size: usize, numbers: &[f64]) -> Triangle {
        let rows: Vec<f64> = numbers
            .chunks_exact(size)
            .flat_map(|row| {
                let scaled = row.iter().enumerate().map(|(k, value)| value * 10_f64.powi(k as i32 % 5 - 2));
                scaled.chain([0.0]).collect::<Vec<f64>>()
            })
            .collect();
        Triangle::of_factor(&Factor::of_rows(size + 1, &rows).unwrap())
    }

    proptest! {
        /// Whatever has been measured, fewer rows than columns included, no bound is above cond of the stack.
        #[test]
        fn no_bound_is_above_the_condition_number(
            size in 1..24_usize,
            rows in [1..30_usize, 1..60],
            numbers in prop::collection::vec(-1.0..1.0_f64, 24 * 90),
        ) {
            let (measured, candidate) = numbers.split_at(24 * 30);
            let measured = triangle(size, &measured[..rows[0] * size]);
            let candidate = triangle(size, &candidate[..rows[1] * size]);
            let mut stack = measured.clone();
            stack.absorb(&mut candidate.clone());
            let cond = stack.condition_number();
            // Directions are found wherever something has been measured.
            let bound = ConditionBound::of(&measured).expect("directions");
            let (first, close) = (bound.first(&candidate), bound.close(&candidate));
            prop_assert!(first <= cond && close <= cond, "{first}, {close}, {cond}");
            // All directions of a small triangle are there: the bound is cond then.
            if size <= super::STRONGEST && measured.condition_number() < 1e6 {
                prop_assert!(close > (1.0 - 1e-5) * cond, "{close}, {cond}");
            }
        }
    }
}
