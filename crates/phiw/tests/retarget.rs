//! `phiw retarget`, from files to files.

use assert_cmd::Command;
use phiw_bspline_retarget::embedded::embedded_motions;
use phiw_bspline_retarget::npz::{Array, Npz, NpzWriter};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use phiw_mjcf::{JointModel, RobotModel, write_mjcf};
use phiw_telemetry::{Recording, TorqueColumns};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const MOTIONS: usize = 3;

/// A folder with a robot and some of the embedded motions, cut short.
fn scene() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (number, mut motion) in embedded_motions(5).unwrap().step_by(40).take(MOTIONS).enumerate() {
        let markers = motion.recording.labels.len();
        motion.recording.positions_m.truncate(120 * markers);
        std::fs::write(folder.path().join(format!("m{number}.c3d")), motion.to_c3d()).unwrap();
    }
    let robot = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/upper_body18.urdf");
    std::fs::copy(robot, folder.path().join("robot.urdf")).unwrap();
    folder
}

fn motions(folder: &TempDir) -> Vec<PathBuf> {
    (0..MOTIONS).map(|number| folder.path().join(format!("m{number}.c3d"))).collect()
}

/// Exit status, standard output, standard error.
fn run(folder: &TempDir, files: &[PathBuf], more: &[&str]) -> (i32, String, String) {
    let mut command = Command::cargo_bin("phiw").unwrap();
    command.arg("retarget").arg("--urdf").arg(folder.path().join("robot.urdf"));
    command.arg("--c3d").args(files).arg("--out").arg(folder.path().join("out")).args(more);
    let output = command.output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

fn names(folder: &Path) -> Vec<String> {
    let entries = folder.read_dir().into_iter().flatten();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_bad_file_does_not_stop_the_rest_and_what_is_done_is_not_done_again() {
    let folder = scene();
    let mut files = motions(&folder);
    let bad = folder.path().join("bad.c3d");
    std::fs::write(&bad, "not a recording at all, but long enough to be one").unwrap();
    files.insert(1, bad);
    let (status, summary, errors) = run(&folder, &files, &[]);
    assert_eq!(status, 1, "{errors}");
    assert!(summary.starts_with("3 motions") && summary.contains("1 failed"), "{summary}");
    assert!(errors.contains("bad.c3d: not a C3D file"), "{errors}");
    let out = folder.path().join("out");
    assert_eq!(names(&out), ["m0.csv", "m0.json", "m1.csv", "m1.json", "m2.csv", "m2.json"]);

    let joints: Vec<String> = {
        let header = std::fs::read_to_string(out.join("m0.csv")).unwrap();
        let header = header.lines().next().unwrap().to_owned();
        header.split(',').filter_map(|name| name.strip_prefix("q.")).map(str::to_owned).collect()
    };
    assert_eq!(joints.len(), 18);
    let log = Recording::from_csv(&out.join("m0.csv"), &joints, TorqueColumns::Optional).unwrap();
    assert_eq!(log.len(), 120);

    // Again: everything is kept, byte for byte, but for the motion whose log was lost.
    let before = std::fs::read(out.join("m1.csv")).unwrap();
    std::fs::remove_file(out.join("m2.csv")).unwrap();
    let (status, summary, _) = run(&folder, &motions(&folder), &[]);
    assert_eq!(status, 0);
    assert!(summary.starts_with("1 motions") && summary.contains("2 kept"), "{summary}");
    assert_eq!(std::fs::read(out.join("m1.csv")).unwrap(), before);

    // Other settings: done again, and named.
    let (_, summary, _) = run(&folder, &motions(&folder), &["--torso-from-reach"]);
    assert!(summary.contains("from the reach") && summary.contains("0 kept"), "{summary}");
    let facts = std::fs::read_to_string(out.join("m1.json")).unwrap();
    assert!(facts.contains("\"torso_and_head\":\"from_reach\""), "{facts}");
}

/// The map of the embedded motions, changed, as a file beside them.
fn map(folder: &TempDir, top: &str) -> Vec<String> {
    let path = folder.path().join("map.toml");
    let map = include_str!("../../bspline-retarget/maps/embedded.toml");
    std::fs::write(&path, format!("{top}\n{map}")).unwrap();
    vec!["--map".to_owned(), path.display().to_string()]
}

/// What was taken out of a static trial, which places the markers of all its motions, went unsaid.
#[test]
fn artefacts_of_static_trials_were_dropped_without_a_word() {
    let folder = scene();
    let mut trial = embedded_motions(5).unwrap().next().unwrap();
    let markers = trial.recording.labels.len();
    trial.recording.positions_m.truncate(20 * markers);
    trial.recording.positions_m[6 * markers + 2] = [0.0; 3];
    let label = trial.recording.labels[2].clone();
    std::fs::write(folder.path().join("m0_static.c3d"), trial.to_c3d()).unwrap();
    let map = map(&folder, "static_suffix = \"_static\"");
    let more: Vec<&str> = map.iter().map(String::as_str).collect();
    let files = motions(&folder);
    let (status, _, errors) = run(&folder, &files, &more);
    assert_eq!(status, 0, "{errors}");
    let told = format!("m0_static.c3d: marker `{label}` is at exactly 0, 0, 0 in 1 frames (first 7)");
    assert_eq!(errors.matches(&told).count(), 1, "{errors}");
    let facts = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    assert!(facts("m0.json").contains(&format!("static trial: marker `{label}` is at exactly")));
    assert!(facts("m1.json").contains("\"artefacts\":[]"));
}

/// The message told to set `units` in the map, which tables took no notice of.
#[test]
fn a_table_in_millimetres_could_not_be_retargeted() {
    let folder = scene();
    let recording = embedded_motions(5).unwrap().next().unwrap().recording;
    let mut text = "t".to_owned();
    for label in &recording.labels {
        text += &format!(",{label}.x,{label}.y,{label}.z");
    }
    for (frame, positions) in recording.positions_m.chunks(recording.labels.len()).take(60).enumerate() {
        text += &format!("\n{}", frame as f64 / recording.rate_hz);
        positions.iter().flatten().for_each(|x| text += &format!(",{}", 1e3 * x));
    }
    let file = folder.path().join("table.csv");
    std::fs::write(&file, text).unwrap();
    let (status, _, errors) = run(&folder, std::slice::from_ref(&file), &[]);
    assert_eq!(status, 2, "{errors}");
    assert!(errors.contains("set `units` in the map (as if they were in mm, not m)"), "{errors}");
    let map = map(&folder, "units = \"mm\"");
    let more: Vec<&str> = map.iter().map(String::as_str).collect();
    let (status, summary, errors) = run(&folder, &[file], &more);
    assert_eq!(status, 0, "{errors}");
    assert!(summary.starts_with("1 motions"), "{summary}");
}

/// One message with all parts, exit status 2, nothing written.
fn check_refused(spoil: impl FnOnce(&TempDir) -> (Vec<PathBuf>, Vec<String>), parts: &[&str]) {
    let folder = scene();
    let (files, more) = spoil(&folder);
    let more: Vec<&str> = more.iter().map(String::as_str).collect();
    let (status, _, errors) = run(&folder, &files, &more);
    assert_eq!(status, 2, "{errors}");
    assert!(parts.iter().all(|part| errors.contains(part)), "{errors}");
    assert!(names(&folder.path().join("out")).is_empty());
}

#[test]
fn wrong_input_is_named() {
    let map = |text: &'static str| {
        move |folder: &TempDir| {
            let path = folder.path().join("map.toml");
            std::fs::write(&path, text).unwrap();
            (motions(folder), vec!["--map".to_owned(), path.display().to_string()])
        }
    };
    check_refused(map("name = 1"), &["map.toml: not a marker map"]);
    check_refused(map("name = \"m\"\n[segments.chst]\n"), &["`chst` is no segment", "`chest`"]);
    check_refused(
        map("name = \"m\"\n[segments.chest]\nat = { STRM = [0.1, 0.0, 0.2] }\n"),
        &["m0.c3d: the map's marker `STRM` is not in the recording", "`STRN`"],
    );
    check_refused(
        map("name = \"m\"\n[segments.chest]\ncluster = [\"STRN\"]\n"),
        &["m0.c3d: nothing says where marker `STRN` sits", "static trial"],
    );
    check_refused(
        |folder| (motions(folder), vec!["--interval".to_owned(), "1e-7".to_owned()]),
        &["m0.c3d: ", "more than 6000 of them", "a longer interval"],
    );
    check_refused(
        |folder| {
            let mut motion = embedded_motions(5).unwrap().next().unwrap();
            let frame = motion.recording.positions_m[..motion.recording.labels.len()].to_vec();
            motion.recording.positions_m = frame.repeat(50);
            let file = folder.path().join("hung.c3d");
            std::fs::write(&file, motion.to_c3d()).unwrap();
            (vec![file], vec![])
        },
        &["hung.c3d: most markers are frozen: "],
    );
    check_refused(|folder| (vec![folder.path().join("none.c3d")], vec![]), &["none.c3d: no such file"]);
    check_refused(
        |folder| {
            let cut = std::fs::read(folder.path().join("m0.c3d")).unwrap();
            std::fs::write(folder.path().join("m0.c3d"), &cut[..20000]).unwrap();
            (vec![folder.path().join("m0.c3d")], vec![])
        },
        &["m0.c3d: the frames needs bytes", "cut off"],
    );
    check_refused(
        |folder| {
            let twice = folder.path().join("m0.csv");
            std::fs::write(&twice, "").unwrap();
            (vec![folder.path().join("m0.c3d"), twice], vec![])
        },
        &["have the same name"],
    );
    check_refused(
        |folder| {
            let urdf = "<robot name=\"r\"><link name=\"a\"/></robot>";
            std::fs::write(folder.path().join("robot.urdf"), urdf).unwrap();
            (motions(folder), vec![])
        },
        &["robot.urdf"],
    );
}

/// Motions as they are written here must not be taken for motions that jump.
#[test]
fn what_retarget_writes_has_no_jumps() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let mut files = Vec::new();
    // Four of them, whole; the twentieth has the fastest turn of a forearm of all.
    for (number, motion) in embedded_motions(5).unwrap().enumerate() {
        if [0, 19, 50, 84].contains(&number) {
            files.push(path(&format!("m{number}.c3d")));
            std::fs::write(&files[files.len() - 1], motion.to_c3d()).unwrap();
        }
    }
    let robot = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/upper_body18.urdf");
    for derivatives in ["analytic", "backward-differences"] {
        let mut retarget = Command::cargo_bin("phiw").unwrap();
        retarget.arg("retarget").arg("--urdf").arg(&robot).arg("--c3d").args(&files);
        retarget
            .args(["--quiet", "--derivatives", derivatives, "--out"])
            .arg(path(derivatives))
            .assert()
            .success();
        let joints: Vec<String> = {
            let tree = phiw_dynamics::urdf::read_urdf_file(&robot, &Default::default()).unwrap().tree;
            tree.joint_names().map(str::to_owned).collect()
        };
        for file in names(&path(derivatives)).iter().filter(|name| name.ends_with(".csv")) {
            let log =
                Recording::from_csv(&path(derivatives).join(file), &joints, TorqueColumns::Absent).unwrap();
            phiw_curriculum::motion::Motion::from_recording(file, "", &log).unwrap();
        }
    }
}

