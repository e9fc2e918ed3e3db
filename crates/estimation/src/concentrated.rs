//! Maximum likelihood of a motion that noise moves, where nobody knows the noise.

use super::body_prior::BodyPrior;
use super::in_order::{Colour, InOrder};
use super::likelihood::column;
use super::profile::{Minimum, Profile};
use super::sensitivity::Sensitivity;
use super::settings::NewtonSettings;
use super::{Estimate, Estimator, Evidence};
use crate::{EstimationError, RobotModel};
use faer::Mat;
use phiw_identification::Design;

/// [`super::MotionLikelihood`] without being told the noise: its size, its correlation from a period to the
/// next, and how much of what the log's torque has beside the command moved the robot are found with the
/// parameters.
///
/// Three things are unknown of each torque, and each has its own trace in the logs:
///
/// - σ, the size. That of the residual under the parameters; the parameters are those that are most likely
///   when σ is (concentrated likelihood). What is lost against a known σ is what the noise's own size
///   tells of the inertia it shakes.
/// - ρ, the correlation from one command to the next. The rows are Φ_t − ρ·Φ_{t−1} (Cochrane & Orcutt
///   1949), whose noise is white, so that the state a period begins with is an instrument again.
/// - Where the noise is. A controller of the form (13) commands what follows from the reference and the
///   encoders ([`crate::MotionLog::commands`]); what the log's torque has beside it is an error of its
///   sensor, or was delivered and moved the robot. The share that did is a coefficient of its own.
///
/// Bodies are possible: the prior is the log-det divergence from what was believed at first, and frictions
/// stay positive. Where the log knows neither commands nor reference, its torque is taken for the command:
/// right where that is what it is, or a torque sensor's noise is small beside the actuators'.
#[derive(Clone, Debug, PartialEq)]
pub struct ConcentratedLikelihood {
    /// What was believed before anything was measured.
    pub initial: RobotModel,
    /// Bodies that do not move ([`super::MotionLikelihood::standing_on`]).
    pub standing_on: Vec<usize>,
    /// What it decides.
    pub settings: ConcentratedSettings,
}

/// What [`ConcentratedLikelihood`] decides.
#[derive(Clone, Debug, PartialEq)]
pub struct ConcentratedSettings {
    /// Weight of the prior: nats of −log L a unit of divergence. Default: 1.
    pub prior_weight: f64,
    /// How round the bodies are that are believed at first: least second moment about the centre of mass
    /// along any axis, over the mean of all axes. Default: 0.4.
    pub roundness: f64,
    /// Rounds at first in which the prior weighs more, each a step nearer to its own weight, and the noise
    /// counts as white: the path leads from what was believed to the estimate through possible bodies.
    /// Default: 6.
    pub tempered_rounds: usize,
    /// How many times more it weighs in one of these than in the next. Default: 4.
    pub tempering: f64,
    /// Rounds after these that take the torques' median correlation for all: under a bad belief the residual
    /// of a single torque is no noise yet, and may keep the estimate from ever leaving it. Default: 4.
    pub rounds_in_common: usize,
    /// Rounds after these at most, each torque with its own correlation. Default: 6.
    pub rounds: usize,
    /// Newton steps of a round at most, but of the last: what is found anew a moment later need not be
    /// found exactly. Default: 8.
    pub steps_a_round: usize,
    /// Change of a correlation from which on another round is worth it. Default: 0.005.
    pub settled: f64,
    /// Largest correlation of the noise. Default: 0.98: rows of a noise that is nearly a constant say nothing
    /// of weights.
    pub largest_correlation: f64,
    /// Least standard deviation of a torque's noise over the RMS of its command. Default: 3·10⁻³. No drive
    /// delivers its command better than to some thousandths, and without a floor a log without noise would
    /// leave no digits for the bodies.
    pub least_noise: f64,
    /// How minima are found.
    pub newton: NewtonSettings,
}

