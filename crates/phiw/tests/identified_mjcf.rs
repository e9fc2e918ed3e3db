//! `identified.xml`: the model as MuJoCo reads it.

use crate::synthetic;

use phiw::arguments::SessionArguments;
use phiw::console::Console;
use phiw::identify::identify;
use phiw_dynamics::random_tree::{RandomNumbers, random_state};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{Tree, Workspace};
use phiw_effects::Catalogue;
use phiw_identification::{Model, predict};
use phiw_sim_mujoco::{MjcfFile, MujocoError};
use phiw_telemetry::{Block, Recording};
use tempfile::TempDir;

/// Identifies what `change` makes of a log; the result's folder and what was printed.
fn identified(urdf: &str, declare: &[&str], change: impl Fn(&mut Recording)) -> (TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("robot.urdf"), urdf).unwrap();
    let mut log = synthetic::recording_of(urdf, 1, 40.0);
    change(&mut log);
    log.write_csv(&path("train.csv")).unwrap();
    let arguments = SessionArguments {
        urdf: path("robot.urdf"),
        train: vec![path("train.csv")],
        declare: declare.iter().map(|kind| (*kind).to_owned()).collect(),
        out: path("out"),
        ..SessionArguments::default()
    };
    let summary = identify(&arguments, &Console::silent()).unwrap().summary;
    (folder, summary)
}

fn text(folder: &TempDir, name: &str) -> String {
    std::fs::read_to_string(folder.path().join("out").join(name)).unwrap()
}

/// The file in MuJoCo; says so and gives `None` where MuJoCo is not there.
fn read(text: &str, tree: &Tree) -> Option<Result<MjcfFile, MujocoError>> {
    match MjcfFile::read(text, tree) {
        Err(MujocoError::NotFound { .. }) => {
            println!("skipped: MuJoCo not found, run cargo xtask mujoco");
            None
        }
        read => Some(read),
    }
}

/// The torques without noise, so that every body stays possible, with viscous friction, a spring of
/// 5 N·m/rad that is slack at 0.2 rad on each joint, and a rotor of 0.4 kg·m² on each but the first, where it
/// cannot be told from the link.
fn with_springs_and_rotors(log: &mut Recording) {
    let (tree, joints) = (synthetic::tree(), log.joints.len());
    let mut workspace = Workspace::new(&tree);
    for row in 1..log.t.len() - 1 {
        let q = |row: usize, joint: usize| log.q[row * joints + joint];
        let all = |of: &dyn Fn(usize) -> f64| (0..joints).map(of).collect::<Vec<f64>>();
        let v = all(&|joint| 0.5 * (q(row + 1, joint) - q(row - 1, joint)) * synthetic::RATE);
        let a = all(&|joint| {
            (q(row + 1, joint) - 2.0 * q(row, joint) + q(row - 1, joint)) * synthetic::RATE.powi(2)
        });
        let mut torque = vec![0.0; joints];
        let at = row * joints..(row + 1) * joints;
        tree.inverse_dynamics(&log.q[at.clone()], &v, &a, &mut workspace, &mut torque).unwrap();
        for joint in 0..joints {
            let spring = 5.0 * (q(row, joint) - 0.2);
            let rotor = if joint == 0 { 0.0 } else { 0.4 };
            torque[joint] += synthetic::VISCOUS[joint] * v[joint] + spring + rotor * a[joint];
        }
        log.tau[at].copy_from_slice(&torque);
    }
}

