//! What the final model leaves: whether it has structure, and what it follows.

use super::probe;
use super::residuals::{Peaks, ResidualShape, residual_shape};
use super::search::Search;
use super::tracing::{Disturbance, Remaining};
use crate::selection::Products;
use phiw_identification::fitting::{Fit, LogChange, TorqueError};
use phiw_identification::{Fold, IdentificationError};
use phiw_regressor::least_squares::GroupedFactor;

/// Standard deviations of the parameters whose error on motion held out is expected.
const EXPECTED_DEVIATIONS: f64 = 2.0;

impl Search<'_> {
    /// Which residuals have structure, and what they follow.
    ///
    /// Structure is what motion foretells on data that were not fitted; what wanders, with a correlation over
    /// seconds that no sensor's noise has; what a training log by itself tells otherwise (`changes`); and an
    /// error on motion held out that no model at all would not have. A residual that is larger than noise and
    /// none of these is a slow disturbance that follows nothing measured; it accuses nobody.
    pub(super) fn remaining(
        &self,
        held_out: &[GroupedFactor],
        (training, error): (&TorqueError, &TorqueError),
        fit: &Fit,
        changes: &[LogChange],
    ) -> Result<Remaining, IdentificationError> {
        let expected = self.expected_squares(held_out, fit)?;
        // What is left of the motion that was fitted to is no error of the parameters.
        let is_large = |row: usize| {
            let of_torque = training.rms_torque[row].powi(2);
            self.is_large(row, error.rmse[row], expected[row])
                || self.is_large(row, training.rmse[row], Expected { torque: of_torque, of_parameters: 0.0 })
        };
        let worse_than_none: Vec<usize> = error.torques_worse_than_none().collect();
        let large: Vec<usize> =
            (0..error.rmse.len()).filter(|&row| is_large(row) || worse_than_none.contains(&row)).collect();
        let small: Vec<usize> = (0..error.rmse.len())
            .filter(|row| !large.contains(row) && self.is_above_floor(*row, training.rmse[*row]))
            .collect();
        let mut remaining = Remaining {
            unidentifiable: self.chosen.unidentifiable.clone(),
            noise_floor: self.input.noise_floor.clone(),
            ..Remaining::default()
        };
        if large.is_empty() && small.is_empty() {
            return Ok(remaining);
        }
        let data = self.fixed.data;
        let folds = [data.train.as_slice(), &data.held_out].concat();
        let shape = self.shape_of_residual(&folds)?;
        let probed = self.probed(&folds, &shape);
        let wanders = |row: usize| self.wanders(&shape, row);
        let of_small = probe::following_own_signal(probed, &small)?;
        let following = probe::following(probed, &large)?;
        let differs = |row: usize| changes.iter().any(|change| change.row == row);
        let is_structured = |row: &usize| {
            following.contains(row) || wanders(*row) || differs(*row) || worse_than_none.contains(row)
        };
        let (structured, colour): (Vec<usize>, Vec<usize>) = large.into_iter().partition(is_structured);
        // Noise that hangs together over time is far less from sample to sample than in the band of the
        // motion. What is small beside its torque accuses nobody, and one signal at a time is asked of it.
        let of_noise = small.into_iter().filter(|row| !of_small.contains(row) && !wanders(*row));
        for row in of_noise.chain(colour.iter().copied()) {
            let left = if self.fixed.prior.is_some() { training.rmse[row] } else { fit.residual_std[row] };
            remaining.noise_floor[row] = remaining.noise_floor[row].max(left);
        }
        let name = |row: usize| self.fixed.tree.joint(row).joint.clone();
        let disturbance = |&row: &usize| Disturbance {
            row,
            joint: name(row),
            rmse: error.rmse[row],
            noise_floor: self.input.noise_floor[row],
            autocorrelation: shape.autocorrelation[row],
        };
        remaining.disturbances = colour.iter().map(disturbance).collect();
        remaining.depends_on = probe::probe(probed, &structured)?;
        remaining.by_log = structured.iter().copied().filter(|&row| differs(row)).map(name).collect();
        remaining.joints = structured.into_iter().map(name).collect();
        Ok(remaining)
    }

    /// What the model leaves on some folds, sample by sample.
    pub(super) fn shape_of_residual(&self, folds: &[Fold]) -> Result<ResidualShape, IdentificationError> {
        let (sources, joints) = (&self.fixed.data.sources, &self.input.ranges.joints);
        residual_shape(&self.design()?, &self.parameters, folds, sources, joints, Peaks::All)
    }

    /// The model, as a probe looks at what it leaves on these folds.
    pub(super) fn probed<'b>(&'b self, folds: &'b [Fold], shape: &'b ResidualShape) -> probe::Fit<'b> {
        probe::Fit {
            peaks: shape,
            fixed: self.fixed,
            folds,
            specs: &self.specs,
            parameters: &self.parameters,
            ranges: &self.input.ranges,
            false_alarm: self.options.thresholds.false_structure_probability,
        }
    }

    /// Whether a residual is correlated over seconds, which no sensor's noise is.
    pub(super) fn wanders(&self, shape: &ResidualShape, row: usize) -> bool {
        shape.wander[row] > self.options.thresholds.wander
    }

    /// Whether a residual (RMS) is more than noise, and more than what the parameters' own uncertainty makes
    /// of this motion.
    fn is_large(&self, row: usize, rmse: f64, expected: Expected) -> bool {
        let left = (rmse * rmse - expected.of_parameters).max(0.0).sqrt();
        self.is_above_floor(row, left)
            && left > self.options.thresholds.least_visible * expected.torque.sqrt()
            && !self.is_as_it_was(row, rmse)
    }

    /// Whether an error (RMS) is more than what sensors' white noise makes.
    fn is_above_floor(&self, row: usize, rmse: f64) -> bool {
        rmse > self.options.thresholds.same_error * self.input.noise_floor[row]
    }

    /// Of each torque on motion held out: its mean square, and that of the error that parameters make which
    /// are a few standard deviations off: mean φᵀΣφ.
    fn expected_squares(
        &self,
        held_out: &[GroupedFactor],
        fit: &Fit,
    ) -> Result<Vec<Expected>, IdentificationError> {
        let deviations = match self.fixed.prior {
            Some(_) => Vec::new(),
            None => fit.covariance.deviations(fit.parameters.len())?,
        };
        let torques = held_out.first().map_or(0, |fold| fold.groups().len());
        let of_torque = |torque: usize| {
            let Some(first) = held_out.first() else { return Expected::default() };
            let parameters = &first.groups()[torque].parameters;
            let mut products = Products::zero(parameters.len() + 1);
            held_out
                .iter()
                .for_each(|fold| products.add(&Products::of_factor(&fold.groups()[torque].factor)));
            let squares = |deviation: &Vec<f64>| {
                let values = parameters.iter().map(|&parameter| deviation[parameter]);
                products.size_of(&values.enumerate().collect::<Vec<(usize, f64)>>())
            };
            let rows = products.rows().max(1.0);
            let of_parameters: f64 = deviations.iter().map(squares).sum();
            Expected {
                torque: products.right_hand_side() / rows,
                of_parameters: EXPECTED_DEVIATIONS.powi(2) * of_parameters / rows,
            }
        };
        Ok((0..torques).map(of_torque).collect())
    }
}

/// Mean squares on motion held out \[(N·m)², N²\].
#[derive(Clone, Copy, Default)]
struct Expected {
    torque: f64,
    of_parameters: f64,
}
