//! A smooth curve through a few even knots that has constants, slopes, sines and cosines in it.

use std::f64::consts::TAU;

/// The curve through values at even knots that is a + b·q + c·sin q + d·cos q between any two of them, with
/// slope and curvature going on from one to the next (Schweikert's spline in tension, 1966, of imaginary
/// tension). Where it has ends, one formula holds over the first two spans and one over the last two, so
/// that a + b·q + c·sin q + d·cos q itself is met exactly.
#[derive(Clone, Debug)]
pub(crate) struct TrigonometricSpline {
    lower: f64,
    /// Between two knots, in units of `unit`.
    spacing: f64,
    /// What the sines count as one radian \[rad, m\].
    unit: f64,
    knots: usize,
    periodic: bool,
    /// Curvature at each knot for a value of one at each knot, `[knot × value]`.
    curvatures: Vec<f64>,
}

/// What each knot's value counts at a position.
pub(crate) struct Weights<'a> {
    spline: &'a TrigonometricSpline,
    /// The knots before and behind the position.
    span: [usize; 2],
    /// What their values count directly, and through their curvatures.
    direct: [f64; 2],
    bent: [f64; 2],
}

impl TrigonometricSpline {
    /// Over an arc of a length > 0 from `lower` on \[rad, m\]; four knots or more. What is longer than a turn
    /// is a slide, of whose position there are no sines to be met.
    pub fn over(lower: f64, length: f64, knots: usize) -> Self {
        let unit = if length > TAU { length } else { 1.0 };
        Self::new(lower, unit, length / unit / (knots - 1) as f64, knots, false)
    }

    /// Around a turn, the first knot at `lower` \[rad\]; four knots or more.
    pub fn around(lower: f64, knots: usize) -> Self {
        Self::new(lower, 1.0, TAU / knots as f64, knots, true)
    }

    fn new(lower: f64, unit: f64, spacing: f64, knots: usize, periodic: bool) -> Self {
        let mut spline =
            TrigonometricSpline { lower, unit, spacing, knots, periodic, curvatures: Vec::new() };
        spline.curvatures = spline.solve();
        spline
    }

    /// Number of knots.
    pub fn knots(&self) -> usize {
        self.knots
    }

    /// Where it begins \[rad, m\].
    pub fn lower(&self) -> f64 {
        self.lower
    }

    /// How long it is \[rad, m\].
    pub fn length(&self) -> f64 {
        let spans = if self.periodic { self.knots } else { self.knots - 1 };
        self.unit * self.spacing * spans as f64
    }

    /// What each knot's value counts at a position; beyond the ends, at the nearest end.
    pub fn weights(&self, position: f64) -> Weights<'_> {
        let place = match self.periodic {
            true => (position - self.lower).rem_euclid(TAU) / self.spacing,
            false => {
                ((position - self.lower) / (self.unit * self.spacing)).clamp(0.0, (self.knots - 1) as f64)
            }
        };
        let last = if self.periodic { self.knots - 1 } else { self.knots - 2 };
        let first = (place as usize).min(last);
        let behind = (place - first as f64).clamp(0.0, 1.0);
        let before = 1.0 - behind;
        let bent = |share: f64| share - (share * self.spacing).sin() / self.spacing.sin();
        Weights {
            spline: self,
            span: [first, (first + 1) % self.knots],
            direct: [before, behind],
            bent: [bent(before), bent(behind)],
        }
    }

    /// Curvatures M of the curve through each unit vector.
    ///
    /// In a span of length h, at x from its beginning, the curve is −(M₀·sin(h − x) + M₁·sin x)/sin h plus a
    /// line. The slope goes on over a knot where (M₋ + M₊)·(1/sin h − 1/h) + 2·M·(1/h − cos h/sin h) is
    /// (y₋ − 2y + y₊)/h, and the third derivative where M₋ + M₊ = 2·M·cos h.
    fn solve(&self) -> Vec<f64> {
        let (count, h) = (self.knots, self.spacing);
        let mut matrix = vec![0.0; count * count];
        let mut right = vec![0.0; count * count];
        for knot in 0..count {
            let is_end = !self.periodic && (knot == 0 || knot == count - 1);
            let middle = if is_end { knot.clamp(1, count - 2) } else { knot };
            let [before, behind] = [(middle + count - 1) % count, (middle + 1) % count];
            let (beside, own) = match is_end {
                true => (1.0, -2.0 * h.cos()),
                false => (h * (1.0 / h.sin() - 1.0 / h), 2.0 * h * (1.0 / h - h.cos() / h.sin())),
            };
            matrix[knot * count + before] += beside;
            matrix[knot * count + behind] += beside;
            matrix[knot * count + middle] += own;
            if !is_end {
                right[knot * count + before] += 1.0;
                right[knot * count + behind] += 1.0;
                right[knot * count + middle] -= 2.0;
            }
        }
        eliminate(&mut matrix, &mut right, count);
        right
    }
}

