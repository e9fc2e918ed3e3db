//! Numbers as people read them.

/// What stands for a number that is absent or not finite.
pub(crate) const ABSENT: &str = "–";

/// `value` with so many significant digits: `24.1`, `0.0123`, `3.2·10⁻⁷`; `–` if it is not finite.
pub fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return ABSENT.into();
    }
    if value == 0.0 {
        return "0".into();
    }
    let digits = digits.max(1);
    // Formatting rounds, and rounding can carry into the next decade (9.996 → 10.0): ask the formatter.
    let scientific = format!("{:.*e}", digits - 1, value);
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-4..6).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        proper_minus(&format!("{value:.decimals$}"))
    } else {
        proper_minus(&format!("{mantissa}·10{}", superscript(exponent)))
    }
}

/// `share` (1 = all) as a percentage with three significant digits and at most one decimal.
pub fn percent(share: f64) -> String {
    if !share.is_finite() {
        return ABSENT.into();
    }
    let percent = 100.0 * share;
    let decimals = if percent.abs() < 99.95 { 1 } else { 0 };
    if percent.abs() >= 1e5 {
        significant(percent, 3)
    } else {
        proper_minus(&format!("{percent:.decimals$}"))
    }
}

/// The label of a tick at `value` on an axis whose ticks are `step` apart: just the digits that tell ticks
/// apart.
pub(crate) fn tick(value: f64, step: f64) -> String {
    if value.abs() < 1e-6 * step {
        return "0".into();
    }
    let step_exponent = (step.log10() + 1e-9).floor() as i32;
    if value.abs() >= 1e5 || step_exponent < -4 {
        let exponent = value.abs().log10().floor() as i32;
        let decimals = (exponent - step_exponent).clamp(0, 6) as usize;
        let text = format!("{value:.decimals$e}");
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let mantissa = if mantissa.contains('.') {
            mantissa.trim_end_matches('0').trim_end_matches('.')
        } else {
            mantissa
        };
        return proper_minus(&format!("{mantissa}·10{}", superscript(exponent.parse().unwrap_or(0))));
    }
    let decimals = (-step_exponent).max(0) as usize;
    proper_minus(&format!("{value:.decimals$}"))
}

/// The label of a tick at 10^`exponent` on a logarithmic axis.
pub(crate) fn decade(exponent: i32) -> String {
    match exponent {
        -2..0 => format!("{:.*}", exponent.unsigned_abs() as usize, 10f64.powi(exponent)),
        0..4 => format!("{:.0}", 10f64.powi(exponent)),
        _ => format!("10{}", superscript(exponent)),
    }
}

fn superscript(exponent: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    exponent.to_string().chars().map(|c| c.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize])).collect()
}

/// The typographic minus, which is as wide as a plus; and no "−0.0".
fn proper_minus(text: &str) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.into(),
        Some(rest) => format!("−{rest}"),
        None => text.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn significant_digits() {
        for (value, digits, expected) in [
            (24.123, 3, "24.1"),
            (9.996, 3, "10.0"),
            (0.012_345, 3, "0.0123"),
            (-3.2e-7, 2, "−3.2·10⁻⁷"),
            (1.5e12, 3, "1.50·10¹²"),
            (95_104.2, 3, "95104"),
            (0.0, 3, "0"),
            (-0.0, 3, "0"),
            (f64::NAN, 3, "–"),
            (f64::INFINITY, 3, "–"),
        ] {
            assert_eq!(significant(value, digits), expected, "{value} to {digits} digits");
        }
    }

    #[test]
    fn percentages() {
        for (share, expected) in
            [(0.241, "24.1"), (1.0, "100"), (0.0, "0.0"), (-1e-9, "0.0"), (f64::NAN, "–"), (1e9, "1.00·10¹¹")]
        {
            assert_eq!(percent(share), expected, "{share}");
        }
    }

    #[test]
    fn ticks() {
        for (value, step, expected) in [
            (0.1 + 0.2, 0.1, "0.3"),
            (1e-17, 0.1, "0"),
            (-2.5, 0.5, "−2.5"),
            (200.0, 50.0, "200"),
            (2.5e6, 5e5, "2.5·10⁶"),
            (2e-6, 1e-6, "2·10⁻⁶"),
        ] {
            assert_eq!(tick(value, step), expected, "{value} in steps of {step}");
        }
        for (exponent, expected) in
            [(-4, "10⁻⁴"), (-2, "0.01"), (-1, "0.1"), (0, "1"), (3, "1000"), (5, "10⁵")]
        {
            assert_eq!(decade(exponent), expected);
        }
    }
}
