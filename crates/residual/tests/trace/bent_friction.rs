//! Frictions that grow with another power of the speed than the catalogue's.

use phiw_identification::EffectSpec;

use super::robot::{State, folds, named, traced, traced_on};

/// A viscous friction that grows with a power of the speed is bent, and neither falls nor grows with the
/// square: a Stribeck and a negative quadratic friction were named, which together draw it.
#[test]
fn a_viscous_friction_that_is_bent_is_no_other_friction() {
    for (power, falls, expected) in [(0.7, 0.0, false), (1.0, 3.0, true)] {
        let tracing = traced(11, &|state, torque| {
            let speed = state.qd[1].abs();
            let own = 5.0 * speed.powf(power) + falls * (-(speed / 0.15).powi(2)).exp();
            torque[1] += own * (state.qd[1] / 0.01).tanh();
        });
        let others = ["stribeck_friction", "quadratic_friction"];
        let is_named = named(&tracing).iter().any(|(kind, _)| others.contains(&kind.as_str()));
        assert_eq!(is_named, expected, "{power}: {:?}", tracing.effects);
    }
}

/// The elbow has no Coulomb friction, and its viscous friction grows with a power of the speed. A quadratic
/// one bends it, beside which a Coulomb friction would be negative: for want of that the quadratic one could
/// not enter, and the residual had structure that other kinds were taken for.
#[test]
fn a_viscous_friction_is_bent_where_there_is_no_coulomb_friction() {
    let secret = |state: &State<'_>, torque: &mut [f64]| {
        let speed = state.qd[1];
        torque[1] -= 0.4 * speed + 0.6 * (speed / 0.01).tanh();
        torque[1] += 8.0 * speed.abs().powf(1.1) * speed.signum();
    };
    let tracing = traced_on(folds().0, &[], 11, &secret, false);
    let of_elbow: Vec<&str> = tracing
        .effects
        .iter()
        .filter(|found| found.spec.joints == ["elbow"])
        .map(|found| found.spec.kind.as_str())
        .collect();
    assert!(of_elbow.iter().all(|kind| kind.ends_with("_friction")), "{:?}", tracing.effects);
    let is_bent = |spec: &EffectSpec| spec.kind == "quadratic_friction" && spec.joints == ["elbow"];
    assert!(tracing.specs.iter().any(is_bent), "{:?}", tracing.specs);
    let error = &tracing.model.held_out;
    assert!(error.rmse[1] < 0.012 * error.rms_torque[1], "{error:?}");
}
