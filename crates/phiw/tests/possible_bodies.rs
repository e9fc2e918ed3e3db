//! What is written for a simulator is a robot that can exist, whatever the logs say.

use crate::synthetic;

use phiw::arguments::SessionArguments;
use phiw::console::Console;
use phiw::identify::{Outcome, identify};
use phiw_dynamics::random_tree::{RandomNumbers, random_state};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use phiw_dynamics::{Tree, Workspace, dense::Cholesky};
use phiw_identification::Model;
use phiw_identification::consistent::impossible_bodies;
use std::path::{Path, PathBuf};

const POSES: usize = 10_000;

/// The robot's set of logs, or nothing where it is absent.
fn real_logs(set: &str) -> Option<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/logs").join(set);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: ../shared/data/logs/{set} is absent");
    None
}

fn run(urdf: PathBuf, train: &[PathBuf], validate: &[PathBuf], out: &Path) -> Outcome {
    let arguments = SessionArguments {
        urdf,
        train: train.to_vec(),
        validate: validate.to_vec(),
        declare: ["viscous_friction", "coulomb_friction", "rotor_inertia"].map(str::to_owned).to_vec(),
        out: out.to_owned(),
        ..SessionArguments::default()
    };
    identify(&arguments, &Console::silent()).unwrap()
}

/// Every body possible, and M(q) positive definite in random poses, without the rotors' inertia.
fn assert_can_exist(urdf: &Path) {
    let tree = read_urdf_file(urdf, &UrdfOptions::default()).unwrap().tree;
    assert_eq!(impossible_bodies(&tree.inertial_parameters()), [0; 0], "{}", urdf.display());
    assert!(tree.bodies().iter().all(|body| body.damping >= 0.0 && body.friction >= 0.0));
    let size = tree.velocity_size();
    let (mut matrix, mut workspace) = (vec![0.0; size * size], Workspace::new(&tree));
    let mut random = RandomNumbers::new(1);
    for pose in 0..POSES {
        let q = random_state(&tree, &mut random).q;
        tree.mass_matrix(&q, &mut workspace, &mut matrix).unwrap();
        assert!(
            Cholesky::of(size, |row, column| matrix[row * size + column]).is_some(),
            "M is not positive definite in pose {pose} of {}",
            urdf.display()
        );
    }
}

#[test]
fn real_robots_can_exist_once_identified() {
    for (set, urdf, train, validate) in [
        ("tx40", "tx40.urdf", &["train.csv"][..], "validate.csv"),
        ("emps", "emps.urdf", &["train.csv"], "validate.csv"),
        ("kr300", "kr300.urdf", &["traj_A.csv", "traj_B.csv"], "traj_C.csv"),
    ] {
        let Some(logs) = real_logs(set) else { continue };
        let folder = tempfile::tempdir().unwrap();
        let train: Vec<PathBuf> = train.iter().map(|log| logs.join(log)).collect();
        let outcome = run(logs.join(urdf), &train, &[logs.join(validate)], folder.path());
        assert_can_exist(&folder.path().join("identified.urdf"));
        let cost = outcome.report.phiw.unwrap().consistency.unwrap();
        assert!(cost.certified, "{set}: gap {}", cost.gap);
        let [free, possible] = [cost.validate_relative.least_squares, cost.validate_relative.consistent];
        assert!(possible < 1.02 * free, "{set}: {possible} held out, {free} by least squares");
    }
}

/// A robot of which the URDF gives no mass at all, identified from a log that moves it little.
#[test]
fn a_robot_without_masses_gets_bodies_that_can_exist() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let mut parts = synthetic::URDF.split("<inertial>");
    let mut urdf = parts.next().unwrap().to_owned();
    parts.for_each(|part| urdf.push_str(part.split_once("</inertial>").unwrap().1));
    std::fs::write(path("robot.urdf"), urdf).unwrap();
    synthetic::recording(1, 12.0).write_csv(&path("train.csv")).unwrap();
    let outcome = run(path("robot.urdf"), &[path("train.csv")], &[], &path("out"));
    assert_can_exist(&path("out/identified.urdf"));
    let report = outcome.report.phiw.unwrap();
    let cost = report.consistency.unwrap();
    assert!(cost.certified && cost.validate.len() == 3);
    let said = |text: &str| report.warnings.iter().any(|warning| warning.contains(text));
    assert_eq!(said("no distribution of mass"), !cost.impossible.is_empty(), "{:?}", report.warnings);
    assert!(outcome.summary.contains("With bodies that can exist"), "{}", outcome.summary);
    let page = std::fs::read_to_string(path("out/report.html")).unwrap();
    assert!(page.contains("With bodies that can exist"));
    let model: Model =
        serde_json::from_str(&std::fs::read_to_string(path("out/model.json")).unwrap()).unwrap();
    let tree: Tree = synthetic::tree();
    let possible = model.consistent_tree(&tree).unwrap();
    assert_eq!(impossible_bodies(&possible.inertial_parameters()), [0; 0]);
    // Of so little motion possible bodies foretell more than least squares: they are the model.
    assert!(cost.is_model && said("the model has the possible ones"), "{:?}", report.warnings);
    assert_eq!(model.identified_tree(&tree).unwrap().inertial_parameters(), possible.inertial_parameters());
}

