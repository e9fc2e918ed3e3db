//! What the factors say of a candidate: refit of everything with it, error on motion held out, and how sure
//! that is.

use super::screening::Whole;
use faer::Mat;
use phiw_regressor::RegressorError;
use phiw_regressor::factor::{Factor, FactorBuilder};
use phiw_regressor::least_squares::{Group, GroupedFactor};
use std::sync::OnceLock;

/// The model's columns in the factors of a larger design, whose candidates' columns follow them.
pub(super) struct Evidence<'a> {
    pub train: &'a GroupedFactor,
    pub held_out: &'a GroupedFactor,
    /// Training folds, then those held out.
    pub folds: Vec<&'a GroupedFactor>,
    /// Number of parameters of the model: the first ones of the design.
    pub model: usize,
    /// Parameters of the model that the logs determine.
    pub determined: Vec<bool>,
    /// 1/σ of each torque.
    pub weights: Vec<f64>,
    /// What was known before (a held model), over the model's parameters.
    pub prior: Option<&'a Factor>,
    /// For each torque, the model's rows (the prior behind them).
    rows: Vec<Factor>,
    /// For each torque, the model's rows of all the others and the prior; filled in when it is first asked
    /// for.
    others: Vec<OnceLock<Factor>>,
    /// The model's rows of all torques, for the quick look; filled in when it is first asked for.
    whole: OnceLock<Whole>,
    /// For each torque the factor over the model's columns alone: training, held out.
    alone: [Vec<Factor>; 2],
}

/// A refit of the model together with some columns.
#[derive(Clone, Debug)]
pub(super) struct Refit {
    /// All parameters of the design; zero where neither in the model nor in the candidate.
    pub parameters: Vec<f64>,
    /// Residual sum of squares of each torque on the training folds.
    pub train: Vec<f64>,
    /// The same on the folds held out.
    pub held_out: Vec<f64>,
}

impl<'a> Evidence<'a> {
    pub fn new(
        train: &'a GroupedFactor,
        held_out: &'a GroupedFactor,
        folds: Vec<&'a GroupedFactor>,
        model: usize,
        determined: Vec<bool>,
        weights: Vec<f64>,
        prior: Option<&'a Factor>,
    ) -> Result<Self, RegressorError> {
        let mut evidence = Evidence {
            train,
            held_out,
            folds,
            model,
            determined,
            weights,
            prior,
            rows: Vec::new(),
            others: Vec::new(),
            whole: OnceLock::new(),
            alone: [Vec::new(), Vec::new()],
        };
        evidence.alone = [model_alone(train, model)?, model_alone(held_out, model)?];
        evidence.rows = evidence.model_rows()?;
        evidence.others = (0..train.groups().len()).map(|_| OnceLock::new()).collect();
        Ok(evidence)
    }

    /// Places of the model's determined parameters among themselves.
    pub(super) fn places(&self) -> (Vec<Option<usize>>, usize) {
        let mut count = 0;
        let place = |&determined: &bool| {
            determined.then(|| {
                count += 1;
                count - 1
            })
        };
        let places = self.determined.iter().map(place).collect();
        (places, count)
    }

    fn model_rows(&self) -> Result<Vec<Factor>, RegressorError> {
        let (places, count) = self.places();
        let mut rows = Vec::new();
        for (group, weight) in self.train.groups().iter().zip(&self.weights) {
            let mut builder = FactorBuilder::new(count + 1);
            push_group(&mut builder, group, self.model, &places, &[], *weight)?;
            rows.push(builder.factor());
        }
        rows.extend(self.prior.cloned());
        Ok(rows)
    }

    fn others(&self, row: usize) -> Result<&Factor, RegressorError> {
        if let Some(factor) = self.others[row].get() {
            return Ok(factor);
        }
        let rest = self.rows.iter().enumerate().filter(|(other, _)| *other != row);
        let merged = Factor::merge_all(rest.map(|(_, factor)| factor))?;
        // A robot with a single joint has no others.
        let merged = if merged.columns() == 0 { Factor::empty(self.rows[row].columns()) } else { merged };
        Ok(self.others[row].get_or_init(|| merged))
    }

