//! Maps say what the columns of a log mean.

use phiw_telemetry::segments::GapReason;
use phiw_telemetry::{LogMap, LogPart, LogSource, Recording, TorqueColumns, survey};
use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

/// A log of joints `a` and `b` with one row of these columns (and more rows like it), read with a map: q, tau
/// and qd of that row.
fn read(header: &str, row: &str, map: &str) -> Result<[Vec<f64>; 3], String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let rows: String = (0..4).map(|k| format!("{k},{row}\n")).collect();
    std::fs::write(&path, format!("t,{header}\n{rows}")).unwrap();
    let map = LogMap::parse(Path::new("map.toml"), map).map_err(|error| error.to_string())?;
    let joints = ["a".to_owned(), "b".to_owned()];
    map.check_joints(&joints).map_err(|error| error.to_string())?;
    let source = LogSource::mapped(&path, Some(Arc::new(map)));
    let log = Recording::read(source, &joints, TorqueColumns::Optional).map_err(|error| error.to_string())?;
    let first = |values: &[f64]| values.iter().take(2).copied().collect();
    Ok([first(&log.q), first(&log.tau), log.qd.map_or(Vec::new(), |qd| first(&qd))])
}

#[track_caller]
fn check(header: &str, row: &str, map: &str, expected: [&[f64]; 3]) {
    let found = read(header, row, map).unwrap();
    for (found, expected) in found.iter().zip(expected) {
        let near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-12 * (1.0 + b.abs());
        assert!(
            found.len() == expected.len() && found.iter().zip(expected).all(near),
            "{found:?}, not {expected:?}"
        );
    }
}

#[test]
fn columns_are_named_for_all_joints_at_once() {
    let map = "joints = [\"a\", \"b\"]\n[every_joint]\nq = \"pos_{index}\"\ntau = { column = \"{joint}.load\", unit = \"N.cm\" }";
    check("pos_0,pos_1,a.load,b.load", "1,2,300,400", map, [&[1.0, 2.0], &[3.0, 4.0], &[]]);
}

#[test]
fn what_the_map_does_not_name_has_its_own_name() {
    let map = "[joint.b]\nq = { unit = \"deg\" }";
    check("q.a,q.b,qd.a,qd.b", "1,180,5,6", map, [&[1.0, PI], &[], &[5.0, 6.0]]);
}

#[test]
fn units_become_si() {
    let q = |unit: &str, value: f64| {
        let map = format!("[every_joint]\nticks_per_rev = 4096\ngear = 50\nq = {{ unit = \"{unit}\" }}");
        check("q.a,q.b", "2,4", &map, [&[2.0 * value, 4.0 * value], &[], &[]]);
    };
    for (unit, value) in [("deg", PI / 180.0), ("rev", 2.0 * PI), ("ticks", 2.0 * PI / 4096.0), ("mm", 1e-3)]
    {
        q(unit, value);
    }
    let tau = |keys: &str, value: f64| {
        let map = format!("[every_joint]\ntau = {{ {keys} }}");
        check("q.a,q.b,tau.a,tau.b", "0,0,2,4", &map, [&[0.0, 0.0], &[2.0 * value, 4.0 * value], &[]]);
    };
    tau("unit = \"mN.m\"", 1e-3);
    tau("unit = \"A\", torque_constant_nm_per_a = 0.5, gear = 100", 50.0);
    tau("unit = \"mA\", torque_constant_nm_per_a = 0.5, gear = 100, efficiency = 0.8, sign = -1", -0.04);
    tau("unit = \"A\", torque_constant_nm_per_a = 7, side = \"joint\"", 7.0);
    tau("unit = \"%\", rated_torque_nm = 20, side = \"joint\"", 0.2);
    tau("unit = \"permille\", rated_current_a = 10, torque_constant_nm_per_a = 0.1, gear = 50", 0.05);
}

