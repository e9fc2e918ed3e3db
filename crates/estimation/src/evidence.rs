//! All that estimators remember of what was measured.

use super::foresight;
use super::in_order::InOrder;
use super::stored::StoredFactor;
use super::turning::{Believed, Turned, TurningColumns, turned};
use crate::{EstimationError, MotionLog};
use phiw_identification::fitting::accumulate;
use phiw_identification::{Design, Fold, IdentificationError};
use phiw_regressor::factor::Factor;
use phiw_regressor::least_squares::{Group, GroupedFactor};
use phiw_telemetry::Block;
use serde::{Deserialize, Serialize};

/// Which instants of a log become rows of Φ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RowsAt {
    /// The stamps: position, velocity and acceleration as they were measured there, as the paper has it.
    Stamps,
    /// The middle of each period: what the motion was on average while one command was held. Position by
    /// Hermite's cubic, velocity Δq/T, acceleration Δq̇/T, so that inertia and viscous friction balance the
    /// command exactly, however fast the motion changes within a period. Dry friction is the mean on the way
    /// of the velocity. Other effects that are not linear in the motion are taken as they were when the
    /// period began, so that its noise is not in them.
    #[default]
    Periods,
}

/// How logs are reduced.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EvidenceSettings {
    /// Which instants become rows.
    pub rows_at: RowsAt,
    /// Time between two instants at which the motion's sensitivity to noise is looked at \[s\]. Shorter costs
    /// time in each estimate. Default: 0.4, in which the inertia of a robot moved by a person changes little.
    pub instant_every_s: f64,
    /// Whether each row is taken together with the one before it, for estimators that find out how noise is
    /// correlated in time ([`super::Estimator::in_order`]). It costs four times the columns' square. Rows
    /// over periods only. Default: no.
    pub in_order: bool,
}

impl Default for EvidenceSettings {
    fn default() -> Self {
        EvidenceSettings { rows_at: RowsAt::default(), instant_every_s: 0.4, in_order: false }
    }
}

impl From<RowsAt> for EvidenceSettings {
    fn from(rows_at: RowsAt) -> Self {
        EvidenceSettings { rows_at, ..EvidenceSettings::default() }
    }
}

/// One instant of a motion that stands for many.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Instant {
    /// How many rows it stands for.
    pub weight: f64,
    /// Time over which one command was held \[s\].
    pub period_s: f64,
    /// `[q, q̇, q̈]`.
    pub state: [Vec<f64>; 3],
}

/// What was measured, reduced to what estimators and selections need. It depends on the length of the logs by
/// some instants only, but for logs of encoders and of frictions that turn, which are looked at again under a
/// better belief: it keeps these.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(into = "StoredEvidence", try_from = "StoredEvidence")]
pub struct Evidence {
    pub(super) settings: EvidenceSettings,
    pub(super) factor: GroupedFactor,
    pub(super) instants: Vec<Instant>,
    /// For each instant, the slopes of what turns with a velocity in the periods that it stands for.
    pub(super) turned: Vec<Turned>,
    /// Of which parameters the columns are those of the periods' beginnings; none of them if it is empty.
    pub(super) foreseen: Vec<bool>,
    /// Rows a second of each torque \[Hz\]; none where they are as dense as those of the motions.
    pub(super) rate_hz: Option<f64>,
    /// The rows with those before them, where the settings ask for them.
    pub(super) in_order: Option<InOrder>,
    /// Logs of encoders, where rows are asked for in order: their motion is found again under a better
    /// belief.
    pub(super) encoder_logs: Vec<MotionLog>,
    /// Other logs of a robot with frictions that turn: how they do is found again under a better belief.
    turning_logs: Vec<MotionLog>,
    /// Under which belief it was found.
    believed: Option<Believed>,
}

#[derive(Serialize, Deserialize)]
struct StoredEvidence {
    #[serde(flatten)]
    settings: EvidenceSettings,
    factor: StoredFactor,
    instants: Vec<Instant>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    turned: Vec<Turned>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    foreseen: Vec<bool>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rate_hz: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rows_in_order: Option<StoredFactor>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    encoder_logs: Vec<MotionLog>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    turning_logs: Vec<MotionLog>,
}

