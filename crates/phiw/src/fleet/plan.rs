//! `phiw plan`: what must be decided over all logs together.

use super::FleetOutcome;
use super::plan_file::PlanFile;
use crate::Error;
use crate::arguments::SessionArguments;
use crate::console::Console;
use crate::output::check_file;
use crate::page::counted;
use crate::session::Session;
use crate::warnings::of_log;
use clap::error::Error as ClapError;
use clap::{ArgMatches, Args, FromArgMatches};
use phiw_report::number::significant;
use phiw_result_folder::{Disk, Lock, StreamedFile, check_inputs};
use phiw_telemetry::Survey;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Arguments of `phiw plan`: those of a session, with the training logs without an option's name.
#[derive(Clone, Debug, Default)]
pub struct PlanArguments {
    /// Robot, logs and declared model.
    pub session: SessionArguments,
    /// The plan.
    pub out: PathBuf,
    /// Print nothing but errors.
    pub quiet: bool,
}

impl Args for PlanArguments {
    fn augment_args(command: clap::Command) -> clap::Command {
        SessionArguments::augment_args(command)
            .mut_arg("train", |train| train.long(None).index(1))
            .mut_arg("out", |out| out.value_name("PLAN.json").help("The plan"))
    }

    fn augment_args_for_update(command: clap::Command) -> clap::Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for PlanArguments {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, ClapError> {
        let read = SessionArguments::from_arg_matches(matches)?;
        let (out, quiet) = (read.out.clone(), read.quiet);
        // Where results go is told when they are made.
        let session = SessionArguments { out: PathBuf::new(), quiet: false, ..read };
        Ok(PlanArguments { session, out, quiet })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), ClapError> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Surveys all logs and writes down what `phiw reduce` and `phiw identify --plan` need to work on each by
/// itself.
///
/// # Errors
/// An input is wrong, or the plan cannot be written.
pub fn plan(arguments: &PlanArguments, console: &Console) -> Result<FleetOutcome, Error> {
    check_file(&arguments.out)?;
    check_inputs(&arguments.session.inputs(), std::slice::from_ref(&arguments.out))?;
    let _place = Lock::acquire(&arguments.out, "phiw plan")?;
    let progress = |what: &str, done: u64, total: u64| console.progress(what, done, total);
    let session = Session::open(&arguments.session, &progress)?;
    let file = PlanFile::of_session(&session, &progress)?;
    console.finish();
    write(&arguments.out, file.to_json()?.as_bytes())?;
    let surveys = session.logs.surveys();
    let seconds: f64 = surveys.iter().map(Survey::duration).sum();
    let conditioning = session.logs.conditioning();
    Ok(FleetOutcome {
        summary: format!(
            "{}: {}, {} s; positions low-passed at {} Hz, columns and torque at {} Hz\n{} for phiw reduce\n",
            session.tree.name(),
            counted(surveys.len(), "log"),
            significant(seconds, 3),
            significant(conditioning.cutoff_hz, 3),
            significant(conditioning.parallel_cutoff_hz, 3),
            arguments.out.display()
        ),
        warnings: surveys.iter().flat_map(of_log).collect(),
    })
}

/// Writes a file in one step.
pub(super) fn write(path: &Path, content: &[u8]) -> Result<(), Error> {
    let mut file = StreamedFile::create(&Disk, path)?;
    file.write_all(content).map_err(|source| file.unwritable(source))?;
    Ok(file.commit()?)
}

#[cfg(test)]
mod tests {
    use crate::arguments::{Arguments, Command};
    use clap::Parser;

    /// It had a list of its own, which lacked what was added to the others'.
    #[test]
    fn a_plan_takes_every_option_of_a_session() {
        let options = [
            "--declare viscous_friction",
            "--hold j",
            "--mass a=1",
            "--total-mass 3",
            "--mirrored a=b",
            "--motions m",
            "--map m.toml",
            "--cutoff-hz 3",
            "--parallel-cutoff-hz 2",
        ];
        let options = options.iter().flat_map(|option| option.split(' '));
        let words: Vec<&str> = ["--urdf", "r.urdf"].into_iter().chain(options).collect();
        let inside = ["--inside-geometry", "--inside", "a=0 0 0 1 1 1"];
        let plan =
            ["phiw", "plan", "a.csv", "b.csv"].iter().chain(&words).chain(&inside).chain(&["--out", "p"]);
        let Command::Plan(plan) = Arguments::try_parse_from(plan).unwrap().command else {
            panic!("`plan` is read as another command");
        };
        let identify = ["phiw", "identify", "--train", "a.csv", "b.csv"];
        let identify = identify.iter().chain(&words).chain(&inside).chain(&["--out", "o"]);
        let Command::Identify(identify) = Arguments::try_parse_from(identify).unwrap().command else {
            panic!("`identify` is read as another command");
        };
        assert_eq!(plan.out, std::path::Path::new("p"));
        let json = |session| serde_json::to_value(session).unwrap();
        let mut expected = json(&identify.session);
        expected["out"] = "".into();
        assert_eq!(json(&plan.session), expected);
        assert!(Arguments::try_parse_from(["phiw", "plan", "--urdf", "r", "--out", "p"]).is_err(), "no log");
    }
}
