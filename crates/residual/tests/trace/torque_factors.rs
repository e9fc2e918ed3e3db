//! Torques that are logged as another multiple of what they are: what is linear in a factor about one is not
//! about a half or two.

use super::robot::{DECLARED, State, folds, named, traced, traced_on};
use phiw_residual::trace::{Tracing, Verdict};

/// What the torque of a joint is multiplied by in the log, in the model at the end.
fn factor(tracing: &Tracing, joint: &str) -> f64 {
    let effects = tracing.model.design.effects();
    let is_it = |index: &usize| {
        (tracing.specs[*index].kind == "torque_gain") & (tracing.specs[*index].joints == [joint])
    };
    let place = (0..effects.len()).find(is_it).expect("the model has the gain");
    let fitted = tracing.model.fit.parameters[tracing.model.design.effect_parameters(place).start];
    1.0 + tracing.specs[place].constants.get("gain_error").copied().unwrap_or_default() + fitted
}

/// These torques were called an efficiency, a spring or nothing, with up to half of the error left.
#[test]
fn a_torque_of_a_third_to_three_times_is_a_gain_and_nothing_else() {
    for gain in [0.3, 0.6, 1.5, 2.0, 3.0] {
        let tracing = traced(11, &|_: &State<'_>, torque: &mut [f64]| torque[0] *= gain);
        let [(kind, joints)] = &named(&tracing)[..] else { panic!("{gain}: {:?}", named(&tracing)) };
        assert_eq!(kind, "torque_gain");
        // Of two torques, a factor on the one is one over it on the other, with all parameters of the robot
        // multiplied.
        let expected = if joints[0] == "shoulder" { gain } else { 1.0 / gain };
        let found = factor(&tracing, &joints[0]);
        assert!((found / expected - 1.0).abs() < 0.02, "{gain}: {} times {found}", joints[0]);
        assert_eq!(tracing.verdict, Verdict::Explained, "{gain}");
        assert!(tracing.model.held_out.relative < 0.02, "{gain}: {}", tracing.model.held_out.relative);
    }
}

/// A friction that is missing is no factor, and a factor hides no friction.
#[test]
fn a_factor_and_frictions_are_told_apart_with_nothing_declared() {
    let doubled = |_: &State<'_>, torque: &mut [f64]| torque[1] *= 2.0;
    let tracing = traced_on(folds().0, &[], 11, &doubled, false);
    let mut kinds: Vec<String> = named(&tracing).into_iter().map(|(kind, _)| kind).collect();
    kinds.dedup();
    assert_eq!(kinds, ["coulomb_friction", "torque_gain", "viscous_friction"], "{:?}", named(&tracing));
    assert!(tracing.model.held_out.relative < 0.02, "{}", tracing.model.held_out.relative);
}

/// `identify` left 760 % of the torque held out: each fit moved away from the last.
#[test]
fn a_declared_gain_of_a_third_to_three_is_fitted() {
    for gain in [0.3, 0.6, 1.5, 2.0, 3.0] {
        let doubled = |_: &State<'_>, torque: &mut [f64]| torque[1] *= gain;
        let tracing =
            traced_on(folds().0, &[DECLARED[0], DECLARED[1], "torque_gain:elbow"], 11, &doubled, false);
        assert_eq!(named(&tracing), [], "{gain}");
        assert!(tracing.before.1.relative < 0.02, "{gain}: {}", tracing.before.1.relative);
        assert!((factor(&tracing, "elbow") / gain - 1.0).abs() < 0.02, "{gain}");
    }
}
