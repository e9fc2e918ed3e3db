//! A fitted model with everything that the report says of it.

use crate::noise_floor::{NOISE_MARGIN, noise_floor};
use crate::possible_bodies::PossibleBodies;
use crate::session::Session;
use crate::traces::Traces;
use crate::{Error, conventions, fingerprint, told, warnings};
use phiw_identification::bandwidth::Bandwidth;
use phiw_identification::fitting::{held_out_change, log_changes, merge};
use phiw_identification::model::DataFingerprint;
use phiw_identification::{Data, Identified, Model, WithRests};
use phiw_regressor::RegressorError;
use phiw_report::json::InformationJson;

/// A fitted model with everything that the report says of it.
pub struct Analysis<'a> {
    /// Robot, logs, declared effects.
    pub session: &'a Session,
    /// The fit.
    pub identified: &'a Identified,
    /// The same as it is written to `model.json`.
    pub model: Model,
    /// The same fit over bodies that can exist, and least squares.
    pub possible: PossibleBodies,
    /// What the logs tell of each parameter.
    pub information: InformationJson,
    /// Torques over time; none where the rows were not at hand.
    pub traces: Option<Traces>,
    /// What the rows at which joints rest add.
    pub with_rests: WithRests,
    /// RMS of the noise in each joint's filtered torque, disturbances that follow nothing measured included
    /// where they were looked for \[N·m, N\].
    pub noise_floor: Vec<f64>,
    /// What other cut-offs would do, where it was asked.
    pub bandwidth: Option<Bandwidth>,
    /// The training log that tells otherwise than all together, where logs were compared.
    pub odd_log: Option<usize>,
    /// What a reader should know before trusting a number.
    pub warnings: Vec<String>,
}

impl<'a> Analysis<'a> {
    /// Puts everything together; where the logs are at hand, it passes over them once more with the fitted
    /// model. `with_rests` is found there where it is not given.
    ///
    /// # Errors
    /// A log cannot be read any more.
    pub fn new(
        session: &'a Session,
        rows: Rows<'_>,
        identified: &'a Identified,
        possible: PossibleBodies,
        with_rests: Option<WithRests>,
    ) -> Result<Self, Error> {
        let Identified { design, fit, .. } = identified;
        let at_rest = session.joints_without_held_out_motion(&identified.held_out_folds)?;
        let conditioning = session.logs.conditioning();
        let cutoffs = (conditioning.cutoff_hz, conditioning.parallel_cutoff_hz);
        let fingerprints = match rows {
            Rows::Logs(_) => fingerprint::of_session(session)?,
            Rows::Reduced { fingerprints, .. } => fingerprints.to_vec(),
        };
        let model = Model::of_fit(design, fit, &session.declared, &session.held, cutoffs)?
            .with_sources(&session.xml, fingerprints);
        let changed = held_out_change(identified)?;
        // The error on another robot's motion is no error of this model.
        let model = match changed.is_empty() {
            true => model.with_held_out_rmse(&identified.held_out.rmse),
            false => model,
        };
        let model = model.with_consistent(design, &possible.consistent)?;
        let information = told::information(session, identified, &possible.consistent)?;
        let traces = match rows {
            Rows::Logs(data) => {
                let folds = [data.train.as_slice(), data.held_out.as_slice()];
                Some(Traces::collect(design, &fit.parameters, folds, &data.sources)?)
            }
            Rows::Reduced { .. } => None,
        };
        let noise_floor = noise_floor(session, rows, &model)?;
        let of_traces = || traces.as_ref().map(|traces| traces.with_rests(session.tree.joint_count()));
        let with_rests = with_rests.or_else(of_traces).unwrap_or_default();
        let mut warnings = warnings::all(session, identified);
        if let Rows::Logs(data) = rows {
            warnings.extend(conventions::warnings(session, data)?);
        }
        warnings.extend(possible.warnings(model.bodies.len(), fit));
        warnings.extend(warnings::at_rest_where_held_out(session, &at_rest));
        warnings.extend(warnings::changed_where_held_out(session, &changed));
        Ok(Analysis {
            session,
            identified,
            model,
            possible,
            information,
            traces,
            with_rests,
            noise_floor,
            bandwidth: None,
            odd_log: None,
            warnings,
        })
    }

    /// The same with a warning if the training logs are not of one robot. Not for a held model, whose
    /// parameters are not those of these logs.
    ///
    /// # Errors
    /// The factors are not of these logs.
    pub fn with_logs_compared(mut self) -> Result<Self, Error> {
        let Identified { fit, train_folds, .. } = self.identified;
        let changes = log_changes(fit, &self.session.logs.training_folds(), train_folds)?;
        self.odd_log = match self.session.logs.training().len() {
            // Of two that differ the later one is what has changed.
            2 => changes.iter().map(|change| change.log).max(),
            _ => changes.first().map(|change| change.log),
        };
        let warning = self.odd_log.and_then(|odd| warnings::of_another_robot(self.session, odd, &changes));
        self.warnings.extend(warning);
        Ok(self)
    }

    /// The same with what other cut-offs would do.
    pub fn with_bandwidth(mut self, bandwidth: Option<Bandwidth>) -> Self {
        self.warnings.extend(bandwidth.iter().flat_map(crate::bandwidth::warnings));
        Analysis { bandwidth, ..self }
    }

    /// Names of the robot's joints.
    pub fn joints(&self) -> Vec<String> {
        self.session.tree.joint_names().map(str::to_owned).collect()
    }

    /// Joints whose held-out error exceeds the noise floor by more than its uncertainty.
    pub fn joints_above_noise(&self) -> Vec<usize> {
        let errors = self.identified.held_out.rmse.iter().zip(&self.noise_floor).enumerate();
        errors
            .filter(|(_, (error, floor))| **error > NOISE_MARGIN * **floor)
            .map(|(joint, _)| joint)
            .collect()
    }

    /// cond of the weighted regressor.
    pub fn condition_number(&self) -> f64 {
        self.identified.fit.factor.condition_number().unwrap_or(f64::NAN)
    }

    /// Determined parameters that act like an undetermined one on the training motion, with their share,
    /// largest first.
    ///
    /// # Errors
    /// None is known: the fit has solved the same columns.
    pub fn acts_like(&self, undetermined: usize) -> Result<Vec<(usize, f64)>, RegressorError> {
        let fit = &self.identified.fit;
        let all = merge(&self.identified.train_folds)?;
        let weights: Vec<f64> = fit.residual_std.iter().map(|std| 1.0 / std.max(f64::MIN_POSITIVE)).collect();
        let factor = all.combine(&weights)?;
        let mut columns = fit.determined();
        columns.push(undetermined);
        let coefficients = factor.select(&columns)?.solve()?.parameters;
        let norm = factor.column_norm(undetermined);
        let share = |(&column, coefficient): (&usize, &f64)| {
            (column, coefficient * factor.column_norm(column) / norm)
        };
        let mut shares: Vec<(usize, f64)> = columns.iter().zip(&coefficients).map(share).collect();
        shares.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        Ok(shares)
    }
}

/// Where the rows of the logs are.
#[derive(Clone, Copy)]
pub enum Rows<'a> {
    /// At hand.
    Logs(&'a Data<'a>),
    /// Elsewhere: they were reduced.
    Reduced {
        /// The logs.
        fingerprints: &'a [DataFingerprint],
        /// Positions here and there in the logs \[rad, m\], one row after another.
        poses: &'a [f64],
    },
}
