//! `cargo xtask test`: all checks of the workspace, with one line at the end that counts the tests.

pub mod tally;

use crate::{consumers, mujoco, python};
use anyhow::Context;
use phiw_experiments::environment;
use std::io::{BufRead, BufReader};
use std::process::{ExitCode, Stdio};
use tally::Tally;

/// Command line of `cargo xtask test`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Tests only: neither format, lints nor documentation.
    #[arg(long)]
    quick: bool,
}

/// Checks that are one call of cargo each.
const CHECKS: [&[&str]; 3] = [
    &["fmt", "--all", "--check"],
    &["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"],
    &["doc", "--workspace", "--no-deps"],
];

/// Licences, duplicates and sources of what is linked, by `deny.toml`. Advisories are left out: they need a
/// network.
const DEPENDENCIES: &[&str] = &["deny", "check", "licenses", "bans", "sources"];

/// `--show-output` prints what passing tests said, so that a test that skipped itself is seen and counted.
const TESTS: &[&str] = &["test", "--workspace", "--no-fail-fast", "--", "--show-output"];

/// Runs every check, also after one has failed, and prints what failed tests said once more and the tally as
/// the last line.
///
/// # Errors
/// Cargo cannot be started.
pub fn command(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    mujoco::fetch_if(true);
    let mut failed = Vec::new();
    let mut checks = Vec::new();
    let unchecked_dependencies = !arguments.quick && !has_deny()?;
    if !arguments.quick {
        checks.extend((!unchecked_dependencies).then_some(DEPENDENCIES));
        checks.extend(CHECKS);
    }
    for check in checks {
        if !passes(check)? {
            failed.push(named(check));
        }
    }
    let mut tally = Tally::default();
    tally.add_failures(failed.len() as u64);
    if !run_tests(TESTS, &mut tally)? {
        failed.push(named(TESTS));
    }
    let folder = tempfile::Builder::new().prefix("phiw-consumers-").tempdir()?;
    let problems = consumers::generate(folder.path())?;
    tally.add_failures(problems.len() as u64);
    failed.extend(problems);
    let consumers = consumers::arguments(folder.path())?;
    let consumers: Vec<&str> = consumers.iter().map(String::as_str).collect();
    if !run_tests(&consumers, &mut tally)? {
        failed.push(named(&consumers));
    }
    failed.extend(python::test(&mut tally)?);
    tally.said_by_failures().iter().for_each(|line| println!("{line}"));
    failed.iter().for_each(|problem| println!("failed: {problem}"));
    if unchecked_dependencies {
        println!("skipped: cargo-deny is not installed: licences and sources of dependencies unchecked");
    }
    println!("{tally}");
    Ok(if failed.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Whether `cargo deny` can be run.
fn has_deny() -> anyhow::Result<bool> {
    let version =
        environment::cargo()?.args(["deny", "--version"]).output().context("cargo cannot be started")?;
    Ok(version.status.success())
}

fn passes(check: &[&str]) -> anyhow::Result<bool> {
    announce(check);
    let status = environment::cargo()?
        .args(check)
        .env("RUSTDOCFLAGS", "-D warnings")
        .status()
        .context("cargo cannot be started")?;
    Ok(status.success())
}

/// Runs tests, passing on their output line by line, and counts; whether all is well.
fn run_tests(arguments: &[&str], tally: &mut Tally) -> anyhow::Result<bool> {
    announce(arguments);
    let mut child = environment::cargo()?
        .args(arguments)
        .stdout(Stdio::piped())
        .spawn()
        .context("cargo cannot be started")?;
    let failures = tally.failures();
    if let Some(output) = child.stdout.take() {
        for line in BufReader::new(output).split(b'\n') {
            let line = line.context("the output of the tests cannot be read")?;
            let line = String::from_utf8_lossy(&line);
            println!("{line}");
            tally.read_line(&line);
        }
    }
    let passed = child.wait().context("cargo test did not end")?.success();
    if !passed && tally.failures() == failures {
        tally.add_failures(1); // tests that do not compile, or a binary that crashed
    }
    Ok(passed)
}

fn announce(arguments: &[&str]) {
    println!("\n=== {}", named(arguments));
}

fn named(arguments: &[&str]) -> String {
    format!("cargo {}", arguments.join(" "))
}
