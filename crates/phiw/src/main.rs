//! The command `phiw`.

use phiw::{command, little_memory};
use std::process::ExitCode;

fn main() -> ExitCode {
    let command_line: Vec<_> = std::env::args_os().collect();
    let done = little_memory::in_a_process_of_its_own(&command_line);
    ExitCode::from(done.unwrap_or_else(|| command::main(command_line)))
}
