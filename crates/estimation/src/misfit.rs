//! Whether the story that an estimate believes holds: a test that its noise is news.
//!
//! The story is that what is left of a torque is noise that is correlated with itself from one command to the
//! next and with nothing else. Then what is new in it, ε_t = (Φ_t − ρ·Φ_{t−1})·w − (u_t − ρ·u_{t−1}), is
//! foretold by nothing that was there a period before: neither the motion, in the columns Φ_{t−1}, nor the
//! command u_{t−1}. Of N rows of ε with the standard deviation σ, k such columns take N·R² by chance, which
//! is χ² with k degrees of freedom: the test of overidentified instruments (Sargan 1958). That w was fitted
//! to the same rows takes away some degrees; the test is a little too mild for it.

use super::in_order::{Colour, InOrder};
use crate::EstimationError;
use faer::Mat;
use phiw_dynamics::dense::dot;
use phiw_regressor::factor::Factor;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Whether what is left of a torque is foretold by the period before.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TorqueMisfit {
    /// N·R², what was foretold of the squares of the noise's news, in its variances.
    pub chi_squared: f64,
    /// How much chance foretells: k, the columns that do not depend on each other.
    pub degrees: f64,
    /// Probability that chance foretells so much.
    pub probability: f64,
}

impl TorqueMisfit {
    /// Of these numbers.
    fn of(chi_squared: f64, degrees: f64) -> Self {
        TorqueMisfit { chi_squared, degrees, probability: exceeds(chi_squared, degrees) }
    }

    /// Whether the story does not hold for a torque of `count` that were tested: at most one false alarm in
    /// `once_in` tests of all of them.
    pub fn is_refuted(&self, count: usize, once_in: f64) -> bool {
        self.probability * count.max(1) as f64 * once_in < 1.0
    }
}

/// Share of a column below which what the others leave of it is rounding.
const LEAST_LEFT: f64 = 1e-6;

/// The test of each torque, at parameters `w` and the colours of the noise.
pub(super) fn misfits(
    in_order: &InOrder,
    w: &[f64],
    colours: &[Colour],
) -> Result<Vec<TorqueMisfit>, EstimationError> {
    let torque = |(index, colour): (usize, &Colour)| {
        let (factor, size) = in_order.news(index, w, *colour)?;
        Ok(foretold(&factor, size))
    };
    colours.iter().enumerate().map(torque).collect()
}

/// N·R² of the last column of a factor on the `size` columns before it.
fn foretold(factor: &Factor, size: usize) -> TorqueMisfit {
    let r = factor.as_mat();
    // R of these columns is not triangular: orthogonalise them again, and leave out what depends on others.
    let (mut taken, mut left) = (Vec::<Vec<f64>>::new(), r.col(size).iter().copied().collect::<Vec<f64>>());
    let all = dot(&left, &left);
    for column in 0..size {
        let mut own: Vec<f64> = r.col(column).iter().copied().collect();
        let before = dot(&own, &own);
        for _ in 0..2 {
            for direction in &taken {
                let along = dot(direction, &own);
                own.iter_mut().zip(direction).for_each(|(own, direction)| *own -= along * direction);
            }
        }
        let rest = dot(&own, &own);
        if rest.is_nan() || rest <= LEAST_LEFT * LEAST_LEFT * before || rest == 0.0 {
            continue;
        }
        own.iter_mut().for_each(|value| *value /= rest.sqrt());
        let along = dot(&own, &left);
        left.iter_mut().zip(&own).for_each(|(left, direction)| *left -= along * direction);
        taken.push(own);
    }
    let rest = dot(&left, &left);
    let rows = factor.rows() as f64;
    let degrees = taken.len() as f64;
    let chi_squared = if rest > 0.0 { (rows - degrees) * (all - rest) / rest } else { 0.0 };
    TorqueMisfit::of(chi_squared.max(0.0), degrees)
}

/// Probability that χ² with k degrees of freedom exceeds x; 1 without any degree.
fn exceeds(x: f64, k: f64) -> f64 {
    ChiSquared::new(k).map_or(1.0, |chi_squared| chi_squared.sf(x))
}

/// R of columns given row by row is all that the test needs of them.
impl InOrder {
    /// R of the columns of the period before and of what is new in the noise of a torque, in that order, and
    /// the number of the former.
    fn news(&self, torque: usize, w: &[f64], colour: Colour) -> Result<(Factor, usize), EstimationError> {
        let (group, half, parameters) = self.torque(torque);
        let own = parameters.len();
        // What is left of a period: columns of Φ times w, less the felt share of d and the command.
        let left = |row: usize| match row {
            row if row < own => w[parameters[row]],
            row if row == own => -colour.felt,
            _ => -1.0,
        };
        let differs = self.differs(torque);
        let kept: Vec<usize> = (0..half).filter(|&row| row != own || differs).collect();
        let size = kept.len();
        let map =
            Mat::from_fn(2 * half, size + 1, |row, column| match (kept.get(column), row.checked_sub(half)) {
                (Some(&kept), None) => f64::from(u8::from(kept == row)),
                (Some(_), Some(_)) => 0.0,
                (None, None) => -colour.correlation * left(row),
                (None, Some(row)) => left(row),
            });
        Ok((group.factor.combine(map.as_ref())?, size))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_are_those_of_tables() {
        // χ² of 10 and 100 degrees at their 5 % and 0.1 % points.
        for (k, x, expected) in
            [(10.0, 18.307, 0.05), (10.0, 29.588, 0.001), (100.0, 124.342, 0.05), (100.0, 149.449, 0.001)]
        {
            let found = exceeds(x, k);
            assert!((found / expected - 1.0).abs() < 1e-3, "{k}, {x}: {found}");
        }
        // That of two degrees is e^(−x/2), however far out.
        assert!((exceeds(400.0, 2.0) / f64::exp(-200.0) - 1.0).abs() < 1e-9);
        assert_eq!(exceeds(0.0, 0.0), 1.0);
    }
}
