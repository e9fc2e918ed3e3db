//! The command `phiw`.

use clap::Parser;
use phiw::arguments::{Arguments, Command};
use phiw::console::{self, Console};
use phiw::{Error, threads};
use std::process::ExitCode;

fn main() -> ExitCode {
    // A wrong command line ends here, with exit status 2.
    let arguments = Arguments::parse();
    // A fault of ours is one message and status 1, like any other failure that is not the input's.
    std::panic::set_hook(Box::new(|fault| {
        if phiw_telemetry::is_guarded() {
            return;
        }
        // A library's way of saying that the system gave no memory.
        match fault.to_string().contains("AllocError") {
            true => console::say(
                "error: ",
                "there is not enough memory; give phiw more (ulimit -v), or hold joints (--hold)",
            ),
            false => console::say("error: phiw itself is at fault, please report it: ", &fault.to_string()),
        }
    }));
    std::panic::catch_unwind(|| threads::with(|| run(&arguments))).unwrap_or(ExitCode::FAILURE)
}

/// Does what was asked for and says what became of it.
fn run(arguments: &Arguments) -> ExitCode {
    let quiet = arguments.command.quiet();
    let console = Console::of_terminal(quiet);
    match told(&arguments.command, &console) {
        Ok(told) => {
            drop(console);
            if !quiet {
                told.warnings.iter().for_each(|warning| console::say("warning: ", warning));
                console::print(&told.summary);
            }
            told.failures.iter().for_each(|failure| console::say("failed: ", failure));
            ExitCode::from(u8::from(!told.failures.is_empty()))
        }
        Err(error) => {
            drop(console);
            console::say("error: ", &error.to_string());
            ExitCode::from(error.exit_status())
        }
    }
}

/// What is said at the end of a command.
struct Told {
    summary: String,
    warnings: Vec<String>,
    /// Parts of the work that could not be done, though others could.
    failures: Vec<String>,
}

fn told(command: &Command, console: &Console) -> Result<Told, Error> {
    let no_failures = Vec::new();
    Ok(match command {
        Command::Identify(arguments) => {
            let outcome = match &arguments.merge {
                Some(merge) => phiw::fleet::merge(merge, console)?,
                None => phiw::identify::identify(&arguments.session, console)?,
            };
            Told { summary: outcome.summary, warnings: outcome.warnings, failures: no_failures }
        }
        Command::Explain(arguments) => {
            let outcome = phiw::explain::explain(arguments, console)?;
            Told { summary: outcome.summary, warnings: outcome.warnings, failures: no_failures }
        }
        Command::Predict(arguments) => {
            let outcome = phiw::predict::predict(arguments, console)?;
            Told { summary: outcome.summary, warnings: outcome.warnings, failures: no_failures }
        }
        Command::Simulate(arguments) => {
            let outcome = phiw::simulate::simulate(arguments, console)?;
            Told { summary: outcome.summary, warnings: outcome.warnings, failures: no_failures }
        }
        Command::Export(arguments) => {
            let outcome = phiw::export::export(arguments)?;
            Told { summary: outcome.summary, warnings: Vec::new(), failures: no_failures }
        }
        Command::Check(arguments) => {
            let outcome = phiw::check::check(arguments, console)?;
            Told { summary: outcome.summary, warnings: Vec::new(), failures: no_failures }
        }
        Command::Map(arguments) => {
            let outcome = phiw::map::map(arguments)?;
            Told { summary: outcome.summary, warnings: outcome.warnings, failures: no_failures }
        }
        Command::Retarget(arguments) => {
            let outcome = phiw::retarget::retarget(arguments, console)?;
            let failures = outcome.failures.iter().map(|failure| failure.reason.to_string()).collect();
            Told { summary: outcome.summary, warnings: outcome.warnings, failures }
        }
        Command::Plan(arguments) => {
            let outcome = phiw::fleet::plan(arguments, console)?;
            Told { summary: outcome.summary, warnings: outcome.warnings, failures: no_failures }
        }
        Command::Reduce(arguments) => {
            let outcome = phiw::fleet::reduce(arguments, console)?;
            Told { summary: outcome.summary, warnings: outcome.warnings, failures: no_failures }
        }
        Command::Next(arguments) => {
            let outcome = phiw::next::next(arguments, console)?;
            Told { summary: outcome.summary, warnings: outcome.warnings, failures: no_failures }
        }
    })
}
