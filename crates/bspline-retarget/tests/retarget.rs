//! Retargeting of motions whose truth is known, and of real ones.

use phiw_bspline_retarget::c3d::read_c3d;
use phiw_bspline_retarget::embedded::{EmbeddedMotion, TASKS, embedded_motions};
use phiw_bspline_retarget::human::{MapError, MarkerMap};
use phiw_bspline_retarget::markers::read_recording;
use phiw_bspline_retarget::robot::RobotError;
use phiw_bspline_retarget::solver::{QuasiNewton, quasi_newton, solve};
use phiw_bspline_retarget::{Problem, RetargetError, RetargetOptions, Retargeted, Retargeter};
use phiw_dynamics::Tree;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use std::path::{Path, PathBuf};

fn shared(path: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(path);
    if !path.exists() {
        println!("skipped: {} is absent", path.display());
        return None;
    }
    Some(path)
}

/// The project's own upper body.
fn robot() -> Tree {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/upper_body18.urdf");
    read_urdf_file(path, &UrdfOptions::default()).unwrap().tree
}

fn retargeter(map: MarkerMap) -> Retargeter {
    Retargeter::new(robot(), map, RetargetOptions::default()).unwrap()
}

/// The first motion of a task, cut to `frames`.
fn motion(task: &str, frames: usize) -> EmbeddedMotion {
    let mut motion = embedded_motions(3).unwrap().find(|motion| motion.task == task).unwrap();
    let markers = motion.recording.labels.len();
    motion.recording.positions_m.truncate(frames * markers);
    motion
}

fn check_sound(result: &Retargeted, name: &str) {
    let quality = &result.quality;
    assert!(quality.marker_rms_m < 0.01, "{name}: markers {} m", quality.marker_rms_m);
    assert!(quality.hand_share() < 0.05, "{name}: hands {} of the arm", quality.hand_share());
    assert_eq!(quality.limit_excess, 0.0, "{name}");
    assert!(quality.jerk_rms.is_finite());
}

#[test]
fn the_embedded_motions_are_table_1() {
    assert_eq!(TASKS.iter().map(|task| task.count).sum::<usize>(), 110);
    let motions: Vec<EmbeddedMotion> = embedded_motions(1).unwrap().collect();
    assert_eq!(motions.len(), 110);
    for task in TASKS {
        let durations = motions.iter().filter(|m| m.task == task.name).map(|m| m.recording.duration_s());
        let (least, most) = durations.fold((f64::MAX, 0.0f64), |(a, b), d| (a.min(d), b.max(d)));
        assert!((least - task.shortest_s).abs() < 0.006 && (most - task.longest_s).abs() < 0.006);
    }
    let missing = motions.iter().map(|m| m.recording.missing_share()).sum::<f64>() / 110.0;
    assert!((0.002..0.05).contains(&missing), "{missing}");
    let again = embedded_motions(1).unwrap().nth(40).unwrap();
    assert_eq!(again.to_c3d(), motions[40].to_c3d());
    let read = read_c3d(&again.to_c3d()).unwrap().recording(None).unwrap();
    assert_eq!((read.frames(), &read.labels), (again.recording.frames(), &again.recording.labels));
}

#[test]
fn angles_behind_the_markers_come_back() {
    let motion = motion("Stir", 300);
    let result = retargeter(MarkerMap::embedded().unwrap()).retarget(&motion.recording, None).unwrap();
    check_sound(&result, &motion.name);
    assert!(result.quality.marker_rms_m < 0.002, "{}", result.quality.marker_rms_m);
    let mut scratch = vec![0.0; 4];
    let mut human = vec![0.0; result.human.dimension()];
    for frame in (0..300).step_by(25) {
        result.human.evaluate(0, frame as f64 / result.rate_hz, &mut scratch, &mut human);
        // The bend of the elbow is what markers tell best; misplaced ones leave a few degrees.
        for name in ["left_forearm_flexion", "right_forearm_flexion"] {
            let index = result.human_names.iter().position(|other| other == name).unwrap();
            let truth = motion.coordinates.iter().find(|(other, _)| other == name).unwrap().1[frame];
            assert!((human[index] - truth).abs() < 0.2, "{name}: {} instead of {truth}", human[index]);
        }
    }
}

#[test]
fn the_gradient_is_the_slope_of_the_cost() {
    let motion = motion("Pour", 90);
    let retargeter = retargeter(MarkerMap::embedded().unwrap());
    let person = retargeter.person(&motion.recording, None).unwrap();
    let basis = retargeter.basis(&motion.recording).unwrap();
    let mut weights = retargeter.options().weights;
    weights.velocity_limits = 0.3;
    let problem = Problem::new(&person.body, Some(retargeter.robot()), &motion.recording, basis, weights);
    // Away from rest, so that no term is at its minimum, and limits of position and velocity are exceeded.
    let mut variables = problem.rest();
    variables
        .iter_mut()
        .enumerate()
        .for_each(|(i, value)| *value += ((i * 37 % 101) as f64 / 101.0 - 0.5) * 1.5);
    let mut gradient = vec![0.0; problem.variables()];
    let cost = problem.gradient(&variables, &mut gradient);
    assert_eq!(cost, problem.cost(&variables));
    assert!(cost.limits > 0.0 && cost.correspondence > 0.0 && cost.prior > 0.0);
    let scale = gradient.iter().fold(0.0f64, |most, value| most.max(value.abs()));
    for variable in 0..variables.len() {
        let step = 1e-5;
        let mut at = |shift: f64| {
            let value = std::mem::replace(&mut variables[variable], 0.0);
            variables[variable] = value + shift;
            let cost = problem.cost(&variables).total();
            variables[variable] = value;
            cost
        };
        let slope = (at(step) - at(-step)) / (2.0 * step);
        assert!(
            (slope - gradient[variable]).abs() < 1e-6 * scale,
            "{variable}: {slope} {}",
            gradient[variable]
        );
    }
}