#[test]
fn mujoco_finds_the_torques_of_the_model() {
    let declare = ["viscous_friction", "rotor_inertia", "joint_spring"];
    let (folder, summary) = identified(synthetic::URDF, &declare, with_springs_and_rotors);
    let xml = text(&folder, "identified.xml");
    assert!(!summary.contains("identified.xml cannot express") && !summary.contains("refuse"), "{summary}");
    let lacks =
        "identified.urdf cannot express rotor_inertia of joint_1, joint_2, joint_3; joint_spring of joint_1";
    assert!(summary.contains(lacks), "{summary}");
    assert!(text(&folder, "report.html").contains(lacks));
    let urdf = text(&folder, "identified.urdf");
    assert!(
        urdf.starts_with("<!--\n  Identified by phiw from train.csv.")
            && urdf.contains("- rotor_inertia of joint_1")
    );

    let model: Model = serde_json::from_str(&text(&folder, "model.json")).unwrap();
    let tree = read_urdf(synthetic::URDF, &UrdfOptions::default()).unwrap().tree;
    let Some(file) = read(&xml, &tree) else { return };
    let mut file = file.unwrap();
    let (design, mut parameters) = model.design(&tree, &Catalogue::default()).unwrap();
    // The file holds the possible bodies and their effects.
    let possible = model.consistent_tree(&tree).unwrap().inertial_parameters();
    let base = design.base().from_standard(&possible).unwrap();
    parameters[..base.len()].copy_from_slice(&base);
    for effect in 0..design.effects().len() {
        for (at, parameter) in design.effect_parameters(effect).enumerate() {
            parameters[parameter] = model.consistent_effect(effect, at).unwrap();
        }
    }
    let mut random = RandomNumbers::new(1);
    let mut found = vec![0.0; 3];
    for _ in 0..50 {
        let state = random_state(&tree, &mut random);
        let q: Vec<f64> = state.q.iter().map(|q| 0.9 * q).collect();
        file.inverse_dynamics(&q, &state.v, &state.a, &mut found).unwrap();
        let block = Block::unfiltered(3, vec![0.0], [q, state.v, state.a], vec![0.0; 3]);
        let mut expected = Vec::new();
        predict(&design, &parameters, &[&vec![block]], &mut |prediction| {
            expected = prediction.predicted.to_vec()
        })
        .unwrap();
        for (found, expected) in found.iter().zip(&expected) {
            assert!((found - expected).abs() < 1e-9 * (1.0 + expected.abs()), "{found} {expected}");
        }
    }
}

/// A log that no robot of positive mass can have made: the bodies are possible all the same, and MuJoCo takes
/// the file.
#[test]
fn a_log_that_no_robot_can_have_made_gives_bodies_that_mujoco_reads() {
    let (folder, summary) =
        identified(synthetic::URDF, &[], |log| log.tau.iter_mut().for_each(|tau| *tau *= -1.0));
    let xml = text(&folder, "identified.xml");
    assert!(!summary.contains("MuJoCo will refuse"), "{summary}");
    if let Some(read) = read(&xml, &synthetic::tree()) {
        read.unwrap();
    }
}

/// Meshes are not looked for: neither those of packages nor those that are absent.
#[test]
fn meshes_that_are_nowhere_stop_nothing() {
    let mesh = r#"<visual><geometry><mesh filename="package://nowhere/arm.dae"/></geometry></visual>
      <collision><geometry><mesh filename="absent.stl"/></geometry></collision><inertial>"#;
    let urdf = synthetic::URDF.replace("<inertial>", mesh);
    let (folder, _) = identified(&urdf, &["viscous_friction"], |_| ());
    if let Some(read) = read(&text(&folder, "identified.xml"), &synthetic::tree()) {
        read.unwrap();
    }
    assert!(text(&folder, "identified.urdf").contains("package://nowhere/arm.dae"));
}

/// MuJoCo's own files are as good as URDFs wherever a robot is asked for.
#[test]
fn a_robot_of_mjcf_is_identified_like_that_of_its_urdf() {
    let tree = synthetic::tree();
    let mut robot = phiw_mjcf::RobotModel::new(&tree);
    robot.joints[1].armature = 0.2;
    let mjcf = phiw_mjcf::write_mjcf(&robot).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    synthetic::recording(1, 40.0).write_csv(&path("train.csv")).unwrap();
    let identified = |name: &str, text: &str| {
        std::fs::write(path(name), text).unwrap();
        let arguments = SessionArguments {
            urdf: path(name),
            train: vec![path("train.csv")],
            declare: vec!["viscous_friction".to_owned()],
            out: path(&format!("{name} out")),
            ..SessionArguments::default()
        };
        identify(&arguments, &Console::silent()).unwrap();
        let text = |file: &str| std::fs::read_to_string(path(&format!("{name} out")).join(file)).unwrap();
        (text("report.json"), serde_json::from_str::<Model>(&text("model.json")).unwrap())
    };
    let (_, of_urdf) = identified("robot.urdf", synthetic::URDF);
    let (report, of_mjcf) = identified("robot.xml", &mjcf);
    assert!(report.contains("armature of joint_2 (declare rotor_inertia)"), "{report}");
    assert_eq!(of_urdf.joints, of_mjcf.joints);
    for (one, other) in of_urdf.residual_std.iter().zip(&of_mjcf.residual_std) {
        assert!((one - other).abs() < 1e-9 * one, "{one} {other}");
    }
    // The model is kept with a URDF, which can be read again.
    let kept = of_mjcf.urdf.unwrap();
    assert!(kept.contains("left out: armature of joint_2"));
    assert_eq!(read_urdf(&kept, &UrdfOptions::default()).unwrap().tree.joint_count(), 3);
}
