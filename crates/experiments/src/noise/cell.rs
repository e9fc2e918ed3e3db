//! One cell of the table: where the noise is, what measures, who estimates.

use crate::paper::{Arm, NoiseIn, Setup};
use crate::plant::engine::Engine;
use phiw_curriculum::end::FixedCount;
use phiw_curriculum::motion::Motion;
use phiw_curriculum::planner::NoneAllowed;
use phiw_curriculum::{
    Curriculum, CurriculumError, CurriculumRun, CurriculumSettings, Experiment, Trial, unreliable_model,
};
use phiw_estimation::{
    ConcentratedLikelihood, ConcentratedSettings, Estimator, LeastSquares, MotionLikelihood, Robot,
    RobotModel, RowsAt, TorqueNoise,
};
use phiw_simulated_robot::{Encoders, KnownOfController, Measuring, SimulatedRobot};
use rand::Rng;

/// Bits of the encoders.
const ENCODER_BITS: u8 = 17;

/// What measures the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum SensorName {
    /// Positions and speeds, exactly.
    Exact,
    /// Encoders of 17 bits, read at 1 kHz.
    Encoders,
    /// Encoders of 17 bits, read with each command, at 100 Hz.
    #[value(name = "encoders-100hz")]
    SlowEncoders,
}

/// What the log says of the controller beside the torques.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum ControllerName {
    /// Its commands.
    Commands,
    /// What it was asked for.
    Reference,
    /// Nothing.
    Nothing,
}

impl From<ControllerName> for KnownOfController {
    fn from(name: ControllerName) -> Self {
        match name {
            ControllerName::Commands => KnownOfController::Commands,
            ControllerName::Reference => KnownOfController::Reference,
            ControllerName::Nothing => KnownOfController::Nothing,
        }
    }
}

/// Who estimates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum EstimatorName {
    /// The likelihood that finds the noise out.
    Concentrated,
    /// The likelihood that is told σ exactly.
    Likelihood,
    /// The same told a σ that is 20 % too small.
    LikelihoodLow,
    /// The same told a σ that is 20 % too large.
    LikelihoodHigh,
    /// Equation (4).
    LeastSquares,
}

/// A cell.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Where the noise is.
    pub noise_in: NoiseIn,
    /// Its correlation from one command to the next.
    pub correlation: f64,
    /// What measures the motion.
    pub sensors: SensorName,
    /// Who estimates.
    pub estimator: EstimatorName,
    /// What the estimator decides that finds the noise out.
    pub settings: ConcentratedSettings,
    /// What the log says of the controller.
    pub controller: ControllerName,
}

/// What a run came to.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// RMSE_w of the first belief and after the last motion.
    pub rmse_w: [f64; 2],
    /// Held-out torque error of both \[N·m\].
    pub torque: [f64; 2],
    /// RMSE_w of an estimate without a prior that knows all but the parameters; none where nothing moves the
    /// robot but its commands, or the rows are not those of [`ConcentratedLikelihood`].
    pub bound: Option<f64>,
    /// Torques of the last estimate whose misfit is refuted, one false alarm in a hundred tests of them all.
    pub refuted: usize,
    /// Iterations in which the constraint allowed nothing.
    pub forced: usize,
}

/// An experiment that does not say what noise it makes, for estimators that are told another one.
struct Secretive(SimulatedRobot);

impl Experiment for Secretive {
    fn perform(
        &self,
        robot: &Robot,
        model: &RobotModel,
        motion: &Motion,
        rng: &mut dyn Rng,
    ) -> Result<Trial, CurriculumError> {
        self.0.perform(robot, model, motion, rng)
    }
}

