//! Experiments and set-up of the workspace: `cargo xtask <task>`.

mod consumers;
mod mujoco;
mod python;
mod test;
mod torture;

use clap::{Parser, Subcommand};
use phiw_experiments::*;
use std::process::ExitCode;

#[derive(Parser)]
#[command(name = "xtask", bin_name = "cargo xtask", about = "Experiments and set-up of phiw's workspace")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// The main job: a curriculum with the loop closed, then `phiw explain`, on data made on the spot.
    Run(run::Arguments),
    /// A log as long as wanted, to see that memory does not grow with it.
    SyntheticLog(synthetic_log::Arguments),
    /// Retargeting on one page: databases, a film of person and robot, mink on the same markers, figure 9.
    Retarget(retarget::Arguments),
    /// All checks of the workspace, and the count of tests.
    Test(test::Arguments),
    /// Hostile inputs, kills and concurrent runs on the release binary: a table of what came of each class.
    Torture(torture::Arguments),
    /// The Python package in a fresh environment: pip install, pytest, notebooks; with --timings against
    /// others.
    Python(python::Arguments),
    /// Fetch MuJoCo's library into the user's cache folder, with Python's pip.
    Mujoco(mujoco::Arguments),
    /// Compare with Pinocchio, MuJoCo, ezc3d, CVXPY and Clarabel, installed from PyPI into an environment.
    Oracle(oracle::Arguments),
    /// What it costs that identified bodies can exist, on real logs.
    Consistent(consistent::Arguments),
    /// What is said of logs that count joints otherwise than the URDF: signs, exchanges, units, mountings.
    Conventions(conventions::Arguments),
    /// How often 95 % intervals of parameters and bands of torques hold the truth, on synthetic logs.
    Coverage(coverage::Arguments),
    /// Robot logs with effects that nobody declared: generate, trace with `phiw explain`, score.
    Undeclared(undeclared::Arguments),
    /// Effects added to the torques of measured logs: traced with `phiw explain`, scored.
    Added(added::Arguments),
    /// The experiments of the paper's section 5, resumable, on one machine or many.
    Paper(paper::Arguments),
    /// The curriculum on a robot whose noise nobody knows: estimators, sensors and noises compared.
    Noise(noise::Arguments),
    /// Logs reduced by many processes, against one.
    Fleet(fleet::Arguments),
    /// Robots in physics engines with one secret each, tracked poorly: log, trace with `phiw explain`, score.
    Plant(plant::Arguments),
}

fn main() -> anyhow::Result<ExitCode> {
    let task = Arguments::parse().task;
    let wanted = matches!(&task, Task::Paper(paper) if paper.needs_mujoco());
    mujoco::fetch_if(wanted || matches!(task, Task::Run(_) | Task::Noise(_)));
    let done = match task {
        Task::Test(arguments) => return test::command(&arguments),
        Task::Python(arguments) => return python::command(&arguments),
        Task::Torture(arguments) => return torture::command(&arguments),
        Task::Mujoco(arguments) => return mujoco::command(&arguments),
        Task::Oracle(arguments) => return oracle::command(&arguments),
        Task::Run(arguments) => run::command(&arguments),
        Task::SyntheticLog(arguments) => synthetic_log::command(&arguments),
        Task::Retarget(arguments) => retarget::command(&arguments),
        Task::Paper(arguments) => paper::command(&arguments),
        Task::Noise(arguments) => noise::command(&arguments),
        Task::Plant(arguments) => plant::command(&arguments),
        Task::Fleet(arguments) => fleet::command(&arguments),
        Task::Consistent(arguments) => consistent::command(&arguments),
        Task::Conventions(arguments) => conventions::command(&arguments),
        Task::Coverage(arguments) => coverage::command(&arguments),
        Task::Added(arguments) => added::command(&arguments),
        Task::Undeclared(arguments) => undeclared::command(&arguments),
    };
    done.map(|()| ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use super::Arguments;
    use clap::CommandFactory;

    /// Units in doc comments are escaped for rustdoc. `cargo xtask plant --help` showed the escapes: `\[s\]`.
    #[test]
    fn help_has_no_escapes_of_rustdoc() {
        let mut command = Arguments::command();
        command.build();
        for task in command.get_subcommands_mut() {
            let help = task.render_long_help().to_string();
            assert!(!help.contains('\\') && !help.contains("[`"), "{help}");
        }
    }
}
