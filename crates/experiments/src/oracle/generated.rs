//! Generated inverse dynamics, compiled and timed.

use anyhow::{Context, ensure};
use std::path::Path;
use std::process::Command;

/// Times that all states are gone through, for the time of a call.
const ROUNDS: usize = 2000;

/// Writes the torques of all states, and prints the nanoseconds of a call.
const C_DRIVER: &str = r#"
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "inverse_dynamics.c"
int main(int count, char **words) {
    long rounds = count > 1 ? atol(words[1]) : 1, states = 0, round, row;
    static double state[100000][3 * PHIW_JOINTS], torque[100000][PHIW_JOINTS];
    struct timespec begin, end;
    FILE *in = fopen("states", "rb"), *out = fopen("torques", "wb");
    if (!in || !out) return 1;
    states = (long)fread(state, sizeof state[0], 100000, in);
    clock_gettime(CLOCK_MONOTONIC, &begin);
    for (round = 0; round < rounds; round++)
        for (row = 0; row < states; row++)
            phiw_inverse_dynamics(state[row], state[row] + PHIW_JOINTS, state[row] + 2 * PHIW_JOINTS, torque[row]);
    clock_gettime(CLOCK_MONOTONIC, &end);
    fwrite(torque, sizeof torque[0], (size_t)states, out);
    printf("%.1f\n", ((double)(end.tv_sec - begin.tv_sec) * 1e9 + (double)(end.tv_nsec - begin.tv_nsec)) / (double)(rounds * states));
    return fclose(out);
}
"#;

const RUST_DRIVER: &str = r#"
use inverse_dynamics::{JOINTS, inverse_dynamics};
fn main() -> std::io::Result<()> {
    let rounds: usize = std::env::args().nth(1).unwrap().parse().unwrap();
    let bytes = std::fs::read("states")?;
    let numbers: Vec<f64> = bytes.chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
    let states: Vec<[[f64; JOINTS]; 3]> = numbers
        .chunks(3 * JOINTS)
        .map(|row| std::array::from_fn(|at| row[at * JOINTS..(at + 1) * JOINTS].try_into().unwrap()))
        .collect();
    let mut torques = vec![[0.0; JOINTS]; states.len()];
    let begin = std::time::Instant::now();
    for _ in 0..rounds {
        for (torque, [q, v, a]) in torques.iter_mut().zip(std::hint::black_box(&states)) {
            *torque = inverse_dynamics(q, v, a);
        }
        std::hint::black_box(&torques);
    }
    let time = begin.elapsed().as_secs_f64();
    println!("{:.1}", time * 1e9 / (rounds * states.len()) as f64);
    std::fs::write("torques", torques.iter().flatten().flat_map(|torque| torque.to_le_bytes()).collect::<Vec<_>>())
}
"#;

/// Torques of all states, and the time of a call \[ns\].
pub struct Run {
    /// A row for each state.
    pub torque: Vec<f64>,
    /// \[ns\].
    pub nanoseconds: f64,
}

/// Runs `inverse_dynamics.c` of the folder over its file `states`; `None` where there is no C compiler.
///
/// # Errors
/// It does not compile without a warning.
pub fn in_c(folder: &Path) -> anyhow::Result<Option<Run>> {
    std::fs::write(folder.join("driver.c"), C_DRIVER)?;
    let mut compile = Command::new("cc");
    compile.args(["-std=c99", "-Wall", "-Werror", "-O2", "-o", "driver", "driver.c", "-lm"]);
    run(folder, &mut [compile])
}

/// The same of `inverse_dynamics.rs`.
///
/// # Errors
/// It does not compile without a warning.
pub fn in_rust(folder: &Path) -> anyhow::Result<Option<Run>> {
    std::fs::write(folder.join("driver.rs"), RUST_DRIVER)?;
    let rustc = |arguments: &[&str]| {
        let mut rustc = Command::new("rustc");
        rustc.args(["--edition", "2021", "-D", "warnings", "-C", "opt-level=3"]).args(arguments);
        rustc
    };
    let library = rustc(&["--crate-type", "lib", "inverse_dynamics.rs"]);
    run(
        folder,
        &mut [library, rustc(&["--extern", "inverse_dynamics=libinverse_dynamics.rlib", "driver.rs"])],
    )
}

fn run(folder: &Path, compile: &mut [Command]) -> anyhow::Result<Option<Run>> {
    for command in compile {
        let Ok(output) = command.current_dir(folder).output() else { return Ok(None) };
        ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let output = Command::new(folder.join("driver")).arg(ROUNDS.to_string()).current_dir(folder).output()?;
    ensure!(output.status.success(), "the driver of generated code fails");
    let nanoseconds = String::from_utf8_lossy(&output.stdout).trim().parse().context("the driver's time")?;
    Ok(Some(Run { torque: super::python::read_numbers(&folder.join("torques"))?, nanoseconds }))
}
