//! Curves: control points on a basis.

use super::Basis;

/// A curve of any dimension, θ(t) = Σ θ_j b_j(t) (14).
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    basis: Basis,
    dimension: usize,
    control: Vec<f64>,
}

/// Control points that do not fit a basis.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{found} control values do not make a curve: this basis needs {control_points} points of dimension {dimension}"
)]
pub struct CurveError {
    /// Values given.
    pub found: usize,
    /// Control points of the basis.
    pub control_points: usize,
    /// Dimension asked for.
    pub dimension: usize,
}

impl Curve {
    /// A curve with the given control points, point by point: `control[j * dimension + i]` is coordinate `i`
    /// of point `j`.
    ///
    /// # Errors
    /// The number of values is not that of the basis' control points times `dimension`.
    pub fn new(basis: Basis, dimension: usize, control: Vec<f64>) -> Result<Self, CurveError> {
        let control_points = basis.control_points();
        if control.len() != control_points * dimension {
            return Err(CurveError { found: control.len(), control_points, dimension });
        }
        Ok(Curve { basis, dimension, control })
    }

    /// Its basis.
    pub fn basis(&self) -> &Basis {
        &self.basis
    }
    /// Coordinates of a point.
    pub fn dimension(&self) -> usize {
        self.dimension
    }
    /// The control points, point by point.
    pub fn control(&self) -> &[f64] {
        &self.control
    }

    /// The derivative of the given order (0: the curve itself) at time `t` \[s\], into `point`. `scratch`
    /// needs `degree + 1` elements. Units: those of the control points, per s^order.
    ///
    /// # Panics
    /// If `point` is shorter than the dimension or `scratch` than `degree + 1`.
    pub fn evaluate(&self, order: usize, t: f64, scratch: &mut [f64], point: &mut [f64]) {
        let first = self.basis.derivative(order, t, scratch);
        let point = &mut point[..self.dimension];
        point.fill(0.0);
        let rows = self.control[first * self.dimension..].chunks_exact(self.dimension.max(1));
        for (weight, row) in scratch[..=self.basis.degree()].iter().zip(rows) {
            for (sum, value) in point.iter_mut().zip(row) {
                *sum += weight * value;
            }
        }
    }

    /// The derivative as a curve of its own, one degree lower; `None` for degree 0.
    ///
    /// Its control points bound the derivative, since a curve stays inside the hull of its control points.
    pub fn derivative(&self) -> Option<Curve> {
        let degree = self.basis.degree();
        if degree == 0 {
            return None;
        }
        let knots = self.basis.knots();
        let mut control = Vec::with_capacity(self.control.len().saturating_sub(self.dimension));
        for point in 1..self.basis.control_points() {
            let width = knots[point + degree] - knots[point];
            // Knots that coincide `degree` fold leave the curve a jump there, and no derivative.
            let factor = if width > 0.0 { degree as f64 / width } else { 0.0 };
            for coordinate in 0..self.dimension {
                let [before, after] =
                    [point - 1, point].map(|point| self.control[point * self.dimension + coordinate]);
                control.push(factor * (after - before));
            }
        }
        let basis = Basis::from_knots(degree - 1, knots[1..knots.len() - 1].to_vec()).ok()?;
        Some(Curve { basis, dimension: self.dimension, control })
    }
}
