//! What a friction that turns with the velocity takes of a period in which it turns.
//!
//! Within a period the noise moves the joint, and near a reversal it decides when the velocity passes
//! through zero. The friction of the period is the mean of its column c over the way from the velocity v₀ at
//! its beginning to the velocity v₁ at its end, c̄ = ∫₀¹ c(v₀ + s·(v₁ − v₀)) ds, the acceleration taken for
//! constant. v₁ has the period's noise in it, and so has c̄: the likelihood of the motion counts it by the
//! slope ∂c̄/∂v₁ = (c(v₁) − c̄)/(v₁ − v₀) ([`super::turning_response`]), as it counts the acceleration by the
//! inertia.
//!
//! The slope is the larger the less the velocity changes, and where it changes by no more than the error with
//! which encoders tell it, it is the error's own: a joint that rests would seem to rub. In such a period the
//! column is that of its beginning, and has no slope.

use crate::{EstimationError, MotionLog};
use phiw_identification::Design;
use phiw_telemetry::Block;
use serde::{Deserialize, Serialize};

/// Parts of the way between which the column is looked at; even, for Simpson's rule.
const PARTS: usize = 8;
const SAMPLES: usize = PARTS + 1;
/// Change of a velocity within a period from which on it is one, in standard deviations of one that encoders
/// tell. Independent errors alone change it by 1.4 of them, and in one period of 2000 by so many.
const CERTAIN: f64 = 5.0;
/// Change of a velocity that is rounding \[rad/s, m/s\].
const LEAST_CHANGE: f64 = 1e-9;

/// The columns of a design that turn with the velocity.
pub(super) struct TurningColumns<'a> {
    design: &'a Design,
    /// Those effects alone.
    part: Design,
    columns: Vec<TurningColumn>,
}

/// One of them.
pub(super) struct TurningColumn {
    /// The parameter that it is of.
    pub parameter: usize,
    /// The joint whose velocity it turns with, and whose torque it is in.
    pub joint: usize,
    /// Its place in an evaluation of the design.
    pub place: usize,
    /// Its place in an evaluation of the part.
    place_in_part: usize,
}

/// The mean of a column over a period and its slope by the velocity at the end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mean {
    pub value: f64,
    pub slope: f64,
}

/// Simpson's weight of a sample.
fn weight(sample: usize) -> f64 {
    let times = match sample {
        0 | PARTS => 1.0,
        sample if sample % 2 == 1 => 4.0,
        _ => 2.0,
    };
    times / (3 * PARTS) as f64
}

impl<'a> TurningColumns<'a> {
    /// Those of a design's `foreseen` parameters; none of them where there is no noise to foresee.
    pub fn of(design: &'a Design, foreseen: &[bool]) -> Self {
        let is_foreseen = |effect: usize| {
            let parameters = design.effect_parameters(effect);
            let is_foreseen = parameters.clone().all(|own| foreseen.get(own).copied().unwrap_or(false));
            !parameters.is_empty() && is_foreseen
        };
        let chosen: Vec<usize> = (0..design.effects().len())
            .filter(|&effect| design.effects()[effect].turns_with().is_some() && is_foreseen(effect))
            .collect();
        let part = design.part(&chosen, false);
        let mut columns = Vec::new();
        for (own, &effect) in chosen.iter().enumerate() {
            let Some(joint) = design.effects()[effect].turns_with() else { continue };
            let parameters = design.effect_parameters(effect).zip(part.effect_parameters(own));
            for (parameter, parameter_of_part) in parameters {
                let place = |design: &Design, parameter: usize| {
                    let layout = design.rows().get(joint)?;
                    let column = layout.parameters.iter().position(|own| *own == parameter)?;
                    Some(layout.range.start + column)
                };
                let places = place(design, parameter).zip(place(&part, parameter_of_part));
                let column =
                    |(place, place_in_part)| TurningColumn { parameter, joint, place, place_in_part };
                columns.extend(places.map(column));
            }
        }
        TurningColumns { design, part, columns }
    }

    /// The columns, in the order of the means.
    pub fn columns(&self) -> &[TurningColumn] {
        &self.columns
    }

    /// Their means over each period of a log, one period after the other, those of one beside each other;
    /// none where the velocity does not change for certain. `begun` and `mean` are the periods of the log as
    /// they began and as they were on average.
    ///
    /// # Errors
    /// The log is not of this robot.
    pub fn means(
        &self,
        (begun, mean): (&Block, &Block),
        measured: &MotionLog,
    ) -> Result<Vec<Option<Mean>>, EstimationError> {
        if self.columns.is_empty() {
            return Ok(Vec::new());
        }
        let (joints, period_s) = (measured.joints, measured.period_s);
        let least = least_changes(measured);
        let mut signals = [0; 3].map(|_| Vec::with_capacity(SAMPLES * mean.q.len()));
        for row in (0..mean.len()).map(|sample| mean.row(sample)) {
            for sample in 0..SAMPLES {
                let place_s = period_s * sample as f64 / PARTS as f64;
                signals[0].extend_from_slice(&mean.q[row.clone()]);
                signals[1].extend(row.clone().map(|index| begun.qd[index] + place_s * mean.qdd[index]));
                signals[2].extend_from_slice(&mean.qdd[row.clone()]);
            }
        }
        // Nothing here is a function of time.
        let block = Block::unfiltered(joints, vec![0.0; SAMPLES * mean.len()], signals, Vec::new());
        let mut scratch = self.part.scratch();
        scratch.begin(&block)?;
        let mut evaluation = vec![0.0; self.part.evaluation_width()];
        let mut values = vec![0.0; self.columns.len()];
        let mut means = Vec::with_capacity(mean.len() * self.columns.len());
        for row in 0..mean.len() {
            values.fill(0.0);
            for sample in 0..SAMPLES {
                scratch.evaluate(&block, SAMPLES * row + sample, &mut evaluation)?;
                for (value, column) in values.iter_mut().zip(&self.columns) {
                    *value += weight(sample) * evaluation[column.place_in_part];
                }
            }
            means.extend(values.iter().zip(&self.columns).map(|(&value, column)| {
                let change = period_s * mean.qdd[mean.row(row)][column.joint];
                let factor = self.design.logged_factors()[column.joint];
                let slope = (evaluation[column.place_in_part] - value) / change;
                let is_certain = change.abs() > least[column.joint];
                is_certain.then_some(Mean { value: factor * value, slope: factor * slope })
            }));
        }
        Ok(means)
    }
}