/// Of a short log least squares makes bodies that no mass has, and foretells other motion worse than the
/// possible bodies do, which are the model then: the error after is theirs (`tests/predict.rs` holds
/// predictions against it).
#[test]
fn possible_bodies_are_the_model_where_they_foretell_better() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("robot.urdf"), synthetic::URDF).unwrap();
    synthetic::recording(1, 6.0).write_csv(&path("train.csv")).unwrap();
    synthetic::recording(2, 20.0).write_csv(&path("validate.csv")).unwrap();
    let outcome = run(path("robot.urdf"), &[path("train.csv")], &[path("validate.csv")], &path("out"));
    let after = outcome.report.after.validate.relative.unwrap();
    let cost = outcome.report.phiw.unwrap().consistency.unwrap();
    assert!(cost.is_model && !cost.impossible.is_empty(), "{cost:?}");
    assert_eq!(after, cost.validate_relative.consistent);
    assert!(after < cost.validate_relative.least_squares, "{:?}", cost.validate_relative);
}

/// A torque never tells all masses: those that were weighed are in the file.
#[test]
fn known_masses_are_those_of_the_bodies() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("robot.urdf"), synthetic::URDF).unwrap();
    synthetic::recording(1, 20.0).write_csv(&path("train.csv")).unwrap();
    let arguments = |mass: &[(&str, f64)], total_mass| SessionArguments {
        urdf: path("robot.urdf"),
        train: vec![path("train.csv")],
        declare: vec!["viscous_friction".to_owned()],
        mass: mass.iter().map(|&(link, mass)| (link.to_owned(), mass)).collect(),
        total_mass,
        out: path("out"),
        ..SessionArguments::default()
    };
    let outcome = identify(&arguments(&[("link_2", 3.3)], Some(11.0)), &Console::silent()).unwrap();
    let tree = read_urdf_file(path("out/identified.urdf"), &UrdfOptions::default()).unwrap().tree;
    let masses: Vec<f64> = tree.bodies().iter().map(|body| body.inertial[0]).collect();
    assert!((masses[1] - 3.3).abs() < 1e-9 && (masses.iter().sum::<f64>() - 11.0).abs() < 1e-9, "{masses:?}");
    assert!(outcome.report.phiw.unwrap().consistency.unwrap().certified);
    let refused = |mass: &[(&str, f64)], total_mass| {
        let error = identify(&arguments(mass, total_mass), &Console::silent()).err().unwrap();
        assert_eq!(error.exit_status(), 2);
        error.to_string()
    };
    assert!(refused(&[("tool", 1.0)], None).contains("those are link_1, link_2, link_3"));
    assert!(refused(&[("link_2", 3.0)], Some(2.0)).contains("leaves nothing"));
}

/// Where a link's mass must lie, and which links are mirror images, holds for the bodies that are written.
#[test]
fn bodies_lie_inside_their_ellipsoids_and_mirror_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("robot.urdf"), synthetic::URDF).unwrap();
    synthetic::recording(1, 20.0).write_csv(&path("train.csv")).unwrap();
    let arguments = |inside: &str, mirrored: &[(&str, &str)]| SessionArguments {
        urdf: path("robot.urdf"),
        train: vec![path("train.csv")],
        declare: vec!["viscous_friction".to_owned()],
        inside: vec![(inside.to_owned(), [0.1, 0.0, 0.0, 0.2, 0.05, 0.05])],
        mirrored: mirrored.iter().map(|&(link, image)| (link.to_owned(), image.to_owned())).collect(),
        out: path("out"),
        ..SessionArguments::default()
    };
    let bodies = |arguments: &SessionArguments| {
        let outcome = identify(arguments, &Console::silent()).unwrap();
        assert!(outcome.report.phiw.unwrap().consistency.unwrap().certified);
        let tree = read_urdf_file(path("out/identified.urdf"), &UrdfOptions::default()).unwrap().tree;
        assert_eq!(impossible_bodies(&tree.inertial_parameters()), [0; 0]);
        tree.bodies().iter().map(|body| body.inertial).collect::<Vec<_>>()
    };
    let [m, hx, hy, hz, xx, _, yy, _, _, zz] = bodies(&arguments("link_3", &[]))[2];
    let half_trace = 0.5 * (xx + yy + zz);
    // ∫ 1 − Σ((r − c)/a)² dm ≥ 0, with the second moments about the joint's origin.
    let x = (half_trace - xx - 0.2 * hx + 0.01 * m) / 0.04;
    let across = (half_trace - yy + half_trace - zz) / 0.0025;
    assert!(m - x - across > -1e-9 * m, "{m} {x} {across} {hy} {hz}");
    // At zero the frames of these two are turned by half a radian against each other: their masses must
    // agree.
    let found = bodies(&arguments("link_3", &[("link_2", "link_1")]));
    assert!((found[0][0] - found[1][0]).abs() < 1e-9, "{found:?}");
    let refused = identify(&arguments("tool", &[]), &Console::silent()).err().unwrap();
    assert!(refused.to_string().contains("those are link_1, link_2, link_3"));
}