impl Default for ConcentratedSettings {
    fn default() -> Self {
        ConcentratedSettings {
            prior_weight: 1.0,
            roundness: 0.4,
            tempered_rounds: 6,
            tempering: 4.0,
            rounds_in_common: 4,
            rounds: 6,
            steps_a_round: 8,
            settled: 0.005,
            largest_correlation: 0.98,
            least_noise: 3e-3,
            newton: NewtonSettings::default(),
        }
    }
}

/// The noise of a torque, as found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueNoise {
    /// Standard deviation of what moved the robot beside the command \[N·m, N\].
    pub std: f64,
    /// Its correlation from one command to the next.
    pub correlation: f64,
    /// Share of what the log's torque has beside the command that moved the robot: 0 where it is the error of
    /// a sensor, 1 where it was delivered.
    pub felt: f64,
}

impl ConcentratedLikelihood {
    /// For a robot of which this was believed at first.
    pub fn new(initial: RobotModel) -> Self {
        ConcentratedLikelihood { initial, standing_on: Vec::new(), settings: ConcentratedSettings::default() }
    }

    /// The same for a robot on which these bodies do not move.
    pub fn standing_on(self, bodies: Vec<usize>) -> Self {
        ConcentratedLikelihood { standing_on: bodies, ..self }
    }

    /// The noise of each torque under `parameters`.
    ///
    /// # Errors
    /// The evidence is not of this design, or its rows were not taken in order.
    pub fn noise(
        &self,
        design: &Design,
        evidence: &Evidence,
        parameters: &[f64],
    ) -> Result<Vec<TorqueNoise>, EstimationError> {
        let parts = self.parts(design, evidence)?;
        let colours = parts.colours(self, parameters);
        let std = parts.profile(self, &colours)?.noise(&column(parameters));
        let noise = |(colour, std): (&Colour, f64)| TorqueNoise {
            std: std / (1.0 - colour.correlation * colour.correlation).sqrt(),
            correlation: colour.correlation,
            felt: colour.felt,
        };
        Ok(colours.iter().zip(std).map(noise).collect())
    }

    fn parts<'a>(&self, design: &Design, evidence: &'a Evidence) -> Result<Parts<'a>, EstimationError> {
        let in_order = evidence.in_order()?;
        let prior = BodyPrior::new(design, &self.initial, self.settings.roundness)?;
        let base = design.base().map();
        let (rigid, standard) = (design.base().count(), prior.standard_size());
        let map = Mat::from_fn(design.parameter_count(), prior.size(), |row, column| {
            match (row < rigid, column < standard) {
                (true, true) => base[(row, column)],
                (false, false) => f64::from(u8::from(row - rigid == column - standard)),
                _ => 0.0,
            }
        });
        let sensitivities = Sensitivity::all(design, evidence, &self.standing_on)?;
        let variance = |group: &phiw_regressor::least_squares::Group| {
            let rows = group.factor.rows().max(1) as f64;
            let square = group.factor.right_hand_side_sum_of_squares() / rows;
            (self.settings.least_noise.powi(2) * square).max(f64::MIN_POSITIVE)
        };
        let least_variance = evidence.factor().groups().iter().map(variance).collect();
        Ok(Parts { in_order, prior, map, sensitivities, least_variance })
    }
}

/// What all rounds share.
struct Parts<'a> {
    in_order: &'a InOrder,
    prior: BodyPrior,
    map: Mat<f64>,
    sensitivities: Vec<Sensitivity>,
    least_variance: Vec<f64>,
}

