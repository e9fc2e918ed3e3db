//! What a residual follows, without a name: shapes over each signal, fitted on some folds, judged on the
//! others.

mod others;
mod own;
mod shape;
mod swings;

use super::folds::split_by_motion;
use super::residuals::ResidualShape;
use super::stage::Fixed;
use crate::selection::students_tail;
use phiw_effects::SignalRanges;
use phiw_identification::{EffectSpec, Fold, IdentificationError};
use phiw_regressor::RegressorError;
use phiw_regressor::factor::{Factor, FactorBuilder, ROUNDING};
use phiw_regressor::least_squares::GroupedFactor;
use rayon::prelude::*;
pub(super) use shape::nameless_columns;
use shape::{Shape, Torque};

/// A residual that follows a signal, or two together.
#[derive(Clone, Debug, PartialEq)]
pub struct Dependence {
    /// The joint whose residual it is.
    pub joint: String,
    /// The signals, as in `report.json`: `q`, `qd`, `qdd`, `tau`, `t`, or another joint's `q.<joint>`,
    /// `qd.<joint>`, `tau.<joint>`; two where it follows their product.
    pub signals: Vec<String>,
    /// Share of the residual variance that columns over the signals predict on folds that they were not
    /// fitted on.
    pub share: f64,
}

/// Parts that take turns in being left out.
const PARTS: usize = 5;
/// A shape's height is drawn to nothing as if this share of all rows had said so: where few rows are, it does
/// not swing out.
const DRAWN: f64 = 0.01;
/// The same for a parameter of the model that no rows determine.
const DRAWN_MODEL: f64 = 1e-6;
/// Share of all rows that say what the model's parameters are, where folds are left out: a joint that moves
/// in few of them moves in none of the others, and what these make of its parameters would hide all shapes.
const KNOWN: f64 = 0.01;

/// A fitted model whose residual is looked at.
#[derive(Clone, Copy)]
pub(super) struct Fit<'a> {
    pub fixed: &'a Fixed<'a>,
    /// Motion of which one part is foretold from the others.
    pub folds: &'a [Fold],
    pub specs: &'a [EffectSpec],
    pub parameters: &'a [f64],
    pub ranges: &'a SignalRanges,
    /// Over what the residuals swing.
    pub peaks: &'a ResidualShape,
    /// Probability that a residual of noise, of any torque, seems to follow any signal.
    pub false_alarm: f64,
}

/// Which signals the residuals of the torques `rows` follow, strongest first.
pub(super) fn probe(fit: Fit<'_>, rows: &[usize]) -> Result<Vec<Dependence>, IdentificationError> {
    let all = |row: usize| -> Vec<usize> {
        (0..fit.fixed.tree.joint_count()).filter(|&other| other != row).collect()
    };
    let joint = |row: usize| fit.fixed.tree.joint(row).joint.clone();
    let of_probe =
        |probe: Probe| Dependence { joint: joint(probe.row), signals: probe.signals, share: probe.share };
    let mut found: Vec<Dependence> =
        probes(fit, rows, |row| shapes(fit, row, &all(row)))?.into_iter().map(of_probe).collect();
    found.sort_by(|a, b| b.share.total_cmp(&a.share));
    Ok(found)
}

/// Those of the torques `rows` whose residual follows the motion of the joint or of its neighbours, or a
/// torque. Noise that does not know the motion foretells nothing, whatever its colour.
pub(super) fn following(fit: Fit<'_>, rows: &[usize]) -> Result<Vec<usize>, IdentificationError> {
    let neighbours = |row: usize| others::neighbours(fit.fixed.tree, row);
    Ok(rows_of(&probes(fit, rows, |row| shapes(fit, row, &neighbours(row)))?))
}

/// Those of the torques `rows` whose residual follows one signal of its own joint: an eighth of the work of
/// [`following`].
pub(super) fn following_own_signal(fit: Fit<'_>, rows: &[usize]) -> Result<Vec<usize>, IdentificationError> {
    Ok(rows_of(&probes(fit, rows, |row| own::single(&torque(fit, row)))?))
}

