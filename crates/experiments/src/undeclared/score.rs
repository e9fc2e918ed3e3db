//! Holds what the tracer said against what is true.

use super::kind::{Kind, Name};
use super::report_file::{Effect, Error, Report};
use super::suite::Suite;
use super::truth::{TrueSecret, Truth};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// A rival with at least this share of the named effect's confidence is of near-equal merit.
const NEAR_EQUAL: f64 = 0.5;
/// The error before must exceed the floor by this factor (of squares) for a share of the difference to mean
/// anything.
const LEAST_EXCESS: f64 = 1.05;
/// What is left is more than noise where its root mean square exceeds the noise's by this factor, which is
/// the tolerance of the errors of a fit.
const MORE_THAN_NOISE: f64 = 1.2;

/// What became of one secret.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Its kind was named with exactly its joints, and nothing else at near-equal merit.
    Right,
    /// It is among the rivals of what was named, or was named with a rival at near-equal merit.
    Rival,
    /// It was found, but only as a refinement of another effect.
    Refined,
    /// Its kind was named, on other joints.
    WrongJoints,
    /// Something else was named.
    WrongKind,
    /// Nothing was named for it.
    Missed,
}

/// The score of one case.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Score {
    /// What became of each secret, in the truth's order.
    pub outcomes: Vec<Outcome>,
    /// Names that are not true, nor a secret's near rival or wrong joints.
    pub false_names: Vec<String>,
    /// All that was named, with its joints.
    pub named: Vec<String>,
    /// The tracer's verdict.
    pub verdict: String,
    /// Share of the held-out squared error above the noise floor that was taken away; each joint's in units
    /// of its floor.
    pub closed: Option<f64>,
    /// The same with the joints' squared errors added as they are \[N·m, N\].
    pub closed_pooled: Option<f64>,
    /// Of each name as the report has it: its confidence, and whether it is true.
    #[serde(default)]
    pub judged: Vec<(f64, bool)>,
    /// What is left on held-out motion over what the noise leaves there, for the joint where that is most.
    #[serde(default)]
    pub left: Option<f64>,
    /// The report's noise floor over what the noise leaves on held-out motion: lowest and highest joint.
    #[serde(default)]
    pub floor: Option<[f64; 2]>,
}

/// An effect as named: kind and joints.
#[derive(Clone, Debug, PartialEq)]
struct Named {
    kind: String,
    joints: BTreeSet<String>,
    rivals: Vec<(String, BTreeSet<String>, bool)>,
}

impl Score {
    /// Whether the case's own demand is met: all named right and nothing else, or nothing named where there
    /// is nothing, or structure admitted where nothing of the catalogue explains it.
    pub fn is_good(&self, truth: &Truth) -> bool {
        match truth.suite {
            Suite::WideRight => {
                self.false_names.is_empty() && (!self.named.is_empty() || self.is_sufficient())
            }
            Suite::WideOutside | Suite::NewStrangers | Suite::LaterStrangers => !self.is_explained_away(),
            Suite::WideEffects => {
                let found = |(secret, outcome): (&TrueSecret, &Outcome)| {
                    *outcome == Outcome::Right || !secret.is_material()
                };
                truth.secrets.iter().zip(&self.outcomes).all(found) && self.false_names.is_empty()
            }
            Suite::Control => self.named.is_empty() && self.is_sufficient(),
            Suite::Outside => matches!(self.verdict.as_str(), "unexplained" | "partly_explained"),
            Suite::One
            | Suite::Two
            | Suite::Three
            | Suite::NewKinds
            | Suite::LargeGains
            | Suite::NewForms => {
                self.outcomes.iter().all(|outcome| *outcome == Outcome::Right) && self.false_names.is_empty()
            }
        }
    }

    /// Whether the declared model was found right.
    pub fn is_sufficient(&self) -> bool {
        self.verdict == "sufficient"
    }

    /// Whether all was said to be explained although more than noise is left.
    pub fn is_explained_away(&self) -> bool {
        matches!(self.verdict.as_str(), "explained" | "sufficient")
            && self.left.is_none_or(|left| left > MORE_THAN_NOISE)
    }
}