impl Parts<'_> {
    fn colours(&self, estimator: &ConcentratedLikelihood, w: &[f64]) -> Vec<Colour> {
        self.in_order.colours(w, &self.least_variance, estimator.settings.largest_correlation)
    }

    fn profile(
        &self,
        estimator: &ConcentratedLikelihood,
        colours: &[Colour],
    ) -> Result<Profile<'_>, EstimationError> {
        let factor = self.in_order.whitened(colours)?;
        let gram = |group: &phiw_regressor::least_squares::Group| {
            let size = group.factor.parameters();
            let r = group.factor.as_mat().get(.., ..size);
            r.transpose() * r
        };
        Ok(Profile {
            grams: factor.groups().iter().map(gram).collect(),
            factor,
            sensitivities: &self.sensitivities,
            map: &self.map,
            prior: &self.prior,
            prior_weight: estimator.settings.prior_weight,
            least_variance: self.least_variance.clone(),
            newton: estimator.settings.newton,
        })
    }
}

/// Gives all torques the median correlation.
fn in_common(colours: &mut [Colour]) {
    let mut all: Vec<f64> = colours.iter().map(|colour| colour.correlation).collect();
    all.sort_by(f64::total_cmp);
    let Some(&median) = all.get(all.len() / 2) else { return };
    colours.iter_mut().for_each(|colour| colour.correlation = median);
}

impl Estimator for ConcentratedLikelihood {
    fn name(&self) -> &'static str {
        "concentrated_likelihood"
    }

    fn in_order(&self) -> bool {
        true
    }

    fn estimate(
        &self,
        design: &Design,
        evidence: &Evidence,
        present: &RobotModel,
        present_parameters: &[f64],
    ) -> Result<Estimate, EstimationError> {
        let parts = self.parts(design, evidence)?;
        let rigid = design.base().count();
        let mut x = parts.prior.start(&present.standard, &present_parameters[rigid..]);
        let mut colours = vec![Colour { correlation: 0.0, felt: 0.0 }; design.rows().len()];
        let mut covariance = None;
        let settings = &self.settings;
        let common = settings.tempered_rounds + settings.rounds_in_common;
        let rounds = common + settings.rounds.max(1);
        for round in 0..rounds {
            let hotter = settings.tempered_rounds.saturating_sub(round) as i32;
            let profile = Profile {
                prior_weight: settings.prior_weight * settings.tempering.powi(hotter),
                ..parts.profile(self, &colours)?
            };
            let last = round + 1 == rounds;
            let steps = if last { settings.newton.most_steps } else { settings.steps_a_round };
            let found: Minimum = profile.minimum(x, steps);
            (x, covariance) = (found.x, found.covariance);
            let w = &parts.map * &x;
            let mut next = parts.colours(self, w.col_as_slice(0));
            match round {
                _ if round < settings.tempered_rounds => {
                    next.iter_mut().for_each(|colour| colour.correlation = 0.0)
                }
                _ if round < common => in_common(&mut next),
                _ => (),
            }
            let change = |(one, other): (&Colour, &Colour)| {
                (one.correlation - other.correlation).abs().max((one.felt - other.felt).abs())
            };
            let changed = colours.iter().zip(&next).map(change).fold(0.0, f64::max);
            if round >= common && found.settled && changed < settings.settled {
                break;
            }
            colours = next;
        }
        let w = &parts.map * &x;
        let covariance = covariance.map(|own: Mat<f64>| &parts.map * own * parts.map.transpose());
        let deviation = |k: usize| covariance.as_ref().map_or(f64::NAN, |own| own[(k, k)].max(0.0).sqrt());
        Ok(Estimate {
            parameters: w.col_as_slice(0).to_vec(),
            standard_deviations: (0..w.nrows()).map(deviation).collect(),
            covariance,
        })
    }

    /// At the colours that the parameters themselves leave, so that models are compared each at its best.
    fn negative_log_likelihood(
        &self,
        design: &Design,
        evidence: &Evidence,
        parameters: &[f64],
    ) -> Result<Option<f64>, EstimationError> {
        let parts = self.parts(design, evidence)?;
        let colours = parts.colours(self, parameters);
        Ok(Some(parts.profile(self, &colours)?.likelihood(&column(parameters))))
    }
}
