//! What the user has a say in: effects declared on given joints, candidates excluded, joints held by pattern,
//! right angles of the URDF.

use crate::synthetic;

use assert_cmd::Command;
use phiw::arguments::{ExplainArguments, PredictArguments, SessionArguments};
use phiw::console::Console;
use phiw_effects::{Catalogue, EffectKind};
use phiw_identification::Model;
use phiw_identification::model::EffectParameters;
use phiw_regressor::BaseParameters;
use phiw_report::ReportJson;
use phiw_telemetry::Recording;
use rayon::prelude::*;
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

/// A folder with the robot and two logs, `secret(velocities, torques)` added to both.
struct Scene(TempDir);

impl Scene {
    fn new(seconds: f64, secret: impl Fn(&[f64], &mut [f64])) -> Self {
        let scene = Scene(TempDir::new().unwrap());
        fs::write(scene.path("robot.urdf"), synthetic::URDF).unwrap();
        for (seed, name) in [(1, "train.csv"), (2, "validate.csv")] {
            let mut log = synthetic::recording(seed, seconds);
            add(&mut log, &secret);
            fs::write(scene.path(name), synthetic::csv(&log)).unwrap();
        }
        scene
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn session(&self, declare: &[&str], out: &str) -> SessionArguments {
        SessionArguments {
            urdf: self.path("robot.urdf"),
            train: vec![self.path("train.csv")],
            validate: vec![self.path("validate.csv")],
            declare: declare.iter().map(|&declared| declared.to_owned()).collect(),
            out: self.path(out),
            quiet: true,
            ..SessionArguments::default()
        }
    }

    fn explain(&self, declare: &[&str], exclude: &[&str]) -> ReportJson {
        self.explain_at(declare, exclude, None)
    }

    fn explain_at(&self, declare: &[&str], exclude: &[&str], false_name_rate: Option<f64>) -> ReportJson {
        let arguments = ExplainArguments {
            session: self.session(declare, "explained"),
            exclude: exclude.iter().map(|&excluded| excluded.to_owned()).collect(),
            false_name_rate,
            ..ExplainArguments::default()
        };
        phiw::explain::explain(&arguments, &Console::silent()).unwrap().report
    }

    /// Standard error of a command that is refused.
    fn refused(&self, line: &str) -> String {
        let line = format!("{line} --out refused");
        let mut phiw = Command::cargo_bin("phiw").unwrap();
        let output = phiw.current_dir(&self.0).args(line.split(' ')).output().unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), message.lines().count()), (Some(2), 1), "{line}: {message}");
        assert!(!self.path("refused").exists());
        message
    }
}

fn add(log: &mut Recording, secret: &impl Fn(&[f64], &mut [f64])) {
    let rows = log.t.len();
    for row in 0..rows {
        let (before, after) = (row.saturating_sub(1), (row + 1).min(rows - 1));
        let speed = |joint: usize| {
            (log.q[3 * after + joint] - log.q[3 * before + joint]) / (log.t[after] - log.t[before])
        };
        let speeds = [0, 1, 2].map(speed);
        secret(&speeds, &mut log.tau[3 * row..3 * row + 3]);
    }
}

/// Kinds and joints of everything that was found.
fn found(report: &ReportJson) -> Vec<(String, Vec<String>)> {
    let effects = report.effects.iter().chain(&report.refinements);
    effects.map(|effect| (effect.kind.clone(), effect.joints.clone())).collect()
}

/// `--declare load_dependent_friction` ended with "columns of the merged factor has 50 elements", and most
/// kinds could not be declared at all.
#[test]
fn every_kind_can_be_declared_alone_on_one_joint_and_on_all() {
    let scene = Scene::new(6.0, |_, _| ());
    let (tree, catalogue) = (synthetic::tree(), Catalogue::default());
    // What belongs to logs is only ever found (`torque_zeros.rs`).
    let kinds: Vec<&dyn EffectKind> = catalogue.kinds().filter(|kind| !kind.is_of_training_logs()).collect();
    kinds.into_par_iter().for_each(|kind| {
        let first: Vec<String> =
            kind.sites(&tree)[0].iter().map(|&joint| tree.joint(joint).joint.clone()).collect();
        let on_first = match first.is_empty() {
            true => kind.name().to_owned(),
            false => format!("{}:{}", kind.name(), first.join("+")),
        };
        for declared in [kind.name(), &on_first] {
            // Alone, and between two others, one of which needs the model's torque.
            for all in [&[declared][..], &["load_dependent_friction:joint_1", declared, "viscous_friction"]] {
                let session = scene.session(all, kind.name());
                let outcome = phiw::identify::identify(&session, &Console::silent());
                let report = outcome.unwrap_or_else(|error| panic!("{all:?}: {error}")).report;
                assert!(report.after.validate.relative.is_some_and(f64::is_finite), "{all:?}");
                assert!(report.declared.iter().any(|text| text.starts_with(kind.name())), "{all:?}");
            }
        }
        // What was written is a model, and can be used.
        let written = scene.path(kind.name()).join("model.json");
        let model: Model = serde_json::from_str(&fs::read_to_string(&written).unwrap()).unwrap();
        let is_it = |effect: &EffectParameters| effect.spec.kind == kind.name() && effect.declared;
        assert!(model.effects.iter().any(is_it), "{}", kind.name());
        let arguments = PredictArguments {
            model: written,
            logs: vec![scene.path("validate.csv")],
            out: scene.path(&format!("{}.csv", kind.name())),
            quiet: true,
            ..PredictArguments::default()
        };
        phiw::predict::predict(&arguments, &Console::silent()).unwrap();
    });
}