/// Scores a report. `floors`: RMS that the noise leaves on the validation log, joint by joint; the report's
/// own where `None`.
pub fn score(truth: &Truth, report: &Report, floors: Option<&BTreeMap<String, f64>>) -> Score {
    let named = merged(&report.effects);
    let mut used = vec![false; named.len()];
    let mut outcomes = vec![Outcome::Missed; truth.secrets.len()];
    // What may be named on any joint may be named on more joints than the secret's.
    let is_allowed = |kind: &str| truth.allowed.iter().any(|allowed| allowed.name() == kind);
    let among_allowed = |secret: &TrueSecret, named: &Named| {
        let is_part = secret.joints.iter().all(|joint| named.joints.contains(joint));
        (named.kind == secret.kind.name() && is_allowed(&named.kind) && is_part).then_some(Outcome::Right)
    };
    // Exact matches first, so that no secret takes a name that is exactly another's.
    type Test<'a> = &'a dyn Fn(&TrueSecret, &Named) -> Option<Outcome>;
    let tests: [Test<'_>; 4] = [&exact, &among_allowed, &among_rivals, &same_kind];
    for test in tests {
        for (outcome, secret) in outcomes.iter_mut().zip(&truth.secrets) {
            for (used, named) in used.iter_mut().zip(&named) {
                if *outcome == Outcome::Missed
                    && !*used
                    && let Some(found) = test(secret, named)
                {
                    (*outcome, *used) = (found, true);
                }
            }
        }
    }
    let false_names: Vec<String> = named
        .iter()
        .zip(&used)
        .filter(|(named, used)| !**used && !is_allowed(&named.kind))
        .map(|(named, _)| named.to_string())
        .collect();
    let refined = merged(&report.refinements);
    for (outcome, secret) in outcomes.iter_mut().zip(&truth.secrets) {
        let found = |named: &Named| same_kind(secret, named).is_some();
        if *outcome == Outcome::Missed && refined.iter().any(found) {
            *outcome = Outcome::Refined;
        }
    }
    let mut unclaimed = false_names.len();
    for outcome in &mut outcomes {
        if *outcome == Outcome::Missed && unclaimed > 0 {
            *outcome = Outcome::WrongKind;
            unclaimed -= 1;
        }
    }
    // Of a right model the noise leaves what its fit leaves.
    let known = floors.or((truth.suite == Suite::WideRight).then_some(&report.before.validate.rmse));
    let floors = floors.unwrap_or(&report.noise_floor);
    let closed = |weighted| closed(&report.before.validate, &report.after.validate, floors, weighted);
    Score {
        outcomes,
        false_names,
        named: named.iter().map(Named::to_string).collect(),
        verdict: report.verdict.clone(),
        closed: closed(true),
        closed_pooled: closed(false),
        judged: report.effects.iter().map(|effect| (effect.confidence, is_true(truth, effect))).collect(),
        left: largest_ratio(left_over(report), known),
        floor: known.and_then(|known| ratios(&report.noise_floor, known)),
    }
}

/// Errors of the end on held-out motion.
fn left_over(report: &Report) -> &BTreeMap<String, f64> {
    let after = &report.after.validate.rmse;
    if after.is_empty() { &report.before.validate.rmse } else { after }
}

/// Lowest and highest of the joints' ratios.
fn ratios(values: &BTreeMap<String, f64>, floors: &BTreeMap<String, f64>) -> Option<[f64; 2]> {
    let ratio = |(joint, floor): (&String, &f64)| values.get(joint).map(|value| value / floor);
    let all: Vec<f64> = floors.iter().filter_map(ratio).collect();
    (!all.is_empty())
        .then(|| [all.iter().copied().fold(f64::INFINITY, f64::min), all.iter().copied().fold(0.0, f64::max)])
}

fn largest_ratio(values: &BTreeMap<String, f64>, floors: Option<&BTreeMap<String, f64>>) -> Option<f64> {
    Some(ratios(values, floors?)?[1])
}

/// Whether one name of the report, as it stands there, is true: a part of a family is.
fn is_true(truth: &Truth, effect: &Effect) -> bool {
    let joints: BTreeSet<String> = effect.joints.iter().cloned().collect();
    let part = |secret: &TrueSecret| {
        secret.kind.name() == effect.kind
            && effect.kind != Kind::TransmissionCoupling.name()
            && joints.iter().all(|joint| secret.joints.contains(joint))
    };
    let secret = |secret: &TrueSecret| is_secret(secret, &effect.kind, &joints) || part(secret);
    truth.secrets.iter().any(secret) || truth.allowed.iter().any(|kind| kind.name() == effect.kind)
}

fn exact(secret: &TrueSecret, named: &Named) -> Option<Outcome> {
    if !is_secret(secret, &named.kind, &named.joints) {
        return None;
    }
    let contested = named.rivals.iter().any(|(kind, joints, near)| *near && !is_secret(secret, kind, joints));
    Some(if contested { Outcome::Rival } else { Outcome::Right })
}

fn among_rivals(secret: &TrueSecret, named: &Named) -> Option<Outcome> {
    named.rivals.iter().any(|(kind, joints, _)| is_secret(secret, kind, joints)).then_some(Outcome::Rival)
}

fn same_kind(secret: &TrueSecret, named: &Named) -> Option<Outcome> {
    (secret.kind.name() == named.kind).then_some(Outcome::WrongJoints)
}

/// Whether kind and joints are the secret's, or another name for literally the same torque.
fn is_secret(secret: &TrueSecret, kind: &str, joints: &BTreeSet<String>) -> bool {
    // Joints where it is immaterial may be named or not.
    let same = |names: &[String]| {
        names.iter().all(|name| joints.contains(name) || secret.optional.contains(name))
            && joints.iter().all(|joint| names.contains(joint))
            && (!joints.is_empty() || names.is_empty())
    };
    // A tilt acts on the base: whatever joints are listed are those that feel it.
    let tilt = secret.kind == Name::Catalogue(Kind::GravityTilt);
    (secret.kind.name() == kind && (tilt || same(&secret.joints)))
        || secret.equivalents.iter().any(|(other, names)| other.name() == kind && same(names))
}

/// The named effects; one kind named on several joints one after another is one effect, but for couplings,
/// whose joints are pairs.
fn merged(effects: &[Effect]) -> Vec<Named> {
    let mut all: Vec<Named> = Vec::new();
    for effect in effects {
        let joints: BTreeSet<String> = effect.joints.iter().cloned().collect();
        let rivals = effect.rivals.iter().map(|rival| {
            let near = rival.confidence >= NEAR_EQUAL * effect.confidence;
            (rival.kind.clone(), rival.joints.iter().cloned().collect(), near)
        });
        let pairs = effect.kind == Kind::TransmissionCoupling.name();
        match all.iter_mut().find(|named| named.kind == effect.kind && !pairs) {
            Some(named) => {
                named.joints.extend(joints);
                named.rivals.extend(rivals);
            }
            None => all.push(Named { kind: effect.kind.clone(), joints, rivals: rivals.collect() }),
        }
    }
    all
}

/// (before² − after²) / (before² − floor²), summed over joints. After cannot count as better than the floor.
fn closed(before: &Error, after: &Error, floors: &BTreeMap<String, f64>, weighted: bool) -> Option<f64> {
    // A report that named nothing may leave out what has not changed.
    let after = if after.rmse.is_empty() { before } else { after };
    let mut sums = [0.0; 3];
    for (joint, before) in &before.rmse {
        let floor = *floors.get(joint)?;
        let after = *after.rmse.get(joint)?;
        let weight = if weighted { 1.0 / floor } else { 1.0 };
        for (sum, value) in sums.iter_mut().zip([*before, after, floor]) {
            *sum += (weight * value).powi(2);
        }
    }
    let [before, after, floor] = sums;
    (before > LEAST_EXCESS * floor && floor > 0.0).then(|| (before - after.max(floor)) / (before - floor))
}

impl std::fmt::Display for Named {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let joints: Vec<&str> = self.joints.iter().map(String::as_str).collect();
        write!(formatter, "{}[{}]", self.kind, joints.join("+"))
    }
}