/// Both stop at a minimum; it need not be the same one, but the structured one should not be worse.
#[test]
fn the_structured_solver_is_no_worse_than_quasi_newton() {
    let motion = motion("Cut", 120);
    let retargeter = retargeter(MarkerMap::embedded().unwrap());
    let person = retargeter.person(&motion.recording, None).unwrap();
    let problem = retargeter.problem(&person, &motion.recording);
    let start = retargeter.start(&problem, &person);
    let iterations = phiw_bspline_retarget::solver::Iterations { hard_limits: false, ..Default::default() };
    let ours = solve(&problem, start.clone(), &iterations);
    let theirs = quasi_newton(&problem, start, &QuasiNewton { most: 150, ..Default::default() }, &|_| {});
    assert!(ours.cost.total() <= 1.02 * theirs.cost.total(), "{:?} {:?}", ours.cost, theirs.cost);
    let mut gradient = vec![0.0; problem.variables()];
    problem.gradient(&ours.variables, &mut gradient);
    assert!(gradient.iter().all(|value| value.is_finite()));
}

#[test]
fn missing_markers_carry_no_weight() {
    let retargeter = retargeter(MarkerMap::embedded().unwrap());
    let mut recording = motion("Mix", 200).recording;
    let markers = recording.labels.len();
    let whole = retargeter.retarget(&recording, None).unwrap();
    // A marker that is hidden for a second, one for all but a few frames.
    for frame in 0..200 {
        if (50..150).contains(&frame) {
            recording.positions_m[frame * markers + 3] = [f64::NAN; 3];
        }
        if frame > 5 {
            recording.positions_m[frame * markers + 10] = [f64::NAN; 3];
        }
    }
    let gaps = retargeter.retarget(&recording, None).unwrap();
    check_sound(&gaps, "with gaps");
    assert!(gaps.quality.marker_rms_m < whole.quality.marker_rms_m * 1.1);
}

#[test]
fn what_does_not_fit_is_named() {
    let recording = motion("Open", 60).recording;
    let retargeter = retargeter(MarkerMap::embedded().unwrap());
    let refused = |change: &dyn Fn(&mut phiw_bspline_retarget::markers::MarkerRecording)| {
        let mut changed = recording.clone();
        change(&mut changed);
        retargeter.retarget(&changed, None).unwrap_err()
    };
    let markers = recording.labels.len();
    let renamed = refused(&|r| r.labels[0] = "LASO".to_owned());
    assert!(
        matches!(&renamed, RetargetError::Map(MapError::Marker { nearest, .. }) if nearest.contains("`LASO`"))
    );
    let hidden = refused(&|r| r.positions_m.iter_mut().step_by(markers).for_each(|p| *p = [f64::NAN; 3]));
    assert!(matches!(hidden, RetargetError::Map(MapError::NeverSeen { .. })));
    let short = refused(&|r| r.positions_m.truncate(markers));
    assert!(matches!(short, RetargetError::TooShort(1)));
    assert!(matches!(MarkerMap::from_toml("name = 3"), Err(MapError::Toml(_))));
    let misspelt = MarkerMap::from_toml("name = \"a\"\n[segments.left_forarm]\n");
    assert!(
        matches!(misspelt, Err(MapError::Segment { nearest, .. }) if nearest.starts_with("`left_forearm`"))
    );
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/upper_body18.urdf");
    let floating = UrdfOptions { floating_base: true, ..Default::default() };
    let floating = read_urdf_file(path, &floating).unwrap().tree;
    let refused = Retargeter::new(floating, MarkerMap::embedded().unwrap(), RetargetOptions::default());
    assert_eq!(refused.unwrap_err(), RobotError::FloatingBase);
}

#[test]
fn real_motions_of_the_seated_set() {
    let (Some(motions), Some(urdf)) = (shared("motions/ue_adl/c3d"), shared("robots/torobo20/torobo20.urdf"))
    else {
        return;
    };
    let held = vec![("torso/joint_3".to_owned(), 0.0), ("head/joint_1".to_owned(), 0.0)];
    let tree = read_urdf_file(urdf, &UrdfOptions { held, ..UrdfOptions::default() }).unwrap().tree;
    let read = |name: &str| read_recording(&motions.join(name), None).unwrap();
    for torso_from_reach in [false, true] {
        let options = RetargetOptions { torso_from_reach, ..Default::default() };
        let retargeter = Retargeter::new(tree.clone(), MarkerMap::ue_adl().unwrap(), options).unwrap();
        // Subject 9 sits the other way round.
        for subject in ["ADL001", "ADL009"] {
            let calibration = retargeter.calibrate(&read(&format!("{subject}_static.c3d"))).unwrap();
            assert!(calibration.marker_rms_m < 0.025);
            let name = format!("{subject}FR1.c3d");
            let result = retargeter.retarget(&read(&name), Some(&calibration)).unwrap();
            check_sound(&result, &name);
        }
    }
}
