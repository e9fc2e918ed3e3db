//! Other constants of a friction that turns, beside a model that has been fitted with its own.
//!
//! A score ([`super::score`]) begins with no friction, where nothing sticks: it foretells a fifth of what a
//! friction saves, and the widths over which signs turn are too large by up to ten times. Here the model has
//! the friction. That of one joint is exchanged for the same with other constants, its own parameters are
//! those that are then best, and all others stay: of −log L only the squares of what is left of the joint's
//! torque change, and the determinants of the periods in which its friction turns.

use super::joint_rows::JointRows;
use super::turning::{Believed, Felt, TurningColumns};
use super::turning_path::Mean;
use super::turning_response::TurningAxes;
use super::{Gain, MotionLikelihood, foresight};
use crate::{EstimationError, KnownEffect, MotionLog, Robot, RobotModel};
use phiw_identification::{Design, Effect, EffectSpec};
use phiw_telemetry::Block;
use std::ops::Range;

/// How often parameters are sought under the ways that they are believed to make.
const ROUNDS: usize = 2;

impl MotionLikelihood {
    /// What each of the `candidates` would save in the place of the model's effect of the same kind on the
    /// same joint: its gain is that of the exchange, and its parameters are those that are then best. The
    /// model has been fitted to these logs with this estimator. None for one that takes nothing's place,
    /// whose columns do not turn with one joint's velocity ([`phiw_identification::Effect::turns_with`]), or
    /// that has other parameters.
    ///
    /// # Errors
    /// A log or a candidate is not of this robot.
    pub fn exchanges(
        &self,
        robot: &Robot,
        model: &RobotModel,
        logs: &[MotionLog],
        candidates: &[EffectSpec],
    ) -> Result<Vec<Option<Gain>>, EstimationError> {
        let mut found = vec![None; candidates.len()];
        let mut waiting = exchanges_of(robot, model, candidates)?;
        if waiting.is_empty() {
            return Ok(found);
        }
        let design = robot.design_of(model)?;
        let foreseen = foresight::foreseen(&design);
        let parameters = model.parameters(robot)?;
        let believed = Believed { parameters, standing_on: self.standing_on.clone() };
        let turning = TurningColumns::of(&design, &foreseen)?;
        let logs: Result<Vec<_>, _> =
            logs.iter().map(|log| Periods::of((&design, &foreseen), &turning, log, &believed)).collect();
        let logs = logs?;
        // All joints change at a time, each once.
        while !waiting.is_empty() {
            let (mut now, mut later): (Vec<Exchange>, Vec<Exchange>) = Default::default();
            for exchange in waiting {
                let is_taken = now.iter().any(|other| other.joint == exchange.joint);
                if is_taken { later.push(exchange) } else { now.push(exchange) }
            }
            waiting = later;
            let mut other = model.clone();
            for exchange in &now {
                other.effects[exchange.effect].spec = candidates[exchange.candidate].clone();
            }
            let other = robot.design_of(&other)?;
            let other = TurningColumns::of(&other, &foreseen)?;
            // A kind of the user's own may have its columns elsewhere with other constants.
            if other.places() != turning.places() {
                continue;
            }
            self.decide(&mut now, (&turning, &other), &logs, &believed.parameters);
            for Exchange { candidate, values, gain, .. } in now {
                let effect = candidates[candidate].clone();
                found[candidate] = Some(Gain { effect, gain, parameters: values, merit: gain });
            }
        }
        Ok(found)
    }

