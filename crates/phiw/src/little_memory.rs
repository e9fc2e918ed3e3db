//! Where the address space is limited (`ulimit -v`), what is said when it is used up.
//!
//! An allocation that fails ends a Rust program with SIGABRT and lines of the standard library's. No code of
//! the program is called before, unless it replaces the allocator, which takes `unsafe`. So the work is done
//! by a process of its own there, and this one says what became of it.

use crate::console;
use std::ffi::OsString;

/// What is said, with what helps.
pub const MESSAGE: &str = "there is not enough memory; give phiw more (ulimit -v), or hold joints (--hold)";

/// Set in the process that works.
#[cfg(target_os = "linux")]
const WORKS: &str = "PHIW_WORKS_IN_LITTLE_MEMORY";

/// How the standard library's lines begin.
#[cfg(target_os = "linux")]
const STANDARD_LIBRARYS: &[u8] = b"memory allocation of ";

/// Does the command in another process where the address space is limited, and gives its exit status; none
/// where it is not, where this is that process, or where there is no room for another.
#[cfg(target_os = "linux")]
pub fn in_a_process_of_its_own(command_line: &[OsString]) -> Option<u8> {
    use std::io::{BufRead, BufReader, Write};
    use std::os::unix::process::ExitStatusExt;
    use std::process::{Command, Stdio};

    rustix::process::getrlimit(rustix::process::Resource::As).current?;
    if std::env::var_os(WORKS).is_some() {
        return None;
    }
    let mut command = Command::new(std::env::current_exe().ok()?);
    command.args(command_line.get(1..)?).env(WORKS, "1").env_remove("RUST_BACKTRACE").stderr(Stdio::piped());
    let mut child = command.spawn().ok()?;
    let mut used_up = false;
    for mut line in child.stderr.take().map(BufReader::new)?.split(b'\n').map_while(Result::ok) {
        // It may have said so itself, and then have ended by what it could not clean up.
        used_up |= line.starts_with(STANDARD_LIBRARYS) || line.ends_with(MESSAGE.as_bytes());
        // What follows is a note on how to see where. Where nobody listens, nothing is lost but the message.
        if !used_up {
            line.push(b'\n');
            let _ = std::io::stderr().write_all(&line);
        }
    }
    let status = child.wait().ok()?;
    if used_up {
        console::say("error: ", MESSAGE);
    }
    // As a shell says it of a process that a signal has ended.
    let of_signal = || 128 + status.signal().unwrap_or(0);
    let code = if used_up { 1 } else { status.code().unwrap_or_else(of_signal) };
    Some(u8::try_from(code).unwrap_or(1))
}

#[cfg(not(target_os = "linux"))]
pub fn in_a_process_of_its_own(_: &[OsString]) -> Option<u8> {
    None
}