/// The boxes around what a URDF shows of its links hold their masses; a mesh that is not there stops nothing
/// and is said.
#[test]
fn bodies_lie_inside_the_geometry_of_their_links() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::create_dir(path("meshes")).unwrap();
    std::fs::write(path("meshes/link_2.obj"), "v -50 -60 -60\nv 400 60 60\n").unwrap();
    synthetic::recording(1, 20.0).write_csv(&path("train.csv")).unwrap();
    let geometry = |link_2: &str| {
        let shapes = [
            (
                "link_1",
                "<collision><geometry><mesh filename=\"package://gone/link_1.stl\"/></geometry></collision>",
            ),
            ("link_2", link_2),
            // Off by where the mass is not: 0.15 m along x, and at y = −0.02.
            (
                "link_3",
                "<visual><origin xyz=\"0.15 0 0\" rpy=\"0 1.5707963267948966 0\"/><geometry><cylinder radius=\"0.03\" length=\"0.2\"/></geometry></visual>",
            ),
            ("tool", "<visual><geometry><sphere radius=\"0.01\"/></geometry></visual>"),
        ];
        shapes.into_iter().fold(
            synthetic::URDF.replace("<link name=\"tool\"/>", "<link name=\"tool\"></link>"),
            |urdf, (link, shape)| {
                let at = urdf.find(&format!("<link name=\"{link}\">")).unwrap();
                let end = at + urdf[at..].find("</link>").unwrap();
                format!("{}{shape}{}", &urdf[..end], &urdf[end..])
            },
        )
    };
    let mesh = "<visual><geometry><mesh filename=\"meshes/link_2.obj\" scale=\"0.001 0.001 0.001\"/></geometry></visual>";
    std::fs::write(path("robot.urdf"), geometry(mesh)).unwrap();
    let arguments = SessionArguments {
        urdf: path("robot.urdf"),
        train: vec![path("train.csv")],
        declare: vec!["viscous_friction".to_owned()],
        inside_geometry: true,
        out: path("out"),
        ..SessionArguments::default()
    };
    let outcome = identify(&arguments, &Console::silent()).unwrap();
    assert!(outcome.report.phiw.unwrap().consistency.unwrap().certified);
    let said = outcome.warnings.iter().find(|warning| warning.contains("--inside-geometry")).unwrap();
    assert!(
        said.contains("link_1 (package://gone/link_1.stl is not at hand)") && !said.contains("link_2"),
        "{said}"
    );
    let tree = read_urdf_file(path("out/identified.urdf"), &UrdfOptions::default()).unwrap().tree;
    assert_eq!(impossible_bodies(&tree.inertial_parameters()), [0; 0]);
    // The tool's ball reaches from x = 0.29 to 0.31.
    for (body, lower, upper) in
        [(1, [-0.05, -0.06, -0.06], [0.4, 0.06, 0.06]), (2, [0.05, -0.03, -0.03], [0.31, 0.03, 0.03])]
    {
        let [m, hx, hy, hz, xx, _, yy, _, _, zz] = tree.bodies()[body].inertial;
        let half = 0.5 * (xx + yy + zz);
        for (axis, (first, second)) in
            [(hx, half - xx), (hy, half - yy), (hz, half - zz)].into_iter().enumerate()
        {
            let (low, high): (f64, f64) = (lower[axis], upper[axis]);
            let inside = (low + high) * first - second - low * high * m;
            assert!(inside > -1e-9 * m, "body {body}, axis {axis}: {inside}");
        }
    }
    assert!(arguments.command_line("identify").contains(" --inside-geometry "));
}
