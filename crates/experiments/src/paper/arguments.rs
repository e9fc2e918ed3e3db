//! The command line.

use super::arm::{Arm, Footing};
use super::motions::Source;
use super::shard::Shard;
use super::subject::SubjectName;
use crate::plant::engine::Engine;
use crate::plant::secret::SecretKind;
use phiw_simulated_robot::LoggedTorque;
use std::path::PathBuf;

/// Arguments of `cargo xtask paper`.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct Arguments {
    /// What to do instead of running.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// What to run.
    #[command(flatten)]
    pub run: RunArguments,
    /// Where the noise is. The paper's text says that it moves the robot and is not logged; its numbers look
    /// like noise of the log.
    #[arg(long, default_value = "motion")]
    pub noise_in: NoiseIn,
}

impl Arguments {
    /// What to run.
    pub fn run(&self) -> RunArguments {
        RunArguments { noise_in: self.noise_in, ..self.run.clone() }
    }
}

/// What else can be done.
#[derive(Debug, clap::Subcommand)]
pub enum Command {
    /// Takes the runs of several shards together, and makes tables and the report of them.
    Merge(MergeArguments),
}

/// Arguments of `cargo xtask paper merge`.
#[derive(Debug, clap::Args)]
pub struct MergeArguments {
    /// Folders of the shards.
    #[arg(required = true)]
    pub shards: Vec<PathBuf>,
    /// Folder for everything.
    #[arg(long, default_value = "target/paper")]
    pub out: PathBuf,
}

/// Arguments of a run.
#[derive(Clone, Debug, clap::Args)]
pub struct RunArguments {
    /// Noise sequences.
    #[arg(long, default_value_t = 200)]
    pub seeds: u64,
    /// The first seed.
    #[arg(long, default_value_t = 0)]
    pub first_seed: u64,
    /// Who computes the physics.
    #[arg(long, default_value = "mujoco")]
    pub backend: Engine,
    /// The robot.
    #[arg(long, default_value = "upper-body18")]
    pub robot: SubjectName,
    /// The motions: those embedded, or the seated set of the shared data.
    #[arg(long, default_value = "embedded", conflicts_with = "motions")]
    pub dataset: Source,
    /// A folder of motions of this robot, as `phiw retarget` writes them; what is before the first `_` in a
    /// name is its task.
    #[arg(long, value_name = "DIR")]
    pub motions: Option<PathBuf>,
    /// So many of the embedded motions of each task; all of them without it.
    #[arg(long, value_name = "COUNT", conflicts_with = "motions")]
    pub per_task: Option<usize>,
    /// What is compared.
    #[arg(long, value_delimiter = ',', default_value = "curriculum,random,task-a,task-b")]
    pub arm: Vec<Arm>,
    /// How the robot's base is held: bolted down as in the paper, or free to topple.
    #[arg(long, value_delimiter = ',', default_value = "fixed")]
    pub footing: Vec<Footing>,
    /// Effects that nobody declared, one in the plant of each run; without any, there is none.
    #[arg(long, value_name = "KIND,…", value_delimiter = ',')]
    pub secret: Vec<SecretKind>,
    /// With secrets: so many seeds of a plant without any beside them, to count what is invented.
    #[arg(long, value_name = "COUNT", default_value_t = 0)]
    pub control: u64,
    /// Who looks for what the model lacks, where the loop is closed.
    #[arg(long, default_value = "score")]
    pub detector: Detector,
    /// Count what is not known in the constraint: so often may a motion that it allows leave the support, and
    /// where it allows none nothing is run. Without it, the method decides: 0.001 for ours, else uncertainty
    /// does not count, and the least violation is run.
    #[arg(long, value_name = "RATE")]
    pub false_fall_rate: Option<f64>,
    /// Slower versions of all motions beside them, so many times slower. Without it, the method decides: 2
    /// for ours, else none.
    #[arg(long, value_name = "TIMES,…", value_delimiter = ',')]
    pub slower: Vec<f64>,
    /// A whole method: the paper's as it is printed, or ours for a robot that nobody knows. It decides
    /// estimator, constants of α and sensors.
    #[arg(long = "as", value_name = "METHOD", conflicts_with_all = ["estimator", "prior", "relaxation"])]
    pub method: Option<Method>,
    /// How parameters are estimated.
    #[arg(long, default_value = "concentrated")]
    pub estimator: EstimatorName,
    /// What the estimate falls back on where the logs tell little. Without it: the initial model for the
    /// robot on its feet, nothing for the others, as in the paper. For the likelihood only.
    #[arg(long)]
    pub prior: Option<PriorName>,
    /// What α follows. Without it: the torques' uncertainty for the robot on its feet, cond(Φ) for the
    /// others, as in the paper.
    #[arg(long)]
    pub relaxation: Option<RelaxationName>,
    /// Standard deviation of the torque noise over the torque limit.
    #[arg(long, default_value_t = 0.05)]
    pub noise: f64,
    /// Where it is.
    #[arg(skip)]
    pub noise_in: NoiseIn,
    /// Iterations of each run.
    #[arg(long, default_value_t = 5)]
    pub iterations: usize,
    /// One initial model for all seeds, as in the paper, or one for each.
    #[arg(long, default_value = "each")]
    pub initial: Initial,
    /// Do part I of N of the runs only.
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Write a Slurm array script of N shards to standard output, and do nothing else.
    #[arg(long, value_name = "N")]
    pub slurm: Option<u32>,
    /// Stop after so many iterations, as if killed: for tests.
    #[arg(long, value_name = "COUNT", hide = true)]
    pub stop_after: Option<usize>,
    /// Folder for runs, tables and the report.
    #[arg(long, default_value = "target/paper")]
    pub out: PathBuf,
}

