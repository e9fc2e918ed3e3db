//! Maximum likelihood of a motion that noise moves, where nobody knows the noise.

use super::body_prior::BodyPrior;
use super::concentrated_settings::ConcentratedSettings;
use super::in_order::{Colour, InOrder};
use super::likelihood::column;
use super::misfit::{TorqueMisfit, misfits};
use super::missing_information;
use super::own_friction::OwnFriction;
use super::profile::{Curvature, Minimum, Profile};
use super::sensitivity::Sensitivity;
use super::smoothing::{Belief, Smoothed};
use super::smoothing_path::{self, Believing, Path};
use super::turning::Believed;
use super::{Estimate, Estimator, Evidence};
use crate::{EstimationError, MotionLog, RobotModel};
use faer::prelude::Solve;
use faer::{Mat, Side};
use phiw_identification::Design;
use phiw_regressor::factor::Factor;
use phiw_regressor::least_squares::{Group, GroupedFactor};
use rayon::prelude::*;

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

impl TorqueNoise {
    /// White noise of this standard deviation \[N·m, N\] that moves the robot and is in no log.
    pub fn white(std: f64) -> Self {
        TorqueNoise { std, correlation: 0.0, felt: 0.0 }
    }

    /// From the standard deviation of what is news in it.
    fn of_news((colour, std): (&Colour, &f64)) -> Self {
        let Colour { correlation, felt } = *colour;
        TorqueNoise { std: std / (1.0 - correlation * correlation).sqrt(), correlation, felt }
    }

