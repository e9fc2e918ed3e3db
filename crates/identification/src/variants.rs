//! Which variant of each declared effect the factors choose, and which comes next to it.

use crate::Design;
use crate::fit::solve_determined;
use phiw_regressor::RegressorError;
use phiw_regressor::factor::{Factor, FactorBuilder};
use phiw_regressor::least_squares::{GroupedFactor, WeightedSolution};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::ops::Range;

/// Share of a torque's residual variance that a variant of a declared effect must save over a simpler one.
const WORTH_A_VARIANT: f64 = 0.1;
/// Torques that are merged on one processor; where there are more, several have work.
const TORQUES_AT_A_TIME: usize = 9;
/// Sweeps over the effects; more have never changed a choice.
const SWEEPS: usize = 2;

/// For each slot the variant with the smallest sum of the torques' log errors, found slot by slot.
///
/// The pooled error would let the torque that fits worst decide for all.
pub(crate) fn choose(
    design: &Design,
    slots: &[Range<usize>],
    factors: &GroupedFactor,
) -> Result<Choice, RegressorError> {
    let mut chosen: Vec<usize> = slots.iter().map(|slot| slot.start).collect();
    let mut rivals = vec![None; slots.len()];
    if slots.iter().all(|slot| slot.len() <= 1) {
        return Ok(Choice { chosen, rivals });
    }
    let undetermined = undetermined_with(design, &chosen, factors)?;
    // The columns of the slot that is being chosen are kept even where undetermined, so that all its variants
    // have equally many columns.
    let columns = |chosen: &[usize], open: Option<usize>| -> Vec<usize> {
        let base = (0..design.base().count()).filter(|parameter| !undetermined.contains(parameter));
        base.chain(chosen.iter().enumerate().flat_map(|(slot, &effect)| {
            let stays = open == Some(slot);
            let parameters = design.effect_parameters(effect);
            parameters.filter(|parameter| stays || !undetermined.contains(parameter)).collect::<Vec<_>>()
        }))
        .collect()
    };
    for _ in 0..SWEEPS {
        let before = chosen.clone();
        let (_, solution) = solve_determined(&factors.select(&columns(&chosen, None))?, &[])?;
        for (slot, variants) in slots.iter().enumerate() {
            if variants.len() <= 1 {
                continue;
            }
            let with = |variant: usize| {
                let mut trial = chosen.clone();
                trial[slot] = variant;
                Columns::new(columns(&trial, Some(slot)), design, variant)
            };
            let rest = Rest::new(design, factors, &solution, &with(chosen[slot]), variants.clone())?;
            let merits: Result<Vec<Merit>, RegressorError> =
                variants.clone().into_par_iter().map(|variant| rest.merit(factors, &with(variant))).collect();
            let merits = merits?;
            let any_possible = merits.iter().any(|merit| merit.is_possible);
            let merits: Vec<f64> = merits
                .into_iter()
                .map(|merit| if any_possible && !merit.is_possible { f64::INFINITY } else { merit.log_error })
                .collect();
            let best = merits.iter().copied().fold(f64::INFINITY, f64::min);
            let margin = 0.5 * rest.own_rows(factors) * WORTH_A_VARIANT;
            let simplest = merits.iter().position(|merit| *merit <= best + margin).unwrap_or_default();
            chosen[slot] = variants.start + simplest;
            rivals[slot] = rival(&merits, simplest).map(|rival| variants.start + rival);
        }
        if chosen == before {
            break;
        }
    }
    Ok(Choice { chosen, rivals })
}

/// The variant of each slot that was chosen, and the one beside it.
pub(crate) struct Choice {
    pub chosen: Vec<usize>,
    pub rivals: Vec<Option<usize>>,
}

/// The variant that stands for what the choice leaves open: the best, and where that is chosen the better of
/// its neighbours in the list.
fn rival(merits: &[f64], chosen: usize) -> Option<usize> {
    let best = (0..merits.len()).min_by(|&a, &b| merits[a].total_cmp(&merits[b]))?;
    if best != chosen {
        return Some(best);
    }
    let neighbours = [chosen.checked_sub(1), Some(chosen + 1).filter(|&next| next < merits.len())];
    neighbours.into_iter().flatten().min_by(|&a, &b| merits[a].total_cmp(&merits[b]))
}

