//! Tail probabilities of Fisher's and Student's distributions.

use statrs::function::beta::beta_reg;

/// P(F > `value`) for Fisher's distribution with `numerator` and `denominator` degrees of freedom.
///
/// From the small side of the incomplete beta function, so that a tail of 1e-40 has its digits, too. 1 where
/// there is nothing to tell from: no value, or no degrees.
pub(super) fn fisher_tail(value: f64, numerator: f64, denominator: f64) -> f64 {
    let tells = value > 0.0 && numerator > 0.0 && denominator > 0.0;
    if !tells {
        return 1.0;
    }
    beta_reg(0.5 * denominator, 0.5 * numerator, denominator / (denominator + numerator * value))
}

/// P(t > `value`) for Student's distribution with `freedom` degrees of freedom.
pub(crate) fn students_tail(value: f64, freedom: f64) -> f64 {
    let half = 0.5 * fisher_tail(value * value, 1.0, freedom);
    if value > 0.0 { half } else { 1.0 - half }
}

#[cfg(test)]
mod tests {
    use super::{fisher_tail, students_tail};

    #[test]
    fn tails_are_those_of_the_tables() {
        // value, degrees of freedom, tail: quantiles of published tables; Student's t with d is Fisher's with
        // (1, d) of its square, two-sided.
        let table = [
            (4.964_6, 1.0, 10.0, 0.05),
            (10.044_3, 1.0, 10.0, 0.01),
            (3.708_3, 3.0, 10.0, 0.05),
            (3.492_8, 2.0, 20.0, 0.05),
            (4.780_9_f64.powi(2), 1.0, 9.0, 0.001),
            (1.0, 5.0, 5.0, 0.5),
        ];
        for (value, numerator, denominator, tail) in table {
            let found = fisher_tail(value, numerator, denominator);
            assert!((found - tail).abs() < 2e-3 * tail.max(0.05), "{value}: {found} {tail}");
        }
    }

    /// With two degrees of the numerator the tail is (1 + 2v/d)^(−d/2), however many rows there are and
    /// however far out.
    #[test]
    fn tails_are_those_of_the_closed_form_however_far_out() {
        for denominator in [1.0, 3.0, 20.0, 400.0, 1e4, 1e6] {
            for value in [1e-3, 0.5, 1.0, 4.0, 20.0, 90.0] {
                let exact = f64::exp(-0.5 * denominator * f64::ln_1p(2.0 * value / denominator));
                let found = fisher_tail(value, 2.0, denominator);
                assert!((found - exact).abs() < 1e-6 * exact, "{value} {denominator}: {found} {exact}");
            }
        }
        // One stretch of motion leaves no degree to its spread, a factor without rows none at all.
        for nothing in [(4.0, 1.0, 0.0), (4.0, 0.0, 9.0), (f64::NAN, 1.0, 9.0), (4.0, 1.0, f64::NAN)] {
            let (value, numerator, denominator) = nothing;
            assert_eq!(fisher_tail(value, numerator, denominator), 1.0, "{nothing:?}");
        }
        assert_eq!(fisher_tail(f64::INFINITY, 2.0, 9.0), 0.0);
        // Student's with one degree is Cauchy's.
        for value in [-30.0, -1.0, 0.0, 0.3, 1.0, 1e4] {
            let exact = 0.5 - f64::atan(value) / std::f64::consts::PI;
            assert!((students_tail(value, 1.0) - exact).abs() < 1e-9, "{value}");
        }
    }
}
