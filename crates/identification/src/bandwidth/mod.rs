//! What the cut-off of the parallel filter does to the parameters: fits at several cut-offs, compared by
//! their leave-fold-out errors in one band.
//!
//! In its own band a low cut-off always looks good, since it leaves out of the error what the model cannot
//! follow. So every fit is judged by the rows of one cut-off, the reference: the one that the logs are
//! conditioned with, in whose band the report's errors are.
//!
//! The comparison says what to expect of another cut-off; it does not set one. Least squares are best in the
//! band that they are fitted in, so another cut-off can only win there by its smaller scatter, which it does
//! on none of six real robots (docs/results/bandwidth.md).

mod choice;
mod stretches;

pub use choice::{Comparison, better, compare};

use crate::accumulate::accumulate;
use crate::fit::{left_out, merge, undetermined};
use crate::model::parameter_name;
use crate::{BlockSource, Design, Fold, IdentificationError, LogSet, Progress, Variants};
use phiw_dynamics::Tree;
use phiw_regressor::least_squares::{GroupedFactor, weighted_least_squares};
use phiw_regressor::{BaseParameters, BaseParametersOptions, RegressorError, fewest_base_parameters};
use phiw_telemetry::Survey;
use stretches::Stretches;

/// How cut-offs are compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BandwidthSettings {
    /// A cut-off over the next lower one.
    pub ratio: f64,
    /// Cut-offs below the reference.
    pub below: usize,
    /// Cut-offs above the reference, as far as they are below the positions' cut-off.
    pub above: usize,
    /// Training motion that is used, the beginning of each fold, in seconds.
    pub seconds: f64,
    /// Samples that are used; they are held in memory.
    pub samples: usize,
    /// Parameters of a fit; a larger one is not compared, since a comparison takes the cube of their number.
    /// A robot of 18 joints with friction has 168, one of 30 about 300.
    pub parameters: usize,
    /// Standard errors, over the folds, by which another cut-off must be better than the reference. None is
    /// by two on any of the six real robots of docs/results/bandwidth.md, nor by 2.5 on 90 right models of
    /// `cargo xtask undeclared --suite control,wide_right --seeds dev`.
    pub standard_errors: f64,
    /// Share of the reference's error variance that another cut-off must save.
    pub saving: f64,
    /// Standard deviations that a parameter must move by, from the reference to the next lower or higher
    /// cut-off, for the answer to depend on the cut-off. Of those 90 right models, the 82 whose drives do
    /// not filter the torque that they log move by one in the median and by 4.5 in all but two; three of the
    /// four of situation `drive_filter` move by more than five.
    pub deviations: f64,
}

impl Default for BandwidthSettings {
    fn default() -> Self {
        BandwidthSettings {
            ratio: 2.0,
            below: 3,
            above: 2,
            seconds: 60.0,
            samples: 60_000,
            parameters: 300,
            standard_errors: 3.0,
            saving: 0.02,
            deviations: 5.0,
        }
    }
}

/// What the training logs say of the parallel filter's cut-off.
#[derive(Clone, Debug, PartialEq)]
pub struct Bandwidth {
    /// Cut-off of the rows that all fits are judged by, in Hz.
    pub reference_hz: f64,
    /// Cut-off whose fit is better than the reference's in the reference's band, by more than the folds'
    /// scatter explains, in Hz.
    pub better_hz: Option<f64>,
    /// The cut-offs that give a fit, ascending; the reference is one of them.
    pub rungs: Vec<Rung>,
    /// Parameters that depend on the cut-off, those that move most first (see
    /// [`BandwidthSettings::deviations`]).
    pub moved: Vec<MovedParameter>,
}

/// One cut-off.
#[derive(Clone, Debug, PartialEq)]
pub struct Rung {
    /// The cut-off, in Hz.
    pub cutoff_hz: f64,
    /// Error in the reference's band on folds left out: RMS of the error over RMS of the torque, all joints
    /// pooled.
    pub relative: f64,
    /// How it compares with the reference.
    pub comparison: Comparison,
}