/// How parameters are estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum EstimatorName {
    /// Equation (4).
    LeastSquares,
    /// Equation (4) with each torque weighted by its own residual.
    Weighted,
    /// Maximum likelihood of the motion under the torque noise, which it is told.
    Likelihood,
    /// The same with the noise found out: the one for a real robot.
    Concentrated,
}

/// Where the noise is.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseIn {
    /// It is added to the command and moves the robot; the log has the command.
    #[default]
    Motion,
    /// It is added to the logged torque and moves nothing.
    Log,
    /// Both, independently.
    Both,
    /// It is added to the command and moves the robot, and the log has what was delivered.
    Delivered,
}

impl NoiseIn {
    /// Of a noise, what moves the robot and what is an error of the log.
    pub fn shares(self, noise: f64) -> (f64, f64) {
        match self {
            NoiseIn::Motion | NoiseIn::Delivered => (noise, 0.0),
            NoiseIn::Log => (0.0, noise),
            NoiseIn::Both => (noise, noise),
        }
    }

    /// Which torque the log has.
    pub fn logged(self) -> LoggedTorque {
        match self {
            NoiseIn::Delivered => LoggedTorque::Delivered,
            _ => LoggedTorque::Commanded,
        }
    }
}

/// A whole method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Equation (4), α_max = 0.74 and a = 2.5·10⁻⁴, and a log of the motion and the command, exactly.
    Printed,
    /// The likelihood that finds the noise out, from encoders of 17 bits at 1 kHz.
    Ours,
}

impl RunArguments {
    /// How parameters are estimated, by the method if there is one.
    pub fn estimator(&self) -> EstimatorName {
        match self.method {
            Some(Method::Printed) => EstimatorName::LeastSquares,
            Some(Method::Ours) => EstimatorName::Concentrated,
            None => self.estimator,
        }
    }
}

/// What the estimate falls back on.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum PriorName {
    /// Nothing.
    #[default]
    None,
    /// The run's first belief, with the spread that it is drawn with.
    Initial,
}

/// What the reduction coefficient α follows.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum RelaxationName {
    /// cond(Φ): equation (20).
    #[default]
    Condition,
    /// How uncertain the torques of all motions are.
    Uncertainty,
}

/// Who looks for what the model lacks.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum Detector {
    /// The likelihood itself: a score test of every effect. Another estimator has none, and traces.
    #[default]
    Score,
    /// A trace of the residuals that are not white.
    Trace,
}

/// How many initial models there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Initial {
    /// One for all.
    One,
    /// One for each seed.
    Each,
}
