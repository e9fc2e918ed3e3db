//! What was believed before anything was measured, as rows beside those that were measured.

use crate::{EstimationError, RobotModel};
use phiw_dynamics::check_size;
use phiw_identification::Design;
use phiw_regressor::factor::FactorBuilder;
use phiw_regressor::least_squares::{Group, GroupedFactor};

/// A Gaussian belief about parameters: those of a model, give or take a share of their magnitudes.
///
/// Many a robot has combinations of parameters that its motions hardly excite. The noise then decides them,
/// and what was believed at first, bad as it was, is nearer to the truth than what is estimated. With a prior
/// the estimate is the mean of what the logs and the first belief say, each counted by its own certainty:
/// where the logs determine a parameter the estimate is theirs, elsewhere it is the first belief's, and no
/// threshold has to decide between them.
///
/// Of a body, a mass m is uncertain by `share`·m, a first moment by `share`·m·0.2 m and a moment of inertia
/// by `share`·m·(0.2 m)² ([`phiw_regressor::parameter_scales`]), whatever its own value: one that is zero in
/// the model may still be wrong. Of an effect's parameter it is `share` times its value, or times the mean of
/// its kind where that is larger. Effects that the model has not are free.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterPrior {
    /// What was believed.
    pub model: RobotModel,
    /// Standard deviation over magnitude.
    pub share: f64,
}

/// The standard deviation of a number uniform between 0 and 2, over its mean: how wrong the paper's bad
/// initial model is (section 5.2.1).
const UNIFORM_SHARE: f64 = 0.577_350_269_189_625_8;

impl ParameterPrior {
    /// For the paper's bad initial model, each of whose parameters is drawn uniformly between zero and twice
    /// the truth.
    ///
    /// The magnitudes are those of the draw, as nobody knows the true ones. A friction that was drawn much
    /// too small is therefore believed too firmly: single frictions are let go by more logs only. A larger
    /// `share` lets go earlier, and guards less against the noise of few logs.
    pub fn unreliable(model: RobotModel) -> Self {
        ParameterPrior { model, share: UNIFORM_SHARE }
    }

    /// The belief as rows of unit variance over all parameters of `design`.
    pub(super) fn group(&self, design: &Design) -> Result<Group, EstimationError> {
        if !(self.share.is_finite() && self.share > 0.0) {
            let what = "the share by which a prior may be wrong";
            return Err(EstimationError::Value { what, value: self.share, must_be: "finite and > 0" });
        }
        let (count, rigid) = (design.parameter_count(), design.base().count());
        let mut builder = FactorBuilder::new(count + 1);
        let mut row = vec![0.0; count + 1];
        for prior in design.base().prior_rows(&self.model.standard, self.share)?.chunks_exact(rigid + 1) {
            row[..rigid].copy_from_slice(&prior[..rigid]);
            row[count] = prior[rigid];
            builder.push_row(&row)?;
        }
        for (index, effect) in design.effects().iter().enumerate() {
            let spec = effect.spec();
            let Some(known) = self.model.effects.iter().find(|known| known.spec == spec) else { continue };
            let parameters = design.effect_parameters(index);
            check_size("parameters of a prior's effect", known.parameters.len(), parameters.len())?;
            for (place, (parameter, &value)) in parameters.zip(&known.parameters).enumerate() {
                let scale = self.share * value.abs().max(self.mean_of_kind(&spec.kind, place));
                // Nothing is known of the size of what is zero in every effect of its kind.
                if scale > 0.0 {
                    row.fill(0.0);
                    (row[parameter], row[count]) = (1.0 / scale, value / scale);
                    builder.push_row(&row)?;
                }
            }
        }
        Ok(Group { parameters: (0..count).collect(), factor: builder.factor() })
    }

    /// Mean magnitude of a parameter over all effects of a kind.
    fn mean_of_kind(&self, kind: &str, place: usize) -> f64 {
        let of_kind = self.model.effects.iter().filter(|effect| effect.spec.kind == kind);
        let values: Vec<f64> =
            of_kind.filter_map(|effect| effect.parameters.get(place)).map(|value| value.abs()).collect();
        values.iter().sum::<f64>() / values.len().max(1) as f64
    }
}

/// The measured rows, and those of a belief as one more group.
pub(super) fn with_prior(measured: &GroupedFactor, prior: Group) -> Result<GroupedFactor, EstimationError> {
    let groups = measured.groups().iter().cloned().chain([prior]).collect();
    Ok(GroupedFactor::new(measured.parameter_count(), groups)?)
}
