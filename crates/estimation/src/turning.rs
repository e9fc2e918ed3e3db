//! What a friction that turns with the velocity takes of a period in which it turns.
//!
//! Within a period the noise moves the joint, and near a reversal it decides when the velocity passes through
//! zero. The friction of the period is the mean c̄ of its column along the way of the velocity from v₀ at the
//! beginning to v₁ at the end ([`super::turning_path`]): slowed by the damping and the friction that the
//! joint is believed to have, so that it may come to rest. v₁ has the period's noise in it, and so has c̄:
//! the likelihood of the motion counts it by the slope dc̄/dv₁ ([`super::turning_response`]), as it counts
//! the acceleration by the inertia.
//!
//! A friction between two joints is one of the shaft that turns with their sum or their difference: its
//! column, its way and its slope are that shaft's.
//!
//! The way depends on how large the friction is. So friction and slope are those of the way under the
//! friction that is believed, and an estimate is made again until it agrees with what it believed.
//!
//! The slope is the larger the less the velocity changes, and where it changes by no more than the error with
//! which encoders tell it, it is the error's own: a joint that rests would seem to rub. In such a period the
//! column is that of its beginning, and has no slope.

use super::evidence::{Instant, instants};
use super::likelihood::column;
use super::response::Modes;
use super::sensitivity::Sensitivity;
use super::turning_path::{Mean, Slowed, Way, interpolated, velocities};
use super::turning_response::TurningAxis;
use crate::{EstimationError, MotionLog};
use phiw_identification::Design;
use phiw_identification::effect::VelocitySum;
use phiw_telemetry::Block;
use serde::{Deserialize, Serialize};
use std::rc::Rc;

/// Change of a velocity within a period from which on it is one, in standard deviations of one that encoders
/// tell. Independent errors alone change it by 1.4 of them, and in one period of 2000 by so many.
const CERTAIN: f64 = 5.0;
/// What a column changes by within a period, at most, where it does not turn, and the share of a sum that is
/// nothing.
const ROUNDING: f64 = 1e-9;
/// Change of a velocity that is rounding \[rad/s, m/s\].
const LEAST_CHANGE: f64 = 1e-9;

/// Time between two instants at which it is looked at how a believed friction changes a velocity \[s\].
const INSTANT_EVERY_S: f64 = 0.4;

/// The columns of a design that turn with the velocity.
pub(super) struct TurningColumns<'a> {
    design: &'a Design,
    /// The velocities that they turn with.
    axes: Vec<VelocitySum>,
    columns: Vec<TurningColumn>,
    /// Velocities of the columns' tables.
    velocities: Vec<f64>,
    /// Of which parameters the columns are those of the periods' beginnings.
    foreseen: &'a [bool],
}

/// What a joint is believed to be, and so to do in a period: parameters of the design's first columns, and
/// bodies that do not move.
#[derive(Clone, Debug)]
pub(super) struct Believed {
    pub parameters: Vec<f64>,
    pub standing_on: Vec<usize>,
}

/// A column that turns with a velocity.
pub(super) struct TurningColumn {
    /// The parameter that it is of.
    pub parameter: usize,
    /// The velocity that it turns with: its place among those of all columns.
    pub axis: usize,
    /// Its places in an evaluation of the design, one for each joint of the axis, and the factor there.
    pub places: Vec<(usize, f64)>,
    /// The column at the velocities of a table.
    table: Vec<f64>,
}

