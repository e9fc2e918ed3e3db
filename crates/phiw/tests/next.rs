//! `phiw next`, from files to files: a small robot that stands, motions of it, and logs of what it has run.

use crate::next_scene;
use crate::synthetic;

use next_scene::{JOINTS, Scene, motion, tree, urdf};
use phiw_dynamics::random_tree::RandomNumbers;
use phiw_mjcf::{JointModel, RobotModel, write_mjcf};
use phiw_telemetry::{Recording, TorqueColumns};
use phiw_zmp::{MotionBalance, Stance, SupportPolygon, ZmpWorkspace, standing_parameters};
use serde_json::Value;

/// The same robot as its maker believes it to be.
fn wrong_urdf() -> String {
    urdf().replace("<mass value=\"5\"/>", "<mass value=\"6.2\"/>").replace(
        "<origin xyz=\"0.2 0.03 -0.01\"/><mass value=\"3\"/>",
        "<origin xyz=\"0.26 0.03 -0.01\"/><mass value=\"4\"/>",
    )
}

/// RMS of the difference between the planned torques and those of a robot (with friction), over the latter's
/// RMS.
fn torque_error(plan: &Recording, urdf: &str, viscous: [f64; 3]) -> f64 {
    let tree = tree(urdf, false);
    let mut workspace = phiw_dynamics::Workspace::new(&tree);
    let mut torque = [0.0; JOINTS];
    let (mut error, mut total) = (0.0, 0.0);
    for row in 0..plan.len() {
        let at = row * JOINTS..(row + 1) * JOINTS;
        let v = &plan.qd.as_ref().unwrap()[at.clone()];
        let a = &plan.qdd.as_ref().unwrap()[at.clone()];
        tree.inverse_dynamics(&plan.q[at.clone()], v, a, &mut workspace, &mut torque).unwrap();
        for joint in 0..JOINTS {
            let expected = torque[joint] + viscous[joint] * v[joint];
            error += (plan.tau[at.start + joint] - expected).powi(2);
            total += expected * expected;
        }
    }
    (error / total).sqrt()
}

/// The parameters of all that stands.
fn standing(urdf: &str) -> Vec<f64> {
    let (fixed, floating) = (tree(urdf, false), tree(urdf, true));
    standing_parameters(&floating.bodies()[0].inertial, &fixed.inertial_parameters())
}

/// The margin of the planned motion for a robot with these parameters, on its sole.
fn margin(plan: &Recording, parameters: &[f64]) -> f64 {
    let fixed = tree(&urdf(), false);
    let sole = [[0.22, 0.2], [-0.2, 0.2], [-0.2, -0.2], [0.22, -0.2]];
    let stance = Stance::new(SupportPolygon::from_points(&sole).unwrap(), [0.0; 2], 0.0).unwrap();
    let (qd, qdd) = (plan.qd.as_ref().unwrap(), plan.qdd.as_ref().unwrap());
    let row = |values: &[f64], row: usize| values[row * JOINTS..(row + 1) * JOINTS].to_vec();
    let samples: Vec<[Vec<f64>; 3]> =
        (0..plan.len()).map(|k| [row(&plan.q, k), row(qd, k), row(qdd, k)]).collect();
    let motion = samples.iter().map(|sample| [0, 1, 2].map(|part| &sample[part][..]));
    MotionBalance::of_motion(&fixed, parameters, &stance, motion, &mut ZmpWorkspace::new(&fixed))
        .unwrap()
        .multi_body
        .margin
}