    /// Refits the model with `added` parameters of the design; `rows` are the torques that they act on.
    ///
    /// `None` where the added columns have nothing left after the model has absorbed its part: not
    /// identifiable from these logs.
    pub fn refit(&self, added: &[usize], rows: &[usize]) -> Result<Option<Refit>, RegressorError> {
        let (places, count) = self.places();
        let columns = count + added.len();
        let mut builder = FactorBuilder::new(columns + 1);
        // The candidate's columns stand last, the right-hand side behind them.
        let model_columns: Vec<usize> = (0..count).chain([columns]).collect();
        if let [row] = rows {
            builder.push_factor(self.others(*row)?, &model_columns, 1.0)?;
            push_group(
                &mut builder,
                &self.train.groups()[*row],
                self.model,
                &places,
                added,
                self.weights[*row],
            )?;
        } else {
            for (group, weight) in self.train.groups().iter().zip(&self.weights) {
                push_group(&mut builder, group, self.model, &places, added, *weight)?;
            }
            if let Some(prior) = self.prior {
                builder.push_factor(prior, &model_columns, 1.0)?;
            }
        }
        let factor = builder.factor();
        // Columns that the motion does not excite, or that the model has absorbed but for a thousandth, say
        // nothing: the rest of the candidate may.
        let silent = |column: usize| factor.entry(column, column) < ABSORBED * factor.column_norm(column);
        let undetermined = factor.undetermined_columns();
        if undetermined.iter().any(|&column| column < count) {
            return Ok(None);
        }
        let heard: Vec<usize> = (0..added.len())
            // A dependent column shifts the diagonal of those after it: first the one, then the other.
            .filter(|&place| match undetermined.is_empty() {
                true => !silent(count + place),
                false => !undetermined.contains(&(count + place)),
            })
            .map(|place| added[place])
            .collect();
        if heard.len() < added.len() {
            return if heard.is_empty() { Ok(None) } else { self.refit(&heard, rows) };
        }
        let solution = factor.solve()?.parameters;
        let mut parameters = vec![0.0; self.train.parameter_count()];
        for (parameter, place) in places.iter().enumerate() {
            parameters[parameter] = place.map_or(0.0, |place| solution[place]);
        }
        added.iter().zip(&solution[count..]).for_each(|(&parameter, value)| parameters[parameter] = *value);
        self.outcome(parameters, rows, added).map(Some)
    }

    /// The model's rows of all torques as one factor.
    pub(super) fn whole(&self) -> Result<&Whole, RegressorError> {
        if let Some(whole) = self.whole.get() {
            return Ok(whole);
        }
        let whole = Whole::of_rows(&self.rows)?;
        Ok(self.whole.get_or_init(|| whole))
    }

    /// Parameters, with what they leave of each torque.
    pub(super) fn outcome(
        &self,
        parameters: Vec<f64>,
        rows: &[usize],
        added: &[usize],
    ) -> Result<Refit, RegressorError> {
        Ok(Refit {
            train: self.squares(self.train, &self.alone[0], &parameters, rows, added)?,
            held_out: self.squares(self.held_out, &self.alone[1], &parameters, rows, added)?,
            parameters,
        })
    }

    /// Residual sum of squares of each torque; those that the added columns do not act on need the model's
    /// columns only.
    fn squares(
        &self,
        factors: &GroupedFactor,
        alone: &[Factor],
        parameters: &[f64],
        rows: &[usize],
        added: &[usize],
    ) -> Result<Vec<f64>, RegressorError> {
        let of_row = |(row, (group, alone)): (usize, (&Group, &Factor))| {
            let whole = rows.contains(&row) && !added.is_empty();
            let columns =
                if whole { group.parameters.as_slice() } else { &group.parameters[..alone.parameters()] };
            let own: Vec<f64> = columns.iter().map(|&parameter| parameters[parameter]).collect();
            let factor = if whole { &group.factor } else { alone };
            factor.residual_sum_of_squares(&own)
        };
        factors.groups().iter().zip(alone).enumerate().map(of_row).collect()
    }

    /// For each fold the weighted error of `refit`, with σ of each torque as given.
    pub fn fold_errors(&self, refit: &Refit, std: &[f64]) -> Result<Vec<f64>, RegressorError> {
        let error = |fold: &&GroupedFactor| {
            let squares = fold.residual_sums_of_squares(&refit.parameters)?;
            Ok(squares.iter().zip(std).map(|(sum, std)| 0.5 * sum / (std * std)).sum())
        };
        self.folds.iter().map(error).collect()
    }

