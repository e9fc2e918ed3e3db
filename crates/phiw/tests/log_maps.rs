//! Logs with a map give what the same logs without one give; `phiw map` writes a first map.

use crate::synthetic;

use assert_cmd::Command;
use phiw_telemetry::Recording;
use serde_json::Value;
use std::path::Path;

/// Runs the command; exit status, standard output and standard error.
fn run(arguments: &str, folder: &Path) -> (i32, String, String) {
    let mut command = Command::cargo_bin("phiw").unwrap();
    let output = command.current_dir(folder).args(arguments.split_whitespace()).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

#[track_caller]
fn report(arguments: &str, folder: &Path) -> Value {
    let (status, _, stderr) = run(arguments, folder);
    assert_eq!(status, 0, "{stderr}");
    let out = arguments.split_whitespace().last().unwrap();
    serde_json::from_str(&std::fs::read_to_string(folder.join(out).join("report.json")).unwrap()).unwrap()
}

/// A folder with the robot.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("robot.urdf"), synthetic::URDF).unwrap();
    folder
}

/// A column of a log: its name, and its value in a row.
type LogColumn<'a> = (String, Box<dyn Fn(usize) -> f64 + 'a>);

/// A log as CSV with columns of its own.
fn write_log(path: &Path, rows: usize, columns: &[LogColumn<'_>]) {
    let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    let mut text = names.join(",") + "\n";
    for row in 0..rows {
        let cells: Vec<String> = columns.iter().map(|(_, value)| value(row).to_string()).collect();
        text += &(cells.join(",") + "\n");
    }
    std::fs::write(path, text).unwrap();
}

const GEARS: [f64; 3] = [100.0, 80.0, 50.0];
const TORQUE_CONSTANT: f64 = 0.07;

/// The same recording with positions in degrees, a clock in milliseconds, and motor currents in mA.
fn write_with_currents(recording: &Recording, path: &Path) {
    let mut columns: Vec<LogColumn<'_>> = vec![("stamp_ms".into(), Box::new(|row| 1e3 * recording.t[row]))];
    for joint in 0..3 {
        let name = joint + 1;
        columns.push((
            format!("Joint{name}_Pos_deg"),
            Box::new(move |row| recording.q[3 * row + joint].to_degrees()),
        ));
        columns.push((
            format!("Joint{name}_Cur_mA"),
            Box::new(move |row| -1e3 * recording.tau[3 * row + joint] / (GEARS[joint] * TORQUE_CONSTANT)),
        ));
    }
    write_log(path, recording.len(), &columns);
}

/// The map of that.
fn map_of_currents() -> String {
    let mut map = "time = { column = \"stamp_ms\", unit = \"ms\" }\n".to_owned();
    for (joint, gear) in GEARS.iter().enumerate() {
        let name = joint + 1;
        map += &format!(
            "[joint.joint_{name}]\ngear = {gear}\ntorque_constant_nm_per_a = {TORQUE_CONSTANT}\n\
             q = {{ column = \"Joint{name}_Pos_deg\", unit = \"deg\" }}\n\
             tau = {{ column = \"Joint{name}_Cur_mA\", unit = \"mA\", sign = -1 }}\n"
        );
    }
    map
}

#[test]
fn a_log_of_currents_gives_what_the_log_of_torques_gives() {
    let folder = folder();
    let recording = synthetic::recording(1, 20.0);
    std::fs::write(folder.path().join("torques.csv"), synthetic::csv(&recording)).unwrap();
    write_with_currents(&recording, &folder.path().join("currents.csv"));
    std::fs::write(folder.path().join("map.toml"), map_of_currents()).unwrap();
    let declare = "identify --urdf robot.urdf --declare viscous_friction";
    let torques = report(&format!("{declare} --train torques.csv --out a"), folder.path());
    let currents = report(&format!("{declare} --train currents.csv --map map.toml --out b"), folder.path());
    let near = |path: &str| {
        let [a, b] =
            [&torques, &currents].map(|report| report.pointer(path).and_then(Value::as_f64).unwrap());
        assert!((a - b).abs() < 1e-6 * a.abs(), "{path}: {a} and {b}");
    };
    near("/before/validate/relative");
    near("/noise_floor/joint_2");
    // What reads logs reads the map, too.
    let (status, _, stderr) =
        run("predict --model b/model.json currents.csv --map map.toml --out p.csv", folder.path());
    assert_eq!(status, 0, "{stderr}");
    let (status, stdout, stderr) = run("check --urdf robot.urdf currents.csv --map map.toml", folder.path());
    assert!(status == 0 && stdout.contains("4000 rows"), "{stdout}{stderr}");
}

#[test]
fn a_log_of_a_controller_s_law_names_the_same_effects() {
    let folder = folder();
    let mut recording = synthetic::recording(2, 30.0);
    let rows = recording.len();
    // The velocity as a drive logs it, and the reference that the law made the torque of.
    let (kp, kd) = (500.0, 5.0);
    let q = |row: usize, joint: usize| recording.q[3 * row.min(rows - 1) + joint];
    let qd: Vec<f64> = (0..3 * rows)
        .map(|k| {
            let (row, joint) = (k / 3, k % 3);
            let (before, after) = (row.saturating_sub(1), (row + 1).min(rows - 1));
            (q(after, joint) - q(before, joint)) * synthetic::RATE / (after - before) as f64
        })
        .collect();
    let columns = || -> Vec<LogColumn<'_>> {
        let mut columns: Vec<LogColumn<'_>> = vec![("t".into(), Box::new(|row| recording.t[row]))];
        for joint in 0..3 {
            let name = joint + 1;
            let (recording, qd) = (&recording, &qd);
            columns.push((format!("q.joint_{name}"), Box::new(move |row| recording.q[3 * row + joint])));
            columns.push((format!("qd.joint_{name}"), Box::new(move |row| qd[3 * row + joint])));
            columns.push((
                format!("goal.joint_{name}"),
                Box::new(move |row| {
                    let k = 3 * row + joint;
                    recording.q[k] + (recording.tau[k] + kd * qd[k]) / kp
                }),
            ));
        }
        columns
    };
    write_log(&folder.path().join("law.csv"), rows, &columns());
    let map =
        format!("[every_joint]\nqref = \"goal.{{joint}}\"\ntau = {{ pd = {{ kp = {kp}, kd = {kd} }} }}\n");
    std::fs::write(folder.path().join("map.toml"), map).unwrap();
    recording.qd = Some(qd.clone());
    std::fs::write(folder.path().join("torques.csv"), synthetic::csv(&recording)).unwrap();
    let torques = report("explain --urdf robot.urdf --train torques.csv --out a", folder.path());
    let law = report("explain --urdf robot.urdf --train law.csv --map map.toml --out b", folder.path());
    let kinds = |report: &Value| -> Vec<(String, Value)> {
        let effects = report["effects"].as_array().unwrap().iter();
        effects
            .map(|effect| (effect["kind"].as_str().unwrap().to_owned(), effect["joints"].clone()))
            .collect()
    };
    assert_eq!(kinds(&torques), kinds(&law));
    assert!(kinds(&law).iter().any(|(kind, _)| kind == "viscous_friction"), "{:?}", kinds(&law));
}

