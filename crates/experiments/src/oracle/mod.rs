//! `cargo xtask oracle`: this workspace's dynamics against Pinocchio's, robot by robot, its C3D reader
//! against ezc3d's, its fit of possible bodies against CVXPY's, and the files of identified robots in other
//! programs.
//!
//! # What it asks
//!
//! Whether independent programs compute the same. Regressor, inverse dynamics, mass matrix, forward dynamics
//! and centre of mass are compared at random states of every robot at hand and of random ones, on fixed and
//! floating bases; C3D files coordinate by coordinate; the optimum over possible bodies on random problems of
//! real robots; the torques and mass matrices of identified.urdf and identified.xml in MuJoCo (pinned, and
//! the newest), Pinocchio and Rapier; the report on a log in every format that is read against that on the
//! CSV, on files that the formats' own packages wrote.
//!
//! # How it is run
//!
//! `cargo xtask oracle`, or one part of it: `cargo xtask oracle dynamics`, `cargo xtask oracle c3d`,
//! `cargo xtask oracle consistency`, `cargo xtask oracle export`, `cargo xtask oracle formats` (or one part
//! of it: `--formats same`, `damage`, `memory`; the last writes 5 GB). It needs
//! Python 3.10 or later, and a network the first time: Pinocchio, ezc3d, CVXPY, Clarabel and MuJoCo are
//! installed from PyPI, pinned. Robots whose logs are absent are skipped.
//! For this reason it is not part of `cargo xtask test`.
//!
//! # What it prints
//!
//! A table of the largest relative differences, by robot and quantity. The exit status is not 0 if one is
//! above 1e-9, if a C3D file is not read alike, or if an
//! optimum is not certified, is above Clarabel's by more than 1e-6, or too many differ.
//!
//! # Where results go
//!
//! Nowhere but to standard output. The Python environment stays in the build folder, as `oracle-python`.

mod answers;
mod c3d;
mod case;
mod comparison;
mod consistency;
mod driven;
mod export;
mod formats;
mod generated;
mod pinocchio;
pub(crate) mod python;

use crate::environment;
use answers::QUANTITIES;
use case::Case;
use python::Python;
use std::process::ExitCode;

/// The packages, pinned.
const REQUIREMENTS: &str = include_str!("requirements.txt");
/// The largest relative difference that is rounding.
const TOLERANCE: f64 = 1e-9;

/// Command line of `cargo xtask oracle`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Random states for each robot.
    #[arg(long, default_value_t = 200)]
    states: usize,
    /// Random robots, besides those that are found as files.
    #[arg(long, default_value_t = 12)]
    random_robots: u64,
    /// Random problems in all, to compare the fit of possible bodies on.
    #[arg(long, default_value_t = 200)]
    problems: usize,
    /// Seed of the states; random robots are numbered from it on.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The Python that the private environment is made with.
    #[arg(long, default_value = "python3")]
    python: String,
    /// What of the formats is looked at; everything by default.
    #[arg(long, value_enum)]
    formats: Option<formats::FormatsPart>,
    /// What is compared; everything by default.
    #[arg(value_enum)]
    part: Option<Part>,
}

/// A part of the comparison.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Part {
    /// Dynamics against Pinocchio.
    Dynamics,
    /// C3D files against ezc3d.
    C3d,
    /// Possible bodies that fit best, against CVXPY and Clarabel.
    Consistency,
    /// Logs in other formats, written by their own Python packages.
    Formats,
    /// Files of identified robots, in MuJoCo, Pinocchio and Rapier.
    Export,
}