#[test]
fn before_any_log_the_urdf_is_believed_and_few_motions_are_allowed() {
    let scene = Scene::new(&urdf());
    let (summary, warnings, report) = scene.next("--support DIR/support.toml");
    let next = &report["next"];
    // 5 % of twenty motions.
    assert_eq!((next["candidates"].as_u64(), next["allowed"].as_u64()), (Some(20), Some(1)), "{report}");
    assert_eq!(next["estimate"]["source"], "urdf");
    assert_eq!(next["condition_number"]["before"], Value::Null);
    assert!(next["condition_number"]["after"].as_f64().unwrap() > 1.0);
    let balance = &next["balance"];
    let (std, untold) =
        (balance["margin_std_m"].as_f64().unwrap(), balance["untold_std_m"].as_f64().unwrap());
    assert!(std > untold && untold > 0.0, "{balance}");
    assert!(balance["alpha"].as_f64().unwrap() <= balance["largest_alpha"].as_f64().unwrap() + 1e-9);
    let name = next["motion"].as_str().unwrap();
    assert!(summary.starts_with(&format!("next: {name} (5.99 s")), "{summary}");
    for part in
        ["of the 1 of 20 motions that keep the balance", "nothing has been measured", "by equation (8)"]
    {
        assert!(summary.contains(part), "{summary}");
    }
    assert_eq!(warnings, "");
    // The file is the motion, with the torque that the URDF asks for.
    let plan = scene.planned();
    let joints = plan.joints.clone();
    let chosen =
        Recording::from_csv(&scene.path(&format!("motions/{name}.csv")), &joints, TorqueColumns::Absent)
            .unwrap();
    assert_eq!((&plan.t, &plan.q, &plan.qd, &plan.qdd), (&chosen.t, &chosen.q, &chosen.qd, &chosen.qdd));
    assert!(torque_error(&plan, &urdf(), [0.0; 3]) < 1e-9);
    assert!((margin(&plan, &standing(&urdf())) - balance["margin_m"].as_f64().unwrap()).abs() < 1e-12);
}

#[test]
fn logs_correct_the_estimate_and_open_the_way_to_livelier_motions() {
    let scene = Scene::new(&wrong_urdf());
    let support = "--support DIR/support.toml --declare viscous_friction --selection condition";
    let (_, _, first) = scene.next(support);
    let believed = torque_error(&scene.planned(), &urdf(), synthetic::VISCOUS);
    let (summary, _, one) = scene.next(&format!("{support} --measured DIR/log_1.csv"));
    let (_, _, two) = scene.next(&format!("{support} --measured DIR/log_1.csv DIR/log_2.csv"));
    let number = |report: &Value, path: &str| report.pointer(path).and_then(Value::as_f64).unwrap();
    for (report, logs) in [(&one, 1), (&two, 2)] {
        assert_eq!(report["next"]["estimate"]["source"], "logs");
        assert_eq!(report["next"]["estimate"]["logs"], logs);
        let after = number(report, "/next/condition_number/after");
        assert!(after <= number(report, "/next/condition_number/runner_up/after"));
        assert!(number(report, "/next/allowed") > number(&first, "/next/allowed"), "{report}");
    }
    assert!(number(&two, "/next/condition_number/before") < number(&one, "/next/condition_number/before"));
    assert!(number(&two, "/next/balance/alpha") < number(&one, "/next/balance/alpha"));
    assert!(number(&one, "/next/balance/alpha") < number(&first, "/next/balance/alpha"));
    assert!(summary.contains("from 1 log (15.0 s) and the URDF"), "{summary}");
    // The feed-forward is the true robot's, friction included; the URDF's was not.
    let plan = scene.planned();
    let error = torque_error(&plan, &urdf(), synthetic::VISCOUS);
    println!("torque error {believed:.3} by the URDF, {error:.4} by the estimate");
    assert!(believed > 0.2 && error < 0.01, "{believed} by the URDF, {error} by the estimate");
}

/// Robots that are off the URDF by as much as it is said to be: over all of them the margin is off by its
/// standard deviation, before and after something has been measured, and less after.
#[test]
fn the_margin_is_as_uncertain_as_it_says() {
    const SHARE: f64 = 0.15;
    let scene = Scene::new(&urdf());
    let believed = standing(&urdf());
    let (base_link, bodies) = believed.split_at(10);
    let scales =
        [phiw_regressor::parameter_scales(base_link), phiw_regressor::parameter_scales(bodies)].concat();
    let more =
        format!("--support DIR/support.toml --declare viscous_friction --alpha 0.05 --urdf-error {SHARE}");
    let (mut squares, mut told, mut count) = ([0.0; 2], [0.0; 2], 0.0);
    for seed in 0..16 {
        let mut random = RandomNumbers::new(1000 + seed);
        // Twelve uniform numbers make a normal one.
        let mut normal = || (0..12).map(|_| random.uniform(-0.5, 0.5)).sum::<f64>();
        let truth: Vec<f64> =
            believed.iter().zip(&scales).map(|(value, scale)| value + SHARE * scale * normal()).collect();
        let mut robot = tree(&urdf(), false);
        robot.set_inertial_parameters(&truth[10..]).unwrap();
        let log = synthetic::recording_of_tree(&robot, seed, 10.0);
        log.write_csv(&scene.path("log.csv")).unwrap();
        for (stage, logs) in ["", "--measured DIR/log.csv"].into_iter().enumerate() {
            let (_, _, report) = scene.next(&format!("{more} {logs}"));
            let balance = &report["next"]["balance"];
            let (found, std) =
                (balance["margin_m"].as_f64().unwrap(), balance["margin_std_m"].as_f64().unwrap());
            squares[stage] += ((found - margin(&scene.planned(), &truth)) / std).powi(2);
            let untold = balance["untold_std_m"].as_f64().unwrap();
            told[stage] += (std * std - untold * untold).sqrt();
        }
        count += 1.0;
    }
    let [before, after] = squares.map(|sum: f64| (sum / count).sqrt());
    println!(
        "errors over standard deviations, rms: {before:.2} before, {after:.2} after; what torques can tell {:.2} mm, {:.2} mm",
        1e3 * told[0] / count,
        1e3 * told[1] / count
    );
    assert!((0.6..1.4).contains(&before) && (0.6..1.4).contains(&after), "{before}, {after}");
    assert!(told[1] < 0.1 * told[0], "a log tells something");
}

