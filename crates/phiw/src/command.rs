//! The command as a function: what `phiw` does with its arguments.

use crate::arguments::{Arguments, Command};
use crate::console::{self, Console};
use crate::{Error, little_memory, threads};
use clap::Parser;
use std::ffi::OsString;

/// Does what the command line asks for, the program's name first, and gives the exit status.
pub fn main(command_line: impl IntoIterator<Item = OsString>) -> u8 {
    let arguments = match Arguments::try_parse_from(command_line) {
        Ok(arguments) => arguments,
        Err(told) => {
            // Where nobody listens any more, nothing is lost but the message.
            let _ = told.print();
            return u8::try_from(told.exit_code()).unwrap_or(FAILURE);
        }
    };
    // A fault of ours is one message and status 1, like any other failure that is not the input's.
    std::panic::set_hook(Box::new(|fault| {
        if phiw_telemetry::is_guarded() {
            return;
        }
        // A library's way of saying that the system gave no memory.
        match fault.to_string().contains("AllocError") {
            true => console::say("error: ", little_memory::MESSAGE),
            false => console::say("error: phiw itself is at fault, please report it: ", &fault.to_string()),
        }
    }));
    std::panic::catch_unwind(|| threads::with(|| run(&arguments))).unwrap_or(FAILURE)
}

/// The exit status where neither the command line nor an input is wrong.
const FAILURE: u8 = 1;

/// Does what was asked for and says what became of it.
fn run(arguments: &Arguments) -> u8 {
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
            u8::from(!told.failures.is_empty())
        }
        Err(error) => {
            drop(console);
            console::say("error: ", &error.to_string());
            error.exit_status()
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
                Some(merge) => crate::fleet::merge(merge, console)?,
                None => crate::identify::identify(&arguments.session, console)?,
            };
            Told { summary: outcome.summary, warnings: outcome.warnings, failures: no_failures }
        }
        Command::Explain(arguments) => {
            let outcome = crate::explain::explain(arguments, console)?;
            Told { summary: outcome.summary, warnings: outcome.warnings, failures: no_failures }
        }
        Command::Predict(arguments) => {
            let outcome = crate::predict::predict(arguments, console)?;
            Told { summary: outcome.summary, warnings: outcome.warnings, failures: no_failures }
        }
        Command::Simulate(arguments) => {
            let outcome = crate::simulate::simulate(arguments, console)?;
            Told { summary: outcome.summary, warnings: outcome.warnings, failures: no_failures }
        }
        Command::Export(arguments) => {
            let outcome = crate::export::export(arguments)?;
            Told { summary: outcome.summary, warnings: Vec::new(), failures: no_failures }
        }
        Command::Map(arguments) => {
            let outcome = crate::map::map(arguments)?;
            Told { summary: outcome.summary, warnings: outcome.warnings, failures: no_failures }
        }
        Command::Check(arguments) => {
            let outcome = crate::check::check(arguments, console)?;
            Told { summary: outcome.summary, warnings: Vec::new(), failures: no_failures }
        }
        Command::Plan(arguments) => {
            let outcome = crate::fleet::plan(arguments, console)?;
            Told { summary: outcome.summary, warnings: outcome.warnings, failures: no_failures }
        }
        Command::Reduce(arguments) => {
            let outcome = crate::fleet::reduce(arguments, console)?;
            Told { summary: outcome.summary, warnings: outcome.warnings, failures: no_failures }
        }
        Command::Retarget(arguments) => {
            let outcome = crate::retarget::retarget(arguments, console)?;
            let failures = outcome.failures.iter().map(|failure| failure.reason.to_string()).collect();
            Told { summary: outcome.summary, warnings: outcome.warnings, failures }
        }
        Command::Next(arguments) => {
            let outcome = crate::next::next(arguments, console)?;
            Told { summary: outcome.summary, warnings: outcome.warnings, failures: no_failures }
        }
    })
}
