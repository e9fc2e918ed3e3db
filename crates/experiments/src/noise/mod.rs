//! `cargo xtask noise`: the curriculum on a robot whose noise nobody knows.
//!
//! # What it asks
//!
//! What five motions of the curriculum leave of the parameters' error and of the torques', depending on where
//! the noise is (in the motion, in the log, in both, or in a torque that is measured as it was delivered), on
//! its correlation from one command to the next, on what measures the motion, and on who estimates. Beside an
//! estimator that finds the noise out stand the likelihood that is told it exactly, the same told 20 % too
//! little or too much, and equation (4).
//!
//! # How it is run
//!
//! `cargo xtask noise --seeds 20`. The robot, its motions and its noise are those of `cargo xtask paper`, and
//! so are the options that name them. `--noise-in`, `--correlation`, `--sensors` and `--estimators` say which
//! cells there are: all combinations. The estimators that are told σ are run where they have something to
//! say, which is with noise in the motion.
//!
//! # What it prints
//!
//! A table in Markdown: for each cell the medians of RMSE_w (17) and of the held-out torque error (19) after
//! the last motion, the worst seed, and in how many seeds one of them is worse than the first belief's.
//!
//! # Where results go
//!
//! To the terminal; retargeted motions are kept in the folder that `--out` names.

mod cell;
mod table;

use crate::environment;
use crate::paper::{NoiseIn, RunArguments, Setup};
use anyhow::Context;
use cell::{Cell, ControllerName, EstimatorName, SensorName};
use phiw::console::Console;
use phiw_estimation::ConcentratedSettings;
use rayon::prelude::*;

/// Arguments of `cargo xtask noise`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The robot, its motions, and how many.
    #[command(flatten)]
    pub run: RunArguments,
    /// Where the noise is.
    #[arg(long, value_delimiter = ',', default_value = "motion,log,both")]
    noise_in: Vec<NoiseIn>,
    /// Correlation of the noise from one command to the next.
    #[arg(long, value_delimiter = ',', default_value = "0")]
    correlation: Vec<f64>,
    /// What measures the motion.
    #[arg(long, value_delimiter = ',', default_value = "exact,encoders")]
    sensors: Vec<SensorName>,
    /// Who estimates.
    #[arg(long, value_delimiter = ',', default_value = "concentrated")]
    estimators: Vec<EstimatorName>,
    /// Weight of the prior of the estimator that finds the noise out.
    #[arg(long)]
    prior_weight: Option<f64>,
    /// Times at most that its encoders' motion is found anew under the estimate.
    #[arg(long)]
    smoothings: Option<usize>,
    /// What is left of how accelerations decay within a period, over the noise.
    #[arg(long)]
    decay_error: Option<f64>,
    /// Error of an encoder's reading over that of rounding.
    #[arg(long)]
    reading_error: Option<f64>,
    /// What the log says of the controller beside the torques.
    #[arg(long, default_value = "commands")]
    controller: ControllerName,
}

impl Arguments {
    /// What the estimator decides that finds the noise out.
    fn settings(&self) -> ConcentratedSettings {
        let usual = ConcentratedSettings::default();
        ConcentratedSettings {
            prior_weight: self.prior_weight.unwrap_or(usual.prior_weight),
            smoothings: self.smoothings.unwrap_or(usual.smoothings),
            decay_error: self.decay_error.unwrap_or(usual.decay_error),
            reading_error: self.reading_error.unwrap_or(usual.reading_error),
            ..usual
        }
    }
}

/// Runs the task.
///
/// # Errors
/// A motion or the robot does not read, an engine is not there, or a run fails.
pub fn command(arguments: &Arguments) -> anyhow::Result<()> {
    let out = environment::workspace_root()?.join(&arguments.run.out);
    std::fs::create_dir_all(&out).with_context(|| out.display().to_string())?;
    let setup = Setup::new(&arguments.run, &out, &Console::of_terminal(false))?;
    println!("{}", table::HEAD);
    for &sensors in &arguments.sensors {
        for &noise_in in &arguments.noise_in {
            for &correlation in &arguments.correlation {
                for &estimator in &arguments.estimators {
                    let cell = Cell {
                        noise_in,
                        correlation,
                        sensors,
                        estimator,
                        settings: arguments.settings(),
                        controller: arguments.controller,
                    };
                    let first = arguments.run.first_seed;
                    let seeds: Vec<u64> = (first..first + arguments.run.seeds).collect();
                    let outcomes: anyhow::Result<Vec<_>> =
                        seeds.par_iter().map(|&seed| cell.run(&setup, arguments.run.backend, seed)).collect();
                    println!("{}", table::row(&cell, &outcomes?));
                }
            }
        }
    }
    Ok(())
}
