//! What a log shows of one joint.

pub use crate::alignment::Alignment;
pub use crate::signal_shape::{SignalShape, Still};
pub use crate::spectrum::Spectrum;

use crate::alignment::AlignmentCollector;
use crate::check_settings::CheckSettings;
use crate::clock::{stamped_interpolation_error, uniform_interpolation_error};
use crate::histogram::Histogram;
use crate::signal_shape::ShapeCollector;
use serde::{Deserialize, Serialize};

/// What a log shows of one joint, over all usable rows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JointSurvey {
    /// Name of the joint.
    pub name: String,
    /// Smallest position, in rad or m.
    #[serde(with = "crate::any_number")]
    pub q_min: f64,
    /// Largest position, in rad or m.
    #[serde(with = "crate::any_number")]
    pub q_max: f64,
    /// Mean position, in rad or m.
    #[serde(with = "crate::any_number")]
    pub q_mean: f64,
    /// Standard deviation of the position, in rad or m.
    #[serde(with = "crate::any_number")]
    pub q_std: f64,
    /// Root mean square of the velocity (differences over four steps, the noise taken off), in rad/s or m/s.
    #[serde(with = "crate::any_number")]
    pub velocity_rms: f64,
    /// The torque, where the log has it.
    pub torque: Option<TorqueSurvey>,
    /// Standard deviation of the position's white noise, from fourth differences: their median magnitude,
    /// over windows where the reading changes at all, divided by what unit white noise gives. Low-passed
    /// noise looks smaller than it is, motion fast for the sample rate looks like noise. In rad or m.
    #[serde(with = "crate::any_number")]
    pub position_noise_std: f64,
    /// What the encoder made of the position.
    pub position_shape: SignalShape,
    /// The measured velocity (`qd.<joint>`), where the log has it.
    pub velocity: Option<DerivativeSurvey>,
    /// The measured acceleration (`qdd.<joint>`), where the log has it.
    pub acceleration: Option<DerivativeSurvey>,
    /// Whether the log has a temperature (`temp.<joint>`).
    pub temperature: bool,
}

impl JointSurvey {
    /// Largest minus smallest position, in rad or m; 0 if the joint never moves.
    pub fn travel(&self) -> f64 {
        self.q_max - self.q_min
    }
}

/// What a log shows of one joint's torque.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TorqueSurvey {
    /// Smallest, in N·m or N.
    #[serde(with = "crate::any_number")]
    pub min: f64,
    /// Largest, in N·m or N.
    #[serde(with = "crate::any_number")]
    pub max: f64,
    /// Root mean square, in N·m or N.
    #[serde(with = "crate::any_number")]
    pub rms: f64,
    /// Standard deviation of the white noise, found as [`JointSurvey::position_noise_std`] is, in N·m or N.
    #[serde(with = "crate::any_number")]
    pub noise_std: f64,
    /// What the sensor made of it.
    pub shape: SignalShape,
}

impl TorqueSurvey {
    /// Whether every sample is 0.
    pub fn all_zero(&self) -> bool {
        self.min == 0.0 && self.max == 0.0
    }

    /// Whether every sample is the same.
    pub fn constant(&self) -> bool {
        self.min == self.max
    }
}

/// What a log shows of a measured derivative of one joint's position.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DerivativeSurvey {
    /// Smallest.
    #[serde(with = "crate::any_number")]
    pub min: f64,
    /// Largest.
    #[serde(with = "crate::any_number")]
    pub max: f64,
    /// Slope of the derivative of the signal below (`q` for `qd`, `qd` for `qdd`; by central differences)
    /// over this column, by least squares: 1 where the two agree; NaN where there is too little motion.
    #[serde(with = "crate::any_number")]
    pub agreement: f64,
    /// Of a velocity, how it relates to the positions in detail; `None` where there is too little motion.
    pub alignment: Option<Alignment>,
}

