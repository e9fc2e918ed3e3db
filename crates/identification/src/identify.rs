//! The declared model, identified: constants chosen, parameters fitted, error held out.

use crate::accumulate::{FoldFactors, Rests, accumulate_folds};
use crate::fit::{Fit, TorqueError, fit_with_factors, merge, solve_determined, torque_error, undetermined};
use crate::logged_factors::{FIRST_ORDER, in_force};
use crate::own_torque::{OwnTorqueFit, fit_with_own_torque};
use crate::reference::ReferenceModel;
use crate::variants::{Choice, Rivals, choose};
use crate::{BlockSource, Design, Effect, Fold, IdentificationError};
use phiw_dynamics::Tree;
use phiw_dynamics::check::check_size;
use phiw_limits::Limits;
use phiw_regressor::least_squares::{Group, GroupedFactor};
use phiw_regressor::{BaseParameters, BaseParametersOptions, RegressorError};
use std::ops::Range;

/// The same effect with several values of its constants, one of which the data will choose; the first is the
/// simplest.
pub type Variants = Vec<Box<dyn Effect>>;

/// What a model is fitted to and validated on.
pub struct Data<'a> {
    /// Stretches of time to fit.
    pub train: Vec<Fold>,
    /// Stretches of time to validate on.
    pub held_out: Vec<Fold>,
    /// Where the samples come from.
    pub sources: Vec<&'a dyn BlockSource>,
    /// For each joint the speed below which it stands still \[rad/s, m/s\] (see
    /// [`Design::with_rest_speeds`]).
    pub rest_speeds: Vec<f64>,
}

/// A declared model and what the logs say of it.
pub struct Identified {
    /// The columns of the model.
    pub design: Design,
    /// Its parameters.
    pub fit: Fit,
    /// Error on the training folds.
    pub train: TorqueError,
    /// Error on the folds held out.
    pub held_out: TorqueError,
    /// Factors of the training folds.
    pub train_folds: Vec<GroupedFactor>,
    /// Factors of the folds held out.
    pub held_out_folds: Vec<GroupedFactor>,
}

/// Identifies a rigid body with effects from the training folds.
///
/// One pass over the logs: all variants of all effects go into the factors, and choosing among them is
/// choosing columns.
///
/// # Errors
/// A log cannot be read or does not fit the robot, or holds too little.
pub fn identify(
    tree: &Tree,
    effects: Vec<Variants>,
    data: &Data<'_>,
) -> Result<Identified, IdentificationError> {
    let (fitted, folds) = identify_rows(tree, effects, data, Rests::Dropped)?;
    fitted.identified(folds.moving)
}

/// [`identify`], and the rows at which joints rest.
///
/// # Errors
/// The same.
pub fn identify_with_rests(
    tree: &Tree,
    effects: Vec<Variants>,
    data: &Data<'_>,
) -> Result<(Identified, RowsAtRest), IdentificationError> {
    let (fitted, folds) = identify_rows(tree, effects, data, Rests::Kept)?;
    Ok((fitted.identified(folds.moving)?, RowsAtRest { folds: folds.at_rest }))
}

fn identify_rows(
    tree: &Tree,
    effects: Vec<Variants>,
    data: &Data<'_>,
    rests: Rests,
) -> Result<(Fitted, FoldFactors), IdentificationError> {
    let Data { train, held_out, sources, rest_speeds } = data;
    let all_folds = [train.as_slice(), held_out].concat();
    let mut declared = Declared::new(tree, effects, all_folds.len(), rest_speeds.clone())?;
    let needs_reference = declared.needs_reference();
    let mut folds = accumulate_folds(&declared.design, &all_folds, sources, rests)?;
    if needs_reference {
        // Columns that need the model's torque take the URDF's model in the first pass (zero without
        // inertials).
        for _ in 0..REFERENCE_PASSES {
            let reference =
                fitted_reference(&declared.design, &declared.slots, &folds.moving[..train.len()])?;
            declared.design = declared.design.with_reference(reference);
            folds = accumulate_folds(&declared.design, &all_folds, sources, rests)?;
        }
    }
    let (fitted, folds) = declared.fitted(folds, train.len(), f64::INFINITY)?;
    // The error is that of the model as it is used: with its own torque in the columns that need one.
    fitted.with_own_torque(folds, |design| accumulate_folds(design, &all_folds, sources, rests))
}

/// A rigid body with all variants of its declared effects: the columns of the first pass.
pub struct Declared {
    design: Design,
    /// The variants of each effect.
    slots: Vec<Range<usize>>,
}

