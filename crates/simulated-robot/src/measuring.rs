//! What a simulated robot's log says of a trial: encoders alone or all of the motion, and what is wrong with
//! its torques.

use phiw_curriculum::CurriculumError;
use phiw_curriculum::motion::Motion;
use phiw_dynamics::Tree;
use phiw_estimation::{Asked, Logged, MotionLog};
use phiw_plant::{Clock, Derivatives, History, PlantRun, Sensors, Timing};
use phiw_telemetry::Recording;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// What stands between a trial and its log. The default is the paper's: the motion and the command, exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measuring {
    /// The encoders, if they are all that is known of the motion; none if positions and speeds are exact.
    pub encoders: Option<Encoders>,
    /// Standard deviation of the error of a logged torque over the torque limit; one error a command.
    pub torque_noise: f64,
    /// Correlation of that error from one command to the next, between −1 and 1.
    pub torque_noise_correlation: f64,
    /// Which torque is logged.
    pub logged: LoggedTorque,
    /// What the log says of the controller beside the torques.
    pub controller: KnownOfController,
}

/// What a log says of the controller.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KnownOfController {
    /// The commands themselves ([`MotionLog::command`]).
    #[default]
    Commands,
    /// What it was asked for ([`MotionLog::asked`]), and not with which gains it answered.
    Reference,
    /// Nothing.
    Nothing,
}

/// Which torque a log has, before its errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LoggedTorque {
    /// What the controller commanded.
    #[default]
    Commanded,
    /// What the actuators delivered, their noise included.
    Delivered,
}

/// Encoders that are read more often than commands are given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encoders {
    /// 2^bits steps a turn.
    pub bits: u8,
    /// Time between two readings \[s\].
    pub period_s: f64,
    /// When they are read, and what is stamped.
    pub clock: Clock,
}

impl Encoders {
    /// Read every `period_s` \[s\], evenly.
    pub fn new(bits: u8, period_s: f64) -> Self {
        Encoders { bits, period_s, clock: Clock::Even }
    }
}

impl Measuring {
    /// The plant's sensors; `exact` are those of a robot without encoders here.
    pub(crate) fn sensors(&self, exact: &Sensors, joints: usize) -> Sensors {
        match self.encoders {
            None => exact.clone(),
            Some(Encoders { bits, period_s, clock }) => {
                let steps = Sensors::default().with_encoder_bits(bits, joints);
                Sensors { period_s, torque_window_s: 0.0, clock, derivatives: Derivatives::Unlogged, ..steps }
            }
        }
    }

    /// Whether the log's torques are the commands.
    fn is_exact(&self) -> bool {
        self.torque_noise == 0.0 && self.logged == LoggedTorque::Commanded
    }

    /// The log of a run, without [`MotionLog::still`] and [`MotionLog::asked`].
    ///
    /// # Errors
    /// The run is too short for a log.
    pub(crate) fn log(
        &self,
        run: &PlantRun,
        tree: &Tree,
        timing: &Timing,
        rng: &mut dyn Rng,
    ) -> Result<MotionLog, CurriculumError> {
        let mut log = match self.encoders {
            None => MotionLog::from_recording(&run.recording)?,
            Some(encoders) => {
                let step = std::f64::consts::TAU * 0.5_f64.powi(i32::from(encoders.bits));
                let steps = vec![step; run.recording.joints.len()];
                let mut log = MotionLog::of_encoders(&run.recording, timing.control_period_s, &steps)?;
                log.tau = torques(&run.history, &run.history.command, &log);
                log
            }
        };
        if self.controller == KnownOfController::Commands && !self.is_exact() {
            log.command = torques(&run.history, &run.history.command, &log);
        }
        if self.logged == LoggedTorque::Delivered {
            log.tau = torques(&run.history, &run.history.delivered, &log);
        }
        if self.torque_noise > 0.0 {
            let mut own = ChaCha8Rng::seed_from_u64(rng.random());
            self.disturb(&mut log, tree, &mut own);
        }
        Ok(log)
    }

    /// What a logger writes down beside each reading: the torque and the command that are in force, and what
    /// the controller is asked for.
    pub(crate) fn logged(&self, readings: &Recording, measured: &MotionLog) -> Logged {
        let (joints, last) = (measured.joints, measured.rows().saturating_sub(1));
        let held = |values: &[f64]| -> Vec<f64> {
            let row =
                |t: &f64| (((t - readings.t[0]) / measured.period_s + 1e-6) as usize).min(last) * joints;
            readings.t.iter().flat_map(|t| values[row(t)..row(t) + joints].iter().copied()).collect()
        };
        let command = match (self.controller, measured.command.as_slice()) {
            (KnownOfController::Commands, []) => Some(held(&measured.tau)),
            (KnownOfController::Commands, command) => Some(held(command)),
            _ => None,
        };
        let reference = measured.asked.as_ref().map(|asked| held(&asked.q));
        let recording = Recording { tau: held(&measured.tau), ..readings.clone() };
        Logged { recording, command, reference }
    }

    /// Adds the errors of the logged torques.
    fn disturb(&self, log: &mut MotionLog, tree: &Tree, rng: &mut ChaCha8Rng) {
        let correlation = self.torque_noise_correlation;
        let mut error = vec![0.0; log.joints];
        for (row, torques) in log.tau.chunks_exact_mut(log.joints).enumerate() {
            for (joint, torque) in torques.iter_mut().enumerate() {
                let fresh: f64 = StandardNormal.sample(rng);
                error[joint] = match row {
                    0 => fresh,
                    _ => correlation * error[joint] + (1.0 - correlation * correlation).sqrt() * fresh,
                };
                *torque += self.torque_noise * tree.joint(joint).limits.effort * error[joint];
            }
        }
    }
}

/// What was constant over the period after each row, `[row × joint]`.
fn torques(history: &History, values: &[f64], log: &MotionLog) -> Vec<f64> {
    let of_row = |row: usize| {
        let t_s = row as f64 * log.period_s;
        (0..log.joints).map(move |joint| history.mean(values, log.joints, joint, t_s, t_s))
    };
    (0..log.rows()).flat_map(of_row).collect()
}

/// What the controller was asked for at each row: the reference, and the torque that its model gave for it.
///
/// # Errors
/// The motion is not of the robot that `torque` is of.
pub(crate) fn asked(
    motion: &Motion,
    log: &MotionLog,
    mut torque: impl FnMut([&[f64]; 3], &mut [f64]) -> Result<(), CurriculumError>,
) -> Result<Asked, CurriculumError> {
    let joints = log.joints;
    let mut asked = Asked::default();
    let [mut q, mut v, mut a, mut own] = [0; 4].map(|_| vec![0.0; joints]);
    for row in 0..log.rows() {
        let t_s = (row as f64 * log.period_s).min(motion.duration_s());
        motion.at(t_s, &mut q, &mut v, &mut a);
        torque([&q, &v, &a], &mut own)?;
        asked.q.extend_from_slice(&q);
        asked.qd.extend_from_slice(&v);
        asked.torque.extend_from_slice(&own);
    }
    Ok(asked)
}
