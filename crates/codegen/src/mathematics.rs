//! Elementary functions for generated Rust, as `core` has none. This file is compiled and tested here, and
//! its part below is copied into what is generated.

#![allow(dead_code)] // Each generated file uses some of them.
// BEGIN
/// Sine and cosine of the rest of an angle [rad] after multiples of a quarter turn (Cody & Waite 1980: the
/// quarter turn in three parts; Taylor's polynomials beyond that). To the last digits up to 1e5 rad.
fn quarter(angle: f64) -> (i64, f64, f64) {
    let turns = angle * core::f64::consts::FRAC_2_PI;
    let nearest = (if turns < 0.0 { turns - 0.5 } else { turns + 0.5 }) as i64;
    let count = nearest as f64;
    let rest = angle - count * 1.570_796_326_734_125_6;
    let part = count * 6.077_100_506_303_966e-11;
    let x = rest - part;
    let left = ((rest - x) - part) - count * 2.022_266_248_795_950_6e-21;
    let square = x * x;
    let sines = [
        -1.666_666_666_666_666_6e-1,
        8.333_333_333_333_333e-3,
        -1.984_126_984_126_984e-4,
        2.755_731_922_398_589e-6,
        -2.505_210_838_544_172e-8,
        1.605_904_383_682_161_3e-10,
        -7.647_163_731_819_816e-13,
        2.811_457_254_345_520_6e-15,
    ];
    let cosines = [
        4.166_666_666_666_666_4e-2,
        -1.388_888_888_888_889e-3,
        2.480_158_730_158_73e-5,
        -2.755_731_922_398_589_3e-7,
        2.087_675_698_786_81e-9,
        -1.147_074_559_772_972_5e-11,
        4.779_477_332_387_385e-14,
        -1.561_920_696_858_622_5e-16,
    ];
    let polynomial = |coefficients: &[f64; 8]| {
        let mut sum = 0.0;
        for coefficient in coefficients.iter().rev() {
            sum = sum * square + coefficient;
        }
        sum
    };
    let first_cosine = 1.0 - 0.5 * square;
    let cosine = first_cosine
        + (((1.0 - first_cosine) - 0.5 * square) + (square * square * polynomial(&cosines) - x * left));
    let sine = x + (x * square * polynomial(&sines) + left * first_cosine);
    (nearest, sine, cosine)
}

/// Sine of an angle [rad].
fn sin(angle: f64) -> f64 {
    let (turns, sine, cosine) = quarter(angle);
    match turns & 3 {
        0 => sine,
        1 => cosine,
        2 => -sine,
        _ => -cosine,
    }
}

/// Cosine of an angle [rad].
fn cos(angle: f64) -> f64 {
    let (turns, sine, cosine) = quarter(angle);
    match turns & 3 {
        0 => cosine,
        1 => -sine,
        2 => -cosine,
        _ => sine,
    }
}

/// Exponential: powers of two times Taylor's polynomial of the rest.
fn exp(x: f64) -> f64 {
    if x < -700.0 {
        return 0.0;
    }
    if x > 700.0 {
        return f64::INFINITY;
    }
    let doublings = x * core::f64::consts::LOG2_E;
    let nearest = (if doublings < 0.0 { doublings - 0.5 } else { doublings + 0.5 }) as i64;
    let count = nearest as f64;
    let rest = (x - count * 6.931_471_803_691_238e-1) - count * 1.908_214_929_270_587_7e-10;
    let mut sum = 1.0;
    let mut order = 14.0;
    while order > 0.5 {
        sum = 1.0 + rest * sum / order;
        order -= 1.0;
    }
    sum * f64::from_bits(((1023 + nearest) as u64) << 52)
}

/// Hyperbolic tangent: by the exponential, and by its continued fraction where that would lose digits.
fn tanh(x: f64) -> f64 {
    let magnitude = abs(x);
    if magnitude < 0.4 {
        let square = x * x;
        let mut fraction = 19.0;
        let mut order = 17.0;
        while order > 0.5 {
            fraction = order + square / fraction;
            order -= 2.0;
        }
        x / fraction
    } else {
        let value = if magnitude > 20.0 { 1.0 } else { 1.0 - 2.0 / (exp(2.0 * magnitude) + 1.0) };
        if x < 0.0 { -value } else { value }
    }
}

/// Magnitude.
fn abs(x: f64) -> f64 {
    if x < 0.0 { -x } else { x }
}

/// The number where it is positive, else zero.
fn positive_part(x: f64) -> f64 {
    if x > 0.0 { x } else { 0.0 }
}

/// The sign; zero at zero.
fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        0.0
    }
}

/// The magnitude to a power, by its logarithm.
fn power(x: f64, exponent: f64) -> f64 {
    let magnitude = abs(x);
    if magnitude < f64::MIN_POSITIVE {
        return 0.0;
    }
    let bits = magnitude.to_bits();
    let mut exponent_of_two = (bits >> 52) as i64 - 1023;
    let mut mantissa = f64::from_bits((bits & 0x000f_ffff_ffff_ffff) | 0x3ff0_0000_0000_0000);
    if mantissa > core::f64::consts::SQRT_2 {
        mantissa *= 0.5;
        exponent_of_two += 1;
    }
    let ratio = (mantissa - 1.0) / (mantissa + 1.0);
    let square = ratio * ratio;
    let mut sum = 0.0;
    let mut order = 23.0;
    while order > 0.5 {
        sum = sum * square + 1.0 / order;
        order -= 2.0;
    }
    exp(exponent * (exponent_of_two as f64 * core::f64::consts::LN_2 + 2.0 * ratio * sum))
}
// END

/// The part that is copied.
pub(crate) fn text() -> &'static str {
    let whole = include_str!("mathematics.rs");
    let begin = whole.find("// BEGIN\n").map_or(0, |at| at + "// BEGIN\n".len());
    let end = whole.find("// END\n").unwrap_or(whole.len());
    &whole[begin..end]
}

#[cfg(test)]
mod tests {
    use super::{cos, exp, power, sin, tanh};

    fn check(what: &str, x: f64, found: f64, expected: f64) {
        // A power loses the digits that its logarithm is above one.
        let digits = if what == "power" { 16.0 } else { 4.0 };
        let largest = digits * f64::EPSILON * expected.abs().max(1e-300);
        assert!((found - expected).abs() <= largest, "{what}({x:e}) is {found:e}, not {expected:e}");
    }

    #[test]
    fn functions_are_right_to_the_last_digits() {
        for step in -40_000..=40_000 {
            let x = f64::from(step) * 0.001_37;
            // Near a zero the last digits of the angle itself are what is left.
            let angle = |found: f64, expected: f64| (found - expected).abs() < 4e-16;
            assert!(angle(sin(x), x.sin()) && angle(cos(x), x.cos()), "{x}: {} {}", sin(x), cos(x));
            check("tanh", x, tanh(x), x.tanh());
            check("exp", x, exp(x), x.exp());
            check("power", x, power(x, 1.3), x.abs().powf(1.3));
        }
        for (x, tiny) in [(0.0, 0.0), (1e-300, 1e-300), (-1e-9, -1e-9)] {
            check("sin", x, sin(x), tiny);
            check("tanh", x, tanh(x), tiny);
        }
        assert!((sin(1e5) - 1e5_f64.sin()).abs() < 1e-15 && (cos(-9e4) - (-9e4_f64).cos()).abs() < 1e-15);
        assert_eq!((exp(-1000.0), exp(1000.0), power(0.0, 1.5)), (0.0, f64::INFINITY, 0.0));
    }
}