/// A parameter that depends on the cut-off.
#[derive(Clone, Debug, PartialEq)]
pub struct MovedParameter {
    /// `joint_1.Izz` of the rigid body, `joint_1.fv` of an effect.
    pub name: String,
    /// Cut-off of the neighbour, in Hz.
    pub cutoff_hz: f64,
    /// How far it moves, in its standard deviations.
    pub deviations: f64,
}

/// Compares cut-offs by what the training logs say of a rigid body with `effects`; `None` where they hold too
/// little for it, or it has more parameters than the settings allow.
///
/// One pass over the training logs. Effects whose columns need the model's own torque are left out.
///
/// # Errors
/// A log cannot be read or does not fit the robot.
pub fn bandwidth(
    tree: &Tree,
    effects: Vec<Variants>,
    logs: &LogSet,
    settings: &BandwidthSettings,
    progress: Progress<'_>,
) -> Result<Option<Bandwidth>, IdentificationError> {
    let Some(contest) = Contest::new(tree, effects, logs, settings)? else { return Ok(None) };
    let stretches = contest.stretches(logs.training(), logs, progress)?;
    contest.judged(|rung| contest.factors_of(&stretches, rung))
}

/// Cut-offs that are compared, and the columns and the motion that they are compared on.
pub struct Contest {
    design: Design,
    /// The cut-offs, ascending, in Hz.
    cutoffs: Vec<f64>,
    reference_hz: f64,
    /// The beginning of each training fold.
    folds: Vec<Fold>,
    settings: BandwidthSettings,
}

impl Contest {
    /// Of a rigid body with `effects` on the training logs; `None` where it has more parameters than the
    /// settings allow.
    ///
    /// # Errors
    /// The base parameters cannot be found.
    pub fn new(
        tree: &Tree,
        effects: Vec<Variants>,
        logs: &LogSet,
        settings: &BandwidthSettings,
    ) -> Result<Option<Self>, IdentificationError> {
        let reference_hz = logs.conditioning().parallel_cutoff_hz;
        let highest = logs.conditioning().cutoff_hz;
        let rungs = -(settings.below as i32)..=settings.above as i32;
        let cutoffs: Vec<f64> = rungs
            .map(|rung| reference_hz * settings.ratio.powi(rung))
            .filter(|&cutoff_hz| cutoff_hz <= highest || cutoff_hz <= reference_hz)
            .collect();
        let Some(design) = design(tree, effects, logs, settings)? else { return Ok(None) };
        let rates: Vec<f64> = logs.training().iter().map(|survey| survey.rate_hz()).collect();
        let folds = beginnings(&logs.training_folds(), &rates, settings);
        Ok(Some(Contest { design, cutoffs, reference_hz, folds, settings: *settings }))
    }

    /// The columns.
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// The stretches of time, in the order of the logs.
    pub fn folds(&self) -> &[Fold] {
        &self.folds
    }

    /// Number of cut-offs.
    pub fn rungs(&self) -> usize {
        self.cutoffs.len()
    }

    /// What some training logs bring: for each cut-off the factors of their stretches of time, in order.
    ///
    /// # Errors
    /// A log cannot be read or does not fit the robot.
    pub fn factors(
        &self,
        surveys: &[Survey],
        logs: &LogSet,
        progress: Progress<'_>,
    ) -> Result<Vec<Vec<GroupedFactor>>, IdentificationError> {
        let stretches = self.stretches(surveys, logs, progress)?;
        (0..self.rungs()).map(|rung| self.factors_of(&stretches, rung)).collect()
    }

    fn stretches(
        &self,
        surveys: &[Survey],
        logs: &LogSet,
        progress: Progress<'_>,
    ) -> Result<Stretches, IdentificationError> {
        let of_logs = |fold: &&Fold| surveys.iter().any(|survey| survey.session.log == fold.log);
        let folds = self.folds.iter().filter(of_logs).copied().collect();
        Stretches::read(folds, surveys, logs, self.cutoffs[0], progress)
    }

    fn factors_of(
        &self,
        stretches: &Stretches,
        rung: usize,
    ) -> Result<Vec<GroupedFactor>, IdentificationError> {
        let sources = stretches.at(self.cutoffs[rung]);
        let sources: Vec<&dyn BlockSource> =
            sources.iter().map(|source| source as &dyn BlockSource).collect();
        accumulate(&self.design, stretches.folds(), &sources)
    }

