//! Holds what the tracer said against the truth.

use super::case::Case;
use super::engine::Engine;
use super::secret::SecretKind;
use crate::undeclared::report_file::Report;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// What became of a secret.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Kind and joints are named, and nothing else.
    Right,
    /// Kind and joints are named, and something else as well.
    RightAndMore,
    /// Kind and joints are among the rivals of what is named.
    Rival,
    /// The kind is named on other joints.
    WrongJoints,
    /// Something else is named.
    WrongKind,
    /// Nothing is named.
    Missed,
    /// The tracer failed.
    Failed,
}

/// The score of one case.
#[derive(Clone, Debug, Serialize)]
pub struct Scored {
    /// The engine.
    pub engine: Engine,
    /// The secret.
    pub kind: SecretKind,
    /// Its joints.
    pub joints: Vec<String>,
    /// The case's seed.
    pub seed: u64,
    /// What became of it.
    pub outcome: Outcome,
    /// What was named, with its joints.
    pub named: Vec<String>,
    /// The verdict, or why the tracer failed.
    pub verdict: String,
    /// Held-out RMSE over the noise floor before and after, of the secret's joint that was farthest over its
    /// floor before.
    pub over_floor: Option<[f64; 2]>,
    /// That joint.
    pub worst_joint: Option<String>,
    /// Largest RMS tracking error of a joint \[rad\].
    pub tracking_error: f64,
    /// Time of simulation and of tracing \[s\].
    pub seconds: [f64; 2],
}

/// Scores a report.
pub fn score(
    case: &Case,
    joints: &[String],
    report: anyhow::Result<Report>,
    tracking_error: f64,
    seconds: [f64; 2],
) -> Scored {
    let mut scored = Scored {
        engine: case.engine,
        kind: case.kind,
        joints: joints.to_vec(),
        seed: case.seed,
        outcome: Outcome::Failed,
        named: Vec::new(),
        verdict: String::new(),
        over_floor: None,
        worst_joint: None,
        tracking_error,
        seconds,
    };
    match report {
        Ok(report) => {
            scored.outcome = outcome(&case.kind.name(), joints, &report);
            scored.named = merged(&report)
                .into_iter()
                .map(|(kind, joints)| format!("{kind}[{}]", joints.into_iter().collect::<Vec<_>>().join("+")))
                .collect();
            scored.verdict = report.verdict.clone();
            if let Some((joint, over_floor)) = worst(&report, joints) {
                (scored.worst_joint, scored.over_floor) = (Some(joint), Some(over_floor));
            }
        }
        Err(error) => scored.verdict = format!("{error:#}"),
    }
    scored
}

/// The named effects; a kind named on several joints one after another is one effect, but for those of pairs
/// of joints.
fn merged(report: &Report) -> Vec<(String, BTreeSet<String>)> {
    let mut all: Vec<(String, BTreeSet<String>)> = Vec::new();
    for effect in &report.effects {
        let (joints, is_of_pair) = (effect.joints.iter().cloned(), effect.joints.len() == 2);
        match all.iter_mut().find(|(kind, _)| *kind == effect.kind && !is_of_pair) {
            Some((_, all)) => all.extend(joints),
            None => all.push((effect.kind.clone(), joints.collect())),
        }
    }
    all
}

fn outcome(kind: &str, joints: &[String], report: &Report) -> Outcome {
    let wanted: BTreeSet<&String> = joints.iter().collect();
    // A tilt acts on the base: whatever joints are listed are those that feel it.
    let is_it = |named: &str, on: &mut dyn Iterator<Item = &String>| {
        named == kind && (joints.is_empty() || on.collect::<BTreeSet<_>>() == wanted)
    };
    let named = merged(report);
    if named.iter().any(|(kind, on)| is_it(kind, &mut on.iter())) {
        return if named.len() == 1 { Outcome::Right } else { Outcome::RightAndMore };
    }
    let mut rivals = report.effects.iter().flat_map(|effect| &effect.rivals);
    if rivals.any(|rival| is_it(&rival.kind, &mut rival.joints.iter())) {
        return Outcome::Rival;
    }
    match named.iter().any(|(named, _)| named == kind) {
        true => Outcome::WrongJoints,
        false if named.is_empty() => Outcome::Missed,
        false => Outcome::WrongKind,
    }
}

/// The joint, of these or of all if there are none, whose held-out error was the most times its floor, and
/// that error over the floor before and after.
fn worst(report: &Report, joints: &[String]) -> Option<(String, [f64; 2])> {
    let over = |errors: &BTreeMap<String, f64>, joint: &str| -> Option<f64> {
        Some(errors.get(joint)? / report.noise_floor.get(joint)?)
    };
    let before = &report.before.validate.rmse;
    let after = if report.after.validate.rmse.is_empty() { before } else { &report.after.validate.rmse };
    before
        .keys()
        .filter(|joint| joints.is_empty() || joints.contains(joint))
        .filter_map(|joint| Some((joint.clone(), [over(before, joint)?, over(after, joint)?])))
        .max_by(|(_, one), (_, other)| one[0].total_cmp(&other[0]))
}

#[cfg(test)]
mod tests {
    use super::{Outcome, outcome, worst};
    use crate::undeclared::report_file::Report;

    fn report(effects: &str) -> Report {
        let text = format!(
            r#"{{"schema": 1, "verdict": "explained", "noise_floor": {{"a": 1.0, "b": 0.1}},
                "before": {{"validate": {{"rmse": {{"a": 3.0, "b": 0.4}}}}}},
                "after": {{"validate": {{"rmse": {{"a": 1.0, "b": 0.1}}}}}}, "effects": [{effects}]}}"#
        );
        serde_json::from_str(&text).expect("the test's own JSON")
    }

    fn check(joints: &[&str], effects: &str, expected: Outcome) {
        let joints: Vec<String> = joints.iter().map(|&joint| joint.to_owned()).collect();
        assert_eq!(outcome("joint_spring", &joints, &report(effects)), expected, "{effects}");
    }

    #[test]
    fn names_are_held_against_the_truth() {
        const SPRING: &str = r#"{"kind": "joint_spring", "joints": ["a"], "confidence": 0.9}"#;
        const OFFSET: &str = r#"{"kind": "torque_offset", "joints": ["a"],
            "rivals": [{"kind": "joint_spring", "joints": ["b"]}]}"#;
        check(&["a"], SPRING, Outcome::Right);
        check(&["a"], &format!("{SPRING}, {OFFSET}"), Outcome::RightAndMore);
        check(&["b"], OFFSET, Outcome::Rival);
        check(&["b"], SPRING, Outcome::WrongJoints);
        check(&["a"], OFFSET, Outcome::WrongKind);
        check(&["a"], "", Outcome::Missed);
        check(&["a", "b"], &format!("{SPRING}, {}", SPRING.replace("\"a\"", "\"b\"")), Outcome::Right);
    }

    #[test]
    fn the_worst_joint_is_the_one_farthest_over_its_floor() {
        let (joint, [before, after]) = worst(&report(""), &[]).expect("there are errors");
        assert_eq!(joint, "b");
        assert_eq!(worst(&report(""), &["a".to_owned()]), Some(("a".to_owned(), [3.0, 1.0])));
        assert!((before - 4.0).abs() < 1e-12 && (after - 1.0).abs() < 1e-12);
    }
}