impl<'a> TurningColumns<'a> {
    /// Those of a design's `foreseen` parameters; none of them where there is no noise to foresee.
    ///
    /// # Errors
    /// None that a design can cause.
    pub fn of(design: &'a Design, foreseen: &'a [bool]) -> Result<Self, EstimationError> {
        let mut turning = TurningColumns {
            design,
            axes: Vec::new(),
            columns: Vec::new(),
            velocities: velocities(),
            foreseen,
        };
        // Effects and their parameters, by what they turn with.
        let mut of_axes: Vec<(VelocitySum, Vec<[usize; 2]>)> = Vec::new();
        for (effect, own) in design.effects().iter().enumerate() {
            for (place, parameter) in design.effect_parameters(effect).enumerate() {
                let is_foreseen = foreseen.get(parameter).copied().unwrap_or(false);
                let Some(axis) = own.turns_with(place).filter(|_| is_foreseen) else { continue };
                match of_axes.iter_mut().find(|(other, _)| *other == axis) {
                    Some((_, parameters)) => parameters.push([effect, place]),
                    None => of_axes.push((axis, vec![[effect, place]])),
                }
            }
        }
        // Of those that turn with one joint's velocity each, all joints move with the same at once.
        let joints = design.tree().joint_count();
        let (single, several): (Vec<_>, Vec<_>) =
            of_axes.into_iter().partition(|(axis, _)| axis.joint().is_some());
        turning.add(&single, &vec![1.0; joints])?;
        for of_axis in several {
            let square: f64 = of_axis.0.terms.iter().map(|(_, factor)| factor * factor).sum();
            let mut moved = vec![0.0; joints];
            of_axis.0.terms.iter().for_each(|&(joint, factor)| moved[joint] = factor / square);
            turning.add(&[of_axis], &moved)?;
        }
        Ok(turning)
    }

    /// Adds the columns of these axes, with effects and parameters, where a velocity of one along each of
    /// them moves the joints so.
    fn add(
        &mut self,
        of_axes: &[(VelocitySum, Vec<[usize; 2]>)],
        moved: &[f64],
    ) -> Result<(), EstimationError> {
        let mut chosen: Vec<usize> =
            of_axes.iter().flat_map(|(_, parameters)| parameters.iter().map(|[effect, _]| *effect)).collect();
        chosen.sort_unstable();
        chosen.dedup();
        if chosen.is_empty() {
            return Ok(());
        }
        let (design, joints) = (self.design, moved.len());
        let part = design.part(&chosen, false);
        let still = vec![0.0; joints * self.velocities.len()];
        let moving = |velocity: &f64| moved.iter().map(|share| share * velocity).collect::<Vec<f64>>();
        let moving = self.velocities.iter().flat_map(moving).collect();
        let block = Block::unfiltered(
            joints,
            vec![0.0; self.velocities.len()],
            [still.clone(), moving, still],
            Vec::new(),
        );
        let mut scratch = part.scratch();
        scratch.begin(&block)?;
        let mut evaluations = vec![vec![0.0; part.evaluation_width()]; self.velocities.len()];
        for (sample, evaluation) in evaluations.iter_mut().enumerate() {
            scratch.evaluate(&block, sample, evaluation)?;
        }
        let place = |design: &Design, joint: usize, parameter: usize| {
            let layout = design.rows().get(joint)?;
            let column = layout.parameters.iter().position(|own| *own == parameter)?;
            Some(layout.range.start + column)
        };
        for (axis, parameters) in of_axes {
            let Some(&(first, factor)) = axis.terms.first() else { continue };
            for &[effect, own] in parameters {
                let parameter = design.effect_parameters(effect).start + own;
                let Ok(of_part) = chosen.binary_search(&effect) else { continue };
                let Some(column) = place(&part, first, part.effect_parameters(of_part).start + own) else {
                    continue;
                };
                let scale = design.logged_factors()[first] / factor;
                let table = evaluations.iter().map(|evaluation| scale * evaluation[column]).collect();
                let place_of = |&(joint, factor): &(usize, f64)| {
                    let share = factor * design.logged_factors()[joint] / design.logged_factors()[first];
                    Some((place(design, joint, parameter)?, share))
                };
                let Some(places) = axis.terms.iter().map(place_of).collect() else { continue };
                self.columns.push(TurningColumn { parameter, axis: self.axes.len(), places, table });
            }
            self.axes.push(axis.clone());
        }
        Ok(())
    }

    /// The velocities that columns turn with.
    pub fn axes(&self) -> &[VelocitySum] {
        &self.axes
    }

    /// The columns, in the order of the means.
    pub fn columns(&self) -> &[TurningColumn] {
        &self.columns
    }

    /// The parameter and the axis of each.
    pub fn places(&self) -> Vec<(usize, usize)> {
        self.columns.iter().map(|column| (column.parameter, column.axis)).collect()
    }

    /// A column where its axis moves at a velocity \[rad/s, m/s\].
    pub fn at(&self, column: usize, velocity: f64) -> f64 {
        interpolated(&self.velocities, &self.columns[column].table, velocity)
    }

