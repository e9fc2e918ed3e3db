//! A positive definite matrix X of the problem with its dual Z, and the Nesterov–Todd scaling of both.
//!
//! The scaling G makes both the same diagonal matrix: G⁻¹XG⁻ᵀ = GᵀZG = diag(σ) (Nesterov & Todd, "Self-scaled
//! barriers and interior-point methods for convex programming", 1997). On the central path X·Z = τ·1 and all
//! σ² are τ.

use crate::small_matrix::Square;

/// The scaling of a block.
pub(crate) struct Scaled {
    /// G.
    pub scaling: Square,
    /// G⁻¹.
    pub inverse: Square,
    pub sigma: Vec<f64>,
}

impl Scaled {
    /// None if X or Z is not positive definite.
    pub fn new(x: &Square, z: &Square) -> Option<Self> {
        let lower = x.cholesky()?;
        let (squares, vectors) = lower.transposed().congruence(z).eigen();
        if !squares.iter().all(|square| *square > 0.0) {
            return None;
        }
        let sigma: Vec<f64> = squares.iter().map(|square| square.sqrt()).collect();
        let size = x.size;
        let product = lower.times(&vectors);
        let scaling = Square::from_fn(size, |row, column| product.at(row, column) / sigma[column].sqrt());
        let product = vectors.transposed().times(&lower.inverse_of_lower());
        let inverse = Square::from_fn(size, |row, column| sigma[row].sqrt() * product.at(row, column));
        Some(Scaled { scaling, inverse, sigma })
    }

    /// X and Z in scaled coordinates.
    pub fn diagonal(&self) -> Square {
        let sigma = &self.sigma;
        Square::from_fn(sigma.len(), |row, column| if row == column { sigma[row] } else { 0.0 })
    }

    /// The sum of the changes of X and Z, in scaled coordinates, that leads to X·Z = target·1; with the part
    /// of second order that a first pair of changes foretells.
    pub fn wanted(&self, target: f64, first: Option<(&Square, &Square)>) -> Square {
        let sigma = &self.sigma;
        let bent = first.map(|(primal, dual)| primal.times(dual));
        Square::from_fn(sigma.len(), |row, column| {
            let centred = if row == column { target - sigma[row] * sigma[row] } else { 0.0 };
            let bent = bent.as_ref().map_or(0.0, |bent| 0.5 * (bent.at(row, column) + bent.at(column, row)));
            2.0 * (centred - bent) / (sigma[row] + sigma[column])
        })
    }

    /// The step along which X (or Z) comes to the boundary of the positive definite matrices; infinite where
    /// none does. The change is in scaled coordinates.
    pub fn longest(&self, change: &Square) -> f64 {
        let sigma = &self.sigma;
        let relative =
            |row: usize, column: usize| change.at(row, column) / (sigma[row] * sigma[column]).sqrt();
        let lowest = Square::from_fn(sigma.len(), relative).eigen().0.into_iter().fold(0.0, f64::min);
        if lowest < 0.0 { -1.0 / lowest } else { f64::INFINITY }
    }

    /// Z after the share `length` of its change in scaled coordinates.
    pub fn dual(&self, change: &Square, length: f64) -> Square {
        self.inverse.transposed().congruence(&self.diagonal().plus(length, change))
    }
}
