//! What a residual follows, without a name: smooth functions of each signal, fitted on the training folds, judged on those held out.

use super::candidate::{Candidate, Candidates};
use super::evidence::Refit;
use super::stage::Fixed;
use crate::catalogue::{Constants, OwnTorque, ParameterKind, SignalRanges, smooth_sign};
use phiw_identification::{Effect, EffectSpec, IdentificationError, ReferenceModel, Sample};
use std::f64::consts::PI;

/// A residual that follows a signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Dependence {
    /// The joint whose residual it is.
    pub joint: String,
    /// The signal, as in `report.json`: `q`, `qd`, `qdd`, `tau`, `t`, or another joint's `q.<joint>`, `qd.<joint>`.
    pub signal: String,
    /// Share of the held-out residual variance that smooth functions of the signal predict.
    pub share: f64,
}

/// A share below this is not worth a word.
const LEAST_SHARE: f64 = 0.03;

/// Which signals the residuals of the torques `rows` follow, strongest first.
pub(super) fn probe(
    fixed: &Fixed<'_>,
    specs: &[EffectSpec],
    reference: ReferenceModel,
    parameters: &[f64],
    ranges: &SignalRanges,
    rows: &[usize],
) -> Result<Vec<Dependence>, IdentificationError> {
    if rows.is_empty() {
        return Ok(Vec::new());
    }
    let mut candidates = Candidates::none();
    let mut meaning = Vec::new();
    for &row in rows {
        for (signal, effect) in probes(fixed, row, ranges) {
            let first = candidates.effects.len();
            candidates.list.push(Candidate {
                specs: vec![EffectSpec::new("probe", &[])],
                rank: 0,
                effects: first..first + 1,
                constants: 0,
            });
            candidates.effects.push(effect);
            meaning.push((row, signal));
        }
    }
    let stage = fixed.pass(specs, candidates, reference)?;
    let (train, held_out) = (&stage.train, &stage.held_out);
    let mut full = parameters.to_vec();
    full.resize(train.parameter_count(), 0.0);
    let before = held_out.residual_sums_of_squares(&full)?;
    let mut found = Vec::new();
    for (candidate, (row, signal)) in meaning.into_iter().enumerate() {
        let added = stage.parameters(candidate);
        let Some(refit) = fit_residual(train, &full, &added, row)? else { continue };
        let after = held_out.residual_sums_of_squares(&refit.parameters)?[row];
        let share = 1.0 - after / before[row].max(f64::MIN_POSITIVE);
        if share >= LEAST_SHARE {
            let joint = fixed.tree.joint(row).joint.clone();
            found.push(Dependence { joint, signal, share });
        }
    }
    found.sort_by(|a, b| b.share.total_cmp(&a.share));
    Ok(found)
}

/// Least squares of one torque's residual on the added columns alone.
fn fit_residual(
    factors: &phiw_regressor::least_squares::GroupedFactor,
    parameters: &[f64],
    added: &[usize],
    row: usize,
) -> Result<Option<Refit>, IdentificationError> {
    let group = &factors.groups()[row];
    let columns: Vec<usize> = group
        .parameters
        .iter()
        .enumerate()
        .filter(|(_, p)| added.contains(p))
        .map(|(column, _)| column)
        .collect();
    let right = group.factor.parameters();
    // [added columns, f − Φw] as linear combinations of the group's columns.
    let map = faer::Mat::from_fn(right + 1, columns.len() + 1, |column, target| {
        if target < columns.len() {
            f64::from(u8::from(columns[target] == column))
        } else if column == right {
            1.0
        } else {
            -parameters[group.parameters[column]]
        }
    });
    let reduced = group.factor.combine(map.as_ref())?;
    let Ok(solution) = reduced.solve() else { return Ok(None) };
    let mut fitted = parameters.to_vec();
    columns
        .iter()
        .zip(&solution.parameters)
        .for_each(|(&column, value)| fitted[group.parameters[column]] += value);
    Ok(Some(Refit { parameters: fitted, train: Vec::new(), held_out: Vec::new() }))
}

/// Writes the columns of one sample.
type ProbeColumns = Box<dyn Fn(&Sample<'_>, &mut [f64]) + Send + Sync>;

/// Smooth functions of each signal, for one torque.
fn probes(fixed: &Fixed<'_>, row: usize, ranges: &SignalRanges) -> Vec<(String, Box<dyn Effect>)> {
    let tree = fixed.tree;
    let mut probes: Vec<(String, Box<dyn Effect>)> = Vec::new();
    let mut add = |signal: String, count: usize, formula: ProbeColumns| {
        let parameters = vec![("coefficient", ParameterKind::Torque, f64::NEG_INFINITY); count];
        let columns = move |sample: &Sample<'_>, out: &mut [f64]| formula(sample, out);
        let effect = OwnTorque::new("probe", tree, row, &Constants::new(), &parameters, columns);
        let needs = phiw_identification::Needs { torque: signal == "tau", ..Default::default() };
        probes.push((signal, Box::new(effect.needing(needs))));
    };
    let joints = ranges.joints.len();
    for other in 0..joints {
        let own = other == row;
        let name = |signal: &str| {
            if own { signal.to_owned() } else { format!("{signal}.{}", tree.joint(other).joint) }
        };
        let (lower, upper) = ranges.joints[other].position;
        let scale = PI / (upper - lower).max(1e-9);
        let waves = if own { 4 } else { 2 };
        add(
            name("q"),
            2 * waves,
            Box::new(move |sample, out| {
                let angle = scale * (sample.q()[other] - lower);
                for wave in 0..waves {
                    (out[2 * wave], out[2 * wave + 1]) = ((wave + 1) as f64 * angle).sin_cos();
                }
            }),
        );
        let speed = ranges.joints[other].velocity_rms.max(1e-9);
        add(
            name("qd"),
            5,
            Box::new(move |sample, out| {
                let velocity = sample.qd()[other] / speed;
                let bend = velocity.clamp(-4.0, 4.0);
                out.copy_from_slice(&[
                    velocity,
                    bend * bend.abs(),
                    smooth_sign(velocity, 0.05),
                    smooth_sign(velocity, 0.05) * (-velocity.abs() / 0.2).exp(),
                    velocity.abs(),
                ]);
            }),
        );
    }
    add(
        "qdd".to_owned(),
        2,
        Box::new(move |sample, out| {
            let acceleration = sample.qdd()[row];
            out.copy_from_slice(&[acceleration, acceleration.abs()]);
        }),
    );
    let own_speed = 0.05 * ranges.joints[row].velocity_rms.max(1e-9);
    add(
        "tau".to_owned(),
        2,
        Box::new(move |sample, out| {
            let torque = sample.reference_torque().get(row).copied().unwrap_or_default();
            out.copy_from_slice(&[torque, torque.abs() * smooth_sign(sample.qd()[row], own_speed)]);
        }),
    );
    let (start, end) = ranges.session;
    add(
        "t".to_owned(),
        3,
        Box::new(move |sample, out| {
            let x = (sample.time() - start) / (end - start).max(1e-9);
            out.copy_from_slice(&[1.0, x, x * x]);
        }),
    );
    probes
}
