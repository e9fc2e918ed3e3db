//! The fit of a design to its training folds, and its error on those held out.

use crate::checks::InputError;
use crate::covariance::{Covariance, CovarianceSource};
use crate::drawn::drawn_to_nothing;
use crate::jackknife::Jackknife;
use crate::logged_factors::{FIRST_ORDER, LEAST_STEP};
use crate::{Design, IdentificationError};
use phiw_regressor::RegressorError;
use phiw_regressor::factor::Factor;
use phiw_regressor::least_squares::{GroupedFactor, WeightedSolution, weighted_least_squares};
use rayon::prelude::*;

/// A fitted design.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Value of each parameter; those that the logs do not determine are zero (see `undetermined`).
    pub parameters: Vec<f64>,
    /// Standard deviation of each parameter, from leaving out one fold after the other (correlated samples
    /// count as what they are); not a number where there are too few folds.
    pub standard_deviations: Vec<f64>,
    /// The 95 % interval of each parameter: Student's for the number of folds, about the value that it has
    /// with the effects' constants free; not numbers where there are too few folds.
    pub intervals_95: Vec<[f64; 2]>,
    /// Parameters that the logs do not determine: their columns depend on others.
    pub undetermined: Vec<usize>,
    /// Standard deviation of the residual of each torque on the training folds \[N·m, N\].
    pub residual_std: Vec<f64>,
    /// The same on folds that are left out, less what the parameters' uncertainty has in it \[N·m, N\]: what
    /// a prediction lacks on motion that the model was not fitted to. Where there are too few folds it is
    /// `residual_std`.
    pub left_out_std: Vec<f64>,
    /// Whether the logs tell parameters so poorly that all are drawn to nothing: a stretch left out was
    /// foretold worse than by no model at all. `factor` then has that prior.
    pub is_drawn: bool,
    /// The weighted factor of \[Φ f\] that gave the parameters, over `determined()` parameters.
    pub factor: Factor,
    /// Covariance of the `determined()` parameters; its diagonal holds the squares of
    /// `standard_deviations` where these are numbers.
    pub covariance: Covariance,
}

impl Fit {
    /// Of these parameters the one whose value is smallest against its standard deviation, if its 95 %
    /// interval holds nothing.
    fn least_certain(&self, parameters: &[usize]) -> Option<usize> {
        let holds_nothing = |&&parameter: &&usize| {
            let [low, high] = self.intervals_95[parameter];
            low <= 0.0 && high >= 0.0
        };
        let certainty =
            |parameter: &usize| (self.parameters[*parameter] / self.standard_deviations[*parameter]).abs();
        let uncertain = parameters.iter().filter(holds_nothing);
        uncertain.min_by(|a, b| certainty(a).total_cmp(&certainty(b))).copied()
    }

    /// Parameters that the logs determine, ascending.
    pub fn determined(&self) -> Vec<usize> {
        (0..self.parameters.len()).filter(|parameter| !self.undetermined.contains(parameter)).collect()
    }

    /// Takes covariance, standard deviations and intervals from the deviations of the solutions that leave
    /// out a fold each. `shift` is by how much these solutions are about other values than the fit's: the
    /// standard deviations count it, the intervals are about those values.
    pub(crate) fn take_deviations(
        &mut self,
        determined: &[usize],
        deviations: &[Vec<f64>],
        shift: Option<&[f64]>,
    ) {
        let about = Covariance::of_left_out_folds(determined, deviations, None);
        self.covariance = Covariance::of_left_out_folds(determined, deviations, shift);
        for (place, &parameter) in determined.iter().enumerate() {
            self.standard_deviations[parameter] = self.covariance.standard_deviation(place);
            let middle = self.parameters[parameter] + shift.map_or(0.0, |shift| shift[place]);
            let half = about.quantile_95() * about.standard_deviation(place);
            self.intervals_95[parameter] = [middle - half, middle + half];
        }
    }
}

/// Error of a model on some folds, by torque.
#[derive(Clone, Debug, PartialEq)]
pub struct TorqueError {
    /// RMSE of each torque \[N·m, N\].
    pub rmse: Vec<f64>,
    /// RMS of each measured torque \[N·m, N\].
    pub rms_torque: Vec<f64>,
    /// RMS of the error over RMS of the torque, all joints and samples pooled.
    pub relative: f64,
    /// Rows of each torque.
    pub rows: u64,
}

impl TorqueError {
    /// `relative` where the error of a torque that is below `share` of it counts as that share: what is as
    /// good as none can neither grow nor shrink.
    #[must_use]
    pub fn relative_from(&self, share: f64) -> f64 {
        let squares = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
        let counted = self.rmse.iter().zip(&self.rms_torque).map(|(rmse, torque)| rmse.max(share * torque));
        (squares(&counted.collect::<Vec<f64>>()) / squares(&self.rms_torque)).sqrt()
    }

