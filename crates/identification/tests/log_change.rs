//! Whether the training logs are of one robot.

use crate::synthetic;

use phiw_dynamics::Tree;
use phiw_dynamics::random_tree::RandomNumbers;
use phiw_identification::fitting::{LogChange, fit, log_changes, odd_log};
use phiw_identification::{Fold, identify};
use phiw_regressor::factor::FactorBuilder;
use phiw_regressor::least_squares::{Group, GroupedFactor};

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

/// Of three logs the one with a tool, wherever it stands; of logs of one robot none, and of two none.
#[test]
fn the_log_of_another_robot_is_the_one_without_which_the_others_are_of_one() {
    for seed in 0..3 {
        let tree = synthetic::robot(seed, JOINTS);
        for odd in 0..3 {
            let robots =
                [0, 1, 2].map(|log| if log == odd { synthetic::with_tool(&tree) } else { tree.clone() });
            assert_eq!(odd_of(&robots, seed), Some(odd), "robot {seed}");
            assert_eq!(odd_of(&robots[odd.min(1)..][..2], seed), None, "robot {seed}");
        }
        assert_eq!(odd_of(&[tree.clone(), tree.clone(), tree], seed), None, "robot {seed}");
    }
}

/// The odd one of logs of these robots, one after the other.
fn odd_of(robots: &[Tree], seed: u64) -> Option<usize> {
    let (mut train, mut factors, mut design) = (Vec::new(), Vec::new(), None);
    for (log, robot) in robots.iter().enumerate() {
        let recorded = synthetic::recording_that_changes(robot, robot, LOG_S, LOG_S, 10 * seed + log as u64);
        let blocks = synthetic::blocks(&recorded, 4096);
        let data = synthetic::data(&blocks, synthetic::folds(LOG_S, 8), Vec::new());
        let effects = (0..JOINTS).map(|joint| vec![synthetic::Viscous::on(robot, joint)]).collect();
        let identified = identify(robot, effects, &data).unwrap();
        train.extend(data.train.iter().map(|fold| Fold { log, ..*fold }));
        factors.extend(identified.train_folds);
        design = Some(identified.design);
    }
    let design = design.unwrap();
    odd_log(&design, &fit(&design, &factors).unwrap(), &train, &factors).unwrap()
}

/// A parameter that one log tells and the other does not: beside the other log's rows, its own were lost in
/// rounding, and the command failed though both logs together tell it.
#[test]
fn a_log_that_does_not_tell_a_parameter_does_not_fail() {
    let tree = synthetic::robot(3, 1);
    let design = synthetic::design(&tree);
    let columns = design.parameter_count();
    let train: Vec<Fold> = (0..12u8)
        .map(|fold| Fold { log: usize::from(fold >= 6), start: f64::from(fold), end: f64::from(fold + 1) })
        .collect();
    let mut told = 0;
    for quarter in 0..60 {
        // The last two columns are told apart in the second log only, and hardly.
        let apart = 10f64.powf(-0.25 * f64::from(quarter));
        let mut random = RandomNumbers::new(1);
        let mut number = || random.uniform(-1.0, 1.0);
        let folds: Vec<GroupedFactor> = train
            .iter()
            .map(|fold| {
                let mut builder = FactorBuilder::new(columns + 1);
                for _ in 0..50 {
                    let mut row: Vec<f64> = (0..=columns).map(|_| number()).collect();
                    let wobble = if fold.log == 1 { apart * row[columns - 1] } else { 0.0 };
                    row[columns - 1] = row[columns - 2] + wobble;
                    row[columns] = row[..columns].iter().sum::<f64>() + 0.1 * row[columns];
                    builder.push_row(&row).unwrap();
                }
                let group = Group { parameters: (0..columns).collect(), factor: builder.factor() };
                GroupedFactor::new(columns, vec![group]).unwrap()
            })
            .collect();
        let fit = fit(&design, &folds).unwrap();
        told += usize::from(fit.undetermined.is_empty());
        let changes = log_changes(&fit, &train, &folds).unwrap_or_else(|error| panic!("{apart}: {error}"));
        assert_eq!(changes, [], "{apart}");
    }
    assert!((1..59).contains(&told), "{told}");
}