#[test]
fn what_is_measured_at_the_motor_goes_through_the_gear() {
    let map = "[every_joint]\ngear = 10\nq = { unit = \"rev\", side = \"motor\", offset = 0.5 }\nqd = { unit = \"rpm\", side = \"motor\" }";
    check("q.a,q.b,qd.a,qd.b", "5,-5,60,120", map, [&[0.5 + PI, 0.5 - PI], &[], &[0.2 * PI, 0.4 * PI]]);
}

#[test]
fn coupled_motors_turn_joints_together() {
    // a = (m1 + m2)/2, b = (m1 − m2)/2: torques are m1 + m2 and m1 − m2.
    let map = "[[coupling]]\nmotors = [\"m1\", \"m2\"]\njoints = [\"a\", \"b\"]\nmatrix = [[0.5, 0.5], [0.5, -0.5]]\n\
               [motor.m1]\nq = \"e1\"\ntau = \"i1\"\n[motor.m2]\nq = { column = \"e2\", sign = -1 }\ntau = \"i2\"";
    check("e1,e2,i1,i2", "3,-1,5,2", map, [&[2.0, 1.0], &[7.0, 3.0], &[]]);
}

#[test]
fn a_controller_s_law_gives_the_torque() {
    let map = "[every_joint]\nqref = \"cmd.{joint}\"\ntau = { pd = { kp = 100, kd = 2 } }";
    check(
        "q.a,q.b,qd.a,qd.b,cmd.a,cmd.b",
        "1,2,0.5,-0.5,1.1,1.9",
        map,
        [&[1.0, 2.0], &[100.0 * (1.1 - 1.0) - 1.0, 100.0 * (1.9 - 2.0) + 1.0], &[0.5, -0.5]],
    );
    let error = read("q.a,q.b,cmd.a,cmd.b", "1,2,3,4", map).unwrap_err();
    assert!(error.contains("map.toml, line 3, key `joint.a.tau.pd`: it needs the velocity (qd)"), "{error}");
}

#[test]
fn a_load_without_direction_takes_the_sign_of_another_column() {
    let map = "[every_joint]\ntau = { load = \"load.{joint}\", sign_of = \"dir.{joint}\", unit = \"%\", rated_torque_nm = 10, side = \"joint\" }";
    check("q.a,q.b,load.a,load.b,dir.a,dir.b", "0,0,50,-20,-3,1", map, [&[0.0, 0.0], &[-5.0, 2.0], &[]]);
}

#[test]
fn the_time_has_a_unit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let rows: String = (0..200).map(|k| format!("{},{},0\n", 10 * k, f64::from(k).sin())).collect();
    std::fs::write(&path, format!("ms,q.a,q.b\n{rows}")).unwrap();
    let map = LogMap::parse(Path::new("map.toml"), "time = { column = \"ms\", unit = \"ms\" }").unwrap();
    let source = LogSource::mapped(&path, Some(Arc::new(map)));
    let joints = ["a".to_owned(), "b".to_owned()];
    let survey = survey(source, &joints, TorqueColumns::Optional, &mut |_, _| {}).unwrap();
    assert!((survey.period - 0.01).abs() < 1e-12, "{}", survey.period);
}

#[test]
fn stretches_train_validate_or_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run_7.csv");
    let rows: String =
        (0..1000).map(|k| format!("{},{}\n", 100.0 + 0.01 * f64::from(k), f64::from(k).sin())).collect();
    std::fs::write(&path, format!("t,q.a\n{rows}")).unwrap();
    let map = "[[log]]\nfile = \"run_?.csv\"\nvalidate = [[8.0, 9.0]]\nleave_out = [[2.0, 2.495]]\n[[log]]\nfile = \"other*\"\nleave_out = [[0, 9]]";
    let map = Arc::new(LogMap::parse(Path::new("map.toml"), map).unwrap());
    let used = |part| {
        let source = LogSource { part, ..LogSource::mapped(&path, Some(map.clone())) };
        survey(source, &["a".to_owned()], TorqueColumns::Absent, &mut |_, _| {}).unwrap()
    };
    let [all, train, validate] = [LogPart::All, LogPart::Train, LogPart::Validate].map(used);
    assert_eq!([all.used_rows, train.used_rows, validate.used_rows], [950, 849, 101]);
    assert_eq!(all.gaps[0].reason, GapReason::LeftOut);
    assert!(validate.time_range().0 >= 108.0 && train.content_hash != validate.content_hash);
}

