//! Estimates whose frictions turn within a period as the estimate itself says.
//!
//! How a friction turns depends on how large it is, so an estimator takes both from a belief and linearizes
//! there ([`super::turning`]). Its minimum is the next belief: Gauss and Newton's steps, which are halved
//! where −log L under the step's own frictions would grow.

use super::settings::NewtonSettings;
use super::{Estimate, Evidence};
use crate::EstimationError;
use phiw_identification::Design;

/// What all rounds share.
pub(super) struct OwnFriction<'a> {
    pub design: &'a Design,
    /// Bodies that do not move.
    pub standing_on: &'a [usize],
    pub settings: &'a NewtonSettings,
}

/// Parameters, the evidence under them, and −log L of both.
struct Belief {
    parameters: Vec<f64>,
    evidence: Evidence,
    cost: f64,
}

impl OwnFriction<'_> {
    /// The `minimum` of evidence, from the parameters to begin with on, made again until its frictions turn
    /// as it says; `cost` is −log L. Where no friction turns, the minimum.
    ///
    /// # Errors
    /// Those of `minimum` and `cost`; the design is not that of the evidence.
    pub fn estimate(
        &self,
        evidence: &Evidence,
        present: &[f64],
        minimum: impl Fn(&Evidence, &[f64]) -> Result<Estimate, EstimationError>,
        cost: impl Fn(&Evidence, &[f64]) -> Result<f64, EstimationError>,
    ) -> Result<Estimate, EstimationError> {
        let believe = |parameters: Vec<f64>| {
            let Some(evidence) = evidence.under(self.design, &parameters, self.standing_on)? else {
                return Ok::<_, EstimationError>(None);
            };
            let cost = cost(&evidence, &parameters)?;
            let cost = if cost.is_finite() { cost } else { f64::INFINITY };
            Ok(Some(Belief { parameters, evidence, cost }))
        };
        let Some(mut belief) = believe(present.to_vec())? else { return minimum(evidence, present) };
        let mut found = minimum(&belief.evidence, present)?;
        for _ in 0..self.settings.friction_rounds {
            let moved =
                |k: usize| (found.parameters[k] - belief.parameters[k]).abs() / found.standard_deviations[k];
            // What has no standard deviation has not moved.
            if (0..present.len()).map(moved).fold(0.0, f64::max) < self.settings.friction_settled {
                return Ok(found);
            }
            let mut share = 1.0;
            let next = loop {
                let along = |(from, to): (&f64, &f64)| from + share * (to - from);
                let trial = belief.parameters.iter().zip(&found.parameters).map(along).collect();
                let Some(trial) = believe(trial)? else { return Ok(found) };
                if trial.cost <= belief.cost || share <= self.settings.least_friction_step {
                    break trial;
                }
                share *= 0.5;
            };
            belief = next;
            found = minimum(&belief.evidence, &belief.parameters)?;
        }
        // The last minimum was not tried under its own frictions.
        found.parameters = belief.parameters;
        Ok(found)
    }
}
