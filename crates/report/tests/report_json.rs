//! `report.json` is the fixed form, to the letter.

use phiw_report::json::*;
use serde_json::Value;

/// The example of the formats' specification (its list of all verdicts replaced by one of them).
const EXAMPLE: &str = r#"{
  "schema": 1,
  "robot": "tx40",
  "joints": ["joint_1", "…"],
  "declared": ["rigid_body"],
  "verdict": "explained",
  "noise_floor": {"joint_1": 0.31},
  "before": {"train": {"rmse": {"joint_1": 9.1}, "relative": 0.76},
             "validate": {"rmse": {"joint_1": 9.3}, "relative": 0.77}},
  "effects": [
    {"kind": "coulomb_friction", "joints": ["joint_1"],
     "parameters": {"joint_1": {"fc": {"value": 4.1, "std": 0.05, "unit": "N·m"}}},
     "validate_relative": 0.21,
     "explains": 0.62,
     "confidence": 0.98,
     "rivals": [{"kind": "stribeck_friction", "joints": ["joint_1"], "confidence": 0.02}]}
  ],
  "refinements": [],
  "after": {"train": {}, "validate": {}},
  "remaining": {"structured": false, "joints": [], "depends_on": []},
  "warnings": []
}"#;

fn example() -> ReportJson {
    ReportJson::from_json(EXAMPLE).unwrap()
}

#[test]
fn the_example_survives_a_round_trip_unchanged() {
    let text = example().to_json().unwrap();
    let value = |text: &str| serde_json::from_str::<Value>(text).unwrap();
    assert_eq!(value(&text), value(EXAMPLE));
    assert_eq!(ReportJson::from_json(&text).unwrap(), example());
}

#[test]
fn verdicts_have_the_names_of_the_form() {
    for (verdict, name) in [
        (Verdict::Sufficient, "\"sufficient\""),
        (Verdict::Explained, "\"explained\""),
        (Verdict::PartlyExplained, "\"partly_explained\""),
        (Verdict::Unexplained, "\"unexplained\""),
    ] {
        assert_eq!(serde_json::to_string(&verdict).unwrap(), name);
    }
}

#[test]
fn joints_keep_their_order() {
    let mut report = example();
    let names = ["joint_10", "joint_2", "a", "joint_1"];
    report.noise_floor = names.iter().map(|&name| (name.to_string(), 1.0)).collect();
    let text = report.to_json().unwrap();
    let places: Vec<_> = names.iter().map(|name| text.find(&format!("\"{name}\": 1")).unwrap()).collect();
    assert!(places.is_sorted(), "{text}");
    let read = ReportJson::from_json(&text).unwrap();
    assert!(read.noise_floor.keys().eq(names));
}

#[test]
fn numbers_that_are_not_finite_are_null_and_come_back_as_nan() {
    let mut report = example();
    report.noise_floor["joint_1"] = f64::INFINITY;
    report.before.train.rmse["joint_1"] = f64::NAN;
    report.before.train.relative = Some(f64::NAN);
    report.effects[0].explains = f64::NEG_INFINITY;
    report.effects[0].parameters["joint_1"]["fc"].std = f64::NAN;
    let text = report.to_json().unwrap();
    let read = ReportJson::from_json(&text).unwrap();
    assert!(read.noise_floor["joint_1"].is_nan());
    assert!(read.before.train.rmse["joint_1"].is_nan());
    assert_eq!(read.before.train.relative, None);
    assert!(read.effects[0].explains.is_nan());
    assert!(read.effects[0].parameters["joint_1"]["fc"].std.is_nan());
}

#[test]
fn additions_of_the_program_come_last() {
    let mut report = example();
    report.phiw = Some(ProgramJson {
        version: "0.1.0".into(),
        warnings: vec!["train and validate are the same file".into()],
        conditioning: [("cut_off".to_string(), Value::from(5.2))].into_iter().collect(),
        bandwidth: Some(BandwidthJson {
            reference_hz: 10.0,
            better_hz: Some(5.0),
            curve: vec![CutoffJson {
                cutoff_hz: 5.0,
                left_out_relative: 0.04,
                saving: 0.1,
                saving_std: 0.02,
                chosen: false,
            }],
            moved: vec![MovedParameterJson {
                parameter: "joint_1.Izz".into(),
                cutoff_hz: 5.0,
                deviations: 7.5,
            }],
        }),
        relative_with_rests: Some(RelativeErrors { train: 0.2, validate: 0.25 }),
        evidence: vec![EvidenceJson {
            kind: "torque_offset".into(),
            joints: vec!["joint_1".into()],
            significance: 21.5,
            stability: 1.0,
        }],
        unidentifiable: vec![UnidentifiableJson {
            kind: "transmission_coupling".into(),
            joints: vec![vec!["joint_1".into(), "joint_2".into()]],
            telling_motion: "one joint alone".into(),
        }],
        reproduction: None,
        draws: Some(DrawsJson {
            count: 10,
            named: vec![NamedInDrawsJson {
                kind: "torque_offset".into(),
                joints: vec!["joint_1".into()],
                draws: 9,
            }],
        }),
        information: Some(InformationJson {
            narrower_by: 10.0,
            parameters: 20,
            directions: 6,
            told: vec![ToldJson { name: "mass of arm".into(), value: 2.3, std: 0.04, unit: "kg".into() }],
            sums: Vec::new(),
            not_told: vec!["Ixx of arm".into()],
            motions: vec![TellingMotionJson {
                file: "reach.csv".into(),
                nats: 3.2,
                directions: 1,
                tells: vec!["Izz of arm".into()],
            }],
        }),
        consistency: Some(ConsistencyJson {
            prior_weight: 10.0,
            gap: 1e-9,
            certified: true,
            is_model: true,
            impossible: vec!["joint_2".into()],
            validate: JointMap::from([(
                "joint_1".into(),
                OfBothFits { least_squares: 0.2, consistent: 0.21 },
            )]),
            validate_relative: OfBothFits { least_squares: 0.05, consistent: 0.051 },
        }),
    });
    let text = report.to_json().unwrap();
    assert!(text.find("\"phiw\"") > text.find("\"remaining\""));
    assert_eq!(ReportJson::from_json(&text).unwrap(), report);
}

#[test]
fn an_untraced_residual_has_no_verdict() {
    let report = ReportJson { verdict: None, ..example() };
    let text = report.to_json().unwrap();
    assert!(text.contains("\"verdict\": null"), "{text}");
    assert_eq!(ReportJson::from_json(&text).unwrap(), report);
}

#[test]
fn a_missing_field_is_named() {
    let error = ReportJson::from_json(&EXAMPLE.replace("\"robot\": \"tx40\",", "")).unwrap_err();
    assert!(error.to_string().contains("robot"), "{error}");
}