#[test]
fn stretches_of_a_map_are_what_is_fitted_and_validated() {
    let folder = folder();
    std::fs::write(folder.path().join("log.csv"), synthetic::csv(&synthetic::recording(1, 30.0))).unwrap();
    std::fs::write(
        folder.path().join("map.toml"),
        "[[log]]\ntrain = [[0.0, 20.0]]\nvalidate = [[20.0, 28.0]]\n",
    )
    .unwrap();
    let identify =
        "identify --urdf robot.urdf --declare viscous_friction --train log.csv --map map.toml --out a";
    let (status, _, stderr) = run(identify, folder.path());
    assert!(status == 0 && stderr.contains("left out by the map"), "{stderr}");
    assert!(!stderr.contains("the same content"), "{stderr}");
    let model = std::fs::read_to_string(folder.path().join("a/model.json")).unwrap();
    assert!(model.contains("\"role\": \"validate\""), "no validation log in the model");
}

#[test]
fn an_unknown_payload_is_refused_and_not_ignored() {
    let folder = folder();
    std::fs::write(folder.path().join("log.csv"), synthetic::csv(&synthetic::recording(1, 15.0))).unwrap();
    let map = "[[log]]\nfile = \"l*\"\npayload = \"unknown but the same\"\n";
    std::fs::write(folder.path().join("map.toml"), map).unwrap();
    let (status, _, stderr) =
        run("identify --urdf robot.urdf --train log.csv --map map.toml --out a", folder.path());
    assert_eq!(status, 2);
    assert!(stderr.contains("map.toml, line 3, key `log.payload`"), "{stderr}");
    assert!(!folder.path().join("a").exists());
    let (status, stdout, _) = run("check --urdf robot.urdf log.csv --map map.toml", folder.path());
    assert!(status == 0 && stdout.contains("payload"), "{stdout}");
}