impl From<Evidence> for StoredEvidence {
    fn from(evidence: Evidence) -> Self {
        let Evidence {
            settings,
            factor,
            instants,
            turned,
            foreseen,
            rate_hz,
            in_order,
            encoder_logs,
            turning_logs,
            ..
        } = evidence;
        let rows_in_order = in_order.map(|in_order| StoredFactor::from(in_order.factor()));
        let factor = StoredFactor::from(&factor);
        StoredEvidence {
            settings,
            factor,
            instants,
            turned,
            foreseen,
            rate_hz,
            rows_in_order,
            encoder_logs,
            turning_logs,
        }
    }
}

impl TryFrom<StoredEvidence> for Evidence {
    type Error = IdentificationError;

    fn try_from(stored: StoredEvidence) -> Result<Self, IdentificationError> {
        let StoredEvidence {
            settings,
            factor,
            instants,
            turned,
            foreseen,
            rate_hz,
            rows_in_order,
            encoder_logs,
            turning_logs,
        } = stored;
        let in_order: Option<GroupedFactor> = rows_in_order.map(TryInto::try_into).transpose()?;
        let in_order = in_order.map(InOrder::of_factor);
        let of_rows = Evidence::of_factor(factor.try_into()?, rate_hz);
        Ok(Evidence { settings, instants, turned, foreseen, in_order, encoder_logs, turning_logs, ..of_rows })
    }
}

impl Evidence {
    /// Nothing yet.
    ///
    /// # Errors
    /// None that a design can cause.
    pub fn none(design: &Design, settings: impl Into<EvidenceSettings>) -> Result<Self, EstimationError> {
        let settings = settings.into();
        let group = |row: &phiw_identification::design::RowLayout| Group {
            parameters: row.parameters.clone(),
            factor: Factor::empty(row.parameters.len() + 1),
        };
        let groups = design.rows().iter().map(group).collect();
        let factor = GroupedFactor::new(design.parameter_count(), groups)?;
        let mut foreseen = match settings.rows_at {
            RowsAt::Stamps => Vec::new(),
            RowsAt::Periods => foresight::foreseen(design),
        };
        if !foreseen.contains(&true) {
            foreseen.clear();
        }
        let asked = settings.in_order && settings.rows_at == RowsAt::Periods;
        let in_order = asked.then(|| InOrder::none(design)).transpose()?;
        Ok(Evidence { settings, foreseen, in_order, ..Evidence::of_factor(factor, None) })
    }

    /// What somebody else has reduced: rows of \[Φ f\] of logs that were conditioned, as `phiw identify` has
    /// them, `rate_hz` of each torque a second \[Hz\].
    pub fn of_factor(factor: GroupedFactor, rate_hz: Option<f64>) -> Self {
        Evidence {
            settings: RowsAt::Stamps.into(),
            factor,
            instants: Vec::new(),
            turned: Vec::new(),
            foreseen: Vec::new(),
            rate_hz,
            in_order: None,
            encoder_logs: Vec::new(),
            turning_logs: Vec::new(),
            believed: None,
        }
    }

    /// The same evidence with how frictions turn within a period as it is under `parameters` of the design;
    /// none where no friction turns, or its logs are of encoders, which are smoothed under a belief anyway.
    ///
    /// # Errors
    /// The design is not that of the evidence.
    pub(super) fn under(
        &self,
        design: &Design,
        parameters: &[f64],
        standing_on: &[usize],
    ) -> Result<Option<Self>, EstimationError> {
        if self.turning_logs.is_empty() {
            return Ok(None);
        }
        let believed = Believed { parameters: parameters.to_vec(), standing_on: standing_on.to_vec() };
        let mut again = Evidence::none(design, self.settings)?.believing(believed);
        for log in &self.turning_logs {
            again.add(design, log)?;
        }
        again.rate_hz = self.rate_hz;
        Ok(Some(again))
    }

    /// The same, in which logs are looked at under a belief; it has none yet.
    pub(super) fn believing(self, believed: Believed) -> Self {
        Evidence { believed: Some(believed), ..self }
    }

