//! Motions to choose from: the robot's motion dataset (Q₁ʳ, …, Q_Kʳ).

mod limits;
mod slower;
mod steps;

pub use limits::{Excess, MotionLimits, Unrest};
pub use steps::StepTolerance;

use crate::CurriculumError;
use phiw_telemetry::{Block, Recording};

/// When the signals of a motion are taken for signals of one motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionTolerance {
    /// How far stamps may lie from even, as a share of the period. Default: 10⁻³, more than stamps rounded to
    /// microseconds at 1 kHz.
    pub stamps: f64,
    /// RMS of the difference of a derivative from its signal's slope over the RMS of the larger, from which
    /// on they contradict each other. Default: 0.5; retargeted motions, by splines or by backward
    /// differences, stay below 0.1 (`phiw retarget`, all embedded motions).
    pub contradiction: f64,
    /// RMS below which a derivative is rounding \[rad/s, m/s, rad/s², m/s²\]. Default: 10⁻³.
    pub slow: f64,
    /// How far steps from row to row may be from the velocities.
    pub steps: StepTolerance,
}

impl Default for MotionTolerance {
    fn default() -> Self {
        MotionTolerance { stamps: 1e-3, contradiction: 0.5, slow: 1e-3, steps: StepTolerance::default() }
    }
}

/// A reference motion Qʳ, sampled evenly.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Its name.
    pub name: String,
    /// What is done in it, such as the names of the paper's Table 1; may be empty.
    pub task: String,
    /// How many times slower it is than the motion that it was made of; 1 for one as it was recorded.
    pub times_slower: f64,
    period_s: f64,
    joints: usize,
    /// Positions, velocities and accelerations, row-major `[sample × joints]`.
    signals: [Vec<f64>; 3],
}

impl Motion {
    /// A motion of `joints` joints with a sample every `period_s` \[s\]. `signals` are positions \[rad, m\],
    /// velocities and accelerations, row-major `[sample × joints]`, as `Retargeted::signals` of
    /// `phiw-bspline-retarget` has them.
    ///
    /// # Errors
    /// There are fewer than two samples, the signals do not fit each other, or a number is not finite.
    pub fn new(
        name: &str,
        task: &str,
        joints: usize,
        period_s: f64,
        signals: [Vec<f64>; 3],
    ) -> Result<Self, CurriculumError> {
        let wrong = |problem: String| CurriculumError::Motion { name: name.to_owned(), problem };
        let length = signals[0].len();
        if joints == 0 || length < 2 * joints || !length.is_multiple_of(joints) {
            return Err(wrong(format!("{length} positions are not two samples or more of {joints} joints")));
        }
        if signals.iter().any(|signal| signal.len() != length) {
            let [q, qd, qdd] = [0, 1, 2].map(|k| signals[k].len());
            return Err(wrong(format!("it has {q} positions, {qd} velocities and {qdd} accelerations")));
        }
        if !(period_s.is_finite() && period_s > 0.0) {
            return Err(wrong(format!("its period is {period_s} s: it must be positive")));
        }
        if let Some(place) = signals.iter().flatten().position(|value| !value.is_finite()) {
            let sample = place % length / joints;
            return Err(wrong(format!("sample {sample} has a number that is not finite: fill gaps first")));
        }
        Ok(Motion {
            name: name.to_owned(),
            task: task.to_owned(),
            times_slower: 1.0,
            period_s,
            joints,
            signals,
        })
    }

    /// The first `samples` samples of a reference, one every `period_s` \[s\]. `reference` writes positions
    /// \[rad, m\], velocities and accelerations of all joints at a time \[s\].
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of_reference(
        name: &str,
        task: &str,
        joints: usize,
        (samples, period_s): (usize, f64),
        reference: impl Fn(f64, &mut [f64], &mut [f64], &mut [f64]),
    ) -> Result<Self, CurriculumError> {
        let mut signals = [0; 3].map(|_| vec![0.0; samples * joints]);
        let [q, v, a] = &mut signals;
        for sample in 0..samples {
            let row = sample * joints..(sample + 1) * joints;
            let (q, v, a) = (&mut q[row.clone()], &mut v[row.clone()], &mut a[row]);
            reference(sample as f64 * period_s, q, v, a);
        }
        Self::new(name, task, joints, period_s, signals)
    }

    /// A motion from a log with positions, velocities and accelerations, as `phiw retarget` writes it.
    ///
    /// # Errors
    /// A signal is missing, the stamps are not even, a number is not finite, or the signals contradict each
    /// other.
    pub fn from_recording(name: &str, task: &str, recording: &Recording) -> Result<Self, CurriculumError> {
        let wrong =
            |problem: &str| CurriculumError::Motion { name: name.to_owned(), problem: problem.to_owned() };
        let (Some(qd), Some(qdd)) = (&recording.qd, &recording.qdd) else {
            return Err(wrong(
                "it has no columns qd.<joint> and qdd.<joint>: a plan needs its own derivatives, which `phiw retarget` writes",
            ));
        };
        let [first, .., last] = recording.t.as_slice() else {
            return Err(wrong("it has fewer than two rows"));
        };
        let period_s = (last - first) / (recording.t.len() - 1) as f64;
        let tolerance = MotionTolerance::default();
        let even = |(row, t): (usize, &f64)| {
            (t - first - row as f64 * period_s).abs() <= tolerance.stamps * period_s
        };
        if !recording.t.iter().enumerate().all(even) {
            return Err(wrong("its time stamps are not even: resample it"));
        }
        let signals = [recording.q.clone(), qd.clone(), qdd.clone()];
        let motion = Self::new(name, task, recording.joints.len(), period_s, signals)?;
        motion.check_derivatives(&recording.joints, &tolerance)?;
        motion.check_steps(&recording.joints, &[], &tolerance.steps)?;
        Ok(motion)
    }

