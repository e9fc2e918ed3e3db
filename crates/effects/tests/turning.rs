//! Frictions that turn over a way.

use phiw_dynamics::Tree;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_effects::{Catalogue, Constants};
use phiw_identification::{Design, EffectCatalogue, EffectSpec, predict};
use phiw_regressor::BaseParameters;
use phiw_telemetry::Block;

const URDF: &str = r#"<robot name="one"><link name="base"/><link name="arm"><inertial><mass value="1"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <joint name="j" type="continuous"><parent link="base"/><child link="arm"/></joint></robot>"#;
const WAY: f64 = 4e-4;

/// Torques of an effect of these parameters over 4 s of a motion to and fro.
fn torques(tree: &Tree, spec: &EffectSpec, parameters: &[f64]) -> Vec<(f64, f64)> {
    let t: Vec<f64> = (0..2000).map(|row| 0.002 * f64::from(row)).collect();
    let signal = |of: fn(f64) -> f64| t.iter().map(|t| of(5.0 * t + 0.4)).collect::<Vec<f64>>();
    let signals = [signal(f64::sin), signal(|x| 5.0 * x.cos()), signal(|x| -25.0 * x.sin())];
    let block = Block::unfiltered(1, t.clone(), signals, vec![0.0; t.len()]);
    let base = BaseParameters::of_tree(tree, Default::default()).unwrap();
    let all: Vec<f64> = vec![0.0; base.count()].into_iter().chain(parameters.iter().copied()).collect();
    let effect = Catalogue::default().build(spec, tree).unwrap();
    let mut out = Vec::new();
    predict(&Design::new(tree.clone(), base, vec![effect]), &all, &[&vec![block]], &mut |prediction| {
        out.push((prediction.t, prediction.predicted[0]));
    })
    .unwrap();
    out
}

fn turned(kind: &str, constants: &Constants) -> EffectSpec {
    let catalogue = Catalogue::default();
    let constants = catalogue.kind(kind).unwrap().turned_over_a_way(constants, Some(WAY)).unwrap();
    EffectSpec { constants, ..EffectSpec::new(kind, &["j"]) }
}

/// A joint whose dry friction had left the model for a hysteresis over a way of bristles was said to have no
/// Coulomb friction: the two are one.
#[test]
fn a_hysteresis_as_short_as_bristles_is_the_frictions_own_torque() {
    let tree = read_urdf(URDF, &UrdfOptions::default()).unwrap().tree;
    let hysteresis = torques(&tree, &EffectSpec::new("hysteresis", &["j"]).with("presliding", WAY), &[0.7]);
    let friction = torques(&tree, &turned("coulomb_friction", &Constants::new()), &[0.7]);
    assert!(friction.iter().any(|(_, torque)| torque.abs() < 0.5), "it never turns");
    // Where the log begins, a hysteresis has no way behind it.
    for (hysteresis, friction) in hysteresis.iter().zip(&friction).filter(|(own, _)| own.0 > 0.1) {
        assert!((hysteresis.1 - friction.1).abs() < 0.05, "{hysteresis:?} {friction:?}");
    }
}

/// Friction that falls with time and turns over a way was taken for one that turns at once, and a hysteresis.
#[test]
fn a_friction_that_falls_with_time_turns_over_the_way_of_the_one_that_stays() {
    let tree = read_urdf(URDF, &UrdfOptions::default()).unwrap().tree;
    let time = Constants::from([("time_constant".to_owned(), 2.5)]);
    let falling = torques(&tree, &turned("thermal_drift", &time), &[0.0, 0.7]);
    let staying = torques(&tree, &turned("coulomb_friction", &Constants::new()), &[0.7]);
    assert_eq!(falling.len(), 2000);
    for ((t, falling), (_, staying)) in falling.iter().zip(&staying) {
        // Over the way the factor falls a little.
        assert!((falling - (-t / 2.5).exp() * staying).abs() < 0.01, "{t}: {falling} {staying}");
    }
}
