//! Plants with a secret: what closing the loop is worth. And plants without: what it invents.

use super::arm::{Arm, Footing};
use super::report::Results;
use super::run_file::RunFile;
use super::score::Score;
use crate::plant::secret::SecretKind;
use phiw_identification::EffectSpec;
use phiw_report::statistics::median;
use std::collections::BTreeSet;

/// Head of the table.
pub const HEAD: [&str; 10] = [
    "effect",
    "runs",
    "standard deviations from nothing",
    "found, kind and joints",
    "runs with another name",
    "RMSE_w without",
    "RMSE_w with",
    "torque error without [N·m]",
    "torque error with [N·m]",
    "torque error smaller with",
];

/// One row for each kind, and one for the plant without any, if there are runs with the loop closed.
pub fn rows(results: &Results) -> Vec<[String; 10]> {
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
        let mut deviations: Vec<f64> =
            of(Arm::Closed).filter_map(|run| run.detection.as_ref()?.deviations()).collect();
        deviations.sort_by(f64::total_cmp);
        // The same seed has the same secret, and the same noise while the same motions are chosen.
        let error = |run: &RunFile| run.scores.last().map(|score| score.rmse_torque);
        let pairs: Vec<[f64; 2]> = of(Arm::Closed)
            .filter_map(|with| {
                let without = of(Arm::Curriculum).find(|run| run.run.seed == with.run.seed)?;
                Some([error(without)?, error(with)?])
            })
            .collect();
        let smaller = pairs.iter().filter(|[without, with]| with < without).count();
        [
            kind.map_or_else(|| "none".to_owned(), SecretKind::name),
            count.max(of(Arm::Curriculum).count()).to_string(),
            match deviations.as_slice() {
                [] => "–".to_owned(),
                [least, .., most] => format!("{:.1} ({least:.1} to {most:.1})", median(&deviations)),
                [only] => format!("{only:.1}"),
            },
            match kind {
                None => "–".to_owned(),
                Some(kind) => {
                    let named = of(Arm::Closed).filter(|run| is_it(run)).count();
                    let joints = kind.is_family().then(|| share_of_joints(of(Arm::Closed)));
                    let joints = joints
                        .map_or_else(String::new, |share| format!(", {:.0} % of the joints", 100.0 * share));
                    format!("{named} of {count}{joints}")
                }
            },
            format!("{} of {count}", of(Arm::Closed).filter(|run| is_other(run)).count()),
            last(Arm::Curriculum, |score| score.rmse_w),
            last(Arm::Closed, |score| score.rmse_w),
            last(Arm::Curriculum, |score| score.rmse_torque),
            last(Arm::Closed, |score| score.rmse_torque),
            format!("{smaller} of {}", pairs.len()),
        ]
    };
    kinds.into_iter().map(row).collect()
}

/// Share of a family's joints on which it was found, over all runs.
fn share_of_joints<'a>(runs: impl Iterator<Item = &'a RunFile>) -> f64 {
    let (mut named, mut all) = (0, 0);
    for run in runs {
        named += found(run).filter(|spec| is_secret(run, spec)).count();
        all += run.secret_joints.len();
    }
    named as f64 / all.max(1) as f64
}

/// What a run found beside the declared effects.
fn found(run: &RunFile) -> impl Iterator<Item = &EffectSpec> {
    let specs = run.run.model.effects.iter().map(|effect| &effect.spec);
    let declared = &run.run.initial.effects;
    specs.filter(|spec| declared.iter().all(|declared| declared.spec != **spec))
}

/// Whether an effect is the run's secret: its kind on its joints, or on one joint of a family's. A tilt acts
/// on the base, whatever joints feel it.
pub fn is_secret(run: &RunFile, spec: &EffectSpec) -> bool {
    let joints: BTreeSet<&String> = spec.joints.iter().collect();
    let wanted: BTreeSet<&String> = run.secret_joints.iter().collect();
    run.secret.is_some_and(|kind| {
        let on_them = if kind.is_family() { joints.is_subset(&wanted) } else { joints == wanted };
        kind.effect_kind() == spec.kind && (wanted.is_empty() || on_them)
    })
}

/// What a run found, in words: `coulomb_friction[elbow]`.
pub fn names(run: &RunFile) -> Vec<String> {
    found(run).map(|spec| format!("{}[{}]", spec.kind, spec.joints.join("+"))).collect()
}
