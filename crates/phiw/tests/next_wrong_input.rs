//! `phiw next` on wrong input: one message that names the file, the place and the mend, exit status 2, and
//! nothing written.

use crate::next_scene;

use next_scene::{JOINTS, Scene, tree, urdf};
use phiw_telemetry::{Recording, TorqueColumns};

/// One message with all parts, exit status 2, nothing written.
fn check_refused(spoil: impl FnOnce(&Scene) -> &'static str, parts: &[&str]) {
    let scene = Scene::new(&urdf());
    let more = spoil(&scene);
    let line = format!("next --urdf DIR/robot.urdf --motions DIR/motions --out DIR/out/next.csv {more}");
    let (status, summary, message) = scene.run(&line);
    assert_eq!((status, summary.as_str()), (2, ""), "{parts:?}: {message}");
    for part in parts {
        assert!(message.contains(part), "no `{part}` in: {message}");
    }
    assert!(message.lines().count() == 1 || message.contains("try '--help'"), "{message}");
    assert!(!scene.path("out").exists());
}

#[test]
fn wrong_input_is_named() {
    let rewrite = |file: &'static str, change: &'static dyn Fn(&str) -> String| {
        move |scene: &Scene| {
            let text = std::fs::read_to_string(scene.path(file)).unwrap();
            std::fs::write(scene.path(file), change(&text)).unwrap();
            "--support DIR/support.toml"
        }
    };
    check_refused(
        |scene| {
            std::fs::remove_dir_all(scene.path("motions")).unwrap();
            ""
        },
        &["motions: no such file"],
    );
    check_refused(
        |scene| {
            std::fs::remove_dir_all(scene.path("motions")).unwrap();
            std::fs::create_dir(scene.path("motions")).unwrap();
            ""
        },
        &["motions: there are no motions (*.csv)", "phiw retarget"],
    );
    check_refused(
        rewrite("motions/m03.csv", &|text| text.replace("qdd.", "qddot.")),
        &["m03.csv", "no columns qd.<joint> and qdd.<joint>"],
    );
    check_refused(
        rewrite("motions/m03.csv", &|text| text.replacen("\n0.05,", "\n0.056,", 1)),
        &["m03.csv", "time stamps are not even"],
    );
    check_refused(
        rewrite("motions/m03.csv", &|text| text.replace("q.joint_2", "q.joint2")),
        &["m03.csv, line 1: no column `q.joint_2`"],
    );
    check_refused(rewrite("support.toml", &|_| "foot = 3".into()), &["support.toml: not a support file"]);
    check_refused(
        rewrite("support.toml", &|text| text.replace("\"base\"", "\"bass\"")),
        &["support.toml: the foot's link \"bass\"", "base, link_1"],
    );
    check_refused(
        rewrite("support.toml", &|text| text.replace("\"base\"", "\"link_2\"")),
        &["support.toml: the foot `link_2` is moved by the joint `joint_2`", "--hold joint_2"],
    );
    check_refused(
        rewrite("support.toml", &|text| text.replace("0.2", "0.004")),
        &["none of the 20 motions keeps the ZMP over the support", "calmer motions"],
    );
    check_refused(|_| "--support DIR/none.toml", &["none.toml: no such file"]);
    check_refused(|_| "--measured DIR/none.csv", &["none.csv: no such file"]);
    check_refused(|_| "--model DIR/robot.urdf", &["robot.urdf: not a model.json"]);
    check_refused(|_| "--alpha 1.5", &["`1.5` is not a number from 0 to 1"]);
    check_refused(|_| "--declare friction", &["friction"]);
}

#[test]
fn a_joint_that_no_motion_moves_is_named() {
    let scene = Scene::new(&urdf());
    for entry in std::fs::read_dir(scene.path("motions")).unwrap() {
        let path = entry.unwrap().path();
        let joints: Vec<String> = tree(&urdf(), false).joint_names().map(str::to_owned).collect();
        let mut motion = Recording::from_csv(&path, &joints, TorqueColumns::Absent).unwrap();
        motion.q.iter_mut().skip(1).step_by(JOINTS).for_each(|q| *q = 0.25);
        for derivative in [&mut motion.qd, &mut motion.qdd].into_iter().flatten() {
            derivative.iter_mut().skip(1).step_by(JOINTS).for_each(|value| *value = 0.0);
        }
        motion.write_csv(&path).unwrap();
    }
    let line = "next --urdf DIR/robot.urdf --motions DIR/motions --out DIR/next.csv";
    let (status, _, message) = scene.run(line);
    assert_eq!(status, 2, "{message}");
    assert!(message.contains("joint `joint_2` moves by 0.0e0 rad in all motions"), "{message}");
    assert!(message.contains("--hold joint_2=0.2500"), "{message}");
    let (status, _, message) = scene.run(&format!("{line} --hold joint_2=0.25"));
    assert_eq!(status, 0, "{message}");
}