    /// Mean over the torques of the logarithm of error over torque, counted as in [`Self::relative_from`]: in
    /// it a joint of small torques counts as much as one of large ones.
    #[must_use]
    pub fn mean_logarithm_from(&self, share: f64) -> f64 {
        let torques = self.rmse.iter().zip(&self.rms_torque).filter(|(_, torque)| **torque > 0.0);
        let logarithms: Vec<f64> = torques.map(|(rmse, torque)| (rmse / torque).max(share).ln()).collect();
        logarithms.iter().sum::<f64>() / logarithms.len().max(1) as f64
    }

    /// Where the error of all torques together is larger than they are, those torques whose error is larger
    /// than themselves: no model at all would be a better one.
    pub fn torques_worse_than_none(&self) -> impl Iterator<Item = usize> {
        let is_worse = |&torque: &usize| self.relative > 1.0 && self.rmse[torque] > self.rms_torque[torque];
        (0..self.rmse.len()).filter(is_worse)
    }
}

/// Fits a design to the rows of all `folds`, each torque weighted by its own residual. Factors of logged
/// torques that the rows do not tell are left out, as parameters that are undetermined.
///
/// # Errors
/// There are fewer rows than parameters.
pub fn fit(design: &Design, folds: &[GroupedFactor]) -> Result<Fit, IdentificationError> {
    fit_with_factors(design, folds, FIRST_ORDER)
}

/// The same where what is fitted of factors of torques is kept up to `largest`.
///
/// A factor is fitted to first order, about one or about what is in force: where the logs do not tell whether
/// it is another, what they make of it is a large number that foretells nothing. Such factors leave the fit,
/// the largest or the least certain first.
pub(crate) fn fit_with_factors(
    design: &Design,
    folds: &[GroupedFactor],
    largest: f64,
) -> Result<Fit, IdentificationError> {
    let factors = design.logged_factor_parameters();
    let mut untold = Vec::new();
    loop {
        let fit = fit_without(design, folds, &untold)?;
        let value = |factor: &usize| fit.parameters[*factor].abs();
        let too_large = factors.iter().copied().filter(|factor| value(factor) > largest);
        let too_large = too_large.max_by(|a, b| value(a).total_cmp(&value(b)));
        let is_open = |factor: &usize| design.factor_in_force(*factor) == 1.0 || value(factor) > LEAST_STEP;
        let open: Vec<usize> = factors.iter().copied().filter(is_open).collect();
        match too_large.or_else(|| fit.least_certain(&open)) {
            Some(parameter) => untold.push(parameter),
            None => return Ok(fit),
        }
    }
}

/// The fit with `untold` parameters left out.
fn fit_without(
    design: &Design,
    folds: &[GroupedFactor],
    untold: &[usize],
) -> Result<Fit, IdentificationError> {
    let all = merge(folds)?;
    check_length(design, &all)?;
    // Columns that are equal in theory differ by the logs' rounding; the difference must not determine
    // parameters.
    let undetermined = [undetermined(&all)?.as_slice(), untold].concat();
    let (determined, solution) = solve_determined(&all, &undetermined)?;
    let undetermined: Vec<usize> =
        (0..design.parameter_count()).filter(|parameter| !determined.contains(parameter)).collect();
    let own: Vec<GroupedFactor> =
        folds.par_iter().map(|fold| fold.select(&determined)).collect::<Result<_, _>>()?;
    let weights = weights_of(&solution);
    let jackknife = Jackknife::of(&own, &weights)?;
    let base = determined.partition_point(|&parameter| parameter < design.base().count());
    let drawn = drawn_to_nothing(&own, base, &weights, jackknife.as_ref())?;
    let is_drawn = drawn.is_some();
    let (solution, factor, jackknife) = match drawn {
        None => (solution, merge(&own)?.combine(&weights)?, jackknife),
        Some(drawn) => {
            let all = merge(&drawn)?;
            let solution = weighted_least_squares(&all)?;
            let weights = weights_of(&solution);
            (solution, all.combine(&weights)?, Jackknife::of(&drawn, &weights)?)
        }
    };
    let unit = factor.unit_covariance()?;
    let least_squares = |row: usize, column: usize| unit[(row, column)];
    let mut parameters = vec![0.0; design.parameter_count()];
    determined
        .iter()
        .zip(&solution.parameters)
        .for_each(|(&parameter, value)| parameters[parameter] = *value);
    let mut fit = Fit {
        standard_deviations: vec![f64::NAN; parameters.len()],
        intervals_95: vec![[f64::NAN; 2]; parameters.len()],
        parameters,
        undetermined,
        left_out_std: match &jackknife {
            Some(jackknife) => jackknife.left_out_std(&own)?,
            None => solution.group_std.clone(),
        },
        residual_std: solution.group_std,
        is_drawn,
        factor,
        covariance: Covariance::of_entries(CovarianceSource::LeastSquares, &determined, least_squares),
    };
    if let Some(jackknife) = jackknife {
        fit.take_deviations(&determined, &jackknife.deviations(), None);
    }
    Ok(fit)
}

