//! The command `phiw`.

use clap::Parser;
use phiw::arguments::{Arguments, Command, NextArguments, RetargetArguments};
use phiw::console::Console;
use std::io::Write;
use std::process::ExitCode;

fn main() -> ExitCode {
    // A wrong command line ends here, with exit status 2.
    let arguments = Arguments::parse();
    let outcome = match &arguments.command {
        Command::Identify(identify) => {
            phiw::identify::identify(&identify.session, &Console::of_terminal(identify.session.quiet))
        }
        Command::Explain(explain) => {
            phiw::explain::explain(explain, &Console::of_terminal(explain.session.quiet))
        }
        Command::Retarget(arguments) => return retarget(arguments),
        Command::Next(arguments) => return next(arguments),
    };
    match outcome {
        Ok(outcome) => {
            if !arguments.command.quiet() {
                outcome.warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
                // A reader that has seen enough (`| head`) is no failure.
                let _ = std::io::stdout().write_all(outcome.summary.as_bytes());
            }
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_status())
        }
    }
}

/// Retargets; recordings that could not be are listed at the end, and make the exit status 1 if others could.
fn retarget(arguments: &RetargetArguments) -> ExitCode {
    match phiw::retarget::retarget(arguments, &Console::of_terminal(arguments.quiet)) {
        Ok(outcome) => {
            if !arguments.quiet {
                let _ = std::io::stdout().write_all(outcome.summary.as_bytes());
            }
            outcome.failures.iter().for_each(|failure| eprintln!("failed: {}", failure.reason));
            ExitCode::from(u8::from(!outcome.failures.is_empty()))
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_status())
        }
    }
}

/// Chooses the next motion.
fn next(arguments: &NextArguments) -> ExitCode {
    match phiw::next::next(arguments, &Console::of_terminal(arguments.quiet)) {
        Ok(outcome) => {
            if !arguments.quiet {
                outcome.warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
                let _ = std::io::stdout().write_all(outcome.summary.as_bytes());
            }
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_status())
        }
    }
}