/// The training folds with the columns of the chosen effects, and those of their rivals behind them.
pub(crate) struct Rivals {
    pub folds: Vec<GroupedFactor>,
    /// For each rival's column the parameter, of the design of the chosen effects, that it is another form
    /// of.
    pub stands_for: Vec<usize>,
}

impl Rivals {
    /// `None` where no effect has a rival.
    pub fn of(
        design: &Design,
        chosen: &[usize],
        rivals: &[Option<usize>],
        train: &[GroupedFactor],
    ) -> Result<Option<Self>, RegressorError> {
        let mut columns: Vec<usize> = (0..design.base().count()).collect();
        let (mut behind, mut stands_for) = (Vec::new(), Vec::new());
        for (&effect, rival) in chosen.iter().zip(rivals) {
            let own = design.effect_parameters(effect);
            if let Some(rival) = rival {
                // A wave with more harmonics has more columns than its rival, or fewer.
                let both = design.effect_parameters(*rival).zip(columns.len()..columns.len() + own.len());
                both.for_each(|(column, own)| {
                    behind.push(column);
                    stands_for.push(own);
                });
            }
            columns.extend(own);
        }
        if behind.is_empty() {
            return Ok(None);
        }
        columns.extend(behind);
        let folds = train.iter().map(|fold| fold.select(&columns)).collect::<Result<_, _>>()?;
        Ok(Some(Rivals { folds, stands_for }))
    }
}

/// Parameters that the rows do not determine with the `chosen` effects.
fn undetermined_with(
    design: &Design,
    chosen: &[usize],
    factors: &GroupedFactor,
) -> Result<Vec<usize>, RegressorError> {
    let all: Vec<usize> = (0..design.base().count())
        .chain(chosen.iter().flat_map(|&effect| design.effect_parameters(effect)))
        .collect();
    let undetermined = crate::fit::undetermined(&factors.select(&all)?)?;
    Ok(undetermined.into_iter().map(|place| all[place]).collect())
}

/// The columns of a fit, and which of them are those of the variant that is on trial.
struct Columns {
    kept: Vec<usize>,
    /// Places of the variant's columns in `kept`.
    variant: Range<usize>,
    /// What the parameters of these columns can be.
    bounds: Vec<(f64, f64)>,
}

impl Columns {
    fn new(kept: Vec<usize>, design: &Design, effect: usize) -> Self {
        let parameters = design.effect_parameters(effect);
        let first = kept.iter().position(|column| *column == parameters.start).unwrap_or(kept.len());
        let bounds = design.effects()[effect].parameters().iter().map(|parameter| parameter.bounds).collect();
        Columns { kept, variant: first..first + parameters.len(), bounds }
    }

    /// Whether the variant's parameters are what they can be: a stop at the other end of the range, that
    /// pulls, is no stop.
    fn are_possible(&self, solution: &[f64]) -> bool {
        let mut own = self.variant.clone().zip(&self.bounds);
        own.all(|(column, &(low, high))| (low..=high).contains(&solution[column]))
    }
}

/// What a variant is worth.
struct Merit {
    /// Σ rows·log(RMSE).
    log_error: f64,
    is_possible: bool,
}

/// The torques that no variant of a slot acts on, merged once for all of them.
struct Rest {
    /// Torques that a variant acts on.
    own: Vec<usize>,
    /// Over the columns of the others, the variant's left out.
    others: Factor,
    weights: Vec<f64>,
}

