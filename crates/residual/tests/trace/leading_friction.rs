//! Friction that turns before the velocity does, as that of a simulator that holds it by a soft constraint.

use super::robot::{State, folds, named, traced_on};

/// Logs of robots that MuJoCo simulated had friction losses with its defaults: −(q̈ + q̇/9.5 ms) times a
/// constant until it slips. Delays of single joints were named for it, and up to 3 % of the torques left.
#[test]
fn frictions_of_a_soft_constraint_are_frictions_and_no_delays() {
    let secret = |state: &State<'_>, torque: &mut [f64]| {
        for (joint, (slides_at, width)) in [(3.0, 0.01), (2.0, 0.15)].into_iter().enumerate() {
            let (velocity, acceleration) = (state.qd[joint], state.qdd[joint]);
            let line = ((velocity + 0.0095 * acceleration) / width).clamp(-1.0, 1.0);
            torque[joint] += slides_at * line - 0.6 * (velocity / 0.01).tanh();
        }
    };
    let tracing = traced_on(folds().0, &[], 11, &secret, false);
    let named = named(&tracing);
    let expected = ["coulomb_friction", "viscous_friction"];
    assert!(named.len() == 4 && named.iter().all(|(kind, _)| expected.contains(&kind.as_str())), "{named:?}");
    let leads = tracing.specs.iter().filter(|spec| spec.kind == "coulomb_friction");
    let leads: Vec<f64> = leads.filter_map(|spec| spec.constants.get("sign_lead").copied()).collect();
    assert!(leads.len() == 2 && leads.iter().all(|lead| (0.008..0.011).contains(lead)), "{leads:?}");
}