    /// Compares the cut-offs, whose factors of all stretches of time `factors` gives; `None` where they hold
    /// too little.
    ///
    /// # Errors
    /// Those of `factors`, or they are of other columns.
    pub fn judged(
        &self,
        factors: impl Fn(usize) -> Result<Vec<GroupedFactor>, IdentificationError>,
    ) -> Result<Option<Bandwidth>, IdentificationError> {
        let Contest { design, cutoffs, reference_hz, settings, .. } = self;
        let Some(place) = cutoffs.iter().position(|cutoff_hz| cutoff_hz == reference_hz) else {
            return Ok(None);
        };
        let reference = factors(place)?;
        let all = merge(&reference)?;
        let undetermined = undetermined(&all)?;
        let determined: Vec<usize> =
            (0..design.parameter_count()).filter(|parameter| !undetermined.contains(parameter)).collect();
        let mut fits = Vec::with_capacity(cutoffs.len());
        for (rung, &cutoff_hz) in cutoffs.iter().enumerate() {
            let own;
            let folds = if rung == place {
                &reference
            } else {
                own = factors(rung)?;
                &own
            };
            fits.extend(RungFit::new(cutoff_hz, folds, &determined)?);
        }
        judged(design, &reference, &determined, fits, *reference_hz, settings)
    }
}

/// The rigid body with the first variant of each effect; `None` where it has too many parameters.
fn design(
    tree: &Tree,
    effects: Vec<Variants>,
    logs: &LogSet,
    settings: &BandwidthSettings,
) -> Result<Option<Design>, IdentificationError> {
    let first = effects.into_iter().filter_map(|variants| variants.into_iter().next());
    let effects: Vec<_> = first.filter(|effect| !effect.needs().of_reference()).collect();
    // The search for base parameters takes long where there are many joints.
    let of_effects: usize = effects.iter().map(|effect| effect.parameters().len()).sum();
    if fewest_base_parameters(tree).iter().sum::<usize>() + of_effects > settings.parameters {
        return Ok(None);
    }
    let base = BaseParameters::of_tree(tree, BaseParametersOptions::default())?;
    let design = Design::new(tree.clone(), base, effects).with_rest_speeds(logs.rest_speeds());
    Ok((design.parameter_count() <= settings.parameters).then_some(design))
}

/// The fit at one cut-off.
struct RungFit {
    cutoff_hz: f64,
    parameters: Vec<f64>,
    /// The parameters without each fold.
    left_out: Vec<Vec<f64>>,
}

impl RungFit {
    /// `None` where the rows are too few.
    fn new(
        cutoff_hz: f64,
        folds: &[GroupedFactor],
        determined: &[usize],
    ) -> Result<Option<Self>, RegressorError> {
        let all = merge(folds)?;
        if all.rows() < 2 * determined.len() as u64 {
            return Ok(None);
        }
        // What the other cut-offs leave of a parameter may be next to nothing at this one.
        let vanished = undetermined(&all.select(determined)?)?;
        let kept: Vec<usize> = (0..determined.len()).filter(|column| !vanished.contains(column)).collect();
        let own: Vec<usize> = kept.iter().map(|&column| determined[column]).collect();
        let solution = match weighted_least_squares(&all.select(&own)?) {
            Err(RegressorError::RankDeficient { .. }) => return Ok(None),
            other => other?,
        };
        let weights: Vec<f64> = solution.group_std.iter().map(|std| 1.0 / std).collect();
        let spread = |values: &[f64]| {
            let mut all = vec![0.0; determined.len()];
            kept.iter().zip(values).for_each(|(&column, value)| all[column] = *value);
            all
        };
        Ok(left_out(folds, &own, &weights)?.map(|left_out| RungFit {
            cutoff_hz,
            parameters: spread(&solution.parameters),
            left_out: left_out.iter().map(|fit| spread(fit)).collect(),
        }))
    }

    /// Standard deviation of a parameter (delete-one-fold jackknife).
    fn standard_deviation(&self, parameter: usize) -> f64 {
        let count = self.left_out.len() as f64;
        let mean = self.left_out.iter().map(|fit| fit[parameter]).sum::<f64>() / count;
        let square: f64 = self.left_out.iter().map(|fit| (fit[parameter] - mean).powi(2)).sum();
        (square * (count - 1.0) / count).sqrt()
    }
}

