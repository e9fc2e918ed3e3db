//! Whether the robot of the motion held out is that of the training logs.

use crate::synthetic;

use phiw_dynamics::Tree;
use phiw_identification::fitting::{HeldOutChange, held_out_change};
use phiw_identification::{Fold, identify};

const JOINTS: usize = 4;
const TRAINING_S: f64 = 60.0;
const ALL_S: f64 = 90.0;

/// What is said of the last third of a log, in which the robot is `later`.
fn changes(tree: &Tree, later: &Tree, seed: u64) -> Vec<HeldOutChange> {
    let log = synthetic::recording_that_changes(tree, later, TRAINING_S, ALL_S, seed);
    let blocks = synthetic::blocks(&log, 4096);
    let mut folds = synthetic::folds(TRAINING_S - 1.0, 8);
    folds.push(Fold { log: 0, start: TRAINING_S + 1.0, end: ALL_S });
    let data = synthetic::data(&blocks, folds, Vec::new());
    let effects = (0..JOINTS).map(|joint| vec![synthetic::Viscous::on(tree, joint)]).collect();
    held_out_change(&identify(tree, effects, &data).unwrap()).unwrap()
}

/// A robot that carries a tool in the logs held out was called explained, with nothing said of an error
/// ninety times that of the training logs.
#[test]
fn a_tool_that_only_the_motion_held_out_has_is_told() {
    for seed in 0..6 {
        let tree = synthetic::robot(seed, JOINTS);
        assert_eq!(changes(&tree, &tree, seed), [], "robot {seed} is as it was");
        let changes = changes(&tree, &synthetic::with_tool(&tree), seed);
        assert!(changes.iter().any(|change| change.ratio > 6.0), "robot {seed}: {changes:?}");
    }
}
