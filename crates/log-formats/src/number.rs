//! Decimal text to `f64`, fast for what loggers write.

/// Powers of ten that `f64` holds exactly.
const EXACT_POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// The number that `cell` spells (blanks around it allowed), `None` where it spells none.
///
/// Digits with a point take a fast path: up to 2⁵³ as an integer over an exact power of ten, one correctly
/// rounded division (Clinger 1990). All else goes to the standard library, so the result is always the
/// nearest `f64`.
pub(crate) fn parse(cell: &[u8]) -> Option<f64> {
    fast(cell).or_else(|| std::str::from_utf8(cell).ok()?.trim().parse().ok())
}

fn fast(cell: &[u8]) -> Option<f64> {
    let (negative, digits) = match cell {
        [b'-', rest @ ..] => (true, rest),
        rest => (false, rest),
    };
    // 18 digits fit u64 whatever they are.
    if digits.len() > 19 {
        return None;
    }
    let mut integer = 0u64;
    let mut decimals = None;
    let mut count = 0;
    for (i, &byte) in digits.iter().enumerate() {
        match byte {
            b'0'..=b'9' => {
                integer = integer.wrapping_mul(10).wrapping_add(u64::from(byte - b'0'));
                count += 1;
            }
            b'.' if decimals.is_none() => decimals = Some(digits.len() - 1 - i),
            _ => return None,
        }
    }
    if count == 0 || count > 18 || integer > 1 << 53 {
        return None;
    }
    let magnitude = integer as f64 / EXACT_POWERS[decimals.unwrap_or(0)];
    Some(if negative { -magnitude } else { magnitude })
}

#[cfg(test)]
mod tests {
    use super::parse;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn equals_the_standard_library(text in "-?[0-9]{0,20}\\.?[0-9]{0,20}(e-?[0-9]{1,3})?") {
            let standard: Option<f64> = text.parse().ok();
            prop_assert_eq!(parse(text.as_bytes()).map(f64::to_bits), standard.map(f64::to_bits));
        }

        #[test]
        fn round_trips(x in any::<f64>().prop_filter("finite", |x| x.is_finite())) {
            prop_assert_eq!(parse(format!("{x}").as_bytes()).map(f64::to_bits), Some(x.to_bits()));
        }
    }

    #[test]
    fn odd_cells() {
        let check =
            |text: &str, expected: Option<f64>| assert_eq!(parse(text.as_bytes()), expected, "{text:?}");
        check(" 1.5 ", Some(1.5));
        check("+2", Some(2.0));
        check("1e279", Some(1e279));
        check("-inf", Some(f64::NEG_INFINITY));
        for not_a_number in ["", " ", "-", ".", "1.2.3", "1,5", "0x10", "abc", "1 2"] {
            check(not_a_number, None);
        }
        assert!(parse(b"NaN").is_some_and(f64::is_nan));
    }
}