fn weights_of(solution: &WeightedSolution) -> Vec<f64> {
    solution.group_std.iter().map(|std| 1.0 / std).collect()
}

/// The rows of all folds.
///
/// # Errors
/// The folds are of different designs, or there are none.
pub fn merge(folds: &[GroupedFactor]) -> Result<GroupedFactor, RegressorError> {
    let Some((first, rest)) = folds.split_first() else { return GroupedFactor::new(0, Vec::new()) };
    rest.iter().try_fold(first.clone(), |merged, fold| merged.merge(fold))
}

/// Error of `parameters` on the rows of `folds`.
///
/// # Errors
/// `parameters` has the wrong length.
pub fn torque_error(folds: &[GroupedFactor], parameters: &[f64]) -> Result<TorqueError, RegressorError> {
    let all = merge(folds)?;
    let squares = all.residual_sums_of_squares(parameters)?;
    let torques: Vec<f64> =
        all.groups().iter().map(|group| group.factor.right_hand_side_sum_of_squares()).collect();
    let rms = |squares: &[f64]| -> Vec<f64> {
        squares
            .iter()
            .zip(all.groups())
            .map(|(sum, group)| (sum / group.factor.rows().max(1) as f64).sqrt())
            .collect()
    };
    let relative = (squares.iter().sum::<f64>() / torques.iter().sum::<f64>()).sqrt();
    let rows = all.groups().first().map_or(0, |group| group.factor.rows());
    Ok(TorqueError { rmse: rms(&squares), rms_torque: rms(&torques), relative, rows })
}

/// Rows of a torque from which on its error counts as measured; fewer come from a joint that only twitches.
const LEAST_ROWS: u64 = 8;

/// For each torque whether `folds` hold enough motion of its joint to say anything of its error.
///
/// # Errors
/// The folds are of different designs.
pub fn torques_with_enough_rows(folds: &[GroupedFactor]) -> Result<Vec<bool>, RegressorError> {
    let all = merge(folds)?;
    Ok(all.groups().iter().map(|group| group.factor.rows() >= LEAST_ROWS).collect())
}

fn check_length(design: &Design, all: &GroupedFactor) -> Result<(), IdentificationError> {
    let rows = all.rows();
    let parameters = design.parameter_count();
    if rows >= 2 * parameters as u64 {
        return Ok(());
    }
    // Rows come at some tens of Hz for each torque.
    let seconds_missing = (2 * parameters as u64 - rows) as f64 / (20.0 * all.groups().len().max(1) as f64);
    Err(InputError::TooShort { rows, parameters, seconds_missing }.into())
}

pub(crate) fn undetermined(all: &GroupedFactor) -> Result<Vec<usize>, RegressorError> {
    let weights: Vec<f64> = all
        .groups()
        .iter()
        .map(|group| {
            let square = group.factor.right_hand_side_sum_of_squares() / group.factor.rows().max(1) as f64;
            if square > 0.0 { 1.0 / square.sqrt() } else { 1.0 }
        })
        .collect();
    Ok(all.combine(&weights)?.undetermined_columns())
}

/// A weighted fit of what the rows determine, and the columns that it has: all but those that are known to be
/// `undetermined`, and those that are once each torque has its weight. What a torque of large noise alone
/// tells is not told beside one of small noise.
pub(crate) fn solve_determined(
    all: &GroupedFactor,
    undetermined: &[usize],
) -> Result<(Vec<usize>, WeightedSolution), RegressorError> {
    let mut determined: Vec<usize> =
        (0..all.parameter_count()).filter(|parameter| !undetermined.contains(parameter)).collect();
    loop {
        match weighted_least_squares(&all.select(&determined)?) {
            Err(RegressorError::RankDeficient { undetermined, .. }) if !undetermined.is_empty() => {
                let mut place = 0..;
                determined.retain(|_| place.next().is_none_or(|place| !undetermined.contains(&place)));
            }
            other => return Ok((determined, other?)),
        }
    }
}

/// The solutions that leave out one fold each; `None` where there are too few folds.
pub(crate) fn left_out(
    folds: &[GroupedFactor],
    determined: &[usize],
    weights: &[f64],
) -> Result<Option<Vec<Vec<f64>>>, RegressorError> {
    let selected: Vec<GroupedFactor> =
        folds.par_iter().map(|fold| fold.select(determined)).collect::<Result<_, _>>()?;
    Ok(Jackknife::of(&selected, weights)?.map(Jackknife::into_solutions))
}