#[test]
fn declarations_unite_and_are_reported_with_their_joints() {
    let tree = synthetic::tree();
    let catalogue = Catalogue::default();
    for (declared, united) in [
        (&["viscous_friction"][..], &["viscous_friction"][..]),
        (&["rigid_body", "", "viscous_friction:joint_2"], &["viscous_friction:joint_2"]),
        (&["viscous_friction:joint_3", "viscous_friction:joint_1"], &["viscous_friction:joint_1+joint_3"]),
        (&["viscous_friction:joint_3+joint_1+joint_2"], &["viscous_friction"]),
        (&["viscous_friction:joint_3", "viscous_friction"], &["viscous_friction"]),
        (&["transmission_coupling:joint_2+joint_1"], &["transmission_coupling:joint_1+joint_2"]),
        (
            &[
                "transmission_coupling:joint_2+joint_3",
                "torque_offset",
                "transmission_coupling:joint_1+joint_2",
            ],
            &[
                "transmission_coupling:joint_1+joint_2",
                "transmission_coupling:joint_2+joint_3",
                "torque_offset",
            ],
        ),
        (&["gravity_tilt"], &["gravity_tilt"]),
        // One delay of all joints is another effect than one of each.
        (&["time_delay"], &["time_delay"]),
        (&["time_delay:joint_1+joint_2+joint_3"], &["time_delay:joint_1+joint_2+joint_3"]),
        (&["time_delay:joint_1+joint_2"], &["time_delay:joint_1+joint_2"]),
    ] {
        let texts: Vec<String> = declared.iter().map(|&text| text.to_owned()).collect();
        assert_eq!(catalogue.united(&texts, &tree).unwrap(), united);
    }
    let scene = Scene::new(20.0, |_, _| ());
    let report = scene.explain(&["viscous_friction:joint_3+joint_1"], &[]);
    assert_eq!(report.declared, ["rigid_body", "viscous_friction:joint_1+joint_3"]);
    assert_eq!(found(&report)[0], ("viscous_friction".to_owned(), vec!["joint_2".to_owned()]));
    let model = fs::read_to_string(scene.path("explained/model.json")).unwrap();
    let model: Model = serde_json::from_str(&model).unwrap();
    let viscous = model.effects.iter().filter(|effect| effect.spec.kind == "viscous_friction");
    let declared: Vec<(&str, bool)> =
        viscous.map(|effect| (effect.spec.joints[0].as_str(), effect.declared)).collect();
    assert_eq!(declared, [("joint_1", true), ("joint_3", true), ("joint_2", false)]);
}

#[test]
fn what_is_excluded_is_neither_named_nor_a_refinement() {
    let scene = Scene::new(30.0, |speeds, torques| torques[1] += 2.0 * (speeds[1] / 0.005).tanh());
    let is = |(kind, joints): &(String, Vec<String>)| kind == "coulomb_friction" && joints == &["joint_2"];
    assert!(found(&scene.explain(&["viscous_friction"], &[])).iter().any(is));
    let elsewhere = scene.explain(&["viscous_friction"], &["coulomb_friction:joint_1+joint_3"]);
    assert!(found(&elsewhere).iter().any(is));
    for excluded in ["coulomb_friction", "coulomb_friction:joint_2"] {
        let report = scene.explain(&["viscous_friction"], &[excluded]);
        assert!(!found(&report).iter().any(is), "{:?}", found(&report));
    }
    // What is declared stays.
    let declared = ["viscous_friction", "coulomb_friction:joint_2"];
    let report = scene.explain(&declared, &["coulomb_friction"]);
    assert_eq!(report.declared[1..], declared);
    assert!(
        report.after.validate.relative
            < scene.explain(&["viscous_friction"], &["coulomb_friction"]).after.validate.relative
    );
    let page = fs::read_to_string(scene.path("explained/report.html")).unwrap();
    assert!(page.contains("--exclude coulomb_friction"));
}

/// The probability of naming anything where nothing is missing is set, not hoped for.
#[test]
fn a_lower_false_name_rate_asks_for_more_certainty() {
    let scene = Scene::new(30.0, |speeds, torques| torques[1] += 2.0 * (speeds[1] / 0.005).tanh());
    let named = |rate| scene.explain_at(&["viscous_friction"], &[], rate).effects.len();
    assert!(named(None) > 0);
    assert_eq!(named(Some(0.0)), 0);
}