/// The robot with 2 kg at its last link is another robot; with the map it is the robot again.
#[test]
fn a_payload_that_was_weighed_is_taken_off() {
    let folder = folder();
    let mass = "<origin xyz=\"0.15 -0.02 0.02\"/><mass value=\"1.5\"/>";
    assert!(synthetic::URDF.contains(mass));
    // A point mass at the centre of the link's mass leaves the inertia about it.
    let loaded = synthetic::URDF.replace(mass, &mass.replace("1.5\"", "3.5\""));
    let recording = synthetic::recording_of(&loaded, 1, 30.0);
    std::fs::write(folder.path().join("loaded.csv"), synthetic::csv(&recording)).unwrap();
    std::fs::write(folder.path().join("free.csv"), synthetic::csv(&synthetic::recording(2, 30.0))).unwrap();
    let payload = "payload = { link = \"link_3\", mass_kg = 2.0, com_m = [0.15, -0.02, 0.02] }";
    let map = format!("[[log]]\nfile = \"loaded.csv\"\n{payload}\n");
    std::fs::write(folder.path().join("map.toml"), &map).unwrap();
    let logs = "identify --urdf robot.urdf --declare viscous_friction --train loaded.csv --validate free.csv";
    let without = report(&format!("{logs} --out a"), folder.path());
    let with = report(&format!("{logs} --map map.toml --out b"), folder.path());
    let error = |report: &Value| report.pointer("/before/validate/relative").and_then(Value::as_f64).unwrap();
    assert!(error(&without) > 5.0 * error(&with), "{} and {}", error(&without), error(&with));
    assert_eq!(with["verdict"], "sufficient");
    // A model is of the robot alone.
    let (status, _, stderr) =
        run("predict --model b/model.json loaded.csv --map map.toml --out p.csv", folder.path());
    assert!(status == 2 && stderr.contains("line 3, key `log.payload`"), "{stderr}");
    std::fs::write(folder.path().join("map.toml"), map.replace("link_3", "tool")).unwrap();
    let (status, _, stderr) = run(&format!("{logs} --map map.toml --out c"), folder.path());
    assert!(
        status == 2 && stderr.contains("`tool`") && stderr.contains("link_1, link_2, link_3"),
        "{stderr}"
    );
}

#[test]
fn a_map_names_joints_of_the_robot() {
    let folder = folder();
    std::fs::write(folder.path().join("log.csv"), synthetic::csv(&synthetic::recording(1, 15.0))).unwrap();
    std::fs::write(folder.path().join("map.toml"), "[joint.joint_4]\nq = \"x\"\n").unwrap();
    let (status, _, stderr) =
        run("identify --urdf robot.urdf --train log.csv --map map.toml --out a", folder.path());
    assert_eq!(status, 2);
    assert!(
        stderr.contains("map.toml, line 1, key `joint.joint_4`") && stderr.contains("joint_3"),
        "{stderr}"
    );
}