/// The torques of the probes, which are in their order.
fn rows_of(probes: &[Probe]) -> Vec<usize> {
    let mut rows: Vec<usize> = probes.iter().map(|probe| probe.row).collect();
    rows.dedup();
    rows
}

/// Shapes over some signals that foretell a residual.
struct Probe {
    row: usize,
    signals: Vec<String>,
    share: f64,
}

fn torque(fit: Fit<'_>, row: usize) -> Torque<'_> {
    Torque { fixed: fit.fixed, row, ranges: fit.ranges, peaks: fit.peaks }
}

/// All shapes in the torque of `row`, those over the motion of the `moving` joints among them.
fn shapes(fit: Fit<'_>, row: usize, moving: &[usize]) -> Vec<Shape> {
    let torque = torque(fit, row);
    let mut shapes = own::single(&torque);
    shapes.extend(own::products(&torque));
    shapes.extend(swings::swings(&torque));
    shapes.extend(moving.iter().flat_map(|&other| others::motion_of(&torque, other)));
    let others = (0..fit.fixed.tree.joint_count()).filter(|&other| other != row);
    shapes.extend(others.map(|other| others::torque_of_joint(&torque, other)));
    shapes
}

/// Those of the `shapes` of each torque that foretell something, torque by torque.
fn probes(
    fit: Fit<'_>,
    rows: &[usize],
    shapes: impl Fn(usize) -> Vec<Shape>,
) -> Result<Vec<Probe>, IdentificationError> {
    if rows.is_empty() {
        return Ok(Vec::new());
    }
    let (mut effects, mut looked_at) = (Vec::new(), Vec::new());
    for &row in rows {
        for Shape { signals, effect, least_share } in shapes(row) {
            effects.push(effect);
            looked_at.push((row, signals, least_share));
        }
    }
    let Fit { fixed, specs, parameters, .. } = fit;
    let folds = split_by_motion(fixed, fit.folds.to_vec())?;
    let (design, folds) = fixed.factors(specs, effects, fixed.reference(specs, parameters)?, &folds)?;
    // A held model's parameters do not give way.
    let free = if fixed.prior.is_some() { 0 } else { parameters.len() };
    let mut parameters = parameters.to_vec();
    parameters.resize(design.parameter_count(), 0.0);
    let limit = fit.false_alarm / looked_at.len().max(1) as f64;
    let of_row = |&row: &usize| {
        let residual = Residual { folds: &folds, parameters: &parameters, row, free };
        let alone = residual.left_over(&[])?;
        let mut found = Vec::new();
        let own = looked_at.iter().enumerate().filter(|(_, (of, ..))| *of == row);
        for (candidate, (_, signals, least_share)) in own {
            let shape = design.effect_parameters(specs.len() + candidate);
            let after = residual.left_over(&shape.collect::<Vec<usize>>())?;
            let share = 1.0 - after.iter().sum::<f64>() / alone.iter().sum::<f64>().max(f64::MIN_POSITIVE);
            let logarithms = |squares: &[f64]| -> Vec<f64> {
                squares.iter().map(|square| square.max(f64::MIN_POSITIVE).ln()).collect()
            };
            let moving = alone.iter().zip(&after).filter(|(square, _)| **square > 0.0);
            let (alone, after): (Vec<f64>, Vec<f64>) = moving.unzip();
            let t = paired_t(&logarithms(&alone), &logarithms(&after));
            let tail = students_tail(t, (alone.len() as f64 - 1.0).max(1.0));
            if share >= *least_share && tail <= limit {
                found.push(Probe { row, signals: signals.clone(), share });
            }
        }
        Ok(found)
    };
    let found: Result<Vec<Vec<Probe>>, RegressorError> = rows.par_iter().map(of_row).collect();
    Ok(found?.into_iter().flatten().collect())
}

/// What a model leaves of one torque, fold by fold.
struct Residual<'a> {
    folds: &'a [GroupedFactor],
    parameters: &'a [f64],
    row: usize,
    /// The model's parameters from the first up to this one may give way to a shape.
    free: usize,
}

