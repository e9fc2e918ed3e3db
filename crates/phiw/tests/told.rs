//! What the logs tell, in the report and on the terminal, and which motion would tell more.

use crate::next_scene;
use crate::synthetic;

use phiw::arguments::SessionArguments;
use phiw::console::Console;
use phiw::identify::{Outcome, identify};
use phiw_report::json::InformationJson;
use phiw_telemetry::Recording;

/// Identifies the robot of three joints from a log, with a folder of motions: what is told.
fn told(log: &Recording, motions: &[(&str, &Recording)]) -> (InformationJson, Outcome, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("robot.urdf"), synthetic::URDF).unwrap();
    log.write_csv(&path("train.csv")).unwrap();
    std::fs::create_dir(path("motions")).unwrap();
    for (name, motion) in motions {
        motion.write_csv(&path("motions").join(name)).unwrap();
    }
    let arguments = SessionArguments {
        urdf: path("robot.urdf"),
        train: vec![path("train.csv")],
        declare: vec!["viscous_friction".to_owned()],
        motions: (!motions.is_empty()).then(|| path("motions")),
        out: path("out"),
        ..SessionArguments::default()
    };
    let outcome = identify(&arguments, &Console::silent()).unwrap();
    let page = std::fs::read_to_string(&outcome.report_html).unwrap();
    (outcome.report.phiw.clone().unwrap().information.unwrap(), outcome, page)
}

#[test]
fn parameters_are_named_by_link_and_the_truth_is_where_the_report_says() {
    let (information, outcome, page) = told(&synthetic::recording(1, 60.0), &[]);
    assert_eq!(information.narrower_by, 10.0);
    assert_eq!(information.parameters, 33);
    let names: Vec<&str> = information.told.iter().map(|told| told.name.as_str()).collect();
    assert!(
        names.contains(&"first moment x of link_2") || names.contains(&"first moment x of link_3"),
        "{names:?}"
    );
    // Bodies first, then effects.
    for (joint, truth) in synthetic::VISCOUS.into_iter().enumerate() {
        let name = format!("viscous friction of joint_{}", joint + 1);
        let told = information.told.iter().find(|told| told.name == name);
        let told = told.unwrap_or_else(|| panic!("{name} is not told: {names:?}"));
        assert!((told.value - truth).abs() < 4.0 * told.std, "{told:?} {truth}");
        assert_eq!(told.unit, "N·m·s/rad");
    }
    // The first joint stands upright: nothing feels how heavy its link is.
    let untold = &information.not_told;
    assert!(untold.iter().any(|name| name == "mass of link_1"), "{untold:?}");
    // The elbow is 0.4 m along x, turned by 0.5 rad about z: m₂c₂ₓ + 0.4·m₃ + cos ½·m₃c₃ₓ + …, of which the
    // last is known by itself.
    let sum = information
        .sums
        .iter()
        .find(|sum| sum.name.starts_with("first moment x of link_2 + 0.400 · mass of link_3"));
    let sum = sum.unwrap_or_else(|| panic!("{:?}", information.sums));
    let truth = 3.0 * 0.2 + 0.4 * 1.5 - 0.5_f64.sin() * 1.5 * -0.02;
    assert!(sum.name.ends_with("− 0.479 · first moment y of link_3"), "{sum:?}");
    assert!((sum.value - truth).abs() < 4.0 * sum.std && sum.unit == "kg·m", "{sum:?} {truth}");
    assert!(names.len() + untold.len() < 33, "a parameter is in two lists: {information:?}");
    assert!(page.contains("What the logs tell") && page.contains("link_1: mass"), "no section");
    assert!(
        outcome.summary.contains("told by the logs (10 times narrower than believed before)"),
        "{}",
        outcome.summary
    );
    assert!(information.motions.is_empty());
}

/// A log that is hardly longer than nothing leaves much open; of a calm motion and a lively one the lively
/// one tells more of it.
#[test]
fn the_motion_that_tells_most_of_what_is_not_told_is_named() {
    let calm = next_scene::motion(1, 0.02, 0.3);
    let lively = next_scene::motion(2, 0.9, 2.0);
    let log = {
        let mut slow = synthetic::recording(1, 12.0);
        // A twentieth of the way: friction and weights are felt, inertias hardly.
        slow.q.iter_mut().for_each(|q| *q *= 0.05);
        slow
    };
    let (information, outcome, page) = told(&log, &[("calm.csv", &calm), ("lively.csv", &lively)]);
    let motions = &information.motions;
    assert_eq!(motions.len(), 2, "{motions:?}");
    assert_eq!(motions[0].file, "lively.csv");
    assert!(motions[0].nats > motions[1].nats && motions[0].directions > 0, "{motions:?}");
    assert!(motions[0].tells.iter().all(|name| information.told.iter().all(|told| told.name != *name)));
    assert!(outcome.summary.contains("next, lively.csv: "), "{}", outcome.summary);
    assert!(page.contains("Motions that would tell more"));
}