    /// Their means over each period of a log, one period after the other, those of one beside each other;
    /// none where the velocity does not change for certain. `begun` and `mean` are the periods of the log as
    /// they began and as they were on average. Where nothing is `believed`, no friction slows a joint within
    /// a period.
    ///
    /// # Errors
    /// The log is not of this robot.
    pub fn means(
        &self,
        (begun, mean): (&Block, &Block),
        measured: &MotionLog,
        believed: Option<&Believed>,
    ) -> Result<Vec<Option<Mean>>, EstimationError> {
        let felt = match believed.filter(|_| !self.columns.is_empty()) {
            Some(believed) => self.felt(mean, measured.period_s, believed)?,
            None => Vec::new(),
        };
        let parameters = believed.map_or(&[][..], |believed| &believed.parameters);
        Ok(self.means_under((begun, mean), measured, (parameters, &felt)))
    }

    /// The same under parameters that are believed, where it is known what inertia the joints feel
    /// ([`Self::felt`]).
    pub fn means_under(
        &self,
        (begun, mean): (&Block, &Block),
        measured: &MotionLog,
        (parameters, felt): (&[f64], &[Felt]),
    ) -> Vec<Option<Mean>> {
        if self.columns.is_empty() {
            return Vec::new();
        }
        let period_s = measured.period_s;
        let least = self.least_changes(measured);
        let frictions = self.frictions(&self.rubbing(parameters));
        let slowed = felt.iter().flat_map(|felt| {
            let of_axis = |axis: &Option<TurningAxis>| {
                let own = axis.as_ref().map(|axis| [axis.acceleration, axis.velocity]);
                own.map_or_else(Slowed::default, |[free, damped]| {
                    Slowed::of(period_s * free, period_s * damped)
                })
            };
            let own: Rc<[Slowed]> = felt.axes.iter().map(of_axis).collect();
            std::iter::repeat_n(own, felt.periods)
        });
        let slowed: Vec<Rc<[Slowed]>> = slowed.collect();
        let mut of_axes = vec![Vec::new(); self.axes.len()];
        for (index, column) in self.columns.iter().enumerate() {
            of_axes[column.axis].push(index);
        }
        let mut way = Way::default();
        let mut means = vec![None; mean.len() * self.columns.len()];
        for row in 0..mean.len() {
            let of_row = &mut means[row * self.columns.len()..(row + 1) * self.columns.len()];
            for (axis, own) in of_axes.iter().enumerate() {
                let change = period_s * self.axes[axis].of(&mean.qdd[mean.row(row)]);
                if change.abs() <= least[axis] {
                    continue;
                }
                let begin = self.axes[axis].of(&begun.qd[begun.row(row)]);
                let friction = frictions.get(axis).and_then(Option::as_deref);
                let slowed = slowed.get(row).map_or_else(Slowed::default, |own| own[axis]);
                way.lay([begin, begin + change], (&self.velocities, friction), slowed);
                let mut beside = if slowed.scale > 0.0 { way.beside() / slowed.scale } else { 0.0 };
                for &index in own {
                    let mut mean = way.mean_of(&self.velocities, &self.columns[index].table);
                    mean.slope = if (mean.slope * change).abs() < ROUNDING { 0.0 } else { mean.slope };
                    mean.beside = std::mem::take(&mut beside);
                    of_row[index] = Some(mean);
                }
            }
        }
        means
    }

    /// The parameters of the columns, in their order. What pushes along is no friction: where that of an axis
    /// comes out so, as it may where nothing was believed to slow the joint, it is taken to rub as much. What
    /// pushes along in one direction and rubs in the other is left as it is.
    fn rubbing(&self, parameters: &[f64]) -> Vec<f64> {
        let value = |column: &TurningColumn| parameters.get(column.parameter).copied().unwrap_or_default();
        let mut values: Vec<f64> = self.columns.iter().map(value).collect();
        let mut power = vec![[0.0; 2]; self.axes.len()];
        for (column, value) in self.columns.iter().zip(&values) {
            for (own, velocity) in column.table.iter().zip(&self.velocities) {
                let product = value * own * velocity;
                power[column.axis][0] += product;
                power[column.axis][1] += product.abs();
            }
        }
        for (column, value) in self.columns.iter().zip(&mut values) {
            let [sum, of_sizes] = power[column.axis];
            *value = if sum < -ROUNDING * of_sizes { -*value } else { *value };
        }
        values
    }