#[cfg(test)]
mod tests {
    use super::{Outcome, score};
    use crate::undeclared::kind::{Kind, Name};
    use crate::undeclared::report_file::Report;
    use crate::undeclared::sensors::{Clock, Sensors};
    use crate::undeclared::suite::Suite;
    use crate::undeclared::truth::{TrueSecret, Truth};

    fn truth(secrets: &[(Kind, &[&str])]) -> Truth {
        let secret = |(kind, joints): &(Kind, &[&str])| TrueSecret {
            kind: Name::Catalogue(*kind),
            joints: joints.iter().map(|joint| (*joint).to_owned()).collect(),
            optional: vec![],
            equivalents: vec![],
            form: String::new(),
            scale: 1.0,
            size: 0.1,
            visible: 1.0,
        };
        Truth {
            seed: 1,
            suite: Suite::One,
            robot: "planar2",
            held_model: false,
            declared: vec![],
            secrets: secrets.iter().map(secret).collect(),
            situation: None,
            allowed: vec![],
            sign_width: 0.01,
            sensors: Sensors {
                rate: 500.0,
                torque_noise: vec![],
                correlation_time: 0.0,
                quantum: vec![],
                angle_noise: 0.0,
                clock: Clock::Even,
                logging: None,
            },
            rejected: 0,
        }
    }

