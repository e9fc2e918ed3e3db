//! Columns that a period's own noise has not touched.
//!
//! Noise in a torque moves the robot within the period, and so is in the mean speed and the mean acceleration
//! of that period. Where a column is linear in both (rigid body, viscous friction, rotor inertia) the
//! log-determinant of the likelihood accounts for it exactly, and where it is a function of one joint's
//! velocity (dry friction) nearly so ([`super::turning`]). Any other column is taken of what was known when
//! the period began: then its product with the noise is nothing on average, whatever its form.

use super::turning::{Believed, TurningColumns};
use crate::{EstimationError, MotionLog};
use phiw_identification::{Design, Effect};
use phiw_regressor::factor::FactorBuilder;
use phiw_regressor::least_squares::{Group, GroupedFactor};

/// For each parameter, whether its columns are taken of the beginning of a period: those of effects, unless
/// they are linear in the motion. (A torque of the position alone is taken so as well: what half a period of
/// noise adds to a position is little, but a ripple is steep.)
///
/// What looks ahead can not be foreseen: a delay's rate of change has the noise of the next period in it,
/// whenever it is taken.
pub(super) fn foreseen(design: &Design) -> Vec<bool> {
    of_parameters(design, |effect, parameter| effect.is_causal() && !effect.is_linear_in_motion(parameter))
}

/// For each parameter, whether its columns of a row change with what comes after the row.
pub(super) fn looking_ahead(design: &Design) -> Vec<bool> {
    of_parameters(design, |effect, _| !effect.is_causal())
}

/// What is asked of each effect and each of its parameters; no for the rigid body's parameters, which come
/// first.
fn of_parameters(design: &Design, asked: impl Fn(&dyn Effect, usize) -> bool) -> Vec<bool> {
    let mut answers = vec![false; design.base().count()];
    for (index, effect) in design.effects().iter().enumerate() {
        let parameters = 0..design.effect_parameters(index).len();
        answers.extend(parameters.map(|parameter| asked(effect.as_ref(), parameter)));
    }
    answers
}

/// Rows of a log over its periods, columns of foreseen parameters taken of the periods' beginnings or, where
/// they turn with the velocity, of their means, `[row × evaluation width]`, one after the other to `take`.
///
/// # Errors
/// The log is not of this robot; what `take` returns.
pub(super) fn rows(
    design: &Design,
    foreseen: &[bool],
    (measured, believed): (&MotionLog, Option<&Believed>),
    mut take: impl FnMut(&[f64]) -> Result<(), EstimationError>,
) -> Result<(), EstimationError> {
    let (mut block, mut begun) = (measured.over_periods(), measured.begun());
    design.correct(&mut block);
    design.correct(&mut begun);
    let (mut scratch, mut begun_scratch) = (design.scratch(), design.scratch());
    scratch.begin(&block)?;
    begun_scratch.begin(&begun)?;
    let mut row = vec![0.0; design.evaluation_width()];
    let mut begun_row = row.clone();
    let turning = TurningColumns::of(design, foreseen)?;
    let means = turning.means((&begun, &block), measured, believed)?;
    for sample in 0..block.len() {
        scratch.evaluate(&block, sample, &mut row)?;
        begun_scratch.evaluate(&begun, sample, &mut begun_row)?;
        for layout in design.rows() {
            let start = layout.range.start;
            let columns = layout.parameters.iter().enumerate().filter(|(_, parameter)| foreseen[**parameter]);
            columns.for_each(|(column, _)| row[start + column] = begun_row[start + column]);
        }
        let means = means.iter().skip(sample * turning.columns().len());
        for (column, mean) in turning.columns().iter().zip(means) {
            if let Some(mean) = mean {
                column.places.iter().for_each(|&(place, share)| row[place] = share * mean.value);
            }
        }
        take(&row)?;
    }
    Ok(())
}

/// The factors of these rows, one for each torque.
///
/// # Errors
/// The log is not of this robot.
pub(super) fn factor(
    design: &Design,
    foreseen: &[bool],
    measured: (&MotionLog, Option<&Believed>),
) -> Result<GroupedFactor, EstimationError> {
    let mut builders: Vec<FactorBuilder> =
        design.rows().iter().map(|layout| FactorBuilder::new(layout.range.len())).collect();
    rows(design, foreseen, measured, |row| {
        for (builder, layout) in builders.iter_mut().zip(design.rows()) {
            builder.push_row(&row[layout.range.clone()])?;
        }
        Ok(())
    })?;
    let group = |(builder, layout): (&mut FactorBuilder, &phiw_identification::design::RowLayout)| Group {
        parameters: layout.parameters.clone(),
        factor: builder.factor(),
    };
    let groups = builders.iter_mut().zip(design.rows()).map(group).collect();
    Ok(GroupedFactor::new(design.parameter_count(), groups)?)
}