/// Prints tables of differences; fails if one is too large.
///
/// # Errors
/// The packages cannot be installed, a robot or recording cannot be read, or a package fails on it.
pub fn command(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let asked = |part| arguments.part.is_none_or(|only| only == part);
    let files_agree = !asked(Part::Export)
        || export::compare(&arguments.python, &environment::workspace_root()?, arguments.seed)?;
    if arguments.part == Some(Part::Export) {
        return Ok(if files_agree { ExitCode::SUCCESS } else { ExitCode::FAILURE });
    }
    let formats_agree = !asked(Part::Formats)
        || formats::compare(&arguments.python, &environment::workspace_root()?, arguments.formats)?;
    if arguments.part == Some(Part::Formats) {
        return Ok(if formats_agree { ExitCode::SUCCESS } else { ExitCode::FAILURE });
    }
    let python = Python::install(&arguments.python, "oracle-python", REQUIREMENTS)?;
    let recordings_agree = !asked(Part::C3d) || c3d::compare(&python)?;
    let workspace = environment::workspace_root()?;
    let optima_agree = !asked(Part::Consistency)
        || consistency::compare(&python, &workspace, arguments.problems, arguments.seed)?;
    let dynamics_agree = !asked(Part::Dynamics) || dynamics(python, arguments)?;
    Ok(if files_agree && formats_agree && recordings_agree && optima_agree && dynamics_agree {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

/// Prints the table of differences to Pinocchio; whether all are small.
fn dynamics(python: Python, arguments: &Arguments) -> anyhow::Result<bool> {
    let oracle = pinocchio::Oracle::new(python)?;
    let folder = tempfile::tempdir()?;
    let mut cases = case::from_files(&environment::workspace_root()?)?;
    cases.extend(case::random(folder.path(), arguments.seed, arguments.random_robots)?);

    println!(
        "Largest relative difference to Pinocchio {}, {} random states for each robot, seed {}",
        oracle.version(),
        arguments.states,
        arguments.seed
    );
    println!("*: joints follow others; Pinocchio's forward dynamics is through its mass matrix, not ABA");
    println!("singular: the mass matrix is, so that no acceleration is the right one\n");
    print!("{:<22} {:<12} {:>6}", "robot", "base", "joints");
    QUANTITIES.iter().for_each(|quantity| print!(" {quantity:>10}"));
    println!();
    let mut largest = 0.0_f64;
    for case in &cases {
        let row = compare(&oracle, case, arguments)?;
        println!("{row}");
        largest =
            row.differences.iter().flatten().fold(largest, |largest, &difference| largest.max(difference));
    }
    let agrees = largest < TOLERANCE;
    let verdict = if agrees { "below" } else { "NOT below" };
    println!("\nmax relative difference {largest:.1e} over {} cases: {verdict} {TOLERANCE:.0e}", cases.len());
    Ok(agrees)
}

/// A line of the table.
struct Row<'a> {
    case: &'a Case,
    joints: usize,
    follows: bool,
    /// One for each of [`QUANTITIES`]; `None` where Pinocchio has no answer.
    differences: Vec<Option<f64>>,
}

impl std::fmt::Display for Row<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let star = if self.follows { "*" } else { "" };
        write!(
            f,
            "{:<22} {:<12} {:>6}",
            self.case.robot,
            self.case.base(),
            format!("{}{star}", self.joints)
        )?;
        self.differences.iter().try_for_each(|difference| match difference {
            Some(difference) => write!(f, " {difference:>10.1e}"),
            None => write!(f, " {:>10}", "singular"),
        })
    }
}

fn compare<'a>(oracle: &pinocchio::Oracle, case: &'a Case, arguments: &Arguments) -> anyhow::Result<Row<'a>> {
    let tree = case.read()?;
    let states = answers::States::random(&tree, arguments.states, arguments.seed)?;
    let ours = answers::answers(&tree, &states)?;
    let theirs = oracle.answers(case, &tree, &states)?;
    let difference = |(ours, theirs): (&answers::Answer, &Option<Vec<f64>>)| {
        theirs.as_ref().map(|theirs| comparison::relative_difference(ours, theirs))
    };
    let differences = ours.iter().zip(&theirs).map(difference).collect();
    Ok(Row { case, joints: tree.joint_count(), follows: tree.has_mimic(), differences })
}