impl Declared {
    /// Of a robot, over so many folds; `rest_speeds` as in [`Data`].
    ///
    /// # Errors
    /// It has too many columns.
    pub fn new(
        tree: &Tree,
        effects: Vec<Variants>,
        folds: usize,
        rest_speeds: Vec<f64>,
    ) -> Result<Self, IdentificationError> {
        let of_variants = effects.iter().flatten().map(|effect| effect.as_ref());
        crate::checks::check_size_of_robot(tree, of_variants, folds, &Limits::default())?;
        let base = BaseParameters::of_tree(tree, BaseParametersOptions::default())?;
        let mut slots = Vec::with_capacity(effects.len());
        let mut all = Vec::new();
        for variants in effects {
            slots.push(all.len()..all.len() + variants.len());
            all.extend(variants);
        }
        let design = Design::new(tree.clone(), base, all).with_rest_speeds(rest_speeds);
        crate::checks::check_size_of_factors(&design, folds, &Limits::default())?;
        Ok(Declared { design, slots })
    }

    /// The columns of all variants.
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// Whether columns need the model's own torque: then one pass over the rows is not enough.
    pub fn needs_reference(&self) -> bool {
        self.design.needs().of_reference()
    }

    /// The model that the factors of one pass tell, those of `train` folds first. What needs the model's own
    /// torque takes it as it is in these factors.
    ///
    /// # Errors
    /// The factors are of other columns, of too few rows, or lack those at rest.
    pub fn identified(
        self,
        folds: FoldFactors,
        train: usize,
    ) -> Result<(Identified, RowsAtRest), IdentificationError> {
        check_size("folds at rest", folds.at_rest.len(), folds.moving.len())?;
        check_size("training folds", train.min(folds.moving.len()), train)?;
        let (fitted, folds) = self.fitted(folds, train, FIRST_ORDER)?;
        Ok((fitted.identified(folds.moving)?, RowsAtRest { folds: folds.at_rest }))
    }

    /// The variants chosen and fitted, with factors of torques up to `largest_factor`, and the folds' factors
    /// with their columns alone.
    fn fitted(
        self,
        folds: FoldFactors,
        train: usize,
        largest_factor: f64,
    ) -> Result<(Fitted, FoldFactors), IdentificationError> {
        let Declared { design, slots } = self;
        let training = &folds.moving[..train];
        let Choice { chosen, rivals } = choose(&design, &slots, &merge(training)?)?;
        let with_rivals = Rivals::of(&design, &chosen, &rivals, training)?;
        let effects = chosen.iter().flat_map(|&effect| design.effect_parameters(effect));
        let kept: Vec<usize> = (0..design.base().count()).chain(effects).collect();
        let folds = folds.select(&kept)?;
        let design = design.keep(&chosen);
        let fit = fit_beside(&design, &folds.moving[..train], with_rivals.as_ref(), largest_factor)?;
        let design = design.with_own_reference(&fit.parameters)?;
        Ok((Fitted { design, fit, train, rivals: with_rivals }, folds))
    }
}

/// A fit whose deviations count what the choice among `rivals` leaves open; factors of torques up to
/// `largest_factor`.
fn fit_beside(
    design: &Design,
    folds: &[GroupedFactor],
    rivals: Option<&Rivals>,
    largest_factor: f64,
) -> Result<Fit, IdentificationError> {
    let mut fit = fit_with_factors(design, folds, largest_factor)?;
    if let Some(Rivals { folds, stands_for }) = rivals {
        crate::rivals::widen(&mut fit, folds, stands_for)?;
    }
    Ok(fit)
}

/// A model before its error is known.
struct Fitted {
    design: Design,
    fit: Fit,
    /// Number of folds that it was fitted to.
    train: usize,
    rivals: Option<Rivals>,
}

impl Fitted {
    /// Fitted to its own torque, where columns are made of it.
    ///
    /// Factors of logged torques are put in force first: taken to first order, a factor of two or more would
    /// be fitted to a torque that moves away from the model's with each fit.
    fn with_own_torque(
        self,
        folds: FoldFactors,
        read: impl Fn(&Design) -> Result<FoldFactors, IdentificationError>,
    ) -> Result<(Self, FoldFactors), IdentificationError> {
        let Fitted { design, fit, train, rivals } = self;
        let with_factors = |design: &Design, folds: &[GroupedFactor], largest: f64| {
            fit_beside(design, folds, rivals.as_ref(), largest)
        };
        let any = |design: &Design, folds: &[GroupedFactor]| with_factors(design, folds, f64::INFINITY);
        let again = |design: &Design, folds: &[GroupedFactor]| with_factors(design, folds, FIRST_ORDER);
        let (design, mut fit, folds) = in_force(design, fit, folds, train, &read, any)?;
        if !design.logged_factor_parameters().is_empty() {
            fit = again(&design, &folds.moving[..train])?;
        }
        let OwnTorqueFit { design, fit, folds } =
            fit_with_own_torque(design, fit, folds, train, read, again)?;
        Ok((Fitted { design, fit, train, rivals }, folds))
    }