    /// The same for a robot that moves without noise: all columns are those of a period's mean motion.
    pub fn without_noise(self) -> Self {
        Evidence { foreseen: Vec::new(), ..self }
    }

    /// The same of logs with so many rows a second \[Hz\].
    pub fn at_rate(self, rate_hz: f64) -> Self {
        Evidence { rate_hz: Some(rate_hz), ..self }
    }

    /// Takes in a log.
    ///
    /// # Errors
    /// It is not of this robot, or has no derivatives where [`RowsAt`] asks for them.
    pub fn add(&mut self, design: &Design, measured: &MotionLog) -> Result<(), EstimationError> {
        let is_first = self.is_empty();
        let block = match self.settings.rows_at {
            RowsAt::Stamps => measured.at_stamps()?,
            RowsAt::Periods => measured.over_periods(),
        };
        self.instants.extend(instants(&block, measured.period_s, self.settings.instant_every_s));
        let stride = periods_of_an_instant(measured.period_s, self.settings.instant_every_s);
        if !self.foreseen.is_empty() {
            let believed = self.believed.as_ref();
            self.turned.extend(turned(design, &self.foreseen, (measured, stride), believed)?);
        }
        let factor = match self.foreseen.as_slice() {
            [] => grouped_factor(design, block)?,
            foreseen => foresight::factor(design, foreseen, (measured, self.believed.as_ref()))?,
        };
        self.factor = self.factor.merge(&factor)?;
        if let Some(in_order) = &mut self.in_order {
            in_order.add(design, &self.foreseen, (measured, self.believed.as_ref()))?;
            match measured.readings.is_some() && (is_first || !self.encoder_logs.is_empty()) {
                true => self.encoder_logs.push(measured.clone()),
                // Of others the motion was measured: all logs are taken as they are.
                false => self.encoder_logs.clear(),
            }
        }
        let has_all = (is_first || !self.turning_logs.is_empty()) && self.encoder_logs.is_empty();
        if has_all && !TurningColumns::of(design, &self.foreseen)?.columns().is_empty() {
            self.turning_logs.push(measured.clone());
        } else {
            self.turning_logs.clear();
        }
        Ok(())
    }

    /// R of \[Φ f\], one for each torque.
    pub fn factor(&self) -> &GroupedFactor {
        &self.factor
    }

    /// Rows a second of each torque \[Hz\]; none where they are as dense in time as those of the motions to
    /// choose from.
    pub fn rate_hz(&self) -> Option<f64> {
        self.rate_hz
    }

    /// Instants that stand for the motion.
    pub fn instants(&self) -> &[Instant] {
        &self.instants
    }

    /// Whether a parameter's columns are those of the periods' beginnings, which their own noise has not
    /// moved.
    pub(super) fn is_foreseen(&self, parameter: usize) -> bool {
        self.foreseen.get(parameter).copied().unwrap_or(false)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.factor.rows() == 0
    }
}

/// Periods that an instant stands for, but the last of a log.
pub(super) fn periods_of_an_instant(period_s: f64, every_s: f64) -> usize {
    ((every_s / period_s).round() as usize).max(1)
}

/// Evenly spaced samples, each in the middle of those that it stands for.
pub(super) fn instants(block: &Block, period_s: f64, every_s: f64) -> Vec<Instant> {
    let stride = periods_of_an_instant(period_s, every_s);
    let stretches = block.len().div_ceil(stride);
    let stretch = |index: usize| {
        let end = ((index + 1) * stride).min(block.len());
        let row = block.row((index * stride).midpoint(end - 1));
        let state = [&block.q, &block.qd, &block.qdd].map(|signal| signal[row.clone()].to_vec());
        Instant { weight: (end - index * stride) as f64, period_s, state }
    };
    (0..stretches).map(stretch).collect()
}

/// The factors of a block's rows, one for each torque.
///
/// # Errors
/// The block is not of this robot.
pub fn grouped_factor(design: &Design, block: Block) -> Result<GroupedFactor, EstimationError> {
    let everything = Fold { log: block.log, start: f64::NEG_INFINITY, end: f64::INFINITY };
    let mut factors = accumulate(design, &[everything], &[&vec![block]])?;
    Ok(factors.swap_remove(0))
}