    /// The friction along each axis \[N·m, N\] at the velocities of the tables under these parameters of the
    /// columns; none where it has none.
    fn frictions(&self, values: &[f64]) -> Vec<Option<Vec<f64>>> {
        let mut frictions = vec![None; self.axes.len()];
        for (column, value) in self.columns.iter().zip(values).filter(|(_, value)| **value != 0.0) {
            let friction: &mut Vec<f64> =
                frictions[column.axis].get_or_insert_with(|| vec![0.0; self.velocities.len()]);
            friction.iter_mut().zip(&column.table).for_each(|(sum, own)| *sum += value * own);
        }
        frictions
    }

    /// For each axis, the change of its velocity within a period from which on it is certain \[rad/s, m/s\]:
    /// what the steps of its encoders leave of it.
    fn least_changes(&self, measured: &MotionLog) -> Vec<f64> {
        let noise = measured.readings.as_ref().map_or(&[][..], |readings| &readings.noise);
        let of_axis = |axis: &VelocitySum| {
            let noise = axis
                .terms
                .iter()
                .map(|&(joint, factor)| (factor * noise.get(joint).copied().unwrap_or_default()).powi(2));
            let error = std::f64::consts::SQRT_2 * noise.sum::<f64>().sqrt() / measured.period_s;
            (CERTAIN * error).max(LEAST_CHANGE)
        };
        self.axes.iter().map(of_axis).collect()
    }

    /// What inertia the axes feel under a belief, at instants that stand for a log's periods. Frictions
    /// that turn are no part of it.
    ///
    /// # Errors
    /// The log is not of this robot.
    pub fn felt(
        &self,
        mean: &Block,
        period_s: f64,
        believed: &Believed,
    ) -> Result<Vec<Felt>, EstimationError> {
        let mut w = column(&believed.parameters);
        w.resize_with(self.design.parameter_count(), 1, |_, _| 0.0);
        let foreseen = |parameter: usize| self.foreseen.get(parameter).copied().unwrap_or(false);
        let nothing = Turned::default();
        let felt = |instant: Instant| {
            let sensitivity =
                Sensitivity::of(self.design, (&instant, &nothing), &believed.standing_on, foreseen)?;
            let modes = Modes::of(&sensitivity, &w);
            let axis = |axis: &VelocitySum| modes.as_ref()?.axis(&sensitivity.toward(axis));
            Ok(Felt { periods: instant.weight as usize, axes: self.axes.iter().map(axis).collect() })
        };
        instants(mean, period_s, INSTANT_EVERY_S).into_iter().map(felt).collect()
    }
}

/// What inertia each axis feels at an instant that stands for some periods; none where it is no inertia.
pub(super) struct Felt {
    pub periods: usize,
    pub axes: Vec<Option<TurningAxis>>,
}

/// Slopes of the columns that turn in the periods in which any does.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Turned {
    /// The velocities that columns turn with.
    pub axes: Vec<VelocitySum>,
    /// The parameters of the columns, and the axis of each.
    pub columns: Vec<(usize, usize)>,
    /// T·dc̄/dv₁ of each of them, `[period × column]` \[unit of the column × s²/rad, s²/m\].
    pub slopes: Vec<f64>,
    /// What δ ([`super::turning_response`]) has beside these, since a friction also changes what damping
    /// takes, with the first of an axis's columns, `[period × column]` \[N·m·s²/rad, N·s²/m\].
    pub offsets: Vec<f64>,
}

