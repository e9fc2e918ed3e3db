//! The command `phiw`.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(phiw::command::main(std::env::args_os()))
}
