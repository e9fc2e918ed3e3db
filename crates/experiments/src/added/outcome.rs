//! What became of an effect that was added.

use super::forms::{Form, Scale};
use crate::undeclared::report_file::{Effect, Report};
use std::collections::BTreeSet;
use std::fmt::Write;

/// What became of an effect.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It is named, or another name for the same torque is.
    Named,
    /// It is a rival of a name on its joint.
    Rival,
    /// It is a refinement.
    Refined,
    /// The declared model took it up.
    Absorbed,
    /// The robot has it as it is.
    There,
    /// None of these.
    Missed,
}

impl Outcome {
    fn text(&self) -> &'static str {
        match self {
            Outcome::Named => "named",
            Outcome::Rival => "rival",
            Outcome::Refined => "refined",
            Outcome::Absorbed => "absorbed",
            Outcome::There => "there",
            Outcome::Missed => "**missed**",
        }
    }
}

/// An effect on a joint, and what was said.
pub struct Traced {
    /// The effect.
    pub form: Form,
    /// The joint.
    pub joint: String,
    /// What became of it.
    pub outcome: Outcome,
    /// What `phiw explain` reports; nothing where it was not asked.
    pub report: Option<Report>,
}

/// Whether an effect has a name or is a refinement on a joint.
pub fn has(report: &Report, kind: &str, joint: &str) -> bool {
    let is_it = |effect: &Effect| effect.kind == kind && effect.joints.iter().any(|other| other == joint);
    report.effects.iter().chain(&report.refinements).any(is_it)
}

/// What became of an effect, from the reports without and with it.
pub fn of(as_it_is: &Report, report: &Report, scale: &Scale, joints: &[String]) -> Outcome {
    let on = |effect: &Effect| {
        let acts_on = |joint: usize| effect.joints.contains(&joints[joint]);
        acts_on(scale.joint) && (scale.form != Form::TransmissionCoupling || acts_on(scale.other))
    };
    let is_it = |kind: &str| kind == scale.form.kind() || scale.form.equals().contains(&kind);
    let rival = |effect: &Effect| effect.rivals.iter().any(|rival| is_it(&rival.kind));
    if report.effects.iter().any(|effect| on(effect) && is_it(&effect.kind)) {
        Outcome::Named
    } else if report.effects.iter().any(|effect| on(effect) && rival(effect)) {
        Outcome::Rival
    } else if report.refinements.iter().any(|effect| on(effect) && is_it(&effect.kind)) {
        Outcome::Refined
    } else if !is_visible(as_it_is, report, scale, joints) {
        Outcome::Absorbed
    } else {
        Outcome::Missed
    }
}

/// Whether the declared model leaves more of a joint's torque with the effect than without it, by more than
/// the robot leaves as it is once it is explained. What is left grows with the torque that it is left of: a
/// gain makes it larger, and is not seen.
fn is_visible(as_it_is: &Report, report: &Report, scale: &Scale, joints: &[String]) -> bool {
    let explained = match as_it_is.after.validate.rmse.is_empty() {
        true => &as_it_is.before.validate.rmse,
        false => &as_it_is.after.validate.rmse,
    };
    report.before.validate.rmse.iter().any(|(joint, with)| {
        let growth = if *joint == joints[scale.joint] { scale.growth } else { 1.0 };
        let without = growth * as_it_is.before.validate.rmse.get(joint).copied().unwrap_or_default();
        let left = growth * explained.get(joint).copied().unwrap_or_default();
        with * with - without * without > left * left
    })
}

/// The names of a report, joint by joint.
fn names(report: &Report) -> BTreeSet<(String, String)> {
    let of_effect = |effect: &Effect| {
        let kind = effect.kind.clone();
        effect.joints.clone().into_iter().map(move |joint| (kind.clone(), joint))
    };
    report.effects.iter().flat_map(of_effect).collect()
}

fn listed<'a>(names: impl Iterator<Item = &'a (String, String)>) -> String {
    names.map(|(kind, joint)| format!("{kind} {joint}")).collect::<Vec<_>>().join(", ")
}

/// A page in Markdown.
pub fn table(robot: &str, as_it_is: &Report, traced: &[Traced]) -> String {
    let own = names(as_it_is);
    let mut page = format!("## {robot}\n\nAs it is: {}.\n\n", listed(own.iter()));
    page += "| effect | joint | | names beside |\n|---|---|---|---|\n";
    for Traced { form, joint, outcome, report } in traced {
        let with = report.as_ref().map(names).unwrap_or_default();
        let is_it = |kind: &str| kind == form.kind() || form.equals().contains(&kind);
        let beside = with.difference(&own).filter(|(kind, _)| !is_it(kind));
        let _ = writeln!(page, "| {} | {joint} | {} | {} |", form.kind(), outcome.text(), listed(beside));
    }
    let of = |outcome: &Outcome| traced.iter().filter(|traced| traced.outcome == *outcome).count();
    let counted = traced.len() - of(&Outcome::Absorbed) - of(&Outcome::There);
    let _ = writeln!(
        page,
        "\n{} of {counted} named, {} rivals, {} refined, {} missed; {} absorbed, {} there as it is.",
        of(&Outcome::Named),
        of(&Outcome::Rival),
        of(&Outcome::Refined),
        of(&Outcome::Missed),
        of(&Outcome::Absorbed),
        of(&Outcome::There),
    );
    page
}

#[cfg(test)]
mod tests {
    use super::{Form, Outcome, Scale, of};
    use crate::added::log::MeasuredLog;
    use crate::undeclared::report_file::Report;
    use serde_json::json;

    /// A report with one effect, one refinement and what is left of joint a before and after.
    fn report(effect: (&str, &str), rival: &str, refinement: &str, before: f64, after: f64) -> Report {
        let effect =
            json!({"kind": effect.0, "joints": [effect.1], "rivals": [{"kind": rival, "joints": ["a"]}]});
        let refinement = json!({"kind": refinement, "joints": ["a"]});
        serde_json::from_value(json!({
            "verdict": "explained", "noise_floor": {}, "effects": [effect], "refinements": [refinement],
            "before": {"validate": {"rmse": {"a": before}}}, "after": {"validate": {"rmse": {"a": after}}},
        }))
        .unwrap()
    }

    #[test]
    fn what_became_of_a_spring() -> anyhow::Result<()> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("log.csv");
        std::fs::write(&path, "t,q.a,q.b,tau.a,tau.b\n0,0,0,1,1\n0.01,1,1,2,2\n0.02,0,1,1,2\n")?;
        let scale = Scale::of(Form::JointSpring, 0, &[MeasuredLog::read(&path)?], 0.2);
        let joints = ["a".to_owned(), "b".to_owned()];
        let as_it_is = report(("hysteresis", "b"), "", "", 1.0, 0.5);
        let table = [
            (("joint_spring", "a"), "", "", 2.0, Outcome::Named),
            (("gravity_balancer", "a"), "joint_spring", "", 2.0, Outcome::Rival),
            (("joint_spring", "b"), "", "joint_spring", 2.0, Outcome::Refined),
            (("joint_spring", "b"), "", "", 1.1, Outcome::Absorbed),
            (("joint_spring", "b"), "joint_spring", "", 2.0, Outcome::Missed),
        ];
        for (effect, rival, refinement, before, expected) in table {
            let with = report(effect, rival, refinement, before, 0.5);
            assert_eq!(of(&as_it_is, &with, &scale, &joints), expected, "{effect:?}, {before}");
        }
        Ok(())
    }
}
