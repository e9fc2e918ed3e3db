//! `phiw export`: files of a model for other programs.

use crate::synthetic;

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
    let names = [
        "actuators.csv",
        "bam.json",
        "bodies.urdf",
        "identified.xml",
        "inverse_dynamics.c",
        "inverse_dynamics.rs",
        "isaaclab_actuators.py",
        "mjlab_actuators.py",
    ];
    assert_eq!(files(folder.path()), names);
    let text = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    assert!(!text("carried/bodies.urdf").contains("package://"));
    assert!(text("out/identified.urdf").contains("package://"));
    assert!(text("carried/actuators.csv").lines().nth(3).unwrap().ends_with(",30,4"));

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

/// Puts a made-up class in the place of a library's, and prints what a file makes of it.
const CONFIGURATIONS: &str = r#"
import json, runpy, sys
class Kind(dict):
    max_delay = 0
    def __init__(self, **fields): super().__init__(fields)
made = runpy.run_path(sys.argv[1])["configurations"](Kind, 0.002, stiffness=20.0)
print(json.dumps(list(made.values()) if isinstance(made, dict) else list(made)))
"#;

#[test]
fn training_libraries_and_bam_are_given_what_each_joint_has() {
    let declare =
        ["viscous_friction", "coulomb_friction", "rotor_inertia", "load_dependent_friction:joint_2"];
    let folder = identified(&declare);
    // A delay that was found is put into the file: the log has none.
    let path = folder.path().join("out/model.json");
    let mut model: Model = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    let mut effect = model.effects[0].clone();
    effect.spec = phiw_identification::EffectSpec::new("time_delay", &["joint_1"]).with("delay", 0.0);
    effect.parameters[0].name = "delay".to_owned();
    model.effects.push(effect);
    model.consistent.as_mut().unwrap().effects.push(vec![-0.0061]);
    std::fs::write(&path, serde_json::to_string(&model).unwrap()).unwrap();
    let done = export(folder.path(), &["--mjlab", "--isaaclab", "--bam"]).success();
    assert_eq!(files(folder.path()), ["bam.json", "isaaclab_actuators.py", "mjlab_actuators.py"]);
    let said = String::from_utf8_lossy(&done.get_output().stdout).into_owned();
    assert!(said.contains("mjlab_actuators.py cannot express load_dependent_friction of joint_2"), "{said}");
    assert!(said.contains("bam.json cannot express actuator, kt and R of every servo"), "{said}");
    let value = |kind: &str, joint: &str| {
        let is_it = |spec: &phiw_identification::EffectSpec| spec.kind == kind && spec.joints == [joint];
        let at = model.effects.iter().position(|effect| is_it(&effect.spec)).unwrap();
        model.consistent_effect(at, 0).unwrap()
    };
    let text = std::fs::read_to_string(folder.path().join("carried/bam.json")).unwrap();
    let bam: serde_json::Value = serde_json::from_str(&text).unwrap();
    let servo = &bam["joints"]["joint_2"];
    assert_eq!(servo["model"], "m3");
    assert_eq!(servo["friction_base"], value("coulomb_friction", "joint_2"));
    assert_eq!(servo["load_friction_base"], 0.5 * value("load_dependent_friction", "joint_2"));
    assert_eq!(bam["joints"]["joint_1"]["command_delay"], 0.0061);
    assert_eq!(bam["joints"]["joint_1"]["model"], "m1");

    for (file, friction, damping, lag) in [
        ("mjlab_actuators.py", "frictionloss", "viscous_damping", "delay_max_lag"),
        ("isaaclab_actuators.py", "friction", "viscous_friction", "max_delay"),
    ] {
        let file = folder.path().join("carried").join(file);
        let ran = std::process::Command::new("python3").args(["-c", CONFIGURATIONS]).arg(&file).output();
        let Ok(ran) = ran else { return println!("skipped: no python3") };
        assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
        let made: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap();
        assert_eq!(made[1][friction], value("coulomb_friction", "joint_2"));
        assert_eq!(made[1][damping], value("viscous_friction", "joint_2"));
        assert_eq!(made[1]["armature"], value("rotor_inertia", "joint_2"));
        assert_eq!(made[1]["stiffness"], 20.0);
        assert_eq!((&made[0][lag], made[1].get(lag)), (&serde_json::Value::from(3), None));
    }
}