    /// How many standard deviations the added columns' fitted combination is from nothing.
    ///
    /// The standard deviation comes from the scores of whole folds (a cluster-robust sandwich, Liang & Zeger
    /// 1986), so that samples that are correlated within a fold are not counted one by one. It is that of the
    /// combination's scale: the Wald form of several parameters would need more folds than there are.
    pub fn significance(&self, added: &[usize]) -> Result<f64, RegressorError> {
        let (places, count) = self.places();
        let columns = count + added.len();
        let mut builder = FactorBuilder::new(columns + 1);
        for fold in &self.folds {
            for (group, weight) in fold.groups().iter().zip(&self.weights) {
                push_group(&mut builder, group, self.model, &places, added, *weight)?;
            }
        }
        if let Some(prior) = self.prior {
            let model_columns: Vec<usize> = (0..count).chain([columns]).collect();
            builder.push_factor(prior, &model_columns, 1.0)?;
        }
        let factor = builder.factor();
        let fitted = match factor.solve() {
            Ok(solution) => solution.parameters,
            Err(RegressorError::RankDeficient { .. }) => return Ok(0.0),
            Err(error) => return Err(error),
        };
        // The model's columns, the combination, the right-hand side.
        let combination = Mat::from_fn(columns + 1, count + 2, |column, target| match target {
            target if target < count => f64::from(u8::from(column == target)),
            target if target == count => {
                if (count..columns).contains(&column) {
                    fitted[column]
                } else {
                    0.0
                }
            }
            _ => f64::from(u8::from(column == columns)),
        });
        let bread = match factor.combine(combination.as_ref())?.unit_covariance() {
            Ok(bread) => bread,
            Err(RegressorError::RankDeficient { .. }) => return Ok(0.0),
            Err(error) => return Err(error),
        };
        // One row of the bread is all that the combination's variance needs.
        let mut variance = 0.0;
        for fold in &self.folds {
            let mut builder = FactorBuilder::new(columns + 1);
            for (group, weight) in fold.groups().iter().zip(&self.weights) {
                push_group(&mut builder, group, self.model, &places, added, *weight)?;
            }
            let r = builder.factor().combine(combination.as_ref())?;
            let value = |column: usize| if column < count { fitted[column] } else { 1.0 };
            let residual: Vec<f64> = (0..count + 2)
                .map(|row| {
                    let sum: f64 = (row..=count).map(|column| r.entry(row, column) * value(column)).sum();
                    r.entry(row, count + 1) - sum
                })
                .collect();
            // Score of a fold: its columns times its residual.
            let score =
                |column: usize| -> f64 { (0..=column).map(|row| r.entry(row, column) * residual[row]).sum() };
            let influence: f64 = (0..=count).map(|column| bread[(count, column)] * score(column)).sum();
            variance += influence * influence;
        }
        let folds = self.folds.len() as f64;
        variance *= folds / (folds - 1.0).max(1.0);
        Ok(if variance > 0.0 { 1.0 / variance.sqrt() } else { 0.0 })
    }
}

/// For each torque the factor over the model's columns, which come first, and the right-hand side.
fn model_alone(factors: &GroupedFactor, model: usize) -> Result<Vec<Factor>, RegressorError> {
    let of_group = |group: &Group| {
        let own = group.parameters.partition_point(|&parameter| parameter < model);
        let columns: Vec<usize> = (0..own).chain([group.factor.parameters()]).collect();
        group.factor.select(&columns)
    };
    factors.groups().iter().map(of_group).collect()
}

/// A column with less than this share left after the model's columns are taken out is not identifiable.
pub(super) const ABSORBED: f64 = 2e-3;

/// Pushes a torque's rows over the model's determined columns, the added ones and the right-hand side.
///
/// A group's columns are in the order of the design's parameters, the model's first: its factor needs no new
/// decomposition for the model's part, and what is below it is reduced to the added columns.
fn push_group(
    builder: &mut FactorBuilder,
    group: &Group,
    model: usize,
    places: &[Option<usize>],
    added: &[usize],
    weight: f64,
) -> Result<(), RegressorError> {
    let factor = &group.factor;
    let own = group.parameters.partition_point(|&parameter| parameter < model);
    let width = builder.columns();
    let first_added = width - 1 - added.len();
    let right = factor.parameters();
    // (column here, column in the target)
    let tail: Vec<(usize, usize)> = group
        .parameters
        .iter()
        .enumerate()
        .skip(own)
        .filter_map(|(column, parameter)| {
            added.iter().position(|other| other == parameter).map(|place| (column, first_added + place))
        })
        .chain([(right, width - 1)])
        .collect();
    let mut row = vec![0.0; width];
    for index in 0..own {
        row.fill(0.0);
        for column in index..own {
            if let Some(place) = places[group.parameters[column]] {
                row[place] = factor.entry(index, column);
            }
        }
        tail.iter().for_each(|&(column, place)| row[place] = factor.entry(index, column));
        builder.push_scaled_row(&row, weight)?;
    }
    let mut rest = FactorBuilder::new(tail.len());
    let mut short = vec![0.0; tail.len()];
    let last = tail.iter().map(|&(column, _)| column).max().unwrap_or(right);
    for index in own..=last {
        short.iter_mut().zip(&tail).for_each(|(value, &(column, _))| {
            *value = if column >= index { factor.entry(index, column) } else { 0.0 }
        });
        rest.push_row(&short)?;
    }
    let targets: Vec<usize> = tail.iter().map(|&(_, place)| place).collect();
    builder.push_factor(&rest.factor(), &targets, weight)
}

/// Mean of paired differences over their standard error.
pub(super) fn paired_t(left: &[f64], right: &[f64]) -> f64 {
    let count = left.len() as f64;
    let differences: Vec<f64> = left.iter().zip(right).map(|(a, b)| a - b).collect();
    let mean = differences.iter().sum::<f64>() / count;
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
    if variance > 0.0 { mean / (variance / count).sqrt() } else { 0.0 }
}
