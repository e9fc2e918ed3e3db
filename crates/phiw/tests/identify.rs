//! `phiw identify` from end to end, on a robot whose truth is known.

use crate::synthetic;

use phiw::arguments::SessionArguments;
use phiw::console::Console;
use phiw::identify::{Outcome, identify};
use phiw::session::Session;
use phiw::traces::Traces;
use phiw_dynamics::random_tree::{RandomNumbers, random_state};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{Tree, Workspace};
use phiw_effects::Catalogue;
use phiw_identification::Model;
use phiw_identification::consistent::impossible_bodies;
use phiw_regressor::{BaseParameters, JointTorqueRegressor};
use phiw_report::json::Verdict;
use std::path::Path;
use tempfile::TempDir;

struct Identification {
    folder: TempDir,
    arguments: SessionArguments,
    outcome: Outcome,
}

impl Identification {
    /// Identifies from two logs and validates on a third. The URDF's inertials are changed by `spoil`:
    /// identification must not lean on them.
    fn new(declare: &[&str], spoil: impl Fn(&str) -> String) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("robot.urdf"), spoil(synthetic::URDF)).unwrap();
        let log = |seed: u64| {
            let log = path(&format!("log_{seed}.csv"));
            synthetic::recording(seed, 30.0).write_csv(&log).unwrap();
            log
        };
        let arguments = SessionArguments {
            urdf: path("robot.urdf"),
            train: vec![log(1), log(2)],
            validate: vec![log(3)],
            declare: declare.iter().map(|&kind| kind.to_owned()).collect(),
            out: path("deep/out"),
            ..SessionArguments::default()
        };
        let outcome = identify(&arguments, &Console::silent()).unwrap();
        Identification { arguments, outcome, folder }
    }

    fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.folder.path().join("deep/out").join(name)).unwrap()
    }

    fn model(&self) -> Model {
        serde_json::from_str(&self.text("model.json")).unwrap()
    }
}

fn unspoiled(urdf: &str) -> String {
    urdf.to_owned()
}

/// The URDF without any `<inertial>`.
fn without_inertials(urdf: &str) -> String {
    let mut parts = urdf.split("<inertial>");
    let mut text = parts.next().unwrap().to_owned();
    parts.for_each(|part| text.push_str(part.split_once("</inertial>").unwrap().1));
    text
}

/// The same with the first axis horizontal, so that joint_1 feels the weight of link_1, though never its mass
/// alone.
fn lying_without_inertials(urdf: &str) -> String {
    without_inertials(urdf).replacen("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"1 0 0\"/>", 1)
}

#[test]
fn the_truth_is_found_within_its_standard_deviations() {
    let identification = Identification::new(&["rigid_body", "viscous_friction"], without_inertials);
    let model = identification.model();
    let tree = synthetic::tree();
    let base = BaseParameters::of_tree(&tree, Default::default()).unwrap();
    let truth = base.from_standard(&tree.inertial_parameters()).unwrap();
    assert_eq!(model.base_parameters.len(), truth.len());
    for (found, truth) in model.base_parameters.iter().zip(&truth) {
        let (error, std) = ((found.value - truth).abs(), found.std.unwrap());
        assert!(error < 5.0 * std, "{}: {} ± {std}, in truth {truth}", found.name, found.value);
        assert!(std < 0.05, "{}: ± {std} says nothing", found.name);
    }
    for (effect, truth) in model.effects.iter().zip(synthetic::VISCOUS) {
        let fv = &effect.parameters[0];
        assert!(
            (fv.value - truth).abs() < 5.0 * fv.std.unwrap() && fv.std.unwrap() < 0.01 * truth,
            "{fv:?}, in truth {truth}"
        );
    }
}