/// A joint that rests, or hardly moves, in the only log: its parameters are the URDF's, not the noise's.
#[test]
fn what_a_log_hardly_tells_is_left_to_the_urdf() {
    let scene = Scene::new(&urdf());
    let robot = tree(&urdf(), false);
    let mut workspace = phiw_dynamics::Workspace::new(&robot);
    for tremor in [0.0, 2e-3] {
        let mut log = synthetic::recording(5, 12.0);
        let mut random = RandomNumbers::new(3);
        (log.q, log.tau) = (Vec::new(), Vec::new());
        for &t in &log.t {
            let wave = |amplitude: f64, rate: f64| {
                let (sine, cosine) = (rate * t).sin_cos();
                [amplitude * sine, amplitude * rate * cosine, -amplitude * rate * rate * sine]
            };
            let state = [wave(0.8, 1.9), wave(0.7, 1.3), wave(tremor, 2.3)];
            let [q, v, a] = [0, 1, 2].map(|order| state.map(|joint| joint[order]));
            let mut torque = [0.0; JOINTS];
            robot.inverse_dynamics(&q, &v, &a, &mut workspace, &mut torque).unwrap();
            let noise = |joint: usize| synthetic::NOISE[joint];
            log.tau.extend((0..JOINTS).map(|joint| torque[joint] + noise(joint) * random.uniform(-1.7, 1.7)));
            log.q.extend(q);
        }
        log.write_csv(&scene.path("log.csv")).unwrap();
        let (_, _, report) = scene.next("--support DIR/support.toml --measured DIR/log.csv");
        let error = torque_error(&scene.planned(), &urdf(), [0.0; 3]);
        println!("torque error {error:.4} from a log in which the last joint moves by {tremor} rad");
        assert!(error < 0.02, "{error}");
        assert_eq!(report["next"]["estimate"]["source"], "logs");
    }
}

#[test]
fn a_model_file_stands_for_the_fit() {
    let scene = Scene::new(&wrong_urdf());
    let identify = "identify --urdf DIR/robot.urdf --train DIR/log_1.csv DIR/log_2.csv --declare viscous_friction --out DIR/model";
    assert_eq!(scene.run(identify).0, 0);
    let (summary, _, report) = scene.next(
        "--support DIR/support.toml --model DIR/model/model.json --measured DIR/log_1.csv DIR/log_2.csv",
    );
    assert_eq!(report["next"]["estimate"]["source"], "model");
    assert!(summary.contains("parameters from the model"), "{summary}");
    assert!(torque_error(&scene.planned(), &urdf(), synthetic::VISCOUS) < 0.03);
    assert!(report["next"]["balance"]["margin_std_m"].as_f64().unwrap() > 0.0);
    assert!(report["next"]["condition_number"]["before"].as_f64().is_some());
    // Without logs there is no Φ yet, but the parameters are the model's.
    let (_, _, report) = scene.next("--support DIR/support.toml --model DIR/model/model.json");
    assert_eq!(report["next"]["condition_number"]["before"], Value::Null);
    assert!(torque_error(&scene.planned(), &urdf(), synthetic::VISCOUS) < 0.03);
}