impl Residual<'_> {
    /// The sum of squares left of each fold after a fit of the free parameters and `added` to the other parts
    /// of the folds.
    fn left_over(&self, added: &[usize]) -> Result<Vec<f64>, RegressorError> {
        let folds: Result<Vec<Factor>, RegressorError> =
            self.folds.iter().map(|fold| self.reduced(fold, added)).collect();
        let folds = folds?;
        let known = without_shapes(&Factor::merge_all(folds.iter())?, added.len())?;
        let mut left = vec![0.0; folds.len()];
        for part in 0..PARTS {
            let others = folds.iter().enumerate().filter(|(place, _)| place % PARTS != part);
            let others = Factor::merge_all(others.map(|(_, fold)| fold))?;
            let fitted = drawn_to_nothing(&others, &known, added.len())?;
            for (place, fold) in folds.iter().enumerate().filter(|(place, _)| place % PARTS == part) {
                left[place] = fold.residual_sum_of_squares(&fitted)?;
            }
        }
        Ok(left)
    }

    /// The free columns, the added ones and what the model leaves of the torque.
    fn reduced(&self, factors: &GroupedFactor, added: &[usize]) -> Result<Factor, RegressorError> {
        let group = &factors.groups()[self.row];
        let of = |parameter: &usize| *parameter < self.free || added.contains(parameter);
        let columns: Vec<usize> =
            (0..group.parameters.len()).filter(|&column| of(&group.parameters[column])).collect();
        let right = group.factor.parameters();
        let map = faer::Mat::from_fn(right + 1, columns.len() + 1, |column, target| {
            if target < columns.len() {
                f64::from(u8::from(columns[target] == column))
            } else if column == right {
                1.0
            } else {
                -self.parameters[group.parameters[column]]
            }
        });
        group.factor.combine(map.as_ref())
    }
}

/// The columns of the model alone, and nothing to be explained by them.
fn without_shapes(factor: &Factor, added: usize) -> Result<Factor, RegressorError> {
    let count = factor.parameters() - added;
    let map = faer::Mat::from_fn(factor.columns(), count + 1, |column, target| {
        f64::from(u8::from(column == target && target < count))
    });
    factor.combine(map.as_ref())
}

/// Least squares with every column drawn to nothing: the last `added` by themselves, those of the model by
/// what all rows know of them.
fn drawn_to_nothing(factor: &Factor, known: &Factor, added: usize) -> Result<Vec<f64>, RegressorError> {
    let count = factor.parameters();
    if count == 0 {
        return Ok(Vec::new());
    }
    let mut builder = FactorBuilder::new(count + 1);
    let every: Vec<usize> = (0..=count).collect();
    builder.push_factor(factor, &every, 1.0)?;
    let of_model: Vec<usize> = (0..count - added).chain([count]).collect();
    builder.push_factor(known, &of_model, KNOWN.sqrt())?;
    let both = builder.factor();
    let norms: Vec<f64> = (0..count).map(|column| both.column_norm(column)).collect();
    let largest = norms[count - added..].iter().copied().fold(0.0, f64::max);
    let heaviest = norms.iter().copied().fold(0.0, f64::max);
    let otherwise = if heaviest > 0.0 { heaviest } else { 1.0 };
    for column in 0..count {
        let weight = match column < count - added {
            true => DRAWN_MODEL.sqrt() * norms[column],
            false => DRAWN.sqrt() * largest,
        };
        // Where the rows say nothing of a parameter any weight makes it nothing.
        let weight = if weight > ROUNDING * heaviest { weight } else { otherwise };
        let mut row = vec![0.0; count + 1];
        row[column] = weight;
        builder.push_row(&row)?;
    }
    Ok(builder.factor().solve()?.parameters)
}

/// Mean of paired differences over their standard error.
fn paired_t(left: &[f64], right: &[f64]) -> f64 {
    let count = left.len() as f64;
    let differences: Vec<f64> = left.iter().zip(right).map(|(a, b)| a - b).collect();
    let mean = differences.iter().sum::<f64>() / count;
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
    if variance > 0.0 { mean / (variance / count).sqrt() } else { 0.0 }
}
