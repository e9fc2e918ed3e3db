//! The command `phiw`.

use clap::Parser;
use phiw::arguments::{Arguments, Command};
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