    /// A robot that is sent positions at these times moves as they say, whatever the columns beside them say:
    /// a motion whose signals contradict each other is refused.
    fn check_derivatives(
        &self,
        joints: &[String],
        tolerance: &MotionTolerance,
    ) -> Result<(), CurriculumError> {
        let rms = |sum: f64| (sum / self.samples() as f64).sqrt();
        for (joint, name) in joints.iter().enumerate() {
            for (order, column, unit) in [(0, "qd", "rad/s or m/s"), (1, "qdd", "rad/s² or m/s²")] {
                let (mut differences, mut given, mut error) = (0.0, 0.0, 0.0);
                for sample in 1..self.samples() - 1 {
                    let value =
                        |signal: usize, sample: usize| self.signals[signal][sample * self.joints + joint];
                    let slope = (value(order, sample + 1) - value(order, sample - 1)) / (2.0 * self.period_s);
                    let stated = value(order + 1, sample);
                    differences += slope * slope;
                    given += stated * stated;
                    error += (slope - stated) * (slope - stated);
                }
                let larger = rms(differences.max(given));
                if larger > tolerance.slow && rms(error) > tolerance.contradiction * larger {
                    let below = &column[..column.len() - 1];
                    return Err(CurriculumError::Motion {
                        name: self.name.clone(),
                        problem: format!(
                            "its {column}.{name} is {:.3} RMS, but {below}.{name} over the time stamps changes by {:.3} ({unit}): \
                             the stamps, the positions or the derivatives are in another unit, or of another motion",
                            rms(given),
                            rms(differences)
                        ),
                    });
                }
            }
        }
        Ok(())
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.signals[0].len() / self.joints
    }

    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// Time between two samples \[s\].
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// How long it takes \[s\].
    pub fn duration_s(&self) -> f64 {
        (self.samples() - 1) as f64 * self.period_s
    }

    /// `[q, q̇, q̈]` of a sample.
    ///
    /// # Panics
    /// For a sample that is not there.
    pub fn sample(&self, sample: usize) -> [&[f64]; 3] {
        let row = sample * self.joints..(sample + 1) * self.joints;
        [0, 1, 2].map(|signal| &self.signals[signal][row.clone()])
    }

    /// All samples as a block without torques, from which columns can be computed.
    pub fn block(&self) -> Block {
        let t = (0..self.samples()).map(|sample| sample as f64 * self.period_s).collect();
        Block::unfiltered(self.joints, t, self.signals.clone(), Vec::new())
    }
}

impl Motion {
    /// Writes positions \[rad, m\], velocities and accelerations of all joints `t_s` seconds after the
    /// motion's start: linear between samples, each signal by itself; at rest in the last posture after the
    /// end.
    pub fn at(&self, t_s: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]) {
        let last = self.samples() - 1;
        let place = (t_s / self.period_s).clamp(0.0, last as f64);
        // A control period that divides evenly must hit the samples, whatever rounding says.
        let nearest = place.round();
        let place = if (place - nearest).abs() < 1e-6 { nearest } else { place };
        let (before, share) = (place as usize, place.fract());
        let after = (before + 1).min(last);
        for (out, signal) in [q, v, a].into_iter().zip(&self.signals) {
            for (joint, out) in out.iter_mut().enumerate() {
                let [low, high] = [before, after].map(|row| signal[row * self.joints + joint]);
                *out = low + share * (high - low);
            }
        }
    }
}

/// The motions of one robot.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionDataset {
    motions: Vec<Motion>,
}

impl MotionDataset {
    /// Takes motions together.
    ///
    /// # Errors
    /// There are none, or one has not `joints` joints.
    pub fn new(joints: usize, motions: Vec<Motion>) -> Result<Self, CurriculumError> {
        if motions.is_empty() {
            return Err(CurriculumError::NoMotions);
        }
        if let Some(motion) = motions.iter().find(|motion| motion.joints != joints) {
            let problem = format!("it has {} joints, but the robot {joints}", motion.joints);
            return Err(CurriculumError::Motion { name: motion.name.clone(), problem });
        }
        Ok(MotionDataset { motions })
    }

    /// The motions.
    pub fn motions(&self) -> &[Motion] {
        &self.motions
    }

    /// Their number K.
    pub fn len(&self) -> usize {
        self.motions.len()
    }

    /// Whether there are none, which never is.
    pub fn is_empty(&self) -> bool {
        self.motions.is_empty()
    }

    /// Rows of Φ of all motions: samples times joints.
    pub(crate) fn rows(&self) -> usize {
        self.motions.iter().map(|motion| motion.samples() * motion.joints()).sum()
    }

    /// A motion by its name.
    pub fn position(&self, name: &str) -> Option<usize> {
        self.motions.iter().position(|motion| motion.name == name)
    }
}