#[test]
fn a_pair_is_excluded_by_its_two_joints_or_by_one_of_them() {
    let (tree, catalogue) = (synthetic::tree(), Catalogue::default());
    for (text, sites) in [
        ("transmission_coupling", &["joint_1 joint_2", "joint_1 joint_3", "joint_2 joint_3"][..]),
        ("transmission_coupling:joint_3+joint_1", &["joint_1 joint_3"]),
        ("transmission_coupling:joint_1", &["joint_1 joint_2", "joint_1 joint_3"]),
        ("time_delay:joint_1", &["joint_1", "joint_1 joint_2 joint_3"]),
        ("gravity_tilt", &[""]),
        ("viscous_friction:joint_2", &["joint_2"]),
    ] {
        let specs = catalogue.excluded(text, &tree).unwrap();
        let found: Vec<String> = specs.iter().map(|spec| spec.joints.join(" ")).collect();
        assert_eq!(found, sites, "{text}");
    }
}

#[test]
fn entries_that_match_nothing_are_refused_with_the_mend() {
    let scene = Scene::new(8.0, |_, _| ());
    let on_logs = |command: &str, more: &str| {
        scene
            .refused(&format!("{command} --urdf robot.urdf --train train.csv --validate validate.csv {more}"))
    };
    for (entry, expected) in [
        ("visous_friction", "did you mean `viscous_friction`?"),
        ("viscous_friction:joint_4", "did you mean `joint_"),
        ("viscous_friction:joint_1+", "names the joint ``"),
        ("viscous_friction:", "moving joints are: joint_1, joint_2, joint_3"),
        (
            "gravity_tilt:joint_1",
            "acts on the whole robot (no joint is named) and cannot act on `joint_1`; name it without a joint",
        ),
    ] {
        for command in ["identify --declare", "explain --declare", "explain --exclude"] {
            let (command, option) = command.split_once(' ').unwrap();
            let message = on_logs(command, &format!("{option} torque_offset,{entry}"));
            assert!(message.contains(expected), "{command} {option} {entry}: {message}");
        }
    }
    let message = on_logs("identify", "--declare transmission_coupling:joint_1");
    assert!(message.contains("it can on joint_1+joint_2, joint_1+joint_3, joint_2+joint_3"), "{message}");
    let message = on_logs("identify", "--hold shoulder_*");
    assert!(message.contains("cannot hold `shoulder_*`"), "{message}");
    let message = on_logs("identify", "--hold joint_*=0.5,joint_2=0.1");
    assert!(message.contains("`joint_2` at 0.5 and at 0.1"), "{message}");
}

#[test]
fn joints_are_held_by_pattern_by_every_command_on_logs() {
    let scene = Scene::new(20.0, |_, _| ());
    let run = |line: &str| {
        let mut phiw = Command::cargo_bin("phiw").unwrap();
        let output = phiw.current_dir(&scene.0).args(line.split(' ')).output().unwrap();
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    };
    run("check --urdf robot.urdf train.csv --hold *_3=0.1");
    run("explain --urdf robot.urdf --train train.csv --hold *_3=0.1 --out explained");
    run("identify --urdf robot.urdf --train train.csv --hold *_3=0.1 --out out");
    let model: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(scene.path("out/model.json")).unwrap()).unwrap();
    assert_eq!(model["held"], serde_json::json!([["joint_3", 0.1]]));
    run("predict --model out/model.json validate.csv --hold *_3=0.1 --out predicted.csv");
    run("simulate --model out/model.json validate.csv --hold j*_3=0.1 --out simulated");
    let message = scene.refused("predict --model out/model.json validate.csv --hold *_3=0.2");
    assert!(message.contains("--hold joint_3=0.2"), "{message}");
}

/// One robot's rpy of 1.5708 made a direction "identifiable" with −9.7 t.
#[test]
fn a_right_angle_of_four_decimals_makes_no_direction_identifiable() {
    let with = |rpy: &str| synthetic::URDF.replace("rpy=\"0.2 0 0\"", &format!("rpy=\"{rpy}\""));
    let count = |urdf: &str, snap: bool| {
        let options = phiw_dynamics::urdf::UrdfOptions { snap, ..Default::default() };
        let tree = phiw_dynamics::urdf::read_urdf(urdf, &options).unwrap().tree;
        BaseParameters::of_tree(&tree, Default::default()).unwrap().count()
    };
    let (exact, rounded) = (with("1.5707963267948966 0 0"), with("1.5708 0 0"));
    assert_eq!(count(&rounded, true), count(&exact, false));
    assert!(count(&rounded, false) > count(&exact, false), "the story is about another robot");

    let scene = Scene::new(20.0, |_, _| ());
    fs::write(scene.path("robot.urdf"), rounded).unwrap();
    let report = phiw::identify::identify(&scene.session(&[], "out"), &Console::silent()).unwrap().report;
    let warnings = report.phiw.unwrap().warnings;
    let said = warnings.iter().filter(|warning| warning.contains("1 angle or axis of the URDF")).count();
    assert_eq!(said, 1, "{warnings:?}");
}