#[test]
fn what_is_left_is_the_noise() {
    let report = Identification::new(&["viscous_friction"], unspoiled).outcome.report;
    assert_eq!(report.verdict, Some(Verdict::Sufficient));
    assert_eq!(report.declared, ["rigid_body", "viscous_friction"]);
    assert_eq!(report.before, report.after);
    for (joint, sigma) in report.joints.iter().zip(synthetic::NOISE) {
        let (floor, error) = (report.noise_floor[joint], report.after.validate.rmse[joint]);
        assert!(floor < 0.6 * sigma, "the filter takes noise away: {floor} of {sigma}");
        assert!((0.9..1.1).contains(&(error / floor)), "{joint}: {error} held out, {floor} noise");
    }
}

#[test]
fn a_model_that_lacks_friction_is_not_called_sufficient() {
    let report = Identification::new(&[], unspoiled).outcome.report;
    assert_eq!(report.verdict, None);
    assert!(report.remaining.structured);
    assert_eq!(report.remaining.joints, report.joints);
}

#[test]
fn the_model_file_predicts_as_the_fit_did() {
    let identification = Identification::new(&["viscous_friction", "coulomb_friction"], unspoiled);
    let session = Session::open(&identification.arguments, &|_, _, _| ()).unwrap();
    let (design, parameters) = identification.model().design(&session.tree, &Catalogue::default()).unwrap();
    let design = design.with_rest_speeds(session.logs.rest_speeds());
    let sources = session.logs.sources(&|_, _, _| ());
    let data = session.data(&sources);
    let traces = Traces::collect(&design, &parameters, [&data.train, &data.held_out], &data.sources).unwrap();
    let written = identification.outcome.report.phiw.unwrap().relative_with_rests.unwrap();
    let found = traces.with_rests(session.tree.joint_count());
    for (found, written) in
        [(found.train_relative, written.train), (found.held_out_relative, written.validate)]
    {
        assert!((found / written - 1.0).abs() < 1e-9);
    }
}

#[test]
fn the_identified_urdf_gives_the_torque_of_the_model() {
    for spoil in [unspoiled, without_inertials, lying_without_inertials] as [fn(&str) -> String; 3] {
        let identification = Identification::new(&["viscous_friction", "coulomb_friction"], spoil);
        let model = identification.model();
        let possible = model.consistent.unwrap();
        let tree = read_urdf(&identification.text("identified.urdf"), &UrdfOptions::default()).unwrap().tree;
        for joint in 0..tree.joint_count() {
            let fitted = |kind: usize| possible.effects[kind * tree.joint_count() + joint][0];
            let body = tree.joint(joint);
            assert_eq!([body.damping, body.friction], [fitted(0), fitted(1)], "{}", body.joint);
            assert!(body.damping >= 0.0 && body.friction >= 0.0);
        }
        assert_eq!(impossible_bodies(&tree.inertial_parameters()), [0; 0]);
        let standard: Vec<f64> = possible.bodies.iter().flat_map(|body| body.inertial).collect();
        let base = BaseParameters::of_tree(&tree, Default::default()).unwrap();
        assert_same_torques(&tree, &base.from_standard(&standard).unwrap());
    }
}

/// RNEA of the tree against the regressor's base columns times the parameters.
fn assert_same_torques(tree: &Tree, parameters: &[f64]) {
    let base = BaseParameters::of_tree(tree, Default::default()).unwrap();
    let regressor = JointTorqueRegressor::new(tree);
    let mut phi = vec![0.0; regressor.rows() * regressor.columns()];
    let mut pairs = vec![0.0; regressor.buffer_size()];
    let mut torque = vec![0.0; tree.joint_count()];
    let mut random = RandomNumbers::new(7);
    for _ in 0..20 {
        let state = random_state(tree, &mut random);
        tree.inverse_dynamics(&state.q, &state.v, &state.a, &mut Workspace::new(tree), &mut torque).unwrap();
        regressor.compute(tree, &state.q, &state.v, &state.a, &mut regressor.scratch(), &mut pairs).unwrap();
        regressor.scatter(&pairs, &mut phi).unwrap();
        for (torque, row) in torque.iter().zip(phi.chunks_exact(regressor.columns())) {
            let terms =
                base.independent().iter().zip(parameters).map(|(&column, parameter)| row[column] * parameter);
            let of_model: f64 = terms.sum();
            assert!((torque - of_model).abs() < 1e-6 * (1.0 + torque.abs()), "{torque} or {of_model}");
        }
    }
}

