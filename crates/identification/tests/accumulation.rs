//! Factors do not depend on how the work was cut, and no row is lost or counted twice.

use crate::synthetic;

use phiw_identification::fitting::{accumulate, merge};
use phiw_identification::{BlockSource, LogSet, predict};
use phiw_regressor::least_squares::GroupedFactor;
use phiw_telemetry::ConditioningOptions;
use proptest::prelude::*;

/// RᵀR of each torque, to compare triangles whose rows may differ in sign.
fn gram(factor: &GroupedFactor) -> Vec<f64> {
    let of_group = |group: &phiw_regressor::least_squares::Group| {
        let r = group.factor.as_mat();
        let product = r.transpose() * r;
        product.col_iter().flat_map(|column| column.iter().copied().collect::<Vec<_>>()).collect::<Vec<_>>()
    };
    factor.groups().iter().flat_map(of_group).collect()
}

/// All numbers of all triangles.
fn entries(factors: &[GroupedFactor]) -> Vec<u64> {
    let groups = factors.iter().flat_map(|factor| factor.groups());
    groups
        .flat_map(|group| {
            let size = group.factor.columns();
            (0..size * size)
                .map(|index| group.factor.entry(index / size, index % size).to_bits())
                .collect::<Vec<_>>()
        })
        .collect()
}

#[test]
fn the_number_of_threads_changes_not_a_bit() {
    let tree = synthetic::robot(5, 6);
    let design = synthetic::design(&tree).with_rest_speeds(vec![0.05; 6]);
    let blocks = synthetic::blocks(&synthetic::recording(&tree, 5, 30.0, 1.0, 0.1, 5), 256);
    assert!(blocks.len() > 8);
    let folds = synthetic::folds(30.0, 4);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let factors = accumulate(&design, &folds, &[&blocks]).unwrap();
            let mut predictions = Vec::new();
            predict(&design, &synthetic::truth(&tree, 1.0), &[&blocks], &mut |prediction| {
                predictions.extend(prediction.predicted.iter().map(|torque| torque.to_bits()));
            })
            .unwrap();
            (entries(&factors), predictions)
        })
    };
    let one = run(1);
    for threads in [2, 3, 5] {
        assert!(run(threads) == one, "{threads} threads");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

    #[test]
    fn the_size_of_blocks_changes_rounding_only(seed in 0u64..100, block_samples in 40usize..2000, pieces in 1usize..7) {
        let tree = synthetic::robot(seed, 3);
        let design = synthetic::design(&tree);
        let recording = synthetic::recording(&tree, seed, 15.0, 1.0, 0.1, seed);
        let whole = accumulate(&design, &synthetic::folds(16.0, 1), &[&synthetic::blocks(&recording, 1 << 20)]).unwrap();
        let cut = accumulate(&design, &synthetic::folds(16.0, pieces), &[&synthetic::blocks(&recording, block_samples)]).unwrap();
        let cut = merge(&cut).unwrap();
        prop_assert_eq!(cut.rows(), whole[0].rows());
        let (cut, whole) = (gram(&cut), gram(&whole[0]));
        let scale = whole.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
        for (a, b) in cut.iter().zip(&whole) {
            prop_assert!((a - b).abs() < 1e-10 * scale, "{} {}", a, b);
        }
    }
}

/// Every output of every log is in exactly one fold.
#[test]
fn folds_partition_the_outputs() {
    let tree = synthetic::robot(8, 3);
    let folder = tempfile::tempdir().unwrap();
    let paths: Vec<_> = (0..3).map(|log| folder.path().join(format!("{log}.csv"))).collect();
    for (log, path) in paths.iter().enumerate() {
        synthetic::recording(&tree, log as u64, 5.0 + 9.0 * log as f64, 1.0, 0.1, 1).write_csv(path).unwrap();
    }
    for validate in [&paths[2..], &[]] {
        let logs = LogSet::open(&tree, &paths[..2], validate, &ConditioningOptions::default(), &|_, _, _| ())
            .unwrap();
        assert_eq!(logs.splits_training_logs(), validate.is_empty());
        let folds = [logs.training_folds(), logs.held_out_folds()].concat();
        let sources = logs.sources(&|_, _, _| ());
        let sources: Vec<&dyn BlockSource> =
            sources.iter().map(|source| source as &dyn BlockSource).collect();
        let design = synthetic::design(&tree);
        let mut outputs = 0;
        predict(&design, &synthetic::truth(&tree, 1.0), &sources, &mut |prediction| {
            let homes = folds.iter().filter(|fold| fold.contains(prediction.log, prediction.t)).count();
            assert_eq!(homes, 1, "{} s of log {}", prediction.t, prediction.log);
            outputs += 1;
        })
        .unwrap();
        let rows: u64 = accumulate(&design, &folds, &sources).unwrap().iter().map(GroupedFactor::rows).sum();
        assert_eq!(rows, 3 * outputs);
    }
}
