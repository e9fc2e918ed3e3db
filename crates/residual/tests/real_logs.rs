//! Logs of real robots, identified: published parameters and errors on motion held out.

use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use phiw_effects::{Catalogue, SignalRanges};
use phiw_identification::{BlockSource, Data, Identified, LogSet, Variants, identify};
use phiw_telemetry::ConditioningOptions;
use std::path::PathBuf;

/// Identifies one of the robots of the shared data; `None` where the data are absent.
fn identify_set(
    set: &str,
    urdf: &str,
    train: &[&str],
    validate: &[&str],
    declared: &[&str],
) -> Option<Identified> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/logs").join(set);
    if !folder.exists() {
        println!("skipped: ../shared/data/logs/{set} is absent");
        return None;
    }
    let tree = read_urdf_file(folder.join(urdf), &UrdfOptions::default()).unwrap().tree;
    let paths = |names: &[&str]| names.iter().map(|name| folder.join(name)).collect::<Vec<_>>();
    let options = ConditioningOptions::default();
    let logs = LogSet::open(&tree, &paths(train), &paths(validate), &options, &|_, _, _| ()).unwrap();
    let ranges = SignalRanges::of_surveys(logs.training());
    let catalogue = Catalogue::default();
    let effects: Vec<Variants> =
        declared.iter().flat_map(|kind| catalogue.declare(kind, &tree, &ranges).unwrap()).collect();
    let sources = logs.sources(&|_, _, _| ());
    let data = Data {
        train: logs.training_folds(),
        held_out: logs.held_out_folds(),
        sources: sources.iter().map(|source| source as &dyn BlockSource).collect(),
        rest_speeds: logs.rest_speeds(),
    };
    let identified = identify(&tree, effects, &data).unwrap();
    println!("{set}: {}", logs.conditioning());
    println!(
        "  train {:.2} %, held out {:.2} %",
        100.0 * identified.train.relative,
        100.0 * identified.held_out.relative
    );
    println!("  rmse {:.3?} of {:.3?}", identified.held_out.rmse, identified.held_out.rms_torque);
    for (index, effect) in identified.design.effects().iter().enumerate() {
        let spec = effect.spec();
        for (parameter, info) in identified.design.effect_parameters(index).zip(effect.parameters()) {
            let (value, std) =
                (identified.fit.parameters[parameter], identified.fit.standard_deviations[parameter]);
            println!(
                "  {} {}: {value:.4} ± {std:.4} {} {:?}",
                info.joint, info.name, info.unit, spec.constants
            );
        }
    }
    Some(identified)
}

/// Value of an effect's parameter.
fn value(identified: &Identified, kind: &str, joint: usize) -> f64 {
    let name = identified.design.tree().joint(joint).joint.clone();
    let effects = identified.design.effects();
    let place = effects
        .iter()
        .position(|effect| effect.spec().kind == kind && effect.spec().joints == [name.clone()]);
    identified.fit.parameters[identified.design.effect_parameters(place.unwrap()).start]
}

fn assert_within(found: f64, expected: f64, share: f64, what: &str) {
    assert!((found / expected - 1.0).abs() <= share, "{what}: {found} is not within {share} of {expected}");
}

#[test]
fn tx40_has_its_published_friction() {
    let declared = ["viscous_friction", "coulomb_friction", "rotor_inertia"];
    let Some(identified) = identify_set("tx40", "tx40.urdf", &["train.csv"], &["validate.csv"], &declared)
    else {
        return;
    };
    // The model lacks what leaves a sixth of the torque: its frictions depend on the rows that count. With
    // rows of which up to half is at rest they are within 3 %.
    for (joint, published) in [8.11, 5.60, 1.98, 1.11].into_iter().enumerate() {
        assert_within(value(&identified, "viscous_friction", joint), published, 0.05, "viscous friction");
    }
    assert!(identified.held_out.relative <= 0.245);
}

#[test]
fn emps_has_its_published_parameters() {
    let declared = ["viscous_friction", "coulomb_friction", "torque_offset"];
    let Some(identified) = identify_set("emps", "emps.urdf", &["train.csv"], &["validate.csv"], &declared)
    else {
        return;
    };
    assert_eq!(identified.design.base().count(), 1);
    assert_within(identified.fit.parameters[0], 95.11, 0.005, "mass");
    assert_within(value(&identified, "viscous_friction", 0), 203.50, 0.02, "viscous friction");
    assert_within(value(&identified, "coulomb_friction", 0), 20.39, 0.02, "Coulomb friction");
    assert_within(value(&identified, "torque_offset", 0), -3.165, 0.03, "offset");
    assert!(identified.held_out.relative <= 0.046);
}

#[test]
fn kr300_predicts_a_record_that_it_was_not_fitted_to() {
    let declared = ["viscous_friction", "coulomb_friction", "rotor_inertia"];
    let train = ["traj_A.csv", "traj_B.csv"];
    let Some(identified) = identify_set("kr300", "kr300.urdf", &train, &["traj_C.csv"], &declared) else {
        return;
    };
    assert!(identified.held_out.relative <= 0.11);
}