impl Cell {
    /// The curriculum of one seed.
    ///
    /// # Errors
    /// The robot can not be run, or nothing can be estimated.
    pub fn run(&self, setup: &Setup, backend: Engine, seed: u64) -> anyhow::Result<Outcome> {
        let initial = unreliable_model(&setup.truth, seed);
        let experiment = Secretive(self.experiment(setup, backend));
        let estimator = self.estimator(setup, &initial);
        let selection = Arm::Curriculum.selection(&setup.dataset, &setup.settings.tasks);
        let curriculum = Curriculum {
            robot: &setup.robot,
            dataset: &setup.dataset,
            candidates: &setup.candidates,
            experiment: &experiment,
            selection: selection.as_ref(),
            constraint: Arm::Curriculum.constraint(&setup.constraint),
            relaxation: setup.relaxation.as_ref(),
            estimator: estimator.as_ref(),
            growth: None,
            end: &FixedCount(setup.settings.iterations),
            rows_at: RowsAt::Periods,
            settings: CurriculumSettings {
                none_allowed: NoneAllowed::LeastViolation,
                ..CurriculumSettings::default()
            },
        };
        let mut run = CurriculumRun::new(seed, initial.clone());
        curriculum.run::<CurriculumError>(&mut run, |_| Ok(()))?;
        let [first, last] = [&initial, &run.model].map(|model| setup.score(model, None, &setup.validation));
        let (first, last) = (first?, last?);
        Ok(Outcome {
            rmse_w: [first.rmse_w, last.rmse_w],
            torque: [first.rmse_torque, last.rmse_torque],
            bound: self.bound(setup, &run)?,
            refuted: run.history.last().map_or(0, |record| {
                record.misfit.iter().filter(|own| own.is_refuted(record.misfit.len(), 100.0)).count()
            }),
            forced: run.history.iter().filter(|record| record.forced).count(),
        })
    }

    fn bound(&self, setup: &Setup, run: &CurriculumRun) -> anyhow::Result<Option<f64>> {
        let moves = matches!(self.noise_in, NoiseIn::Motion | NoiseIn::Both);
        let (Some(evidence), EstimatorName::Concentrated, true) = (&run.evidence, self.estimator, moves)
        else {
            return Ok(None);
        };
        let noise = |std: f64| TorqueNoise { std, correlation: self.correlation, felt: 0.0 };
        let noise: Vec<TorqueNoise> =
            setup.subject.torque_noise(setup.settings.noise).into_iter().map(noise).collect();
        let truth = setup.truth.parameters(&setup.robot)?;
        let design = setup.robot.design_of(&setup.truth)?;
        let estimator = ConcentratedLikelihood::new(run.initial.clone());
        let std = estimator.bound(&design, evidence, &truth, &noise)?;
        Ok(Some((std.iter().map(|std| std * std).sum::<f64>() / std.len() as f64).sqrt()))
    }

    fn experiment(&self, setup: &Setup, backend: Engine) -> SimulatedRobot {
        let noise = setup.settings.noise;
        let (in_motion, in_log) = self.noise_in.shares(noise);
        let robot = setup.experiment(backend, false, in_motion);
        let command_s = robot.timing.control_period_s;
        let encoders = match self.sensors {
            SensorName::Exact => None,
            SensorName::Encoders => Some(Encoders::new(ENCODER_BITS, 0.1 * command_s)),
            SensorName::SlowEncoders => Some(Encoders::new(ENCODER_BITS, command_s)),
        };
        SimulatedRobot {
            noise_correlation: self.correlation,
            measuring: Measuring {
                encoders,
                torque_noise: in_log,
                torque_noise_correlation: self.correlation,
                logged: self.noise_in.logged(),
                controller: self.controller.into(),
            },
            ..robot
        }
    }

    fn estimator(&self, setup: &Setup, initial: &RobotModel) -> Box<dyn Estimator> {
        let told = |factor: f64| {
            let likelihood = setup.likelihood();
            let torque_noise = likelihood.torque_noise.iter().map(|noise| factor * noise).collect();
            Box::new(MotionLikelihood { torque_noise, ..likelihood })
        };
        match self.estimator {
            EstimatorName::Concentrated => {
                let settings = self.settings.clone();
                Box::new(ConcentratedLikelihood { settings, ..ConcentratedLikelihood::new(initial.clone()) })
            }
            EstimatorName::Likelihood => told(1.0),
            EstimatorName::LikelihoodLow => told(0.8),
            EstimatorName::LikelihoodHigh => told(1.2),
            EstimatorName::LeastSquares => Box::new(LeastSquares),
        }
    }
}