impl Weights<'_> {
    /// What the value at a knot counts.
    #[inline]
    pub fn of(&self, knot: usize) -> f64 {
        let count = self.spline.knots;
        let mut sum = 0.0;
        for side in 0..2 {
            let own = if self.span[side] == knot { self.direct[side] } else { 0.0 };
            sum += own + self.bent[side] * self.spline.curvatures[self.span[side] * count + knot];
        }
        sum
    }
}

/// Solves a square system for as many right-hand sides, in their place; Gauss with the largest pivots.
fn eliminate(matrix: &mut [f64], right: &mut [f64], count: usize) {
    for column in 0..count {
        let size = |row: &usize| matrix[row * count + column].abs();
        let pivot = (column..count).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(column);
        for place in 0..count {
            matrix.swap(column * count + place, pivot * count + place);
            right.swap(column * count + place, pivot * count + place);
        }
        let own = matrix[column * count + column];
        for row in (0..count).filter(|row| *row != column) {
            let factor = matrix[row * count + column] / own;
            for place in 0..count {
                matrix[row * count + place] -= factor * matrix[column * count + place];
                right[row * count + place] -= factor * right[column * count + place];
            }
        }
        for place in 0..count {
            matrix[column * count + place] /= own;
            right[column * count + place] /= own;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at(spline: &TrigonometricSpline, position: f64, value: impl Fn(f64) -> f64) -> f64 {
        let weights = spline.weights(position);
        let of =
            |knot: usize| weights.of(knot) * value(spline.lower + knot as f64 * spline.unit * spline.spacing);
        (0..spline.knots).map(of).sum()
    }

    proptest! {
        /// What gravity, a spring or an offset adds is in a map exactly, so that a fit sees it as the same
        /// columns.
        #[test]
        fn simple_forms_are_met_exactly(
            lower in -4.0..4.0_f64,
            length in 0.05..6.0_f64,
            knots in 6..=12_usize,
            place in 0.0..1.0_f64,
            (a, b, c, d) in (-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64),
        ) {
            let curve = |q: f64| a + b * q + c * q.sin() + d * q.cos();
            let q = lower + place * length;
            let over = TrigonometricSpline::over(lower, length, knots);
            prop_assert!((at(&over, q, curve) - curve(q)).abs() < 1e-7);
            let curve = |q: f64| a + c * q.sin() + d * q.cos();
            let around = TrigonometricSpline::around(lower, knots);
            prop_assert!((at(&around, q, curve) - curve(q)).abs() < 1e-9);
        }

        /// Value, slope and curvature on both sides of a knot, by differences, against a step where they
        /// change by far more.
        #[test]
        fn slope_and_curvature_go_on_over_the_knots(
            knots in 6..=12_usize,
            periodic: bool,
            seed in 0.0..6.0_f64,
        ) {
            let value = |q: f64| (7.0 * q + seed).sin();
            let spline = match periodic {
                true => TrigonometricSpline::around(0.0, knots),
                false => TrigonometricSpline::over(0.0, 3.0, knots),
            };
            let h = 1e-4 * spline.spacing;
            let curve = |q: f64| at(&spline, q, value);
            for knot in 1..knots - 1 {
                let q = knot as f64 * spline.spacing;
                let slope = |from: f64| (curve(from + h) - curve(from)) / h;
                let bend = |middle: f64| (slope(middle) - slope(middle - h)) / h;
                prop_assert!((curve(q) - value(q)).abs() < 1e-9);
                prop_assert!((slope(q) - slope(q - h)).abs() < 1e-2 / spline.spacing);
                prop_assert!((bend(q + 2.0 * h) - bend(q - 2.0 * h)).abs() < 0.1 / spline.spacing.powi(2));
            }
        }
    }

    #[test]
    fn a_slide_longer_than_a_turn_has_slopes() {
        let spline = TrigonometricSpline::over(-2.0, 25.0, 6);
        for q in [-2.0, 3.3, 17.9, 22.9] {
            assert!((at(&spline, q, |q| 3.0 - 0.5 * q) - 3.0 + 0.5 * q).abs() < 1e-9);
        }
    }

    #[test]
    fn beyond_an_arc_its_end_goes_on_and_a_turn_repeats() {
        let value = |q: f64| q * q;
        let over = TrigonometricSpline::over(-1.0, 2.5, 7);
        assert_eq!(at(&over, 9.0, value), at(&over, 1.5, value));
        assert!((at(&over, -9.0, value) - 1.0).abs() < 1e-12);
        let around = TrigonometricSpline::around(0.3, 8);
        assert!((at(&around, 0.9 - TAU, value) - at(&around, 0.9, value)).abs() < 1e-12);
    }
}
