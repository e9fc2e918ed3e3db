//! The choice in words and in numbers.

use super::estimate::{Present, Source};
use super::motions::Motions;
use crate::arguments::{NextArguments, NextEstimator, NextSelection};
use crate::warnings::file_name;
use phiw_curriculum::constraint::MotionMargin;
use phiw_curriculum::motion::{Excess, Motion, MotionLimits, Unrest};
use phiw_curriculum::planner::Plan;
use phiw_curriculum::selection::Choice;
use phiw_dynamics::urdf::Finding;
use phiw_estimation::TorqueMisfit;
use phiw_identification::model::parameter_name;
use phiw_report::number::{percent, significant};
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;

/// All that there is to tell.
pub struct Telling<'a> {
    pub arguments: &'a NextArguments,
    pub motions: &'a Motions,
    pub present: &'a Present,
    pub plan: &'a Plan,
    pub balance: Option<&'a MotionMargin>,
    /// What the present belief predicts for the motion \[N·m, N\].
    pub torque: &'a [f64],
    pub base_mass: f64,
    pub findings: &'a [Finding],
}

impl Telling<'_> {
    fn motion(&self) -> &Motion {
        &self.motions.dataset.motions()[self.plan.choice.motion]
    }

    fn name(&self, motion: usize) -> &str {
        &self.motions.dataset.motions()[motion].name
    }

    /// Number of motions that the constraint allows.
    fn allowed(&self) -> usize {
        if self.plan.forced { 0 } else { self.plan.allowed.len() }
    }

    /// cond(Φ) of all that has been measured; none before anything has been. Infinite while something is not
    /// determined.
    fn before(&self) -> Option<f64> {
        self.present.condition_numbers.last().copied().flatten()
    }

    /// cond(Φ) once the motion has been measured as it is planned.
    fn after(&self) -> f64 {
        self.condition_with(self.plan.choice.motion)
    }

    /// cond(Φ) once a motion has been measured as it is planned.
    fn condition_with(&self, motion: usize) -> f64 {
        let Present { candidates, triangle, .. } = self.present;
        let mut stack = candidates.all()[motion].triangle.clone();
        if let Some(measured) = triangle {
            stack.absorb(&mut measured.clone());
        }
        stack.condition_number()
    }

    /// Why this motion, in one sentence.
    fn reason(&self) -> String {
        let count = self.motions.dataset.len();
        let among = match (self.balance, self.plan.forced) {
            (None, _) => format!("of all {count} motions (no balance is asked for)"),
            (Some(_), true) => format!("of none: no motion of {count} is allowed, and it is the safest"),
            (Some(_), false) => format!("of the {} of {count} motions that keep the balance", self.allowed()),
        };
        let condition_numbers = match self.before() {
            Some(before) => format!("{} → {}", condition(before), condition(self.after())),
            None => format!("{}, nothing has been measured yet", condition(self.after())),
        };
        match self.arguments.selection {
            NextSelection::Condition => {
                let next = match self.plan.choice.runner_up {
                    Some((motion, cond)) => {
                        format!("; {} would give {}", self.name(motion), condition(cond))
                    }
                    None => String::new(),
                };
                format!("it makes cond(Φ) smallest {among}: {condition_numbers}{next}")
            }
            NextSelection::TorquePerSecond => {
                let taken = |(motion, merit): (usize, f64)| {
                    let seconds = self.motions.dataset.motions()[motion].duration_s();
                    let share = taken_share(merit, seconds)?;
                    Some(format!("{} % in {} s", percent(share), significant(seconds, 3)))
                };
                let Choice { motion, merit, runner_up } = self.plan.choice;
                let own = self.is_determined().then_some(merit).flatten();
                let own = own.and_then(|merit| taken((motion, merit)));
                let next = runner_up.and_then(|next| Some((self.name(next.0), taken(next)?)));
                let taken = match (own, next) {
                    (Some(own), Some((name, next))) => format!(": {own}, {name} would take {next}"),
                    (Some(own), None) => format!(": {own}"),
                    (None, _) => String::new(),
                };
                format!(
                    "it takes most of the torques' uncertainty in each second {among}{taken}; cond(Φ) \
                     {condition_numbers}"
                )
            }
        }
    }

    /// Whether what has been measured determines all parameters, so that the torques' uncertainty has a share
    /// to take.
    fn is_determined(&self) -> bool {
        self.before().is_some_and(f64::is_finite)
    }

    /// For a terminal.
    pub fn text(&self, report: &Path) -> String {
        let motion = self.motion();
        let mut text = String::new();
        // Writing to a string does not fail.
        let file = self.motions.file(self.plan.choice.motion).display();
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

    fn balance_text(&self, balance: &MotionMargin) -> String {
        let mm = |value: f64| significant(1e3 * value, 3);
        let sure = self.arguments.false_fall_rate.map_or_else(String::new, |rate| {
            let left = mm(self.plan.safety.sure_margin_m);
            format!("; {left} mm are left at one false fall in {}", significant(1.0 / rate, 3))
        });
        format!(
            "balance: α {}; the ZMP stays {} ± {} mm inside the support (nearest at {} s), of which ± {} mm no \
             torque can tell{sure}; {} mm by equation (8)",
            significant(self.plan.alpha, 3),
            mm(balance.balance.multi_body.margin),
            mm(balance.margin_std),
            significant(balance.worst_s, 3),
            mm(balance.unidentifiable_std),
            mm(balance.balance.point_mass.margin),
        )
    }

    fn estimate_text(&self) -> String {
        let count = self.present.estimate.parameters.len();
        let from = match self.present.measured {
            Some((1, seconds)) => format!("1 log ({} s)", significant(seconds, 3)),
            Some((logs, seconds)) => format!("{logs} logs ({} s)", significant(seconds, 3)),
            None => "no log".to_owned(),
        };
        let urdf = format!("the URDF (± {} %)", percent(self.arguments.urdf_error));
        match self.present.source {
            Source::Urdf => {
                format!("estimate: {count} parameters as {urdf} has them; nothing has been measured")
            }
            Source::ControlledLogs => {
                format!("estimate: {count} parameters from {from}, the noise found with them, and the URDF")
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
        if self.plan.forced {
            warnings.push(format!(
                "no motion is allowed at α = {}: this is the safest of all; add calmer motions",
                significant(self.plan.alpha, 3)
            ));
        }
        if let Some(balance) = self.balance {
            let margin = balance.balance.multi_body.margin;
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
        let by_condition = self.arguments.selection == NextSelection::Condition;
        if by_condition && self.before().is_some_and(|before| self.after() >= before) {
            warnings.push(
                "no motion that is allowed makes cond(Φ) smaller: by this measure enough has been measured"
                    .to_owned(),
            );
        }
        let refuted = self.refuted();
        if !refuted.is_empty() {
            let told = |(joint, misfit): &(&str, TorqueMisfit)| {
                let TorqueMisfit { chi_squared, degrees, .. } = misfit;
                format!("{joint} (χ² {} of {degrees})", significant(*chi_squared, 3))
            };
            warnings.push(format!(
                "what is left of a torque is not noise alone, for the motion before foretells it: {}; `phiw explain` seeks what the model lacks",
                refuted.iter().map(told).collect::<Vec<_>>().join(", ")
            ));
        }
        if self.present.source == Source::Logs && self.arguments.estimator == NextEstimator::UnknownNoise {
            warnings.push(
                "the logs do not say what the controller commanded (tau_cmd.<joint>) or was \
                 asked for (qref.<joint>): noise is taken to be in the logs and not in the motion, which \
                 makes inertias and frictions wrong where it moved the robot"
                    .to_owned(),
            );
        }
        if !self.after().is_finite() {
            warnings.push(
                "even with this motion some parameters stay undetermined, and neither cond(Φ) nor \
                 the torques' uncertainty says much: add motions of more variety"
                    .to_owned(),
            );
        }
        let (limits, tree) = (MotionLimits::default(), self.present.robot.tree());
        for Excess { joint, what, value, limit } in limits.excesses(self.motion(), self.torque, tree) {
            let (value, limit) = (significant(value, 4), significant(limit, 4));
            let mend = if what == "speed" { " (`phiw retarget --velocity-limits` keeps to it)" } else { "" };
            warnings.push(format!(
                "{joint}: the {what} reaches {value}, beyond the URDF's limit of {limit}{mend}"
            ));
        }
        for Unrest { joint, speed, at_start } in limits.unrest(self.motion(), tree) {
            let (what, mend) = if at_start { ("begins", "into it") } else { ("ends", "out of it") };
            warnings.push(format!(
                "the motion {what} with {joint} at {} (rad/s, m/s), not at rest: ease the robot {mend}",
                significant(speed, 2),
            ));
        }
        if self.present.source == Source::Urdf && !self.findings.is_empty() {
            warnings.push(format!(
                "the URDF is believed as it is, though {} things in it should not be \
                 trusted (`urdf_findings` of the report)",
                self.findings.len()
            ));
        }
        warnings
    }

    /// The base parameters as they are believed, with their standard deviations.
    fn base_parameters(&self) -> Vec<Value> {
        let Present { design, estimate, robot, .. } = self.present;
        let numbers = estimate.parameters.iter().zip(&estimate.standard_deviations);
        let columns = design.base().independent().iter().zip(numbers);
        let named = |(&column, (value, std)): (&usize, (&f64, &f64))| json!({"name": parameter_name(robot.tree(), column), "value": value, "std": std});
        columns.map(named).collect()
    }

    /// Torques whose noise is foretold by what was there before it, and by how much.
    fn refuted(&self) -> Vec<(&str, TorqueMisfit)> {
        let all = &self.present.misfit;
        let named = self.present.robot.tree().joint_names().zip(all);
        named
            .filter(|(_, misfit)| misfit.is_refuted(all.len(), ONCE_IN))
            .map(|(joint, own)| (joint, *own))
            .collect()
    }

    fn misfit(&self) -> Value {
        let joints = self.present.robot.tree().joint_names().zip(&self.present.misfit);
        joints
            .map(|(joint, misfit)| (joint.to_owned(), json!(misfit)))
            .collect::<serde_json::Map<_, _>>()
            .into()
    }

    /// For programs. Numbers that are not finite are `null`.
    pub fn json(&self) -> Value {
        let (present, plan, motion) = (self.present, self.plan, self.motion());
        let tree = present.robot.tree();
        let joints: Vec<&str> = tree.joint_names().collect();
        let (logs, seconds) = present.measured.unwrap_or_default();
        let balance = self.balance.map(|balance| {
            json!({
                "alpha": plan.alpha,
                "largest_alpha": plan.safety.largest_reduction,
                "margin_m": balance.balance.multi_body.margin,
                "margin_std_m": balance.margin_std,
                "sure_margin_m": plan.safety.sure_margin_m,
                "false_fall_rate": self.arguments.false_fall_rate,
                "untold_std_m": balance.unidentifiable_std,
                "zmp_m": balance.balance.multi_body.zmp,
                "at_s": balance.worst_s,
                "point_mass_margin_m": balance.balance.point_mass.margin,
            })
        });
        json!({
            "schema": 1,
            "robot": tree.name(),
            "joints": joints,
            "next": {
                "motion": motion.name,
                "file": self.motions.file(plan.choice.motion).display().to_string(),
                "duration_s": motion.duration_s(),
                "times_slower": motion.times_slower,
                "written": self.arguments.out.display().to_string(),
                "reason": self.reason(),
                "candidates": self.motions.dataset.len(),
                "allowed": self.allowed(),
                "forced": plan.forced,
                "selection": self.arguments.selection,
                "merit": plan.choice.merit,
                "condition_number": {
                    "before": self.before(),
                    "after": self.after(),
                    "runner_up": plan.choice.runner_up.map(|(motion, _)| json!({"motion": self.name(motion), "after": self.condition_with(motion)})),
                },
                "balance": balance,
                "estimate": {
                    "source": present.source,
                    "parameters": present.estimate.parameters.len(),
                    "urdf_error": self.arguments.urdf_error,
                    "logs": logs,
                    "seconds": seconds,
                    "base_parameters": self.base_parameters(),
                    "misfit": self.misfit(),
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

/// Tests of all torques of which at most one is a false alarm.
const ONCE_IN: f64 = 100.0;

/// The share of the torques' standard deviation that a motion of so many seconds takes, by the merit of
/// [`TorqueOptimalPerSecond`](phiw_curriculum::selection::TorqueOptimalPerSecond); none where it is not a
/// number.
fn taken_share(merit: f64, seconds: f64) -> Option<f64> {
    let share = 1.0 - (0.5 * merit * seconds).exp();
    share.is_finite().then_some(share)
}

/// A condition number in words.
fn condition(value: f64) -> String {
    if value.is_finite() { significant(value, 4) } else { "∞".to_owned() }
}
