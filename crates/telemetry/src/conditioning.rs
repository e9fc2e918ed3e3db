//! How logs are conditioned: chosen once for a session, applied to each log.

use crate::clock::ClockChoice;
use crate::cutoff::{self, BANDWIDTHS, CutoffSuggestion};
use crate::{LogError, Survey};
use serde::{Deserialize, Serialize};
use std::fmt;

/// What the user fixes; what is left `None` is chosen from the data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ConditioningOptions {
    /// Cut-off of the positions' low-pass, in Hz.
    pub cutoff_hz: Option<f64>,
    /// Cut-off of the parallel filter over columns and torque, in Hz; by default the motion's bandwidth, an
    /// eighth of the positions' cut-off, but at least 10 Hz.
    pub parallel_cutoff_hz: Option<f64>,
    /// Samples from one output to the next; by default the output rate is about four times the parallel
    /// cut-off.
    pub decimation: Option<usize>,
    /// How stamps that jitter are read.
    pub clock: ClockChoice,
    /// Whether the columns `qd.<joint>`, `qdd.<joint>` are used where there are plausible ones, instead of
    /// differentiating.
    pub use_measured_derivatives: bool,
    /// Leading samples of a block that no output covers, in seconds: effects with memory run over them first,
    /// so that they do not begin anew in each block.
    #[serde(with = "crate::any_number")]
    pub warm_up: f64,
    /// About how many samples a block has.
    pub block_samples: usize,
}

/// Samples before a stretch that effects with memory run over first, in seconds: long against what a joint's
/// friction takes to forget.
pub const WARM_UP_S: f64 = 2.0;

impl Default for ConditioningOptions {
    fn default() -> Self {
        ConditioningOptions {
            cutoff_hz: None,
            parallel_cutoff_hz: None,
            decimation: None,
            clock: ClockChoice::Auto,
            use_measured_derivatives: true,
            warm_up: WARM_UP_S,
            block_samples: 1 << 13,
        }
    }
}

/// How the logs of a session are conditioned.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Conditioning {
    /// Cut-off of the positions' low-pass (−6 dB), in Hz.
    #[serde(with = "crate::any_number")]
    pub cutoff_hz: f64,
    /// Whether the data chose it, not the user.
    pub cutoff_from_data: bool,
    /// Cut-off of the parallel filter (−6 dB), in Hz.
    #[serde(with = "crate::any_number")]
    pub parallel_cutoff_hz: f64,
    /// What each joint of each log suggests as the positions' cut-off; the largest is taken. Joints that
    /// never move suggest none.
    pub suggestions: Vec<CutoffSuggestion>,
    /// What was asked for.
    pub options: ConditioningOptions,
}

impl Conditioning {
    /// Chooses one conditioning for the logs of a session from its training logs: the same cut-offs for all.
    ///
    /// Logs that a model is validated on have no say. Where such a log's sample rate cannot carry cut-offs
    /// that were chosen from data, it is read with the highest that it can ([`Conditioning::plan`]).
    ///
    /// # Errors
    /// [`LogError::Cutoff`] for a cut-off that some training log's sample rate can't carry.
    pub fn choose(training: &[Survey], options: &ConditioningOptions) -> Result<Self, LogError> {
        let suggestions: Vec<_> =
            training.iter().enumerate().flat_map(|(log, survey)| cutoff::suggest(survey, log)).collect();
        let highest = training.iter().map(highest_hz).fold(f64::INFINITY, f64::min);
        let suggested = suggestions.iter().map(|suggestion| suggestion.cutoff_hz).fold(0.0, f64::max);
        let from_data = if suggested > 0.0 { suggested.min(highest) } else { highest };
        let cutoff_hz = options.cutoff_hz.unwrap_or(from_data);
        // The positions' filter must not change accelerations within the motion's band. The parallel filter
        // changes columns and torque alike, so its cut-off may be the motion's bandwidth.
        let parallel = (cutoff_hz / BANDWIDTHS).max(LEAST_PARALLEL_HZ).min(cutoff_hz);
        let conditioning = Conditioning {
            cutoff_hz,
            cutoff_from_data: options.cutoff_hz.is_none(),
            parallel_cutoff_hz: options.parallel_cutoff_hz.unwrap_or(parallel),
            suggestions,
            options: options.clone(),
        };
        for survey in training {
            conditioning.check(survey)?;
        }
        Ok(conditioning)
    }

    /// Cut-offs of the positions' low-pass and of the parallel filter for a log, in Hz: those of the session,
    /// unless data chose them and the log's sample rate cannot carry them.
    pub fn cutoffs_for(&self, survey: &Survey) -> [f64; 2] {
        let told = &self.options;
        let cutoff_hz = match told.cutoff_hz {
            Some(cutoff_hz) => cutoff_hz,
            None => self.cutoff_hz.min(highest_hz(survey)),
        };
        let parallel = told.parallel_cutoff_hz.unwrap_or(self.parallel_cutoff_hz.min(cutoff_hz));
        [cutoff_hz, parallel]
    }

    pub(crate) fn check(&self, survey: &Survey) -> Result<(), LogError> {
        let highest_hz = HIGHEST_SHARE_BY_HAND * survey.rate_hz();
        for cutoff_hz in self.cutoffs_for(survey) {
            let rate_hz = survey.rate_hz();
            let lowest_hz = LOWEST_SHARE_BY_HAND * rate_hz;
            if !(lowest_hz..=highest_hz).contains(&cutoff_hz) {
                let path = survey.path.clone();
                return Err(LogError::Cutoff { path, cutoff_hz, rate_hz, lowest_hz, highest_hz });
            }
        }
        Ok(())
    }
}

/// The highest cut-off that is chosen for a log, in Hz.
fn highest_hz(survey: &Survey) -> f64 {
    cutoff::HIGHEST_SHARE * survey.rate_hz()
}

/// What friction does at a reversal lies below this, however slow the motion is otherwise.
const LEAST_PARALLEL_HZ: f64 = 10.0;

/// Below this share of the sample rate the low-pass is longer than a hundred thousand samples, and no number
/// of its length need exist.
const LOWEST_SHARE_BY_HAND: f64 = 1e-5;

/// The low-pass ends at 1.4 times the cut-off; that must stay below half the sample rate.
const HIGHEST_SHARE_BY_HAND: f64 = 0.35;

impl fmt::Display for Conditioning {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let origin = if self.cutoff_from_data { "chosen from the spectra" } else { "as told" };
        write!(f, "positions low-passed at {:.2} Hz ({origin}), ", self.cutoff_hz)?;
        write!(f, "columns and torque at {:.2} Hz", self.parallel_cutoff_hz)
    }
}