/// The fits by the rows of the reference.
fn judged(
    design: &Design,
    reference: &[GroupedFactor],
    determined: &[usize],
    fits: Vec<RungFit>,
    reference_hz: f64,
    settings: &BandwidthSettings,
) -> Result<Option<Bandwidth>, IdentificationError> {
    let Some(place) = fits.iter().position(|fit| fit.cutoff_hz == reference_hz) else { return Ok(None) };
    // Sums of squares: rung, fold, joint.
    let mut squares = Vec::with_capacity(fits.len());
    for fit in &fits {
        let of_fold = |(fold, left_out): (&GroupedFactor, &Vec<f64>)| {
            fold.select(determined)?.residual_sums_of_squares(left_out)
        };
        let folds: Result<Vec<Vec<f64>>, RegressorError> =
            reference.iter().zip(&fit.left_out).map(of_fold).collect();
        squares.push(folds?);
    }
    let torque: f64 = reference
        .iter()
        .flat_map(|fold| fold.groups())
        .map(|group| group.factor.right_hand_side_sum_of_squares())
        .sum();
    let comparisons = compare(&squares, place);
    let better = better(&comparisons, settings);
    let rung = |((fit, squares), comparison): ((&RungFit, &Vec<Vec<f64>>), Comparison)| Rung {
        cutoff_hz: fit.cutoff_hz,
        relative: (squares.iter().flatten().sum::<f64>() / torque).sqrt(),
        comparison,
    };
    Ok(Some(Bandwidth {
        reference_hz,
        better_hz: better.map(|rung| fits[rung].cutoff_hz),
        moved: moved(design, determined, &fits, place, settings.deviations),
        rungs: fits.iter().zip(&squares).zip(comparisons).map(rung).collect(),
    }))
}

/// Parameters that move by more than `least` standard deviations from the fit `place` to a neighbour.
fn moved(
    design: &Design,
    determined: &[usize],
    fits: &[RungFit],
    place: usize,
    least: f64,
) -> Vec<MovedParameter> {
    let (own, effects) = (&fits[place], design.effect_parameter_info());
    let name = |parameter: usize| match design.base().independent().get(parameter) {
        Some(&leading) => parameter_name(design.tree(), leading),
        None => {
            let info = &effects[parameter - design.base().count()];
            format!("{}.{}", info.joint, info.name)
        }
    };
    let neighbours = [place.checked_sub(1), Some(place + 1)].into_iter().flatten();
    let neighbours: Vec<&RungFit> = neighbours.filter_map(|rung| fits.get(rung)).collect();
    let furthest = |(column, &parameter): (usize, &usize)| {
        let std = own.standard_deviation(column);
        let moves = |other: &&RungFit| (other.parameters[column] - own.parameters[column]).abs() / std;
        let other = neighbours.iter().max_by(|a, b| moves(a).total_cmp(&moves(b)))?;
        let deviations = moves(other);
        (deviations > least).then(|| MovedParameter {
            name: name(parameter),
            cutoff_hz: other.cutoff_hz,
            deviations,
        })
    };
    let mut moved: Vec<MovedParameter> = determined.iter().enumerate().filter_map(furthest).collect();
    moved.sort_by(|a, b| b.deviations.total_cmp(&a.deviations));
    moved
}

/// The beginning of each fold, so long that all together are within the settings' limits.
fn beginnings(folds: &[Fold], rates: &[f64], settings: &BandwidthSettings) -> Vec<Fold> {
    let seconds: f64 = folds.iter().map(|fold| fold.end - fold.start).sum();
    let samples: f64 = folds.iter().map(|fold| (fold.end - fold.start) * rates[fold.log]).sum();
    let share = (settings.seconds / seconds).min(settings.samples as f64 / samples).min(1.0);
    let beginning = |fold: &Fold| match share < 1.0 {
        true => Fold { end: fold.start + share * (fold.end - fold.start), ..*fold },
        false => *fold,
    };
    folds.iter().map(beginning).collect()
}
