//! Limits of drives whose command is logged, for a start of the search.
//!
//! A controller winds its command up to many times what the drive delivers. Such samples outweigh all others
//! in every fit, so that no limit looks right beside it. Where the command is beyond a limit, the motion
//! tells the limit alone, and the command could be anything up to its peak.

use super::probe::nameless_columns;
use super::search::Search;
use phiw_effects::EffectKind;
use phiw_identification::effect::{Needs, Sample};
use phiw_identification::fitting::{fit, merge};
use phiw_identification::{Effect, EffectSpec, IdentificationError};
use phiw_regressor::RegressorError;
use phiw_regressor::factor::Factor;
use std::collections::BTreeMap;

/// Limits that are tried first for each torque: each so many times smaller than the one before, from its peak
/// on.
const FIRST: Ladder = Ladder { count: 21, step: 1.25 };
/// Limits that are tried about the best of them.
const SECOND: Ladder = Ladder { count: 17, step: 1.03 };
/// Share of the rows beyond a limit, at most: a drive that mostly does something else than its command is
/// none.
const MOST_BEYOND: f64 = 0.5;
/// Share of a torque's residual that a limit leaves at most, with all that it costs: noise with tails gains
/// up to a fifth by one, and what takes less is found without a start.
const MOST_LEFT: f64 = 0.5;

struct Ladder {
    count: i32,
    step: f64,
}

impl Ladder {
    fn down_from(&self, highest: f64) -> Vec<f64> {
        (1..=self.count).map(|rung| highest / self.step.powi(rung)).collect()
    }

    fn about(&self, middle: f64) -> Vec<f64> {
        self.down_from(middle * self.step.powi((self.count + 1) / 2))
    }
}

impl<'a> Search<'a> {
    /// Adds limits of drives where they take away what is left of a torque, with the parameters of a fit to
    /// what is delivered. Whether there are any.
    pub(super) fn add_limits(&mut self) -> Result<bool, IdentificationError> {
        let kinds = self.kinds_of_limits();
        let peak = |torque: usize| self.input.ranges.joints[torque].torque_peak;
        let first = kinds.keys().map(|&torque| (torque, FIRST.down_from(peak(torque)))).collect();
        let coarse = self.limits(&first)?;
        let limits =
            self.limits(&coarse.into_iter().map(|(torque, at)| (torque, SECOND.about(at))).collect())?;
        if limits.is_empty() {
            return Ok(false);
        }
        self.parameters = self.fitted_to_what_is_delivered(&limits)?;
        for (torque, limit) in limits {
            let (kind, spec) = &kinds[&torque];
            if let Some(constants) = kind.with_torque_limit(limit) {
                self.add(EffectSpec { constants, ..spec.clone() })?;
                if let Some(share) = self.parameters.last_mut() {
                    *share = 1.0;
                }
            }
        }
        Ok(true)
    }

    /// For each torque that may have one the kind that is a limit, and its effect on it.
    fn kinds_of_limits(&self) -> BTreeMap<usize, (&'a dyn EffectKind, EffectSpec)> {
        let mut kinds = BTreeMap::new();
        for kind in self.fixed.catalogue.kinds() {
            let Some(constants) = kind.with_torque_limit(1.0) else { continue };
            for site in kind.sites(self.fixed.tree) {
                let effect = kind.build(self.fixed.tree, &site, &constants);
                let spec = effect.spec();
                let is_it = |other: &EffectSpec| other.kind == spec.kind && other.joints == spec.joints;
                let Some(torque) = effect.entries().first().map(|entry| entry.row) else { continue };
                let asked = self.options.torques.as_ref().is_none_or(|torques| torques.contains(&torque));
                let moves = self.input.ranges.joints.get(torque).is_some_and(|own| own.torque_peak > 0.0);
                if asked && moves && !self.specs.iter().chain(&self.options.excluded).any(is_it) {
                    kinds.insert(torque, (kind, spec));
                }
            }
        }
        kinds
    }

