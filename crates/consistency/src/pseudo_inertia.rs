//! The pseudo-inertia of a body: its mass distribution's moments of order zero, one and two in one matrix.

use crate::small_matrix::Square;

/// Standard parameters of a body.
pub const PARAMETERS_PER_BODY: usize = 10;

/// The 4×4 matrix ∫ \[r; 1\]\[r; 1\]ᵀ dm: \[Σ h; hᵀ m\] with Σ = ½tr(I)·1 − I \[kg·m²\], h \[kg·m\], m
/// \[kg\].
///
/// A distribution of positive mass that is not flat has these moments if and only if the matrix is positive
/// definite (Wensing, Kim & Slotine 2018, equation 13).
#[derive(Clone, Debug, PartialEq)]
pub struct PseudoInertia(pub(crate) Square);

impl PseudoInertia {
    /// From m, h (x, y, z), and the inertia tensor about the origin (xx, xy, yy, xz, yz, zz).
    pub fn of_parameters(parameters: &[f64; PARAMETERS_PER_BODY]) -> Self {
        let [m, hx, hy, hz, xx, xy, yy, xz, yz, zz] = *parameters;
        let half = 0.5 * (xx + yy + zz);
        PseudoInertia(Square {
            size: 4,
            entries: vec![
                half - xx,
                -xy,
                -xz,
                hx, //
                -xy,
                half - yy,
                -yz,
                hy, //
                -xz,
                -yz,
                half - zz,
                hz, //
                hx,
                hy,
                hz,
                m,
            ],
        })
    }

    /// The standard parameters.
    pub fn parameters(&self) -> [f64; PARAMETERS_PER_BODY] {
        parameters_of(&self.0)
    }

    /// An entry; both indices are below 4.
    pub fn entry(&self, row: usize, column: usize) -> f64 {
        self.0.at(row, column)
    }

    /// Whether a body of positive mass has these moments.
    pub fn is_possible(&self) -> bool {
        self.0.cholesky().is_some()
    }

    /// D(self ‖ prior) = tr(P⁰⁻¹P) − log det(P⁰⁻¹P) − 4: zero at the prior, infinite where the body or the
    /// prior is not possible, the same in every frame.
    pub fn divergence(&self, prior: &Self) -> f64 {
        let Some(inverse) = prior.0.cholesky().map(|lower| lower.inverse_of_lower()) else {
            return f64::INFINITY;
        };
        let relative = inverse.congruence(&self.0);
        let Some(lower) = relative.cholesky() else { return f64::INFINITY };
        // Term by term, so that nothing is lost near the prior.
        let trace_less_log = |value: f64| value - 1.0 - value.ln();
        let diagonal: f64 = (0..4).map(|row| trace_less_log(lower.at(row, row).powi(2))).sum();
        let below: f64 = (0..4)
            .flat_map(|row| (0..row).map(move |column| (row, column)))
            .map(|(r, c)| lower.at(r, c).powi(2))
            .sum();
        diagonal + below
    }
}

/// The standard parameters of a symmetric 4×4 matrix.
pub(crate) fn parameters_of(matrix: &Square) -> [f64; PARAMETERS_PER_BODY] {
    let (x, y, z) = (matrix.at(0, 0), matrix.at(1, 1), matrix.at(2, 2));
    [
        matrix.at(3, 3),
        matrix.at(0, 3),
        matrix.at(1, 3),
        matrix.at(2, 3),
        y + z,
        -matrix.at(0, 1),
        x + z,
        -matrix.at(0, 2),
        -matrix.at(1, 2),
        x + y,
    ]
}

/// The gradient with respect to a body's standard parameters of tr(`gradient` · P).
pub(crate) fn gradient_of(gradient: &Square) -> [f64; PARAMETERS_PER_BODY] {
    let [x, y, z] = [0, 1, 2].map(|axis| gradient.at(axis, axis));
    [
        gradient.at(3, 3),
        2.0 * gradient.at(0, 3),
        2.0 * gradient.at(1, 3),
        2.0 * gradient.at(2, 3),
        0.5 * (y + z - x),
        -2.0 * gradient.at(0, 1),
        0.5 * (x + z - y),
        -2.0 * gradient.at(0, 2),
        -2.0 * gradient.at(1, 2),
        0.5 * (x + y - z),
    ]
}

#[cfg(test)]
mod tests {
    use super::{PseudoInertia, gradient_of};
    use crate::small_matrix::Square;

    const BRICK: [f64; 10] = [2.0, 0.6, -2.0, 1.0, 2.6, 0.6, 0.8, -0.3, 1.0, 2.3];

    #[test]
    fn parameters_and_matrix_are_the_same_thing() {
        let back = PseudoInertia::of_parameters(&BRICK).parameters();
        for (found, expected) in back.iter().zip(BRICK) {
            assert!((found - expected).abs() < 1e-15, "{back:?}");
        }
    }

    /// Points of positive mass are the oracle: their sums are a body by definition.
    #[test]
    fn the_matrix_of_points_is_the_sum_of_their_squares() {
        let points =
            [[0.1, 0.2, -0.3, 1.5], [0.5, -0.1, 0.2, 0.3], [-0.2, 0.4, 0.1, 0.7], [0.0, 0.1, 0.6, 0.2]];
        let mut parameters = [0.0; 10];
        let mut matrix = Square::zeros(4);
        for [x, y, z, m] in points {
            let own = [
                m,
                m * x,
                m * y,
                m * z,
                m * (y * y + z * z),
                -m * x * y,
                m * (x * x + z * z),
                -m * x * z,
                -m * y * z,
                m * (x * x + y * y),
            ];
            parameters.iter_mut().zip(own).for_each(|(sum, value)| *sum += value);
            let r = [x, y, z, 1.0];
            matrix = matrix.plus(1.0, &Square::from_fn(4, |row, column| m * r[row] * r[column]));
        }
        let found = PseudoInertia::of_parameters(&parameters);
        assert!(found.is_possible());
        let error = found.0.plus(-1.0, &matrix);
        assert!(error.dot(&error) < 1e-28, "{error:?}");
        let weights = Square::from_fn(4, |row, column| (1 + row + column) as f64);
        let gradient = gradient_of(&weights);
        let along: f64 = gradient.iter().zip(parameters).map(|(a, b)| a * b).sum();
        assert!((along - weights.dot(&matrix)).abs() < 1e-12);
    }

    #[test]
    fn the_divergence_is_zero_at_the_prior_and_grows_towards_impossible_bodies() {
        let prior = PseudoInertia::of_parameters(&[2.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.1, 0.0, 0.0, 0.1]);
        assert!(prior.divergence(&prior) < 1e-30);
        let twice = PseudoInertia::of_parameters(&prior.parameters().map(|value| 2.0 * value));
        assert!((twice.divergence(&prior) - 4.0 * (2.0 - 1.0 - 2.0_f64.ln())).abs() < 1e-12);
        let flat = PseudoInertia::of_parameters(&[2.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.1, 0.0, 0.0, 0.2]);
        assert_eq!(flat.divergence(&prior), f64::INFINITY);
    }
}
