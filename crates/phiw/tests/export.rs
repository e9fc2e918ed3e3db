//! `phiw export`: files of a model for other programs.

mod synthetic;

use assert_cmd::Command;
use phiw::arguments::SessionArguments;
use phiw::console::Console;
use phiw::identify::identify;
use phiw_dynamics::random_tree::{RandomNumbers, random_state};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_effects::Catalogue;
use phiw_identification::{Model, predict};
use phiw_telemetry::Block;
use std::path::Path;
use tempfile::TempDir;

/// Reads states of q, v and a as doubles, and writes torques.
const DRIVER: &str = r#"
#include <stdio.h>
#include "inverse_dynamics.c"
int main(void) {
    double state[3 * PHIW_JOINTS], torque[PHIW_JOINTS];
    FILE *in = fopen("states", "rb"), *out = fopen("torques", "wb");
    if (!in || !out) return 1;
    while (fread(state, sizeof state, 1, in) == 1) {
        phiw_inverse_dynamics(state, state + PHIW_JOINTS, state + 2 * PHIW_JOINTS, torque);
        fwrite(torque, sizeof torque, 1, out);
    }
    return fclose(out);
}
"#;

const MESH: &str =
    r#"<visual><geometry><mesh filename="package://nowhere/arm.dae"/></geometry></visual><inertial>"#;

/// A model of a log with these effects declared.
fn identified(declare: &[&str]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let urdf = synthetic::URDF.replace("<inertial>", MESH);
    std::fs::write(path("robot.urdf"), &urdf).unwrap();
    synthetic::recording(1, 30.0).write_csv(&path("train.csv")).unwrap();
    let arguments = SessionArguments {
        urdf: path("robot.urdf"),
        train: vec![path("train.csv")],
        declare: declare.iter().map(|kind| (*kind).to_owned()).collect(),
        out: path("out"),
        ..SessionArguments::default()
    };
    identify(&arguments, &Console::silent()).unwrap();
    folder
}

fn export(folder: &Path, forms: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::cargo_bin("phiw").unwrap();
    command.current_dir(folder).args(["export", "--model", "out/model.json", "--out", "carried"]).args(forms);
    command.assert()
}

fn files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder.join("carried")).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.filter(|name| !name.starts_with('.')).collect();
    names.sort();
    names
}

#[test]
fn exported_c_gives_the_torques_of_the_possible_bodies_and_their_effects() {
    let declare =
        ["viscous_friction", "coulomb_friction", "rotor_inertia", "torque_offset", "load_dependent_friction"];
    let folder = identified(&declare);
    export(folder.path(), &[]).success();
    let names =
        ["actuators.csv", "bodies.urdf", "identified.xml", "inverse_dynamics.c", "inverse_dynamics.rs"];
    assert_eq!(files(folder.path()), names);
    let text = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    assert!(!text("carried/bodies.urdf").contains("package://"));
    assert!(text("out/identified.urdf").contains("package://"));
    assert!(text("carried/actuators.csv").lines().nth(3).unwrap().ends_with(",0,0,30,4"));

    let model: Model = serde_json::from_str(&text("out/model.json")).unwrap();
    let tree = read_urdf(synthetic::URDF, &UrdfOptions::default()).unwrap().tree;
    let possible = model.consistent_tree(&tree).unwrap();
    // The load that friction goes with is that of the same bodies.
    let same = Model { bodies: model.consistent.as_ref().unwrap().bodies.clone(), ..model.clone() };
    let (design, mut parameters) = same.design(&tree, &Catalogue::default()).unwrap();
    let base = design.base().from_standard(&possible.inertial_parameters()).unwrap();
    parameters[..base.len()].copy_from_slice(&base);
    for effect in 0..design.effects().len() {
        for (at, parameter) in design.effect_parameters(effect).enumerate() {
            parameters[parameter] = model.consistent_effect(effect, at).unwrap();
        }
    }
    let mut random = RandomNumbers::new(3);
    let (mut states, mut ours) = (Vec::new(), Vec::new());
    for _ in 0..200 {
        let state = random_state(&tree, &mut random);
        let signals = [state.q, state.v, state.a];
        signals.iter().for_each(|signal| states.extend(signal.iter().flat_map(|value| value.to_le_bytes())));
        let block = Block::unfiltered(3, vec![0.0], signals, vec![0.0; 3]);
        predict(&design, &parameters, &[&vec![block]], &mut |prediction| {
            ours.extend_from_slice(prediction.predicted)
        })
        .unwrap();
    }
    std::fs::write(folder.path().join("carried/states"), states).unwrap();
    std::fs::write(folder.path().join("carried/driver.c"), DRIVER).unwrap();
    let compiled = std::process::Command::new("cc")
        .current_dir(folder.path().join("carried"))
        .args(["-std=c99", "-Wall", "-Werror", "-O2", "-o", "driver", "driver.c", "-lm"])
        .output();
    let Ok(compiled) = compiled else { return println!("skipped: no cc") };
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let driver = folder.path().join("carried/driver");
    Command::new(driver).current_dir(folder.path().join("carried")).assert().success();
    let torques = std::fs::read(folder.path().join("carried/torques")).unwrap();
    let torques: Vec<f64> =
        torques.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    assert_eq!(torques.len(), ours.len());
    let largest = ours.iter().fold(0.0_f64, |largest, torque| largest.max(torque.abs()));
    for (found, ours) in torques.iter().zip(&ours) {
        assert!((found - ours).abs() < 1e-12 * largest, "{found} {ours}");
    }
}

#[test]
fn what_needs_history_is_named_in_the_header_and_on_the_console() {
    let folder = identified(&["viscous_friction"]);
    // A declared model has no such effect: one is put into the file.
    let path = folder.path().join("out/model.json");
    let mut model: Model = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    let mut effect = model.effects[0].clone();
    effect.spec.kind = "hysteresis".to_owned();
    effect.parameters[0].name = "fh".to_owned();
    model.effects.push(effect);
    model.consistent.as_mut().unwrap().effects.push(vec![0.3]);
    std::fs::write(&path, serde_json::to_string(&model).unwrap()).unwrap();
    let done = export(folder.path(), &["--c", "--rust"]).success();
    assert_eq!(files(folder.path()), ["inverse_dynamics.c", "inverse_dynamics.rs"]);
    let said = String::from_utf8_lossy(&done.get_output().stdout).into_owned();
    assert!(said.contains("inverse_dynamics.c cannot express hysteresis of joint_1"), "{said}");
    for (name, line) in [
        ("inverse_dynamics.c", " * - hysteresis of joint_1\n"),
        ("inverse_dynamics.rs", "//! - hysteresis of joint_1\n"),
    ] {
        let text = std::fs::read_to_string(folder.path().join("carried").join(name)).unwrap();
        assert!(text.contains(line), "{text}");
    }
}

#[test]
fn a_wrong_model_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("out")).unwrap();
    std::fs::write(folder.path().join("out/model.json"), "{}").unwrap();
    let failed = export(folder.path(), &[]).code(2);
    let said = String::from_utf8_lossy(&failed.get_output().stderr).into_owned();
    assert!(said.contains("out/model.json") && said.trim().lines().count() == 1, "{said}");
    assert!(!folder.path().join("carried/inverse_dynamics.c").exists());
}