impl DerivativeSurvey {
    /// Whether the column is the derivative that it says: not constant, not in degrees, not of the wrong
    /// sign, not late, not 0 where there is motion.
    pub fn plausible(&self) -> bool {
        let settings = CheckSettings::default();
        self.is_derivative() && !self.alignment.is_some_and(|alignment| settings.contradicts(&alignment))
    }

    /// Whether the column is another moment's derivative.
    pub fn is_late(&self) -> bool {
        let settings = CheckSettings::default();
        self.is_derivative() && self.alignment.is_some_and(|alignment| settings.is_late(&alignment))
    }

    /// Whether the column is the derivative that it says within a third.
    pub fn is_derivative(&self) -> bool {
        self.min < self.max && !(self.agreement < 0.67 || self.agreement > 1.5)
    }
}

/// What noise the difference of five samples shows when its median magnitude is 1: 1 / (Φ⁻¹(¾)·√70/6).
const NOISE_PER_INTERPOLATION_ERROR: f64 = 6.0 / (0.674_489_75 * 8.366_600_265_340_756);

/// The five latest samples of a signal, oldest first.
pub(crate) type Five = [f64; 5];

/// Collects a [`JointSurvey`].
pub(crate) struct JointCollector {
    rows: f64,
    q: Moments,
    tau: Option<(Moments, Histogram)>,
    interpolation_error: Histogram,
    /// Sum of squared slopes over four steps, their number, and the sum of 2 over the squared time that each
    /// took.
    slopes: [f64; 3],
    /// Interpolation errors at places where the stamps are uneven: under equal distances, and under the
    /// stamps.
    uneven: [Histogram; 2],
    qd: Option<Derivative>,
    qdd: Option<Derivative>,
    alignment: Option<AlignmentCollector>,
    q_shape: ShapeCollector,
    tau_shape: ShapeCollector,
    temperature: bool,
}

impl JointCollector {
    /// For samples about `period` apart \[s\].
    pub fn new(period: f64, torque: bool, [qd, qdd, temperature]: [bool; 3]) -> Self {
        JointCollector {
            rows: 0.0,
            q: Moments::default(),
            tau: torque.then(|| (Moments::default(), Histogram::new())),
            interpolation_error: Histogram::new(),
            slopes: [0.0; 3],
            uneven: [Histogram::new(), Histogram::new()],
            alignment: qd.then(|| AlignmentCollector::new(period)),
            q_shape: ShapeCollector::new(),
            tau_shape: ShapeCollector::new(),
            qd: qd.then(Derivative::default),
            qdd: qdd.then(Derivative::default),
            temperature,
        }
    }

    /// One sample; the signals that the joint lacks are NaN.
    pub fn push(&mut self, t: f64, q: f64, tau: f64, qd: f64, qdd: f64) {
        self.rows += 1.0;
        self.q_shape.push(t, q, q);
        if self.tau.is_some() {
            self.tau_shape.push(t, q, tau);
        }
        if let Some(alignment) = &mut self.alignment {
            alignment.push(t, q, qd);
        }
        self.q.push(q, self.rows);
        if let Some((moments, _)) = &mut self.tau {
            moments.push(tau, self.rows);
        }
        for (derivative, x) in [(&mut self.qd, qd), (&mut self.qdd, qdd)] {
            if let Some(derivative) = derivative {
                derivative.range.push(x, self.rows);
            }
        }
    }

    /// Rows for which the position is held on the mean, where the log is faster than what it logs.
    pub fn held_position(&self) -> Option<f64> {
        self.q_shape.held()
    }

    /// The segment is over.
    pub fn end_segment(&mut self) {
        self.q_shape.end_segment();
        self.tau_shape.end_segment();
        if let Some(alignment) = &mut self.alignment {
            alignment.end_segment();
        }
    }

