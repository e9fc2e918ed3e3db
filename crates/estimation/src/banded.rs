//! Least squares over unknowns of which each equation has neighbours only.

use phiw_dynamics::dense::dot;

/// Normal equations of neighbouring unknowns: the lower band of a symmetric matrix, row by row, each row as
/// wide as the band and with its diagonal last.
pub(super) struct Banded {
    width: usize,
    lower: Vec<f64>,
    right: Vec<f64>,
}

/// Their Cholesky factor, in the same form.
pub(super) struct BandedFactor {
    width: usize,
    lower: Vec<f64>,
}

impl Banded {
    /// Of `size` unknowns, of which an equation has those within `width` of each other.
    pub fn new(size: usize, width: usize) -> Self {
        Banded { width, lower: vec![0.0; size * width], right: vec![0.0; size] }
    }

    /// weight·(Σ shares·unknowns − value)², the unknowns being those from `first` on.
    pub fn add(&mut self, first: usize, shares: &[f64], value: f64, weight: f64) {
        for (high, right) in shares.iter().enumerate().filter(|(_, share)| **share != 0.0) {
            let end = (first + high + 1) * self.width;
            let scaled = weight * right;
            let row = &mut self.lower[end - high - 1..end];
            row.iter_mut().zip(&shares[..=high]).for_each(|(element, left)| *element += scaled * left);
            self.right[first + high] += scaled * value;
        }
    }

    /// Adds to the element of two unknowns.
    pub fn add_element(&mut self, one: usize, other: usize, value: f64) {
        let (high, low) = (one.max(other), one.min(other));
        self.lower[(high + 1) * self.width - 1 - (high - low)] += value;
    }

    /// Adds to the right-hand side.
    pub fn add_right(&mut self, unknown: usize, value: f64) {
        self.right[unknown] += value;
    }

    /// The factor, and the solution.
    pub fn solve(self) -> (BandedFactor, Vec<f64>) {
        let Banded { width, mut lower, right: mut x } = self;
        for row in 0..x.len() {
            let reach = row.min(width - 1);
            let (before, own) = lower.split_at_mut(row * width);
            let own = &mut own[width - 1 - reach..width];
            for place in 0..=reach {
                let column = row - reach + place;
                if place == reach {
                    let rest = own[reach] - dot(&own[..reach], &own[..reach]);
                    own[reach] = rest.max(f64::MIN_POSITIVE).sqrt();
                } else {
                    let end = (column + 1) * width - 1;
                    let other = &before[end - place..=end];
                    own[place] = (own[place] - dot(&own[..place], &other[..place])) / other[place];
                }
            }
            x[row] = (x[row] - dot(&own[..reach], &x[row - reach..row])) / own[reach];
        }
        let factor = BandedFactor { width, lower };
        factor.solve_upper(&mut x);
        (factor, x)
    }
}

impl BandedFactor {
    /// x → L⁻¹x.
    pub fn solve_lower(&self, x: &mut [f64]) {
        for row in 0..x.len() {
            let reach = row.min(self.width - 1);
            let end = (row + 1) * self.width - 1;
            let shares = &self.lower[end - reach..end];
            x[row] = (x[row] - dot(shares, &x[row - reach..row])) / self.lower[end];
        }
    }

    /// x → L⁻ᵀx. Of white noise it makes one with the inverse of the matrix as its covariance.
    pub fn solve_upper(&self, x: &mut [f64]) {
        for row in (0..x.len()).rev() {
            let reach = row.min(self.width - 1);
            let end = (row + 1) * self.width - 1;
            x[row] /= self.lower[end];
            let (before, own) = x.split_at_mut(row);
            let shares = &self.lower[end - reach..end];
            before[row - reach..].iter_mut().zip(shares).for_each(|(value, share)| *value -= share * own[0]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::prelude::Solve;
    use faer::{Mat, Side};

    /// A dense matrix is the oracle.
    #[test]
    fn a_band_is_solved_as_a_whole_matrix() -> Result<(), Box<dyn std::error::Error>> {
        let (size, width) = (23, 5);
        let mut banded = Banded::new(size, width);
        let (mut matrix, mut right) = (Mat::<f64>::zeros(size, size), Mat::<f64>::zeros(size, 1));
        for equation in 0..60_usize {
            let first = equation * 7 % (size - width + 1);
            let shares: Vec<f64> = (0..width).map(|k| ((equation * 5 + k * 3) as f64).sin()).collect();
            let (value, weight) = ((equation as f64).cos(), 1.0 + (equation % 3) as f64);
            banded.add(first, &shares, value, weight);
            for a in 0..width {
                right[(first + a, 0)] += weight * shares[a] * value;
                for b in 0..width {
                    matrix[(first + a, first + b)] += weight * shares[a] * shares[b];
                }
            }
        }
        let expected = matrix.llt(Side::Lower)?.solve(&right);
        let (factor, x) = banded.solve();
        for row in 0..size {
            assert!((x[row] - expected[(row, 0)]).abs() < 1e-9, "{row}");
        }
        // (L⁻ᵀ)(L⁻ᵀ)ᵀ is the inverse.
        let columns: Vec<Vec<f64>> = (0..size)
            .map(|k| {
                let mut unit = vec![0.0; size];
                unit[k] = 1.0;
                factor.solve_upper(&mut unit);
                unit
            })
            .collect();
        let inverse = matrix.llt(Side::Lower)?.solve(Mat::<f64>::identity(size, size));
        for a in 0..size {
            let mut unit = vec![0.0; size];
            unit[a] = 1.0;
            factor.solve_lower(&mut unit);
            factor.solve_upper(&mut unit);
            for b in 0..size {
                let own: f64 = columns.iter().map(|column| column[a] * column[b]).sum();
                assert!((own - inverse[(a, b)]).abs() < 1e-9, "{a}, {b}");
                assert!((unit[b] - inverse[(a, b)]).abs() < 1e-9, "{a}, {b}");
            }
        }
        Ok(())
    }
}