    /// Of the limits of each torque the likeliest, where it takes enough away.
    fn limits(&self, tried: &BTreeMap<usize, Vec<f64>>) -> Result<BTreeMap<usize, f64>, IdentificationError> {
        if tried.is_empty() {
            return Ok(BTreeMap::new());
        }
        let columns = tried.iter().map(|(&torque, limits)| {
            let own = limits.clone();
            let columns = move |sample: &Sample<'_>, out: &mut [f64]| {
                let (beyond, is_beyond) = out.split_at_mut(own.len());
                for ((beyond, is_beyond), limit) in beyond.iter_mut().zip(is_beyond).zip(&own) {
                    *beyond = beyond_limit(sample, torque, *limit);
                    *is_beyond = f64::from(u8::from(*beyond != 0.0));
                }
            };
            let needs = Needs::default();
            nameless_columns(self.fixed, torque, 2 * limits.len(), needs, Box::new(columns))
        });
        let reference = self.fixed.reference(&self.specs, &self.parameters)?;
        let (_, folds) = self.fixed.factors(&self.specs, columns.collect(), reference, &self.folds)?;
        let train = merge(&folds)?;
        let likeliest = |(&torque, limits): (&usize, &Vec<f64>)| {
            let factor = without_what_is_untold(&train.groups()[torque].factor, 2 * limits.len())?;
            let peak = self.input.ranges.joints[torque].torque_peak;
            let gains = limits.iter().zip(gains(&factor, limits, peak));
            let best = gains.min_by(|(_, one), (_, other)| one.total_cmp(other));
            Ok(best.filter(|(_, gain)| *gain < MOST_LEFT.ln()).map(|(limit, _)| (torque, *limit)))
        };
        tried.iter().filter_map(|own| likeliest(own).transpose()).collect()
    }

    /// The parameters of the model, fitted to torques that end at these limits.
    fn fitted_to_what_is_delivered(
        &self,
        limits: &BTreeMap<usize, f64>,
    ) -> Result<Vec<f64>, IdentificationError> {
        let columns = limits.iter().map(|(&torque, &limit)| -> Box<dyn Effect> {
            let column =
                move |sample: &Sample<'_>, out: &mut [f64]| out[0] = beyond_limit(sample, torque, limit);
            nameless_columns(self.fixed, torque, 1, Needs::default(), Box::new(column))
        });
        let reference = self.fixed.reference(&self.specs, &self.parameters)?;
        let (design, folds) = self.fixed.factors(&self.specs, columns.collect(), reference, &self.folds)?;
        let mut parameters = fit(&design, &folds)?.parameters;
        parameters.truncate(self.parameters.len());
        Ok(parameters)
    }
}

/// A factor without those columns of the model that its rows do not tell: what is left of a column that
/// depends on those before it is rounding, and may point along any of the `last` ones and the torque.
fn without_what_is_untold(factor: &Factor, last: usize) -> Result<Factor, RegressorError> {
    let undetermined = factor.undetermined_columns();
    let first = factor.parameters() - last;
    let is_told = |column: &usize| *column >= first || !undetermined.contains(column);
    factor.select(&(0..factor.columns()).filter(is_told).collect::<Vec<_>>())
}

/// The part of a torque beyond a limit \[N·m, N\].
fn beyond_limit(sample: &Sample<'_>, torque: usize, limit: f64) -> f64 {
    let logged = sample.tau().get(torque).copied().unwrap_or_default();
    logged.signum() * (logged.abs() - limit).max(0.0)
}

