//! Plants with a secret: what closing the loop is worth. And plants without: what it invents.

use super::arm::{Arm, Footing};
use super::report::{Results, median};
use super::run_file::RunFile;
use super::score::Score;
use crate::plant_experiment::secret::SecretKind;
use phiw_identification::EffectSpec;
use std::collections::BTreeSet;

/// Head of the table.
pub const HEAD: [&str; 8] = [
    "effect",
    "runs",
    "found, kind and joints",
    "runs with another name",
    "RMSE_w without",
    "RMSE_w with",
    "torque error without [N·m]",
    "torque error with [N·m]",
];

/// One row for each kind, and one for the plant without any, if there are runs with the loop closed.
pub fn rows(results: &Results) -> Vec<[String; 8]> {
    let kinds: BTreeSet<Option<SecretKind>> = results
        .runs
        .iter()
        .filter(|run| run.secret.is_some() || run.arm == Arm::Closed)
        .map(|run| run.secret)
        .collect();
    let row = |kind: Option<SecretKind>| {
        let of = |arm: Arm| {
            let of_kind = move |run: &&RunFile| run.secret == kind && run.footing == Footing::Fixed;
            results.runs.iter().filter(of_kind).filter(move |run| run.arm == arm)
        };
        let last = |arm: Arm, value: fn(&Score) -> f64| {
            let values: Vec<f64> = of(arm).filter_map(|run| run.scores.last().map(value)).collect();
            if values.is_empty() { "–".to_owned() } else { format!("{:.3}", median(&values)) }
        };
        let count = of(Arm::Closed).count();
        let is_it = |run: &RunFile| found(run).any(|spec| is_secret(run, spec));
        let is_other = |run: &RunFile| found(run).any(|spec| !is_secret(run, spec));
        [
            kind.map_or_else(|| "none".to_owned(), SecretKind::name),
            count.max(of(Arm::Curriculum).count()).to_string(),
            kind.map_or_else(
                || "–".to_owned(),
                |_| format!("{} of {count}", of(Arm::Closed).filter(|run| is_it(run)).count()),
            ),
            format!("{} of {count}", of(Arm::Closed).filter(|run| is_other(run)).count()),
            last(Arm::Curriculum, |score| score.rmse_w),
            last(Arm::Closed, |score| score.rmse_w),
            last(Arm::Curriculum, |score| score.rmse_torque),
            last(Arm::Closed, |score| score.rmse_torque),
        ]
    };
    kinds.into_iter().map(row).collect()
}

/// What a run found beside the declared effects.
fn found(run: &RunFile) -> impl Iterator<Item = &EffectSpec> {
    let specs = run.run.model.effects.iter().map(|effect| &effect.spec);
    specs.filter(|spec| spec.kind != "viscous_friction")
}

/// Whether an effect is the run's secret: its kind on its joints. A tilt acts on the base, whatever joints feel it.
fn is_secret(run: &RunFile, spec: &EffectSpec) -> bool {
    let joints: BTreeSet<&String> = spec.joints.iter().collect();
    let wanted: BTreeSet<&String> = run.secret_joints.iter().collect();
    run.secret.is_some_and(|kind| kind.name() == spec.kind) && (wanted.is_empty() || joints == wanted)
}

/// What a run found, in words: `coulomb_friction[elbow]`.
pub fn names(run: &RunFile) -> Vec<String> {
    found(run).map(|spec| format!("{}[{}]", spec.kind, spec.joints.join("+"))).collect()
}
