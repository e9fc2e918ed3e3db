//! Tail probabilities of Fisher's and Student's distributions.

/// P(F > `value`) for Fisher's distribution with `numerator` and `denominator` degrees of freedom.
pub(super) fn fisher_tail(value: f64, numerator: f64, denominator: f64) -> f64 {
    if value.is_nan() || value <= 0.0 {
        return 1.0;
    }
    incomplete_beta(denominator / (denominator + numerator * value), 0.5 * denominator, 0.5 * numerator)
}

/// P(t > `value`) for Student's distribution with `freedom` degrees of freedom.
pub(crate) fn students_tail(value: f64, freedom: f64) -> f64 {
    let half = 0.5 * fisher_tail(value * value, 1.0, freedom);
    if value > 0.0 { half } else { 1.0 - half }
}

/// The regularised incomplete beta function I_x(a, b), by Lentz's continued fraction (Press et al., Numerical
/// Recipes, 6.4).
fn incomplete_beta(x: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    let front = (log_gamma(a + b) - log_gamma(a) - log_gamma(b) + a * x.ln() + b * (-x).ln_1p()).exp();
    if x < (a + 1.0) / (a + b + 2.0) {
        front * continued_fraction(x, a, b) / a
    } else {
        1.0 - front * continued_fraction(1.0 - x, b, a) / b
    }
}

fn continued_fraction(x: f64, a: f64, b: f64) -> f64 {
    const TINY: f64 = 1e-300;
    let guarded = |value: f64| if value.abs() < TINY { TINY } else { value };
    let mut c = 1.0;
    let mut d = 1.0 / guarded(1.0 - (a + b) * x / (a + 1.0));
    let mut value = d;
    for step in 1..500 {
        let m = f64::from(step);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        d = 1.0 / guarded(1.0 + even * d);
        c = guarded(1.0 + even / c);
        value *= d * c;
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        d = 1.0 / guarded(1.0 + odd * d);
        c = guarded(1.0 + odd / c);
        value *= d * c;
        if (d * c - 1.0).abs() < 1e-14 {
            break;
        }
    }
    value
}

/// log Γ(x) for x > 0 (Lanczos 1964).
fn log_gamma(x: f64) -> f64 {
    const COEFFICIENTS: [f64; 6] = [
        76.180_091_729_471_46,
        -86.505_320_329_416_77,
        24.014_098_240_830_91,
        -1.231_739_572_450_155,
        0.120_865_097_386_617_9e-2,
        -0.539_523_938_495_3e-5,
    ];
    let base = x + 5.5 - (x + 0.5) * (x + 5.5).ln();
    let series: f64 =
        COEFFICIENTS.iter().zip(1..).map(|(coefficient, step)| coefficient / (x + f64::from(step))).sum();
    -base + (2.506_628_274_631_000_5 * (1.000_000_000_190_015 + series) / x).ln()
}

#[cfg(test)]
mod tests {
    use super::fisher_tail;

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
}
