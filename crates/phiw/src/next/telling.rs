//! The choice in words and in numbers.

use super::balance::Balance;
use super::estimate::{Estimate, Source};
use super::motions::Motions;
use super::plan::{Excess, Plan};
use super::selection::Choice;
use crate::arguments::NextArguments;
use crate::warnings::file_name;
use phiw_curriculum::{Motion, Robot};
use phiw_dynamics::urdf::Finding;
use phiw_report::number::{percent, significant};
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;

/// A speed at the motion's ends from which a robot at rest must be eased into it \[rad/s, m/s\].
const AT_REST: f64 = 0.05;

/// All that there is to tell.
pub struct Telling<'a> {
    pub arguments: &'a NextArguments,
    pub robot: &'a Robot,
    pub motions: &'a Motions,
    pub estimate: &'a Estimate,
    pub choice: &'a Choice,
    pub balance: Option<&'a Balance>,
    pub plan: &'a Plan,
    pub base_mass: f64,
    pub findings: &'a [Finding],
}

impl Telling<'_> {
    fn motion(&self) -> &Motion {
        &self.motions.dataset.motions()[self.choice.motion]
    }

    fn name(&self, motion: usize) -> &str {
        &self.motions.dataset.motions()[motion].name
    }

    /// Why this motion, in one sentence.
    fn reason(&self) -> String {
        let (choice, count) = (self.choice, self.motions.dataset.len());
        let among = match (choice.alpha, choice.forced) {
            (None, _) => format!("of all {count} motions (no balance is asked for)"),
            (Some(_), true) => format!("of none: no motion of {count} is allowed, and it is the safest"),
            (Some(_), false) => format!("of the {} of {count} motions that keep the balance", choice.allowed),
        };
        let before = match choice.before {
            Some(before) => format!("{} → {}", condition(before), condition(choice.after)),
            None => format!("{}, nothing has been measured yet", condition(choice.after)),
        };
        let next = match choice.runner_up {
            Some((motion, cond)) => format!("; {} would give {}", self.name(motion), condition(cond)),
            None => String::new(),
        };
        format!("it makes cond(Φ) smallest {among}: {before}{next}")
    }

    /// For a terminal.
    pub fn text(&self, report: &Path) -> String {
        let motion = self.motion();
        let mut text = String::new();
        // Writing to a string does not fail.
        let file = self.motions.files[self.choice.motion].display();
        let _ = writeln!(text, "next: {} ({} s, {file})", motion.name, significant(motion.duration_s(), 3));
        let _ = writeln!(text, "because {}", self.reason());
        if let Some(balance) = self.balance {
            let _ = writeln!(text, "{}", self.balance_text(balance));
        }
        let _ = writeln!(text, "{}", self.estimate_text());
        let _ = writeln!(
            text,
            "written: {} (t, q, qd, qdd and the feed-forward torque tau), {}",
            self.arguments.out.display(),
            file_name(report)
        );
        text
    }

    fn balance_text(&self, balance: &Balance) -> String {
        let mm = |value: f64| significant(1e3 * value, 3);
        format!(
            "balance: α {}; the ZMP stays {} ± {} mm inside the support (nearest at {} s), of which ± {} mm no torque can tell; {} mm by equation (8)",
            significant(self.choice.alpha.unwrap_or(0.0), 3),
            mm(balance.motion.multi_body.margin),
            mm(balance.margin_std),
            significant(balance.worst_s, 3),
            mm(balance.untold_std),
            mm(balance.motion.point_mass.margin),
        )
    }

    fn estimate_text(&self) -> String {
        let estimate = self.estimate;
        let count = estimate.parameters.len();
        let from = match &estimate.measured {
            Some(measured) => format!(
                "{} ({} s)",
                if measured.logs == 1 { "1 log".to_owned() } else { format!("{} logs", measured.logs) },
                significant(measured.seconds, 3)
            ),
            None => "no log".to_owned(),
        };
        let urdf = format!("the URDF (± {} %)", percent(self.arguments.urdf_error));
        match estimate.source {
            Source::Urdf => {
                format!("estimate: {count} parameters as {urdf} has them; nothing has been measured")
            }
            Source::Logs => format!("estimate: {count} parameters from {from} and {urdf}"),
            Source::Model => {
                format!("estimate: {count} parameters from the model and {urdf}; cond(Φ) of {from}")
            }
        }
    }

    /// What to look at before the robot moves.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.choice.forced {
            warnings.push(format!(
                "no motion is allowed at α = {}: this is the safest of all; add calmer motions",
                significant(self.choice.alpha.unwrap_or(0.0), 3)
            ));
        }
        if let Some(balance) = self.balance {
            let margin = balance.motion.multi_body.margin;
            let std = balance.margin_std;
            if margin < 2.0 * std {
                warnings.push(format!(
                    "the ZMP's margin of {} mm is less than twice its uncertainty of {} mm: secure the robot",
                    significant(1e3 * margin, 3),
                    significant(1e3 * std, 3)
                ));
            }
            if self.base_mass <= 0.0 {
                warnings.push(
                    "the URDF gives the base link no mass, so the ZMP counts the moving links alone: put the base's <inertial> into the URDF"
                        .to_owned(),
                );
            }
        }
        if self.choice.before.is_some_and(|before| self.choice.after >= before) {
            warnings.push(
                "no motion that is allowed makes cond(Φ) smaller: by this measure enough has been measured"
                    .to_owned(),
            );
        }
        if !self.choice.after.is_finite() {
            warnings.push("even with this motion some parameters stay undetermined, and cond(Φ) says little: add motions of more variety".to_owned());
        }
        for Excess { joint, what, value, limit } in self.plan.excesses(self.motion(), self.robot.tree()) {
            let (value, limit) = (significant(value, 4), significant(limit, 4));
            let mend = if what == "speed" { " (`phiw retarget --velocity-limits` keeps to it)" } else { "" };
            warnings.push(format!(
                "{joint}: the {what} reaches {value}, beyond the URDF's limit of {limit}{mend}"
            ));
        }
        let last = self.motion().samples() - 1;
        for (what, sample) in [("begins", 0), ("ends", last)] {
            let speeds = self.motion().sample(sample)[1].iter().map(|speed| speed.abs());
            if let Some((joint, speed)) =
                speeds.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, s)| *s > AT_REST)
            {
                warnings.push(format!(
                    "the motion {what} with {} at {} (rad/s, m/s), not at rest: ease the robot {}",
                    self.robot.tree().joint(joint).joint,
                    significant(speed, 2),
                    if sample == 0 { "into it" } else { "out of it" }
                ));
            }
        }
        if self.estimate.source == Source::Urdf && !self.findings.is_empty() {
            warnings.push(format!("the URDF is believed as it is, though {} things in it should not be trusted (`urdf_findings` of the report)", self.findings.len()));
        }
        warnings
    }

    /// For programs. Numbers that are not finite are `null`.
    pub fn json(&self) -> Value {
        let (choice, estimate, motion) = (self.choice, self.estimate, self.motion());
        let joints: Vec<&str> = self.robot.tree().joint_names().collect();
        let balance = self.balance.map(|balance| {
            json!({
                "alpha": choice.alpha,
                "largest_alpha": balance.motion.multi_body.largest_reduction,
                "margin_m": balance.motion.multi_body.margin,
                "margin_std_m": balance.margin_std,
                "untold_std_m": balance.untold_std,
                "zmp_m": balance.motion.multi_body.zmp,
                "at_s": balance.worst_s,
                "point_mass_margin_m": balance.motion.point_mass.margin,
            })
        });
        json!({
            "schema": 1,
            "robot": self.robot.tree().name(),
            "joints": joints,
            "next": {
                "motion": motion.name,
                "file": self.motions.files[choice.motion].display().to_string(),
                "duration_s": motion.duration_s(),
                "written": self.arguments.out.display().to_string(),
                "reason": self.reason(),
                "candidates": self.motions.dataset.len(),
                "allowed": choice.allowed,
                "forced": choice.forced,
                "condition_number": {
                    "before": choice.before,
                    "after": choice.after,
                    "runner_up": choice.runner_up.map(|(motion, cond)| json!({"motion": self.name(motion), "after": cond})),
                },
                "balance": balance,
                "estimate": {
                    "source": estimate.source,
                    "parameters": estimate.parameters.len(),
                    "urdf_error": self.arguments.urdf_error,
                    "logs": estimate.measured.as_ref().map_or(0, |measured| measured.logs),
                    "seconds": estimate.measured.as_ref().map_or(0.0, |measured| measured.seconds),
                },
            },
            "phiw": {
                "version": env!("CARGO_PKG_VERSION"),
                "warnings": self.warnings(),
                "urdf_findings": self.findings.iter().map(ToString::to_string).collect::<Vec<_>>(),
            },
        })
    }
}

/// A condition number in words.
fn condition(value: f64) -> String {
    if value.is_finite() { significant(value, 4) } else { "∞".to_owned() }
}