/// The rotor of the first joint turns with the first link: their sum is all that a torque feels.
#[test]
fn what_cannot_be_separated_is_said_with_what_it_acts_like() {
    let identification = Identification::new(&["viscous_friction", "rotor_inertia"], unspoiled);
    let page = identification.text("report.html");
    assert!(page.contains("joint_1.Ia acts like joint_1.Izz: not separable from the rigid body"));
    // The first link turns about the vertical: no torque feels its mass.
    let (_, not_told) = page.split_once("Not at all").expect("some parameters are not told");
    let all = "link_1: mass, first moment x, first moment y, first moment z, Ixx, Ixy, Iyy, Ixz, Iyz";
    assert!(not_told.contains(all), "{not_told}");
    assert!(identification.outcome.summary.contains("rotor_inertia     joint_1  Ia  not separable"));
}

#[test]
fn results_are_replaced_and_nothing_else_is_left() {
    let identification = Identification::new(&[], unspoiled);
    identify(&identification.arguments, &Console::silent()).unwrap();
    let names = |folder: &Path| -> Vec<String> {
        let entries = folder.read_dir().unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    };
    assert_eq!(
        names(&identification.arguments.out),
        ["identified.urdf", "identified.xml", "model.json", "report.html", "report.json"]
    );
}

#[test]
fn a_held_joint_needs_no_column() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(
        path("robot.urdf"),
        synthetic::URDF.replace("name=\"flange\" type=\"fixed\"", "name=\"finger\" type=\"continuous\""),
    )
    .unwrap();
    synthetic::recording(1, 30.0).write_csv(&path("train.csv")).unwrap();
    let arguments = SessionArguments {
        urdf: path("robot.urdf"),
        train: vec![path("train.csv")],
        hold: vec![("finger".to_owned(), 0.3)],
        declare: vec!["viscous_friction".to_owned()],
        out: path("out"),
        ..SessionArguments::default()
    };
    let outcome = identify(&arguments, &Console::silent()).unwrap();
    assert_eq!(outcome.report.joints, ["joint_1", "joint_2", "joint_3"]);
    assert!(outcome.summary.contains("held out is the last 30"), "{}", outcome.summary);
    let without = SessionArguments { hold: Vec::new(), ..arguments };
    let error = identify(&without, &Console::silent()).err().unwrap();
    assert!(error.to_string().contains("no column `q.finger`"), "{error}");
    assert_eq!(error.exit_status(), 2);
}

#[test]
fn other_cut_offs_are_compared_in_the_band_of_the_report() {
    let identification = Identification::new(&["viscous_friction"], unspoiled);
    let program = identification.outcome.report.phiw.clone().unwrap();
    let found = program.bandwidth.unwrap();
    let chosen: Vec<f64> =
        found.curve.iter().filter(|cutoff| cutoff.chosen).map(|cutoff| cutoff.cutoff_hz).collect();
    assert_eq!(chosen, [found.reference_hz]);
    assert!(found.curve.len() > 2 && found.better_hz.is_none() && found.moved.is_empty(), "{found:?}");
    assert!(!program.warnings.iter().any(|warning| warning.contains("cut-off")), "{:?}", program.warnings);
    assert!(identification.text("report.html").contains("Other cut-offs of columns and torque"));

    let arguments = SessionArguments { parallel_cutoff_hz: Some(3.0), ..identification.arguments.clone() };
    let told = identify(&arguments, &Console::silent()).unwrap().report.phiw.unwrap().bandwidth.unwrap();
    assert_eq!(told.reference_hz, 3.0);
}