/// The slopes of a log, for each stretch of `stride` periods.
///
/// # Errors
/// The log is not of this robot.
pub(super) fn turned(
    design: &Design,
    foreseen: &[bool],
    (measured, stride): (&MotionLog, usize),
    believed: Option<&Believed>,
) -> Result<Vec<Turned>, EstimationError> {
    let turning = TurningColumns::of(design, foreseen)?;
    let (mut begun, mut mean) = (measured.begun(), measured.over_periods());
    let stretches = mean.len().div_ceil(stride);
    if turning.columns.is_empty() {
        return Ok(vec![Turned::default(); stretches]);
    }
    design.correct(&mut begun);
    design.correct(&mut mean);
    let means = turning.means((&begun, &mean), measured, believed)?;
    let columns = turning.places();
    let of_stretch = |stretch: &[Option<Mean>]| {
        let (axes, columns) = (turning.axes.clone(), columns.clone());
        let mut turned = Turned { axes, columns, ..Turned::default() };
        for period in stretch.chunks_exact(turning.columns.len()) {
            if period.iter().flatten().any(|mean| mean.slope != 0.0) {
                let own = |of_mean: fn(&Mean) -> f64| {
                    period.iter().map(move |mean| measured.period_s * mean.as_ref().map_or(0.0, of_mean))
                };
                turned.slopes.extend(own(|mean| mean.slope));
                turned.offsets.extend(own(|mean| mean.beside));
            }
        }
        turned
    };
    Ok(means.chunks(stride * columns.len()).map(of_stretch).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Readings;
    use crate::foresight::foreseen;
    use phiw_dynamics::random_tree::{RandomTreeOptions, random_tree};
    use phiw_effects::Catalogue;
    use phiw_identification::{EffectCatalogue, EffectSpec};
    use phiw_regressor::BaseParameters;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const WIDTH: f64 = 0.05;
    const PERIOD_S: f64 = 0.01;

    /// One joint with Coulomb friction.
    fn design() -> Design {
        design_with(EffectSpec::new("coulomb_friction", &[]).with("sign_width", WIDTH))
    }

    /// One joint with this effect.
    fn design_with(spec: EffectSpec) -> Design {
        let tree = random_tree(3, &RandomTreeOptions { joints: 1, ..Default::default() }).unwrap();
        let joint = tree.joint(0).joint.clone();
        let spec = EffectSpec { joints: vec![joint], ..spec };
        let effect = Catalogue::default().build(&spec, &tree).unwrap();
        let base = BaseParameters::of_tree(&tree, Default::default()).unwrap();
        Design::new(tree, base, vec![effect])
    }

    fn log(q: Vec<f64>, qd: Vec<f64>) -> MotionLog {
        let tau = vec![0.0; q.len()];
        MotionLog { joints: 1, period_s: PERIOD_S, q, qd, tau, ..MotionLog::default() }
    }

    fn means_of(design: &Design, log: &MotionLog) -> Vec<Option<Mean>> {
        let foreseen = foreseen(design);
        let turning = TurningColumns::of(design, &foreseen).unwrap();
        turning.means((&log.begun(), &log.over_periods()), log, None).unwrap()
    }

    /// Its velocity turns with the error of a measurement: each turn was evidence of friction.
    #[test]
    fn a_joint_that_rests_turns_with_nothing() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let qd: Vec<f64> = (0..400).map(|_| rng.random_range(-2e-3..2e-3)).collect();
        let readings = Readings { noise: vec![1e-5], ..Readings::default() };
        let log = MotionLog { readings: Some(readings), ..log(vec![0.2; 400], qd) };
        let found = means_of(&design(), &log).iter().flatten().count();
        assert!(found < 4, "{found}");
    }

    /// A wrist's friction came out below nothing under a way that nothing slowed, was taken for none, and
    /// stayed there.
    #[test]
    fn a_friction_that_comes_out_below_nothing_is_taken_to_rub() {
        let design = design();
        let foreseen = foreseen(&design);
        let turning = TurningColumns::of(&design, &foreseen).unwrap();
        let mut parameters = vec![0.0; design.parameter_count()];
        for friction in [-0.3, 0.3] {
            parameters[turning.columns()[0].parameter] = friction;
            assert_eq!(turning.rubbing(&parameters), [0.3]);
        }
    }

    /// Its power over both directions is nothing but rounding, which turned its sign: a right model was given
    /// such a friction.
    #[test]
    fn what_rubs_in_one_direction_only_keeps_its_sign() {
        for width in [0.0011, 0.003, 0.01, WIDTH, 0.1] {
            let spec = EffectSpec::new("asymmetric_friction", &[]).with("part", 1.0);
            let design = design_with(spec.with("sign_width", width));
            let foreseen = foreseen(&design);
            let turning = TurningColumns::of(&design, &foreseen).unwrap();
            let mut parameters = vec![0.0; design.parameter_count()];
            for friction in [-5.45, -5.3, -4.7, -0.3, 0.3, 4.7, 5.3, 5.45] {
                parameters[turning.columns()[0].parameter] = friction;
                assert_eq!(turning.rubbing(&parameters), [friction], "{width} rad/s");
            }
        }
    }
}