    /// `effects`: kind, joints, confidence, rivals (kind, joint, confidence).
    fn report(effects: &str) -> Report {
        let text = format!(
            r#"{{"schema": 1, "verdict": "explained", "noise_floor": {{"a": 1.0, "b": 0.1}},
                "before": {{"train": {{}}, "validate": {{"rmse": {{"a": 3.0, "b": 0.1}}, "relative": 0.3}}}},
                "after": {{"train": {{}}, "validate": {{"rmse": {{"a": 1.0, "b": 0.1}}, "relative": 0.1}}}},
                "effects": [{effects}]}}"#
        );
        serde_json::from_str(&text).expect("the test's own JSON")
    }

    fn check(secrets: &[(Kind, &[&str])], effects: &str, outcomes: &[Outcome], false_names: usize) {
        let score = score(&truth(secrets), &report(effects), None);
        assert_eq!(score.outcomes, outcomes, "{effects}");
        assert_eq!(score.false_names.len(), false_names, "{effects}: {:?}", score.false_names);
    }

    const VISCOUS: &str = r#"{"kind": "viscous_friction", "joints": ["a"], "confidence": 0.9}"#;

    #[test]
    fn names_are_held_against_the_truth() {
        use Kind::*;
        use Outcome::*;
        let viscous: &[(Kind, &[&str])] = &[(ViscousFriction, &["a"])];
        check(viscous, VISCOUS, &[Right], 0);
        check(viscous, "", &[Missed], 0);
        check(viscous, &VISCOUS.replace("\"a\"", "\"b\""), &[WrongJoints], 0);
        check(viscous, &VISCOUS.replace("\"a\"", "\"a\", \"b\""), &[WrongJoints], 0);
        check(viscous, &VISCOUS.replace("viscous", "quadratic"), &[WrongKind], 1);
        let two = format!("{VISCOUS}, {}", VISCOUS.replace("viscous", "coulomb"));
        check(viscous, &two, &[Right], 1);
        check(&[(ViscousFriction, &["a"]), (CoulombFriction, &["a"])], &two, &[Right, Right], 0);
        check(&[(ViscousFriction, &["a"]), (TorqueOffset, &["b"])], VISCOUS, &[Right, Missed], 0);
        check(&[], VISCOUS, &[], 1);
        let tilt = VISCOUS.replace("viscous_friction", "gravity_tilt");
        check(&[(GravityTilt, &[])], &tilt, &[Right], 0);
        let joint_by_joint = format!(
            "{}, {}",
            VISCOUS.replace("viscous_friction", "time_delay"),
            VISCOUS.replace("viscous_friction", "time_delay").replace("\"a\"", "\"b\"")
        );
        check(&[(TimeDelay, &["a", "b"])], &joint_by_joint, &[Right], 0);
    }

    #[test]
    fn rivals_count_apart() {
        use Outcome::*;
        let with_rival = |kind: &str, rival: &str, confidence: f64| {
            format!(
                r#"{{"kind": "{kind}", "joints": ["a"], "confidence": 0.6,
                    "rivals": [{{"kind": "{rival}", "joints": ["a"], "confidence": {confidence}}}]}}"#
            )
        };
        let viscous: &[(Kind, &[&str])] = &[(Kind::ViscousFriction, &["a"])];
        check(viscous, &with_rival("viscous_friction", "quadratic_friction", 0.02), &[Right], 0);
        check(viscous, &with_rival("viscous_friction", "quadratic_friction", 0.4), &[Rival], 0);
        check(viscous, &with_rival("quadratic_friction", "viscous_friction", 0.4), &[Rival], 0);
        check(viscous, &with_rival("quadratic_friction", "joint_spring", 0.4), &[WrongKind], 1);
    }

    /// A drive that filters all torques delays them all, beside one that is late by itself.
    #[test]
    fn a_name_that_the_situation_makes_true_may_stand_on_more_joints() {
        let mut truth = truth(&[(Kind::TimeDelay, &["b"])]);
        truth.allowed = vec![Kind::TimeDelay];
        let named = |joints: &str| {
            let effect = format!(r#"{{"kind": "time_delay", "joints": [{joints}], "confidence": 0.9}}"#);
            score(&truth, &report(&effect), None)
        };
        assert_eq!(named(r#""a", "b", "c""#).outcomes, [Outcome::Right]);
        assert_eq!(named(r#""a", "c""#).outcomes, [Outcome::WrongJoints]);
    }

    /// A family is right with and without the joints where it is immaterial; a secret that is only a
    /// refinement, and a name that the situation makes true, are neither right nor false.
    #[test]
    fn what_is_immaterial_may_be_named_or_not() {
        use Outcome::*;
        let mut truth = truth(&[(Kind::ViscousFriction, &["a", "b", "c"])]);
        truth.secrets[0].optional = vec!["c".to_owned()];
        truth.allowed = vec![Kind::TimeDelay];
        let family = |joints: &str| {
            format!(r#"{{"kind": "viscous_friction", "joints": [{joints}], "confidence": 0.9}}"#)
        };
        let check = |effects: &str, outcome: Outcome, false_names: usize, judged: &[bool]| {
            let score = score(&truth, &report(effects), None);
            assert_eq!(score.outcomes, [outcome], "{effects}");
            assert_eq!(score.false_names.len(), false_names, "{effects}");
            let found: Vec<bool> = score.judged.iter().map(|(_, is_true)| *is_true).collect();
            assert_eq!(found, judged, "{effects}");
        };
        check(&family(r#""a", "b""#), Right, 0, &[true]);
        check(&family(r#""a", "b", "c""#), Right, 0, &[true]);
        check(&format!("{}, {}", family(r#""a""#), family(r#""b", "c""#)), Right, 0, &[true, true]);
        check(&family(r#""a""#), WrongJoints, 0, &[true]);
        check(&family(r#""a", "b", "d""#), WrongJoints, 0, &[false]);
        let delay = family(r#""b""#).replace("viscous_friction", "time_delay");
        check(&delay, Missed, 0, &[true]);
        check(&delay.replace("time_delay", "joint_spring"), WrongKind, 1, &[false]);
        let mut refined = report("");
        refined.refinements = report(&family(r#""a", "b""#)).effects;
        assert_eq!(score(&truth, &refined, None).outcomes, [Refined]);
    }

    /// `identify` gives no verdict on a model that leaves more than noise: the floor of such a case was lost
    /// without a word.
    #[test]
    fn a_report_without_a_verdict_is_read() {
        let text = r#"{"verdict": null, "noise_floor": {}, "before": {}, "effects": [], "after": {}}"#;
        let report: Report = serde_json::from_str(text).expect("the test's own JSON");
        assert_eq!(report.verdict, "");
    }

    #[test]
    fn error_closed_is_the_share_above_the_floor() {
        let score = score(&truth(&[]), &report(VISCOUS), None);
        assert_eq!((score.closed, score.closed_pooled), (Some(1.0), Some(1.0)));
        let floors = [("a".to_owned(), 0.5), ("b".to_owned(), 0.1)].into();
        let partly = super::score(&truth(&[]), &report(VISCOUS), Some(&floors));
        // Joint a: from 36 to 4 times the floor's square; joint b: at the floor throughout.
        assert!((partly.closed.expect("there is excess") - 32.0 / 35.0).abs() < 1e-12);
        let quiet = [("a".to_owned(), 3.0), ("b".to_owned(), 0.1)].into();
        assert_eq!(super::score(&truth(&[]), &report(VISCOUS), Some(&quiet)).closed, None);
    }
}