    /// The five latest samples of a segment; `uneven` where the stamps are.
    pub fn push_five(&mut self, t: Five, uneven: bool, q: Five, tau: Five, qd: Five, qdd: Five) {
        let time = t[4] - t[0];
        let slope = (q[4] - q[0]) / time;
        if slope.is_finite() {
            self.slopes[0] += slope * slope;
            self.slopes[1] += 1.0;
            self.slopes[2] += 2.0 / (time * time);
        }
        if q.iter().any(|&x| x != q[0]) {
            let interpolation_error = uniform_interpolation_error(q);
            self.interpolation_error.push(interpolation_error);
            if uneven {
                self.uneven[0].push(interpolation_error);
                self.uneven[1].push(stamped_interpolation_error(t, q));
            }
        }
        if let Some((_, histogram)) = &mut self.tau
            && tau.iter().any(|&x| x != tau[0])
        {
            histogram.push(uniform_interpolation_error(tau));
        }
        for (derivative, below, x) in [(&mut self.qd, q, qd), (&mut self.qdd, qd, qdd)] {
            if let Some(derivative) = derivative {
                let slope = (below[4] - below[0]) / (t[4] - t[0]);
                if slope.is_finite() {
                    derivative.product += slope * x[2];
                    derivative.square += x[2] * x[2];
                }
            }
        }
    }

    /// ln of how much smoother the position is under equal distances than under the stamps; `None` where
    /// too few stamps are uneven.
    pub fn smoother_when_uniform(&self) -> Option<f64> {
        let [uniform, stamped] = self.uneven.each_ref().map(Histogram::median);
        (uniform > 0.0 && stamped > 0.0 && self.uneven[0].total() >= 20).then(|| (stamped / uniform).ln())
    }

    pub fn finish(&self, name: &str, stamped: bool) -> JointSurvey {
        let interpolation_error =
            if stamped && self.uneven[1].total() > 0 { &self.uneven[1] } else { &self.interpolation_error };
        let position_noise_std = interpolation_error.median() * NOISE_PER_INTERPOLATION_ERROR;
        let [squares, count, noise_gain] = self.slopes;
        let velocity_square = (squares - noise_gain * position_noise_std.powi(2)) / count.max(1.0);
        JointSurvey {
            name: name.into(),
            velocity_rms: velocity_square.max(0.0).sqrt(),
            q_min: self.q.min,
            q_max: self.q.max,
            q_mean: self.q.mean,
            q_std: (self.q.square / self.rows).sqrt(),
            torque: self.tau.as_ref().map(|(moments, histogram)| TorqueSurvey {
                min: moments.min,
                max: moments.max,
                rms: (moments.square / self.rows + moments.mean * moments.mean).sqrt(),
                noise_std: histogram.median() * NOISE_PER_INTERPOLATION_ERROR,
                shape: self.tau_shape.finish(),
            }),
            position_noise_std,
            position_shape: self.q_shape.finish(),
            velocity: self.qd.as_ref().map(|derivative| {
                derivative.finish(self.alignment.as_ref().and_then(AlignmentCollector::finish))
            }),
            acceleration: self.qdd.as_ref().map(|derivative| derivative.finish(None)),
            temperature: self.temperature,
        }
    }
}

/// Running range, mean and sum of squares about the mean (Welford 1962).
struct Moments {
    min: f64,
    max: f64,
    mean: f64,
    square: f64,
}

impl Default for Moments {
    fn default() -> Self {
        Moments { min: f64::INFINITY, max: f64::NEG_INFINITY, mean: 0.0, square: 0.0 }
    }
}

impl Moments {
    fn push(&mut self, x: f64, count: f64) {
        self.min = self.min.min(x);
        self.max = self.max.max(x);
        let deviation = x - self.mean;
        self.mean += deviation / count;
        self.square += deviation * (x - self.mean);
    }
}

#[derive(Default)]
struct Derivative {
    range: Moments,
    product: f64,
    square: f64,
}

impl Derivative {
    fn finish(&self, alignment: Option<Alignment>) -> DerivativeSurvey {
        DerivativeSurvey {
            min: self.range.min,
            max: self.range.max,
            agreement: self.product / self.square,
            alignment,
        }
    }
}