/// A second of AMASS: a person who sways and bends the left elbow.
fn amass() -> Vec<u8> {
    let (mut poses, mut trans) = (Vec::new(), Vec::new());
    for frame in 0..60 {
        let swing = (0.1 * f64::from(frame)).sin();
        let mut pose = vec![0.0; 66];
        (pose[0], pose[3 * 16 + 2], pose[3 * 17 + 2]) = (1.57, -1.2, 1.2);
        pose[3 * 18 + 1] = -1.0 - 0.5 * swing;
        poses.extend(pose);
        trans.extend([0.05 * swing, 0.03 * swing, 0.95]);
    }
    let mut writer = NpzWriter::default();
    writer.numbers("poses", &Array { shape: vec![60, 66], values: poses });
    writer.numbers("trans", &Array { shape: vec![60, 3], values: trans });
    writer.numbers("mocap_framerate", &Array { shape: vec![], values: vec![60.0] });
    writer.finish().unwrap()
}

#[test]
fn an_npz_of_amass_becomes_an_npz_that_learning_programs_read() {
    let folder = scene();
    let file = folder.path().join("sway.npz");
    std::fs::write(&file, amass()).unwrap();
    let (status, summary, errors) = run(&folder, std::slice::from_ref(&file), &["--format", "npz"]);
    assert_eq!(status, 0, "{errors}");
    assert!(summary.contains("with the map `smpl`"), "{summary}");
    let out = folder.path().join("out");
    assert_eq!(names(&out), ["sway.json", "sway.npz"]);
    let bytes = std::fs::read(out.join("sway.npz")).unwrap();
    let mut npz = Npz::new(&bytes, 1 << 20).unwrap();
    let mut shape = |name: &str| npz.array(name).unwrap().unwrap().shape;
    assert_eq!(shape("fps"), [1]);
    assert_eq!(shape("joint_pos"), [60, 18]);
    assert_eq!(shape("joint_vel"), [60, 18]);
    assert_eq!(shape("body_pos_w"), [60, 18, 3]);
    assert_eq!(shape("body_quat_w"), [60, 18, 4]);
    assert_eq!(shape("body_lin_vel_w"), [60, 18, 3]);
    assert_eq!(shape("body_ang_vel_w"), [60, 18, 3]);
    assert!(["joint_names", "body_names"].iter().all(|name| npz.names().contains(&(*name).to_owned())));

    // The same as a log: the same angles.
    let (status, _, errors) = run(&folder, &[file], &[]);
    assert_eq!(status, 0, "{errors}");
    let text = std::fs::read_to_string(out.join("sway.csv")).unwrap();
    let header = text.lines().next().unwrap();
    let joints: Vec<String> =
        header.split(',').filter_map(|name| name.strip_prefix("q.")).map(str::to_owned).collect();
    let log = Recording::from_csv(&out.join("sway.csv"), &joints, TorqueColumns::Optional).unwrap();
    assert_eq!(npz.array("joint_pos").unwrap().unwrap().values, log.q);
}