    /// How it is counted, and the standard deviation of what is news in it.
    fn news(&self) -> (Colour, f64) {
        let TorqueNoise { std, correlation, felt } = *self;
        (Colour { correlation, felt }, std * (1.0 - correlation * correlation).sqrt())
    }
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
        let under = evidence.under(design, parameters, &self.standing_on)?;
        let evidence = under.as_ref().unwrap_or(evidence);
        let noise_of = |own: &Parts<'_>| -> Result<_, EstimationError> {
            let colours = own.colours(self, parameters);
            let profile = own.profile(self, &colours)?;
            let (std, rows) = (profile.noise(&column(parameters)), profile.rows);
            Ok((Believing { x: Mat::zeros(0, 1), colours, std }, rows))
        };
        let (start, _) = noise_of(&self.parts(design, evidence)?)?;
        let no_parameters = Mat::zeros(0, 0);
        let next = |own: &Parts<'_>, _: Believing| {
            let (believing, rows) = noise_of(own)?;
            Ok((believing, Some(smoothing_path::scales(&no_parameters, &rows))))
        };
        let (settled, _) =
            self.settled((design, evidence), start, |_| parameters.to_vec(), next, |_| true)?;
        Ok(settled.colours.iter().zip(&settled.std).map(TorqueNoise::of_news).collect())
    }

    /// The least standard deviation of each parameter at the truth that any estimate without a prior can
    /// have, one to which the noise is known and the motion exact (Cramér and Rao's bound: the observed
    /// information of the motions that were measured). NaN where nothing is known of one.
    ///
    /// # Errors
    /// The evidence is not of this design, or its rows were not taken in order.
    pub fn bound(
        &self,
        design: &Design,
        evidence: &Evidence,
        truth: &[f64],
        noise: &[TorqueNoise],
    ) -> Result<Vec<f64>, EstimationError> {
        let parts = self.parts(design, evidence)?;
        let (colours, std): (Vec<Colour>, Vec<f64>) = noise.iter().map(TorqueNoise::news).unzip();
        let information = parts.profile(self, &colours)?.information(&column(truth), &std);
        let unknown = vec![f64::NAN; truth.len()];
        let Ok(factor) = information.llt(Side::Lower) else { return Ok(unknown) };
        let covariance = factor.solve(Mat::<f64>::identity(truth.len(), truth.len()));
        Ok((0..truth.len()).map(|k| covariance[(k, k)].sqrt()).collect())
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
        let variance = |group: &Group| {
            let rows = group.factor.rows().max(1) as f64;
            let square = group.factor.right_hand_side_sum_of_squares() / rows;
            (self.settings.least_noise.powi(2) * square).max(f64::MIN_POSITIVE)
        };
        let least_variance = evidence.factor().groups().iter().map(variance).collect();
        Ok(Parts { in_order, prior, map, sensitivities, least_variance, spread: None })
    }

    fn belief<'a>(
        &self,
        design: &'a Design,
        evidence: &'a Evidence,
        (w, colours, std): (&'a [f64], &'a [Colour], &'a [f64]),
    ) -> Belief<'a> {
        Belief {
            design,
            foreseen: &evidence.foreseen,
            w,
            colours,
            std,
            instant_every_s: self.settings.smoothing_instant_s,
            decay_error: self.settings.decay_error,
            reading_error: self.settings.reading_error,
        }
    }

    /// The information of the design's parameters that logs of encoders lack, since their motion is not
    /// known.
    fn missing_information(
        &self,
        design: &Design,
        evidence: &Evidence,
        under: (&[f64], &[Colour], &[f64]),
    ) -> Result<Mat<f64>, EstimationError> {
        let belief = self.belief(design, evidence, under);
        let all: Result<Vec<_>, EstimationError> =
            evidence.encoder_logs.par_iter().map(|log| belief.missing_information(log)).collect();
        let none = Mat::zeros(design.parameter_count(), design.parameter_count());
        Ok(all?.into_iter().flatten().fold(none, |sum, own| sum + own))
    }

    /// What evidence of encoders is of once their motion is as it most likely was under parameters `w`, or as
    /// it may have been; none where it is not of encoders alone.
    fn smoothed(
        &self,
        design: &Design,
        evidence: &Evidence,
        (w, colours, std): (&[f64], &[Colour], &[f64]),
        which: Which,
    ) -> Result<Option<(Evidence, Spread)>, EstimationError> {
        if evidence.encoder_logs.is_empty() || !self.standing_on.is_empty() {
            return Ok(None);
        }
        let belief = self.belief(design, evidence, (w, colours, std));
        let smooth = |(index, log): (usize, &MotionLog)| belief.smoothed(log, index as u64);
        let smoothed: Result<Vec<_>, EstimationError> =
            evidence.encoder_logs.par_iter().enumerate().map(smooth).collect();
        let believed = Believed { parameters: w.to_vec(), standing_on: Vec::new() };
        let mut again = Evidence::none(design, evidence.settings)?.believing(believed);
        let mut spread: Option<Spread> = None;
        for smoothed in smoothed? {
            let Some(Smoothed { most_likely, drawn, spread: factors, noise }) = smoothed else {
                return Ok(None);
            };
            again.add(design, if which == Which::MostLikely { &most_likely } else { &drawn })?;
            match &mut spread {
                None => spread = Some(Spread { factors, noise }),
                Some(known) => {
                    for (known, own) in known.factors.iter_mut().zip(&factors) {
                        *known = known.merge(own)?;
                    }
                    known.noise.iter_mut().flatten().zip(noise.iter().flatten()).for_each(|(a, b)| *a += b);
                }
            }
        }
        Ok(spread.map(|spread| (again, spread)))
    }

    /// Finds the motion of encoders anew under what is believed, and what is believed under that, until it
    /// stays, and the evidence of that motion; what is believed at the `start`, and none, where the evidence
    /// is not of encoders alone.
    ///
    /// `w` are the parameters of the design at a place of the path. `next` says what is believed under a
    /// motion, and the standard deviations of its place; without these the path ends. A place has to be
    /// possible.
    fn settled(
        &self,
        (design, evidence): (&Design, &Evidence),
        start: Believing,
        w: impl Fn(&Mat<f64>) -> Vec<f64>,
        mut next: impl FnMut(&Parts<'_>, Believing) -> Result<(Believing, Option<Vec<f64>>), EstimationError>,
        is_possible: impl Fn(&Believing) -> bool,
    ) -> Result<(Believing, Option<Evidence>), EstimationError> {
        let mut path = Path::from(&start);
        let mut believing = start;
        let mut last: Option<Evidence> = None;
        for _ in 0..self.settings.smoothings {
            let parameters = w(&believing.x);
            let under = (parameters.as_slice(), believing.colours.as_slice(), believing.std.as_slice());
            let from = last.as_ref().unwrap_or(evidence);
            let Some((again, spread)) = self.smoothed(design, from, under, Which::MostLikely)? else { break };
            let own = Parts { spread: Some(spread), ..self.parts(design, &again)? };
            let (reached, scales) = next(&own, believing)?;
            let Some(scales) = scales else { return Ok((reached, Some(again))) };
            let (further, moved) = path.on(reached.clone(), &scales, &is_possible);
            if moved < self.settings.smoothing_settled {
                return Ok((reached, Some(again)));
            }
            believing = further;
            last = Some(again);
        }
        Ok((believing, last))
    }
}

/// Which of the motions that readings leave possible.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Which {
    MostLikely,
    Drawn,
}

/// Times that a motion is found anew under a belief, before it is looked at.
const LOOKED_AT: usize = 3;

/// What the spread of motions that encoders leave possible adds to the squares of each torque.
struct Spread {
    factors: Vec<Factor>,
    noise: Vec<[f64; 3]>,
}

/// What all rounds share.
struct Parts<'a> {
    in_order: &'a InOrder,
    prior: BodyPrior,
    map: Mat<f64>,
    sensitivities: Vec<Sensitivity>,
    least_variance: Vec<f64>,
    spread: Option<Spread>,
}

