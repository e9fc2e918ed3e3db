//! What is declared is a start: what the logs refute of it is said.

use super::robot::{State, named, traced};

/// The elbow has no Coulomb friction: its drive pushes a little too much against it.
fn over_compensated(state: &State<'_>, torque: &mut [f64]) {
    torque[1] -= 0.63 * (state.qd[1] / 0.01).tanh();
}

fn is_in_the_model(tracing: &phiw_residual::trace::Tracing, kind: &str, joint: &str) -> bool {
    tracing.specs.iter().any(|spec| spec.kind == kind && spec.joints == [joint])
}

#[test]
fn a_declared_friction_that_drives_leaves_the_model() {
    let tracing = traced(11, &|state, torque| {
        over_compensated(state, torque);
        torque[1] += 0.5 * (6.0 * state.q[1]).sin();
    });
    assert_eq!(named(&tracing), [("torque_ripple".to_owned(), vec!["elbow".to_owned()])]);
    let [withdrawn] = &tracing.withdrawn[..] else { panic!("{:?}", tracing.withdrawn) };
    assert_eq!((withdrawn.spec.kind.as_str(), &withdrawn.name[..]), ("coulomb_friction", "fc"));
    assert_eq!(withdrawn.spec.joints, ["elbow"]);
    assert!(withdrawn.interval_95[0] < -0.03 && withdrawn.interval_95[1] > -0.03, "{withdrawn:?}");
    assert!(!withdrawn.kept);
    assert!(!is_in_the_model(&tracing, "coulomb_friction", "elbow"));
    assert!(is_in_the_model(&tracing, "coulomb_friction", "shoulder"));
    assert!(tracing.model.held_out.relative < 0.5 * tracing.before.1.relative);
}

/// Where nothing makes up for it, a model with a friction that drives foretells the torque better than one
/// without. It stays, and that is said.
#[test]
fn a_declared_friction_that_drives_stays_where_the_model_is_worse_without_it() {
    let tracing = traced(11, &|state, torque| torque[1] -= 0.9 * (state.qd[1] / 0.01).tanh());
    assert_eq!(named(&tracing), []);
    let [withdrawn] = &tracing.withdrawn[..] else { panic!("{:?}", tracing.withdrawn) };
    assert!(withdrawn.kept);
    assert!(is_in_the_model(&tracing, "coulomb_friction", "elbow"));
    assert!(tracing.model.held_out.relative <= (1.0 + 1e-9) * tracing.before.1.relative);
}