    /// Finds values and gains of exchanges that are made together, each under the ways that its friction
    /// leaves. `own` and `other` are the columns of the model, whose parameters are `w`, and of that with all
    /// constants exchanged.
    fn decide(
        &self,
        exchanges: &mut [Exchange],
        (own, other): (&TurningColumns<'_>, &TurningColumns<'_>),
        logs: &[Periods<'_>],
        w: &[f64],
    ) {
        for _ in 0..ROUNDS {
            let mut parameters = w.to_vec();
            for exchange in exchanges.iter() {
                parameters[exchange.parameters.clone()].copy_from_slice(&exchange.values);
            }
            let means: Vec<_> = logs.iter().map(|log| log.means(other, &parameters)).collect();
            for exchange in exchanges.iter_mut() {
                let precision = self.torque_noise[exchange.joint].powi(-2);
                exchange.decide((own, other), (logs, &means), w, precision);
            }
        }
    }
}

/// The candidates that take the place of an effect of the model.
fn exchanges_of(
    robot: &Robot,
    model: &RobotModel,
    candidates: &[EffectSpec],
) -> Result<Vec<Exchange>, EstimationError> {
    let mut first = robot.base().count();
    let mut present = Vec::with_capacity(model.effects.len());
    for (effect, KnownEffect { spec, parameters }) in model.effects.iter().enumerate() {
        let joint = joint_that_turns(robot.catalogue().build(spec, robot.tree())?.as_ref());
        let range = first..first + parameters.len();
        first = range.end;
        present.extend(joint.map(|joint| (effect, spec, joint, range, parameters)));
    }
    let mut exchanges = Vec::new();
    for (candidate, own) in candidates.iter().enumerate() {
        let is_its =
            |(_, spec, ..): &&(_, &EffectSpec, _, _, _)| spec.kind == own.kind && spec.joints == own.joints;
        let Some((effect, _, joint, parameters, values)) = present.iter().find(is_its) else { continue };
        let built = robot.catalogue().build(own, robot.tree())?;
        if joint_that_turns(built.as_ref()) == Some(*joint) && built.parameters().len() == values.len() {
            let (effect, joint, parameters, values) =
                (*effect, *joint, parameters.clone(), (*values).clone());
            exchanges.push(Exchange { candidate, effect, joint, parameters, values, gain: 0.0 });
        }
    }
    Ok(exchanges)
}

/// The joint with whose velocity all columns of an effect turn.
fn joint_that_turns(effect: &dyn Effect) -> Option<usize> {
    let joint = effect.turns_with(0)?.joint()?;
    let is_its = |own| effect.turns_with(own).and_then(|axis| axis.joint()) == Some(joint);
    (0..effect.parameters().len()).all(is_its).then_some(joint)
}

/// A candidate that takes the place of an effect of the model.
struct Exchange {
    candidate: usize,
    effect: usize,
    joint: usize,
    parameters: Range<usize>,
    values: Vec<f64>,
    gain: f64,
}

impl Exchange {
    /// Finds values and gain. `own` and `other` are the columns of the model and of that with the exchanged
    /// constants, `means` those of the latter in each log's periods, `w` the parameters of the model.
    fn decide(
        &mut self,
        (own, other): (&TurningColumns<'_>, &TurningColumns<'_>),
        (logs, means): (&[Periods<'_>], &[Vec<Option<Mean>>]),
        w: &[f64],
        precision: f64,
    ) {
        let of_joint = |index: &usize| own.axes()[own.columns()[*index].axis].joint() == Some(self.joint);
        let of_joint: Vec<usize> = (0..own.columns().len()).filter(of_joint).collect();
        let mut before = JointRows::new(0, precision);
        let mut after = JointRows::new(self.values.len(), precision);
        let mut columns = vec![[0.0; 2]; self.values.len()];
        for (log, means) in logs.iter().zip(means) {
            for row in 0..log.mean.len() {
                let at = log.mean.row(row).start + self.joint;
                // What is left and δ, of the model and of the other without the parameters that are sought.
                let mut model = [log.left[at], 0.0];
                let mut rest = model;
                for &index in &of_joint {
                    let parameter = own.columns()[index].parameter;
                    let value = w[parameter];
                    let (had, beside) = log.column(own, &log.means, (row, index));
                    rest[0] -= value * had[0];
                    model[1] += value * had[1] + beside;
                    let (has, beside) = log.column(other, means, (row, index));
                    rest[1] += beside;
                    match self.parameters.contains(&parameter) {
                        true => columns[parameter - self.parameters.start] = has,
                        false => rest = [rest[0] + value * has[0], rest[1] + value * has[1]],
                    }
                }
                before.push(model, &[], log.felt_alone[at]);
                after.push(rest, &columns, log.felt_alone[at]);
            }
        }
        after.minimize(&mut self.values);
        self.gain = before.cost(&[]) - after.cost(&self.values);
    }
}

/// What exchanges ask of a log, `[period × joint]`.
struct Periods<'a> {
    measured: &'a MotionLog,
    begun: Block,
    mean: Block,
    /// What the model leaves of the torques \[N·m, N\].
    left: Vec<f64>,
    felt: Vec<Felt>,
    /// What a torque on a joint does to its velocity, were it the joint's only friction that is missing.
    felt_alone: Vec<f64>,
    /// Means of the model's columns.
    means: Vec<Option<Mean>>,
}

impl<'a> Periods<'a> {
    fn of(
        (design, foreseen): (&Design, &[bool]),
        turning: &TurningColumns<'_>,
        measured: &'a MotionLog,
        believed: &Believed,
    ) -> Result<Self, EstimationError> {
        let (mut begun, mut mean) = (measured.begun(), measured.over_periods());
        design.correct(&mut begun);
        design.correct(&mut mean);
        let mut left = Vec::with_capacity(mean.len() * measured.joints);
        foresight::rows(design, foreseen, (measured, Some(believed)), |row| {
            for layout in design.rows() {
                let values = &row[layout.range.clone()];
                let product = |(value, &parameter): (&f64, &usize)| value * believed.parameters[parameter];
                let modelled: f64 = values.iter().zip(&layout.parameters).map(product).sum();
                left.push(modelled - values[layout.parameters.len()]);
            }
            Ok(())
        })?;
        let felt = turning.felt(&mean, measured.period_s, believed)?;
        let mut periods =
            Periods { measured, begun, mean, left, felt, felt_alone: Vec::new(), means: Vec::new() };
        periods.means = periods.means(turning, &believed.parameters);
        periods.felt_alone = periods.felt_alone(turning, &believed.parameters);
        Ok(periods)
    }