#[test]
fn a_robot_that_is_bolted_down_may_do_anything() {
    let scene = Scene::new(&urdf());
    let (summary, _, report) = scene.next("--measured DIR/log_1.csv");
    assert_eq!(report["next"]["allowed"], 20);
    assert_eq!(report["next"]["balance"], Value::Null);
    assert!(summary.contains("of all 20 motions (no balance is asked for)"), "{summary}");
}

#[test]
fn limits_and_a_moving_start_are_pointed_out() {
    let scene = Scene::new(
        &urdf().replace("effort=\"80\"", "effort=\"8\"").replace("velocity=\"4\"", "velocity=\"0.05\""),
    );
    let mut moving = motion(1, 0.4, 1.0);
    let keep = 150 * JOINTS..;
    for signal in [&mut moving.q, moving.qd.as_mut().unwrap(), moving.qdd.as_mut().unwrap()] {
        *signal = signal[keep.clone()].to_vec();
    }
    moving.t.truncate(450);
    for entry in std::fs::read_dir(scene.path("motions")).unwrap() {
        std::fs::remove_file(entry.unwrap().path()).unwrap();
    }
    moving.write_csv(&scene.path("motions/moving.csv")).unwrap();
    let (_, warnings, report) = scene.next("");
    for part in [
        "joint_2: the torque reaches ",
        "beyond the URDF's limit of 8",
        "joint_1: the speed reaches",
        "the motion begins with",
        "ease the robot into it",
    ] {
        assert!(warnings.contains(part), "no `{part}` in: {warnings}");
    }
    assert_eq!(report["phiw"]["warnings"].as_array().unwrap().len(), warnings.lines().count());
}

/// A foot behind held joints, as a humanoid's legs are: the same floor as under the base.
#[test]
fn a_foot_may_be_behind_joints_that_are_held() {
    let scene = Scene::new(&urdf());
    let (_, _, on_base) = scene.next("--support DIR/support.toml --hold joint_1");
    // link_1 is 0.3 m above the base, and not turned when joint_1 is at 0.
    let text = std::fs::read_to_string(scene.path("support.toml")).unwrap();
    std::fs::write(
        scene.path("support.toml"),
        text.replace("\"base\"", "\"link_1\"").replace(", 0.0]", ", -0.3]"),
    )
    .unwrap();
    let (_, _, on_link) = scene.next("--support DIR/support.toml --hold joint_1");
    let margin = |report: &Value| report["next"]["balance"]["margin_m"].as_f64().unwrap();
    assert!((margin(&on_base) - margin(&on_link)).abs() < 1e-12);
    assert_eq!(on_base["next"]["motion"], on_link["next"]["motion"]);
}

/// The warning of what the reader of MJCF leaves out was `identify`'s alone.
#[test]
fn an_mjcf_file_is_read_with_a_warning_of_what_is_left_out() {
    let scene = Scene::new(&urdf());
    let tree = tree(&urdf(), false);
    let mut robot = RobotModel::new(&tree);
    robot.joints[1] = JointModel { armature: 0.3, ..JointModel::default() };
    std::fs::write(scene.path("robot.urdf"), write_mjcf(&robot).unwrap()).unwrap();
    let (_, warnings, _) = scene.next("");
    assert!(warnings.contains("without what a URDF cannot express: armature of joint_2"), "{warnings}");
}

/// The first joint's rotor inertia depends on the inertia of its link: cond(Φ) was infinite for every motion,
/// no motion was better than another, and the first was taken.
#[test]
fn parameters_that_no_motion_tells_apart_do_not_decide() {
    let scene = Scene::new(&urdf());
    for selection in ["torque-per-second", "condition"] {
        let measured = "--measured DIR/log_1.csv DIR/log_2.csv";
        let of = |effects: &str| {
            let (_, _, report) =
                scene.next(&format!("{measured} --selection {selection} --declare {effects}"));
            let number = |path: &str| report.pointer(path).and_then(Value::as_f64);
            let runner_up = report.pointer("/next/condition_number/runner_up/motion").cloned();
            (number("/next/merit"), number("/next/condition_number/after"), runner_up)
        };
        let (merit, after, runner_up) = of("viscous_friction,rotor_inertia");
        assert!(merit.is_some() && after.is_some(), "{selection}: {merit:?} {after:?} {runner_up:?}");
        assert!(after >= of("viscous_friction").1 && after < Some(1e6), "{selection}: {after:?}");
    }
}
