//! The root of a function that rises at least as fast as its argument, which implicit steps need.

/// Steps after which the bracket is taken as it is: regula falsi gets there in about eight.
const MOST_STEPS: usize = 80;

/// The root of `excess`, whose slope is at least 1 or near it, to `tolerance`, searched from `guess`.
///
/// Where the slope is at least 1, the root is no farther than the excess at the guess; elsewhere the bracket
/// grows until it holds a change of sign. Then regula falsi, with Illinois' halving (Dowell & Jarratt 1971)
/// and bisection as a guard.
pub(crate) fn rising_root(mut excess: impl FnMut(f64) -> f64, guess: f64, tolerance: f64) -> f64 {
    let at_guess = excess(guess);
    if at_guess == 0.0 || !at_guess.is_finite() {
        return guess;
    }
    let mut reach = -at_guess * 1.000_001;
    let (mut inside, mut at_inside) = (guess, at_guess);
    let (mut outside, mut at_outside) = (guess + reach, excess(guess + reach));
    let mut expansions = 0;
    while at_outside * at_guess > 0.0 && expansions < MOST_STEPS {
        (inside, at_inside) = (outside, at_outside);
        reach *= 2.0;
        outside = guess + reach;
        at_outside = excess(outside);
        expansions += 1;
    }
    for step in 0..MOST_STEPS {
        if at_outside == 0.0 || (outside - inside).abs() <= tolerance {
            break;
        }
        let secant = outside - at_outside * (outside - inside) / (at_outside - at_inside);
        let middle = 0.5 * (inside + outside);
        let next = if step % 4 == 3 || !secant.is_finite() { middle } else { secant };
        let at_next = excess(next);
        if at_next * at_outside < 0.0 {
            (inside, at_inside) = (outside, at_outside);
        } else {
            at_inside *= 0.5;
        }
        if (next - outside).abs() <= 0.1 * tolerance {
            return next;
        }
        (outside, at_outside) = (next, at_next);
    }
    outside
}

#[cfg(test)]
mod tests {
    use super::rising_root;
    use proptest::prelude::*;

    proptest! {
        /// Steep, flat and kinked functions, against bisection.
        #[test]
        fn finds_what_bisection_finds(
            root in -3.0..3.0_f64, steepness in 0.0..1e5_f64, width in 1e-4..1.0_f64, shift in -2.0..2.0_f64, guess in -5.0..5.0_f64,
        ) {
            let bend = |x: f64| steepness * (((x - shift) / width).tanh() + (x - shift).max(0.0));
            let excess = |x: f64| x - root + bend(x) - bend(root);
            let (mut low, mut high) = (-100.0, 100.0);
            for _ in 0..100 {
                let middle = 0.5 * (low + high);
                if excess(middle) > 0.0 { high = middle } else { low = middle }
            }
            let found = rising_root(excess, guess, 1e-12);
            prop_assert!((found - low).abs() < 1e-9, "{found} is not {low}");
        }
    }
}