impl Parts<'_> {
    fn colours(&self, estimator: &ConcentratedLikelihood, w: &[f64]) -> Vec<Colour> {
        let beside = self.spread.as_ref().map_or(&[][..], |spread| &spread.noise);
        self.in_order.colours(w, &self.least_variance, estimator.settings.largest_correlation, beside)
    }

    fn profile(
        &self,
        estimator: &ConcentratedLikelihood,
        colours: &[Colour],
    ) -> Result<Profile<'_>, EstimationError> {
        let mut factor = self.in_order.whitened(colours)?;
        let rows = factor.groups().iter().map(|group| group.factor.rows() as f64).collect();
        if let Some(spread) = &self.spread {
            let group = |(group, own): (&Group, &Factor)| Group {
                parameters: group.parameters.clone(),
                factor: own.clone(),
            };
            let groups = factor.groups().iter().zip(&spread.factors).map(group).collect();
            factor = factor.merge(&GroupedFactor::new(factor.parameter_count(), groups)?)?;
        }
        let gram = |group: &Group| {
            let size = group.factor.parameters();
            let r = group.factor.as_mat().get(.., ..size);
            r.transpose() * r
        };
        Ok(Profile {
            grams: factor.groups().iter().map(gram).collect(),
            factor,
            rows,
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
        let newton = &self.settings.newton;
        let own = OwnFriction { design, standing_on: &self.standing_on, settings: newton };
        own.estimate(
            evidence,
            present_parameters,
            |evidence, start| self.minimum(design, evidence, present, start),
            |evidence, w| self.likelihood(design, evidence, w),
        )
    }

    fn misfit(
        &self,
        design: &Design,
        evidence: &Evidence,
        estimate: &Estimate,
    ) -> Result<Option<Vec<TorqueMisfit>>, EstimationError> {
        let w = estimate.parameters.as_slice();
        let noise = match &estimate.noise {
            Some(noise) => noise.clone(),
            None => self.noise(design, evidence, w)?,
        };
        let (colours, std): (Vec<Colour>, Vec<f64>) = noise.iter().map(TorqueNoise::news).unzip();
        let mut own = evidence.under(design, w, &self.standing_on)?;
        // Of encoders a motion that their readings leave possible: the most likely one has too little noise.
        for time in 1..=LOOKED_AT {
            let which = if time < LOOKED_AT { Which::MostLikely } else { Which::Drawn };
            let from = own.as_ref().unwrap_or(evidence);
            let Some((again, _)) = self.smoothed(design, from, (w, &colours, &std), which)? else { break };
            own = Some(again);
        }
        let parts = self.parts(design, own.as_ref().unwrap_or(evidence))?;
        misfits(parts.in_order, w, &parts.colours(self, w)).map(Some)
    }

    /// At the colours that the parameters themselves leave, so that models are compared each at its best.
    fn negative_log_likelihood(
        &self,
        design: &Design,
        evidence: &Evidence,
        parameters: &[f64],
    ) -> Result<Option<f64>, EstimationError> {
        let under = evidence.under(design, parameters, &self.standing_on)?;
        self.likelihood(design, under.as_ref().unwrap_or(evidence), parameters).map(Some)
    }
}

impl ConcentratedLikelihood {
    /// −log L under `parameters`, at the colours that they leave.
    fn likelihood(
        &self,
        design: &Design,
        evidence: &Evidence,
        parameters: &[f64],
    ) -> Result<f64, EstimationError> {
        let parts = self.parts(design, evidence)?;
        let colours = parts.colours(self, parameters);
        Ok(parts.profile(self, &colours)?.likelihood(&column(parameters)))
    }

    fn minimum(
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
        let (mut covariance, mut curvature) = (None, Curvature::unknown());
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
            let found: Minimum = profile.minimum(x, steps, &mut curvature);
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
        let std = parts.profile(self, &colours)?.noise(&w);
        let start = Believing { x, colours, std };
        let next = |own: &Parts<'_>, believing: Believing| {
            let profile = own.profile(self, &believing.colours)?;
            let found = profile.minimum(believing.x, settings.newton.most_steps, &mut curvature);
            covariance = found.covariance;
            let w = &own.map * &found.x;
            let colours = own.colours(self, w.col_as_slice(0));
            let std = own.profile(self, &colours)?.noise(&w);
            let scales = covariance.as_ref().map(|own| smoothing_path::scales(own, &profile.rows));
            Ok((Believing { x: found.x, colours, std }, scales))
        };
        let w_of = |x: &Mat<f64>| (&parts.map * x).col_as_slice(0).to_vec();
        let is_possible = |own: &Believing| parts.prior.divergence(&own.x).is_finite();
        let (believing, motion) = self.settled((design, evidence), start, w_of, next, is_possible)?;
        if let (Some(own), Some(motion)) = (&covariance, &motion) {
            let w = w_of(&believing.x);
            let under = (w.as_slice(), believing.colours.as_slice(), believing.std.as_slice());
            let missing = self.missing_information(design, motion, under)?;
            covariance =
                Some(missing_information::without(own, &(parts.map.transpose() * missing * &parts.map)));
        }
        let Believing { x, colours, std: std_of_noise } = believing;
        let w = &parts.map * &x;
        let covariance = covariance.map(|own: Mat<f64>| &parts.map * own * parts.map.transpose());
        let deviation = |k: usize| covariance.as_ref().map_or(f64::NAN, |own| own[(k, k)].max(0.0).sqrt());
        Ok(Estimate {
            parameters: w.col_as_slice(0).to_vec(),
            standard_deviations: (0..w.nrows()).map(deviation).collect(),
            covariance,
            noise: Some(colours.iter().zip(&std_of_noise).map(TorqueNoise::of_news).collect()),
        })
    }
}