    /// With its error on the folds, of which those that it was fitted to come first.
    fn identified(self, mut train_folds: Vec<GroupedFactor>) -> Result<Identified, IdentificationError> {
        let held_out_folds = train_folds.split_off(self.train);
        Ok(Identified {
            train: torque_error(&train_folds, &self.fit.parameters)?,
            held_out: torque_error(&held_out_folds, &self.fit.parameters)?,
            fit: self.fit,
            design: self.design,
            train_folds,
            held_out_folds,
        })
    }
}

/// The factors of the rows at which joints rest, fold by fold: those of training first. No fit takes them.
pub struct RowsAtRest {
    folds: Vec<GroupedFactor>,
}

impl RowsAtRest {
    /// What they add to a model that was identified from the other rows of these folds.
    ///
    /// # Errors
    /// The model is of another design.
    pub fn added_to(&self, identified: &Identified) -> Result<WithRests, IdentificationError> {
        let Identified { design, fit, train_folds, held_out_folds, .. } = identified;
        check_size("folds at rest", self.folds.len(), train_folds.len() + held_out_folds.len())?;
        let (train, held_out) = self.folds.split_at(train_folds.len());
        let relative = |moving: &[GroupedFactor], at_rest: &[GroupedFactor]| {
            relative_error(moving.iter().chain(at_rest), &fit.parameters)
        };
        let rows = |folds: &[GroupedFactor], torque: usize| -> u64 {
            folds.iter().map(|fold| fold.groups()[torque].factor.rows()).sum()
        };
        let share = |torque: usize| {
            let moving = rows(train_folds, torque) + rows(held_out_folds, torque);
            let at_rest = rows(&self.folds, torque);
            at_rest as f64 / (moving + at_rest).max(1) as f64
        };
        Ok(WithRests {
            train_relative: relative(train_folds, train)?,
            held_out_relative: relative(held_out_folds, held_out)?,
            share: (0..design.rows().len()).map(share).collect(),
        })
    }
}

/// What rows at which joints rest add: no fit takes them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WithRests {
    /// RMS of the error over RMS of the torque on the training folds, all torques and rows pooled, rests
    /// included.
    pub train_relative: f64,
    /// The same on the folds held out.
    pub held_out_relative: f64,
    /// For each torque the share of all rows in which its joint rests.
    pub share: Vec<f64>,
}

/// RMS of the error over RMS of the torque, all torques and rows pooled.
fn relative_error<'a>(
    folds: impl Iterator<Item = &'a GroupedFactor>,
    parameters: &[f64],
) -> Result<f64, RegressorError> {
    let (mut error, mut torque) = (0.0, 0.0);
    for fold in folds {
        error += fold.residual_sums_of_squares(parameters)?.iter().sum::<f64>();
        let of_group = |group: &Group| group.factor.right_hand_side_sum_of_squares();
        torque += fold.groups().iter().map(of_group).sum::<f64>();
    }
    Ok((error / torque).sqrt())
}

/// Passes over the logs that bring the model's torque into the columns that need it; a third changes nothing
/// that the logs can tell.
const REFERENCE_PASSES: usize = 2;

/// The model that the training folds tell with the columns as they are.
fn fitted_reference(
    design: &Design,
    slots: &[Range<usize>],
    train: &[GroupedFactor],
) -> Result<ReferenceModel, IdentificationError> {
    let factors = merge(train)?;
    let Choice { chosen, .. } = choose(design, slots, &factors)?;
    let columns: Vec<usize> = (0..design.base().count())
        .chain(chosen.iter().flat_map(|&effect| design.effect_parameters(effect)))
        .collect();
    let own = factors.select(&columns)?;
    let (determined, solution) = solve_determined(&own, &undetermined(&own)?)?;
    let mut parameters = vec![0.0; design.parameter_count()];
    determined
        .iter()
        .zip(&solution.parameters)
        .for_each(|(&place, value)| parameters[columns[place]] = *value);
    Ok(design.reference_of(&parameters, &chosen)?)
}