/// For each limit what −2·log likelihood gains for each row, over none: what is left of the torque up to it,
/// and for each row beyond it a command that may be anything up to the peak, in place of one that is told up
/// to what is left.
///
/// The last columns of `factor` are the parts beyond the limits, whether there is any, and the torque.
fn gains(factor: &Factor, limits: &[f64], peak: f64) -> Vec<f64> {
    let torque = factor.columns() - 1;
    let first = torque - 2 * limits.len();
    let rows = (factor.rows() as f64).max(1.0);
    let left = |beyond: Option<usize>| -> f64 {
        let of_row =
            |row: usize| factor.entry(row, torque) - beyond.map_or(0.0, |column| factor.entry(row, column));
        (first..=torque).map(|row| of_row(row).powi(2)).sum::<f64>().max(f64::MIN_POSITIVE)
    };
    let without = left(None);
    let gain = |(place, limit): (usize, &f64)| {
        let share = factor.column_norm(first + limits.len() + place).powi(2) / rows;
        if share == 0.0 || share > MOST_BEYOND {
            return 0.0;
        }
        let with = left(Some(first + place));
        let deviation = (with / rows).sqrt();
        (with / without).ln() + 2.0 * share * ((peak - limit) / deviation).max(1.0).ln()
    };
    limits.iter().enumerate().map(gain).collect()
}

#[cfg(test)]
mod tests {
    use super::{FIRST, MOST_LEFT, gains};
    use phiw_dynamics::random_tree::RandomNumbers;
    use phiw_regressor::factor::Factor;
    use proptest::prelude::*;

    /// The factor of a motion's column, the parts beyond limits, whether there are any, and the command.
    fn factor(motion: &[f64], command: &[f64], limits: &[f64]) -> Factor {
        let mut rows = Vec::new();
        for (motion, command) in motion.iter().zip(command) {
            let beyond: Vec<f64> =
                limits.iter().map(|limit| command.signum() * (command.abs() - limit).max(0.0)).collect();
            rows.push(*motion);
            rows.extend(&beyond);
            rows.extend(beyond.iter().map(|beyond| f64::from(u8::from(*beyond != 0.0))));
            rows.push(*command);
        }
        Factor::of_rows(2 + 2 * limits.len(), &rows).unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        /// Of a command that is anything beyond a limit the limit is the likeliest; of one that the motion
        /// asks for, or that is noise, none is.
        #[test]
        fn the_likeliest_limit_is_that_of_the_drive(
            seed in any::<u64>(),
            limit in 0.5..1.5f64,
            wound_up in 5.0..50.0f64,
            noise in 0.01..0.1f64,
            of_motion in 0.0..2.0f64,
        ) {
            let mut random = RandomNumbers::new(seed);
            // A motion under a drive with a limit: it asks for the limit a third of the time.
            let delivered: Vec<f64> =
                (0..600).map(|row| (1.15 * limit * (0.07 * f64::from(row)).sin()).clamp(-limit, limit)).collect();
            let motion: Vec<f64> = delivered.iter().map(|torque| 0.5 * torque).collect();
            let wind_up = |(row, delivered): (usize, &f64)| {
                let is_at_limit = delivered.abs() == limit && row % 90 < 60;
                let more = if is_at_limit { random.uniform(0.0, wound_up) } else { 0.0 };
                delivered + delivered.signum() * more + noise * random.uniform(-1.0, 1.0)
            };
            let command: Vec<f64> = delivered.iter().enumerate().map(wind_up).collect();
            let peak = command.iter().fold(0.0_f64, |peak, command| peak.max(command.abs()));
            let limits = FIRST.down_from(peak);
            let of_limits = gains(&factor(&motion, &command, &limits), &limits, peak);
            let best = (0..limits.len()).min_by(|&a, &b| of_limits[a].total_cmp(&of_limits[b])).unwrap();
            prop_assert!((limits[best] / limit).ln().abs() < 1.5 * FIRST.step.ln() && of_limits[best] < MOST_LEFT.ln(),
                "{} {limit} {of_limits:?}", limits[best]);

            let command: Vec<f64> = motion
                .iter()
                .map(|motion| of_motion * motion + random.uniform(-1.0, 1.0) * random.uniform(0.0, 1.0))
                .collect();
            let peak = command.iter().fold(0.0_f64, |peak, command| peak.max(command.abs()));
            let limits = FIRST.down_from(peak);
            let of_limits = gains(&factor(&motion, &command, &limits), &limits, peak);
            prop_assert!(of_limits.iter().all(|gain| *gain > 0.7 * MOST_LEFT.ln()), "{of_limits:?}");
        }
    }
}