impl Rest {
    fn new(
        design: &Design,
        factors: &GroupedFactor,
        solution: &WeightedSolution,
        columns: &Columns,
        variants: Range<usize>,
    ) -> Result<Self, RegressorError> {
        let entries = variants.flat_map(|effect| design.effects()[effect].entries());
        let own: BTreeSet<usize> = entries.map(|entry| entry.row).collect();
        let weights: Vec<f64> = solution.group_std.iter().map(|std| 1.0 / std).collect();
        let Columns { kept, variant, .. } = columns;
        let shared: Vec<usize> = [&kept[..variant.start], &kept[variant.end..]].concat();
        let selected = factors.select(&shared)?;
        let rows: Vec<usize> = (0..selected.groups().len()).filter(|row| !own.contains(row)).collect();
        let factor = |rows: &[usize]| {
            let mut builder = FactorBuilder::new(shared.len() + 1);
            for &row in rows {
                let group = &selected.groups()[row];
                let mut columns = group.parameters.clone();
                columns.push(shared.len());
                builder.push_factor(&group.factor, &columns, weights[row])?;
            }
            Ok(builder.factor())
        };
        let parts: Result<Vec<Factor>, RegressorError> =
            rows.par_chunks(TORQUES_AT_A_TIME).map(factor).collect();
        let others = match parts?.as_slice() {
            [] => factor(&[])?,
            [one] => one.clone(),
            several => Factor::merge_all(several)?,
        };
        Ok(Rest { own: own.into_iter().collect(), others, weights })
    }

    /// Rows of the torques that the effect acts on.
    fn own_rows(&self, factors: &GroupedFactor) -> f64 {
        self.own.iter().map(|&row| factors.groups()[row].factor.rows() as f64).sum()
    }

    /// What the fit with these columns leaves.
    fn merit(&self, factors: &GroupedFactor, columns: &Columns) -> Result<Merit, RegressorError> {
        let Columns { kept, variant, .. } = columns;
        let mut builder = FactorBuilder::new(kept.len() + 1);
        let of_others: Vec<usize> = (0..variant.start).chain(variant.end..kept.len()).collect();
        let with_torque: Vec<usize> = of_others.iter().copied().chain([kept.len()]).collect();
        builder.push_factor(&self.others, &with_torque, 1.0)?;
        let mut renumbered = vec![None; factors.parameter_count()];
        kept.iter().enumerate().for_each(|(new, &old)| renumbered[old] = Some(new));
        let mut own = Vec::new();
        for &row in &self.own {
            let group = &factors.groups()[row];
            let columns: Vec<(usize, usize)> = (0..group.parameters.len())
                .filter_map(|column| renumbered[group.parameters[column]].map(|new| (column, new)))
                .collect();
            let named: Vec<usize> =
                columns.iter().map(|&(column, _)| column).chain([group.factor.parameters()]).collect();
            let mut targets: Vec<usize> = columns.iter().map(|&(_, new)| new).collect();
            let factor = group.factor.select(&named)?;
            own.push((factor.clone(), targets.clone()));
            targets.push(kept.len());
            builder.push_factor(&factor, &targets, self.weights[row])?;
        }
        let solution = solve(&builder.factor())?;
        let of_others: Vec<f64> = of_others.iter().map(|&column| solution[column]).collect();
        let others = self.others.residual_sum_of_squares(&of_others)?;
        let mut total = 0.5 * self.others.rows() as f64 * others.max(f64::MIN_POSITIVE).ln();
        for (factor, targets) in &own {
            let parameters: Vec<f64> = targets.iter().map(|&column| solution[column]).collect();
            let squares = factor.residual_sum_of_squares(&parameters)?;
            total += 0.5 * factor.rows() as f64 * squares.max(f64::MIN_POSITIVE).ln();
        }
        Ok(Merit { log_error: total, is_possible: columns.are_possible(&solution) })
    }
}

/// The parameters of a factor; those that the rows do not determine are zero.
fn solve(factor: &Factor) -> Result<Vec<f64>, RegressorError> {
    let undetermined = match factor.solve() {
        Ok(solution) => return Ok(solution.parameters),
        Err(RegressorError::RankDeficient { undetermined, .. }) => undetermined,
        Err(error) => return Err(error),
    };
    let all = 0..factor.parameters();
    let determined: Vec<usize> = all.filter(|column| !undetermined.contains(column)).collect();
    let named: Vec<usize> = determined.iter().copied().chain([factor.parameters()]).collect();
    let part = factor.select(&named)?.solve()?;
    let mut parameters = vec![0.0; factor.parameters()];
    determined.iter().zip(part.parameters).for_each(|(&column, value)| parameters[column] = value);
    Ok(parameters)
}