/// What is wrong is named with its line, key and mend.
#[track_caller]
fn refused(map: &str, parts: &[&str]) {
    let error = read("q.a,q.b,tau.a,tau.b", "0,0,1,1", map).unwrap_err();
    for part in parts {
        assert!(error.contains(part), "`{part}` is not in `{error}`");
    }
    assert!(error.starts_with("map.toml, line ") && !error.contains('\n'), "{error}");
}

#[test]
fn wrong_maps_are_refused_with_line_key_and_mend() {
    refused("topic = 1", &["line 1", "`topic`", "expected a string"]);
    refused("\n[every_joint]\nqq = \"x\"", &["line 3", "`qq`", "unknown field"]);
    refused("[joint.c]\nq = \"x\"", &["line 1", "`joint.c`", "no joint `c`"]);
    refused("[joint.a]\n\nq = \"x\"", &["line 3", "`joint.a.q.column`", "no column `x`", "q.a"]);
    refused("[joint.a]\nq = { unit = \"furlong\" }", &["line 2", "`joint.a.q.unit`", "rad, deg"]);
    refused("[joint.a]\nq = { unit = \"ticks\" }", &["`ticks_per_rev` is missing"]);
    refused("[joint.a]\ntau = { unit = \"A\" }", &["`torque_constant_nm_per_a` is missing"]);
    refused(
        "[joint.a]\ntau = { unit = \"A\", torque_constant_nm_per_a = 1 }",
        &["`gear` is missing", "direct drive"],
    );
    refused("[joint.a]\ntau = { sign = 2 }", &["`joint.a.tau.sign`", "write 1 or -1"]);
    refused("[joint.a]\ngear = -3\nq = { side = \"motor\" }", &["line 3", "-3 is not above zero"]);
    refused("[every_joint]\nq = \"p{index}\"", &["line 2", "`joints`"]);
    refused("[joint.a]\ntau = { load = \"tau.a\" }", &["sign_of", "is missing"]);
    refused("[joint.a]\nq = { pd = { kp = 1 } }", &["of torques (tau) only"]);
    refused("time = { unit = \"weeks\" }", &["line 1", "`time.unit`", "write s, ms"]);
    refused("[[log]]\ntrain = [[3, 1]]", &["line 2", "`log.train`", "no stretch"]);
    refused("[[log]]\npayload = \"heavy\"", &["line 2", "`log.payload`", "unknown but the same"]);
    refused("[[log]]\npayload = { link = \"l\", mass_kg = -1 }", &["`log.payload`", "a mass of -1 kg"]);
    let coupling = "[[coupling]]\nmotors = [\"m\", \"n\"]\njoints = [\"a\", \"b\"]\n";
    refused(&format!("{coupling}matrix = [[1, 1], [2, 2]]\n[motor.m]\n[motor.n]"), &["cannot be inverted"]);
    refused(&format!("{coupling}matrix = [[1, 1]]"), &["must be square"]);
    refused(&format!("{coupling}matrix = [[1, 0], [0, 1]]\n[motor.m]\nq = \"q.a\""), &["no table [motor.n]"]);
    refused(
        &format!("{coupling}matrix = [[1, 0], [0, 1]]\n[motor.m]\nq = \"q.a\"\n[motor.n]"),
        &["`motor.n.q`", "is missing"],
    );
}