#[test]
fn the_result_is_a_file() {
    let scene = Scene::new(&urdf());
    let (status, _, message) =
        scene.run("next --urdf DIR/robot.urdf --motions DIR/motions --out DIR/motions");
    assert_eq!(status, 2);
    assert!(message.contains("this is a folder; name a file in it"), "{message}");
    let line = "next --urdf DIR/robot.urdf --motions DIR/motions --quiet --out DIR/new/folder/plan.csv";
    let (status, summary, message) = scene.run(line);
    assert_eq!((status, summary.as_str(), message.as_str()), (0, "", ""));
    assert!(scene.path("new/folder/plan.csv").is_file() && scene.path("new/folder/plan.json").is_file());
}

/// Such a motion was said to keep the balance, at 2969 rad/s.
#[test]
fn a_motion_whose_stamps_contradict_its_velocities_is_refused() {
    let spoiled = |column: &'static str, factor: f64| {
        move |scene: &Scene| {
            let folder = scene.path("motions").read_dir().unwrap();
            let mut files: Vec<_> = folder.map(|entry| entry.unwrap().path()).collect();
            files.sort();
            let joints: Vec<String> = tree(&urdf(), false).joint_names().map(str::to_owned).collect();
            let mut motion = Recording::from_csv(&files[0], &joints, TorqueColumns::Absent).unwrap();
            let scale = |values: &mut Vec<f64>| values.iter_mut().for_each(|value| *value *= factor);
            match column {
                "t" => scale(&mut motion.t),
                "qdd" => scale(motion.qdd.as_mut().unwrap()),
                _ => scale(&mut motion.q),
            }
            motion.write_csv(&files[0]).unwrap();
            ""
        }
    };
    for (column, factor) in [("t", 1e-3), ("t", 1e3), ("q", 1e3), ("q", 57.3), ("qdd", 57.3)] {
        check_refused(spoiled(column, factor), &["motions", "over the time stamps changes by"]);
    }
}

/// The comparison of whole columns let a short jump pass: 0.02 rad between two rows is 2 rad/s that no column
/// states.
#[test]
fn a_motion_that_jumps_between_two_rows_is_refused() {
    let jump = |size: f64, rows: std::ops::Range<usize>| {
        move |scene: &Scene| {
            let path = scene.path("motions/m19.csv");
            let joints: Vec<String> = tree(&urdf(), false).joint_names().map(str::to_owned).collect();
            let mut motion = Recording::from_csv(&path, &joints, TorqueColumns::Absent).unwrap();
            rows.for_each(|row| motion.q[JOINTS * row + 1] += size);
            motion.write_csv(&path).unwrap();
            ""
        }
    };
    for size in [0.02, -0.03, 0.05] {
        for rows in [300..301, 300..340] {
            let parts = ["m19.csv", "q.joint_2 goes from", "lines 301 and 302", "the robot would jump"];
            check_refused(jump(size, rows), &parts);
        }
        check_refused(jump(size, 599..600), &["m19.csv", "q.joint_2 goes from", "lines 600 and 601"]);
    }
    // So long a jump is seen in whole columns, too.
    for size in [-0.2, 0.5] {
        check_refused(jump(size, 300..301), &["m19.csv", "q.joint_2"]);
    }
}

/// At a thousand rows a second a jump of 4 mrad is no longer than a rounded position, but 4 rad/s.
#[test]
fn a_step_beyond_the_joints_speed_is_refused() {
    let fast = |scene: &Scene| {
        let path = scene.path("motions/m07.csv");
        let joints: Vec<String> = tree(&urdf(), false).joint_names().map(str::to_owned).collect();
        let mut motion = Recording::from_csv(&path, &joints, TorqueColumns::Absent).unwrap();
        motion.t.iter_mut().for_each(|t| *t *= 0.1);
        motion.qd.as_mut().unwrap().iter_mut().for_each(|v| *v *= 10.0);
        motion.qdd.as_mut().unwrap().iter_mut().for_each(|a| *a *= 100.0);
        // Ten times as slow again: the motion itself stays.
        for signal in [&mut motion.q, motion.qd.as_mut().unwrap(), motion.qdd.as_mut().unwrap()] {
            signal.iter_mut().for_each(|value| *value *= 0.1);
        }
        motion.q[JOINTS * 300 + 1] += 0.004;
        motion.write_csv(&path).unwrap();
        let robot = std::fs::read_to_string(scene.path("robot.urdf")).unwrap();
        std::fs::write(scene.path("robot.urdf"), robot.replace("velocity=\"4\"", "velocity=\"2\"")).unwrap();
        ""
    };
    check_refused(fast, &["m07.csv", "q.joint_2 goes from", "lines 301 and 302", "the robot would jump"]);
}