    fn felt_alone(&self, turning: &TurningColumns<'_>, w: &[f64]) -> Vec<f64> {
        let joints = self.measured.joints;
        let columns = turning.places();
        let mut felt_alone = vec![0.0; self.left.len()];
        let mut first = 0;
        for felt in &self.felt {
            let rows = first..first + felt.periods;
            first = rows.end;
            let Some(own) = felt.axes.iter().map(Option::as_ref).collect::<Option<Vec<_>>>() else {
                continue;
            };
            let together = TurningAxes::of(&own);
            for row in rows {
                let mut deltas = vec![0.0; turning.axes().len()];
                for (index, (parameter, axis)) in columns.iter().enumerate() {
                    let ([_, slope], beside) = self.column(turning, &self.means, (row, index));
                    deltas[*axis] += w[*parameter] * slope + beside;
                }
                let Some(alone) = together.felt_alone(&deltas) else { continue };
                for (axis, alone) in turning.axes().iter().zip(alone) {
                    if let Some(joint) = axis.joint() {
                        felt_alone[row * joints + joint] = alone;
                    }
                }
            }
        }
        felt_alone
    }

    /// Means of columns under these parameters.
    fn means(&self, turning: &TurningColumns<'_>, w: &[f64]) -> Vec<Option<Mean>> {
        turning.means_under((&self.begun, &self.mean), self.measured, (w, &self.felt))
    }

    /// A column in a period and T times its slope, and T times what the slope of its axis has beside.
    fn column(
        &self,
        turning: &TurningColumns<'_>,
        means: &[Option<Mean>],
        (row, index): (usize, usize),
    ) -> ([f64; 2], f64) {
        let of_beginning = || {
            let axis = &turning.axes()[turning.columns()[index].axis];
            ([turning.at(index, axis.of(&self.begun.qd[self.begun.row(row)])), 0.0], 0.0)
        };
        let period_s = self.measured.period_s;
        let of_mean = |mean: Mean| ([mean.value, period_s * mean.slope], period_s * mean.beside);
        means[row * turning.columns().len() + index].map_or_else(of_beginning, of_mean)
    }
}