#[test]
fn a_first_map_is_guessed_by_names_and_ranges() {
    let folder = folder();
    write_with_currents(&synthetic::recording(1, 20.0), &folder.path().join("log.csv"));
    let (status, stdout, stderr) = run("map --urdf robot.urdf log.csv --out map.toml", folder.path());
    assert_eq!(status, 0, "{stderr}");
    let map = std::fs::read_to_string(folder.path().join("map.toml")).unwrap();
    for part in [
        "time = { column = \"stamp_ms\", unit = \"ms\" }",
        "q = { column = \"Joint2_Pos_deg\", unit = \"deg\" }",
        "tau = { column = \"Joint3_Cur_mA\", unit = \"mA\" }",
    ] {
        assert!(map.contains(part), "no `{part}` in {map}");
    }
    assert!(stdout.contains("its name says deg") && stderr.contains("fill them in"), "{stdout}{stderr}");
    // Filled in, it is a map.
    let mut filled = map.clone();
    for gear in GEARS {
        filled = filled.replacen("gear = 1.0 ", &format!("gear = {gear} "), 1);
    }
    filled = filled.replace("torque_constant_nm_per_a = 1.0 ", "torque_constant_nm_per_a = 0.07 ");
    filled = filled.replace("unit = \"mA\"", "unit = \"mA\", sign = -1");
    std::fs::write(folder.path().join("map.toml"), filled).unwrap();
    let declare = "identify --urdf robot.urdf --declare viscous_friction";
    let report = report(&format!("{declare} --train log.csv --map map.toml --out a"), folder.path());
    assert_eq!(report["verdict"], "sufficient");
}

/// `q[1]` was taken for `joint_1`, though the entries count from 0: the last joint had no column.
#[test]
fn entries_that_count_from_zero_were_taken_for_joints_that_count_from_one() {
    let folder = folder();
    let recording = synthetic::recording(1, 5.0);
    let mut columns: Vec<LogColumn<'_>> = vec![("time".into(), Box::new(|row| recording.t[row]))];
    for joint in 0..3 {
        let recording = &recording;
        columns.push((format!("pos[{joint}]"), Box::new(move |row| recording.q[3 * row + joint])));
        columns.push((format!("effort[{joint}]"), Box::new(move |row| recording.tau[3 * row + joint])));
    }
    write_log(&folder.path().join("log.csv"), recording.len(), &columns);
    let (status, map, stderr) = run("map --urdf robot.urdf log.csv", folder.path());
    assert!(status == 0 && !stderr.contains("no column"), "{stderr}");
    for joint in 0..3 {
        let table = format!("[joint.\"joint_{}\"]\nq = \"pos[{joint}]\"", joint + 1);
        assert!(map.contains(&table), "no `{table}` in {map}");
    }
}

/// What a log counts otherwise than the URDF was taken for effects: the torque's other sign for the
/// efficiency of a gear, an axis that points the other way for an encoder's offset and a force.
#[test]
fn a_joint_that_turns_the_other_way_in_the_log_is_said_with_the_map_that_mends_it() {
    let folder = folder();
    for (name, seed) in [("train.csv", 1), ("validate.csv", 2)] {
        let mut log = synthetic::recording(seed, 30.0);
        for signal in [&mut log.q, &mut log.tau] {
            signal.iter_mut().skip(1).step_by(3).for_each(|value| *value *= -1.0);
        }
        std::fs::write(folder.path().join(name), synthetic::csv(&log)).unwrap();
    }
    std::fs::write(
        folder.path().join("map.toml"),
        "[joint.joint_2]\nq = { column = \"q.joint_2\", sign = -1 }\ntau = { column = \"tau.joint_2\", sign = -1 }\n",
    )
    .unwrap();
    let line =
        "identify --urdf robot.urdf --train train.csv --validate validate.csv --declare viscous_friction";
    let said = |report: &Value| -> Vec<String> {
        let warnings = report["phiw"]["warnings"].as_array().unwrap().iter();
        warnings
            .map(|warning| warning.as_str().unwrap().to_owned())
            .filter(|text| text.contains("looks as if"))
            .collect()
    };
    let wrong = report(&format!("{line} --out wrong"), folder.path());
    let right = report(&format!("{line} --map map.toml --out right"), folder.path());
    let told = said(&wrong);
    assert_eq!(told.len(), 1, "{told:?}");
    assert!(told[0].contains("joint_2 turns the other way in the logs than in the URDF"), "{told:?}");
    assert!(told[0].contains("q, qd and tau of [joint.joint_2] `sign = -1`"), "{told:?}");
    assert_eq!(said(&right), Vec::<String>::new());
    let error = |report: &Value| report["before"]["validate"]["relative"].as_f64().unwrap();
    assert!(error(&right) < 0.2 * error(&wrong), "{} {}", error(&right), error(&wrong));
}