/// For each joint, the change of its velocity within a period from which on it is certain \[rad/s, m/s\]: what
/// the steps of its encoder leave of it.
fn least_changes(measured: &MotionLog) -> Vec<f64> {
    let noise = measured.readings.as_ref().map_or(&[][..], |readings| &readings.noise);
    let of_joint = |joint: usize| {
        let error =
            noise.get(joint).map_or(0.0, |noise| std::f64::consts::SQRT_2 * noise / measured.period_s);
        (CERTAIN * error).max(LEAST_CHANGE)
    };
    (0..measured.joints).map(of_joint).collect()
}

/// Slopes of one joint's columns in the periods in which there are any.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Turned {
    pub joint: usize,
    /// The parameters of the columns.
    pub parameters: Vec<usize>,
    /// T·∂c̄/∂v₁ of each of them, `[period × parameter]` \[unit of the column × s²/rad, s²/m\].
    pub slopes: Vec<f64>,
}

/// The slopes of a log, for each stretch of `stride` periods those of every joint that has some.
///
/// # Errors
/// The log is not of this robot.
pub(super) fn turned(
    design: &Design,
    foreseen: &[bool],
    measured: &MotionLog,
    stride: usize,
) -> Result<Vec<Vec<Turned>>, EstimationError> {
    let turning = TurningColumns::of(design, foreseen);
    let (mut begun, mut mean) = (measured.begun(), measured.over_periods());
    let stretches = mean.len().div_ceil(stride);
    if turning.columns.is_empty() {
        return Ok(vec![Vec::new(); stretches]);
    }
    design.correct(&mut begun);
    design.correct(&mut mean);
    let means = turning.means((&begun, &mean), measured)?;
    let mut joints: Vec<usize> = turning.columns.iter().map(|column| column.joint).collect();
    joints.sort_unstable();
    joints.dedup();
    let mut all = Vec::with_capacity(stretches);
    for stretch in means.chunks(stride * turning.columns.len()) {
        let mut of_stretch = Vec::new();
        for &joint in &joints {
            let own: Vec<usize> =
                (0..turning.columns.len()).filter(|&column| turning.columns[column].joint == joint).collect();
            let parameters = own.iter().map(|&column| turning.columns[column].parameter).collect();
            let mut slopes = Vec::new();
            for period in stretch.chunks_exact(turning.columns.len()) {
                let of_column = |&column: &usize| period[column].map_or(0.0, |mean| mean.slope);
                if own.iter().any(|column| of_column(column) != 0.0) {
                    slopes.extend(own.iter().map(of_column).map(|slope| measured.period_s * slope));
                }
            }
            if !slopes.is_empty() {
                of_stretch.push(Turned { joint, parameters, slopes });
            }
        }
        all.push(of_stretch);
    }
    Ok(all)
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
        let tree = random_tree(3, &RandomTreeOptions { joints: 1, ..Default::default() }).unwrap();
        let joint = tree.joint(0).joint.clone();
        let spec = EffectSpec::new("coulomb_friction", &[&joint]).with("sign_width", WIDTH);
        let effect = Catalogue::default().build(&spec, &tree).unwrap();
        let base = BaseParameters::of_tree(&tree, Default::default()).unwrap();
        Design::new(tree, base, vec![effect])
    }

    fn log(q: Vec<f64>, qd: Vec<f64>) -> MotionLog {
        let tau = vec![0.0; q.len()];
        MotionLog { joints: 1, period_s: PERIOD_S, q, qd, tau, ..MotionLog::default() }
    }

    fn means_of(design: &Design, log: &MotionLog) -> Vec<Option<Mean>> {
        let turning = TurningColumns::of(design, &foreseen(design));
        turning.means((&log.begun(), &log.over_periods()), log).unwrap()
    }

    /// The integral of tanh(v/w) is known.
    #[test]
    fn a_mean_is_the_integral_over_the_way_and_its_slope_that_by_the_end() {
        let exact = |from: f64, to: f64| {
            let integral = |v: f64| WIDTH * (v / WIDTH).cosh().ln();
            (integral(to) - integral(from)) / (to - from)
        };
        let design = design();
        for (from, to) in [(0.1, 0.3), (0.1, -0.1), (-0.02, 0.08), (0.0, 0.01), (-0.3, -0.2), (0.06, -0.01)] {
            let way = 0.5 * PERIOD_S * (from + to);
            let mean = means_of(&design, &log(vec![0.2, 0.2 + way], vec![from, to]))[0].unwrap();
            let slope = (exact(from, to + 1e-6) - exact(from, to - 1e-6)) / 2e-6;
            assert!((mean.value - exact(from, to)).abs() < 5e-3, "{from} {to}: {mean:?}");
            assert!((mean.slope - slope).abs() < 0.1, "{from} {to}: {mean:?}, {slope}");
        }
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
}