#[test]
fn motions_that_are_cut_short_are_refused_in_one_line() {
    let folder = scene();
    let whole = amass();
    let cut: [(&str, &[u8]); 3] = [
        ("cut.npz", &whole[..whole.len() / 2]),
        ("cut.bvh", b"HIERARCHY\nROOT Hips\n{\n  OFFSET 0 0"),
        ("cut.trc", b"PathFileType\t4\t(X/Y/Z)\tcut.trc\nDataRate"),
    ];
    for (name, bytes) in cut {
        let file = folder.path().join(name);
        std::fs::write(&file, bytes).unwrap();
        let (status, _, errors) = run(&folder, &[file], &[]);
        assert_eq!(status, 2, "{errors}");
        assert!(errors.contains(name) && errors.trim_end().lines().count() == 1, "{errors}");
        assert!(names(&folder.path().join("out")).is_empty());
    }
}

/// The warning of what the reader of MJCF leaves out was `identify`'s alone.
#[test]
fn an_mjcf_file_is_read_with_a_warning_of_what_is_left_out() {
    let folder = scene();
    let path = folder.path().join("robot.urdf");
    let tree = read_urdf_file(&path, &UrdfOptions::default()).unwrap().tree;
    let mut robot = RobotModel::new(&tree);
    robot.joints[1] = JointModel { armature: 0.3, ..JointModel::default() };
    std::fs::write(&path, write_mjcf(&robot).unwrap()).unwrap();
    let (status, _, errors) = run(&folder, &motions(&folder)[..1], &[]);
    assert_eq!(status, 0, "{errors}");
    assert!(errors.contains("without what a URDF cannot express: armature of "), "{errors}");
}
