//! A tenth of what `cargo xtask torture` tries, on the program of this profile.

use phiw_torture::hostile::{Failure, Ground, classes, run};
use std::path::Path;

#[test]
fn hostile_inputs_are_refused_or_said_and_never_crash() {
    let ground = Ground::new(Path::new(env!("CARGO_BIN_EXE_phiw")), 2).unwrap();
    let scores = run(&ground, &classes(), 0.1, 2, &|_| ()).unwrap();
    let failures: Vec<(&str, &Failure)> =
        scores.iter().flat_map(|score| score.failures.iter().map(|failure| (score.name, failure))).collect();
    assert!(failures.is_empty(), "{failures:#?}");
    assert!(scores.iter().map(|score| score.refused).sum::<usize>() > 100, "hardly anything was refused");
    assert!(scores.iter().map(|score| score.results).sum::<usize>() > 100, "hardly anything gave a result");
}
