//! What is asked of the parameters beside possible bodies.

use crate::small_matrix::Square;

/// An affine function of the unknowns whose values are symmetric matrices, to be positive definite.
#[derive(Clone, Debug)]
pub(crate) struct MatrixConstraint {
    /// The matrix where all unknowns are zero.
    pub offset: Square,
    /// Unknowns and what each adds, for each unit of it; an unknown at most once.
    pub terms: Vec<(usize, Square)>,
    /// Whether the constraint is a bound on a single unknown.
    pub is_bound: bool,
}

impl MatrixConstraint {
    /// offset + factor·x ≥ 0 of one unknown.
    pub fn bound(unknown: usize, factor: f64, offset: f64) -> Self {
        let one = |value| Square { size: 1, entries: vec![value] };
        MatrixConstraint { offset: one(offset), terms: vec![(unknown, one(factor))], is_bound: true }
    }

    pub fn value(&self, x: &[f64]) -> Square {
        self.change(x).plus(1.0, &self.offset)
    }

    /// The change of the matrix along a direction of the unknowns.
    pub fn change(&self, direction: &[f64]) -> Square {
        let start = Square::zeros(self.offset.size);
        self.terms.iter().fold(start, |sum, (unknown, matrix)| sum.plus(direction[*unknown], matrix))
    }
}

/// Σ coefficient·x = value.
#[derive(Clone, Debug)]
pub(crate) struct Equality {
    pub coefficients: Vec<(usize, f64)>,
    pub value: f64,
}

impl Equality {
    pub fn product(&self, x: &[f64]) -> f64 {
        self.coefficients.iter().map(|(unknown, coefficient)| coefficient * x[*unknown]).sum()
    }
}
