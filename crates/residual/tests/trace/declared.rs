//! What is declared is a start: what the logs refute of it is said.

use super::robot::{State, URDF, folds, named, record, traced};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_effects::{Catalogue, SignalRanges};
use phiw_identification::{Data, identify};
use phiw_telemetry::{Conditioning, ConditioningOptions};

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

/// A declared stop was put where its column fitted best: at the other end of the range, where it pulled.
#[test]
fn a_declared_stop_is_put_where_it_pushes() {
    let secret = |state: &State<'_>, torque: &mut [f64]| {
        torque[1] -= 2.0 * (-0.8 - state.q[1]).max(0.0) + 3.0 * (state.q[1] - 0.8).max(0.0);
    };
    let tree = read_urdf(URDF, &UrdfOptions::default()).unwrap().tree;
    let log = record(&tree, 11, &secret);
    let surveys = [log.survey().unwrap()];
    let conditioning = Conditioning::choose(&surveys, &ConditioningOptions::default()).unwrap();
    let ranges = SignalRanges::of_surveys(&surveys);
    let catalogue = Catalogue::default();
    let declared = ["viscous_friction", "coulomb_friction", "end_stop"]
        .iter()
        .flat_map(|kind| catalogue.declare(kind, &tree, &ranges).unwrap());
    let blocks = log.blocks(&conditioning).unwrap();
    let (train, held_out) = folds();
    let data = Data { train, held_out, sources: vec![&blocks], rest_speeds: vec![0.01; 2] };
    let identified = identify(&tree, declared.collect(), &data).unwrap();
    let specs: Vec<_> = identified.design.effects().iter().map(|effect| effect.spec()).collect();
    let place = specs.iter().position(|spec| spec.kind == "end_stop" && spec.joints == ["elbow"]).unwrap();
    let stiffness = identified.fit.parameters[identified.design.effect_parameters(place).start];
    assert!(stiffness > 0.0 && specs[place].constants["side"] == -1.0, "{stiffness} {:?}", specs[place]);
}
