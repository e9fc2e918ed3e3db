//! Whether the training logs are of one robot.

mod synthetic;

use phiw_dynamics::Tree;
use phiw_identification::fitting::{LogChange, log_changes};
use phiw_identification::{Fold, identify};

const JOINTS: usize = 4;
const LOG_S: f64 = 40.0;

/// What is said of two logs, of `tree` and of `other`.
fn changes(tree: &Tree, other: &Tree, seed: u64) -> Vec<LogChange> {
    let log = synthetic::recording_that_changes(tree, other, LOG_S, 2.0 * LOG_S, seed);
    let blocks = synthetic::blocks(&log, 4096);
    let data = synthetic::data(&blocks, synthetic::folds(2.0 * LOG_S, 16), Vec::new());
    let effects = (0..JOINTS).map(|joint| vec![synthetic::Viscous::on(tree, joint)]).collect();
    let identified = identify(tree, effects, &data).unwrap();
    let of_log = |fold: &Fold| Fold { log: usize::from(fold.start >= LOG_S), ..*fold };
    let train: Vec<Fold> = data.train.iter().map(of_log).collect();
    log_changes(&identified.fit, &train, &identified.train_folds).unwrap()
}

/// A tool in one of two training logs was called a sufficient model, with masses of neither robot.
#[test]
fn a_tool_that_one_training_log_has_is_told() {
    for seed in 0..6 {
        let tree = synthetic::robot(seed, JOINTS);
        assert_eq!(changes(&tree, &tree, seed), [], "robot {seed} is one robot");
        let changes = changes(&tree, &synthetic::with_tool(&tree), seed);
        let largest = changes.first().unwrap_or_else(|| panic!("robot {seed}: nothing is said"));
        assert!(changes.iter().all(|change| change.ratio <= largest.ratio), "{changes:?}");
    }
}
