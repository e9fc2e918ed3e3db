//! Experiments and set-up of the workspace: `cargo xtask <task>`.

mod consumers;
mod environment;
mod mujoco;
mod oracle;
mod paper;
mod plant_experiment;
mod retarget;
mod run;
mod test;
mod torture;
mod undeclared;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

#[derive(Parser)]
#[command(name = "xtask", bin_name = "cargo xtask", about = "Experiments and set-up of phiw's workspace")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// The best main job so far, on an example log that is made on the spot: identify, with report.
    Run(run::Arguments),
    /// A log as long as wanted, to see that memory does not grow with it.
    SyntheticLog(run::synthetic_log::Arguments),
    /// Retargeting: figure 9 of the paper, whole databases, and a page with pictures of them.
    Retarget(retarget::Arguments),
    /// All checks of the workspace, and the count of tests.
    Test(test::Arguments),
    /// Hostile inputs on the release binary: a table of what came of each class.
    Torture(torture::Arguments),
    /// Fetch MuJoCo's library into the user's cache folder, with Python's pip.
    Mujoco(mujoco::Arguments),
    /// Compare with Pinocchio, installed from PyPI into a private environment.
    Oracle(oracle::Arguments),
    /// Robot logs with effects that nobody declared: generate, trace with `phiw explain`, score.
    Undeclared(undeclared::Arguments),
    /// The experiments of the paper's section 5, resumable, on one machine or many.
    Paper(paper::Arguments),
    /// Robots in physics engines with one secret each, tracked poorly: log, trace with `phiw explain`, score.
    Plant(plant_experiment::Arguments),
}

fn main() -> anyhow::Result<ExitCode> {
    match Arguments::parse().task {
        Task::Run(arguments) => run::command(&arguments),
        Task::SyntheticLog(arguments) => run::synthetic_log::command(&arguments),
        Task::Retarget(arguments) => retarget::command(&arguments).map(|()| ExitCode::SUCCESS),
        Task::Test(arguments) => test::command(&arguments),
        Task::Torture(arguments) => torture::command(&arguments),
        Task::Mujoco(arguments) => mujoco::command(&arguments),
        Task::Oracle(arguments) => oracle::command(&arguments),
        Task::Paper(arguments) => paper::command(&arguments).map(|()| ExitCode::SUCCESS),
        Task::Plant(arguments) => plant_experiment::command(&arguments).map(|()| ExitCode::SUCCESS),
        Task::Undeclared(arguments) => undeclared::command(&arguments).map(|()| ExitCode::SUCCESS),
    }
}
