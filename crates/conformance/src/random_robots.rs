//! Checks over random robots, which shrink to the smallest that fails.

use crate::measured::worse;
use crate::{Builder, Failure, Measured, regressor_predicts_inverse_dynamics};
use phiw_dynamics::random_tree::{RandomTreeOptions, random_tree};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestRng, TestRunner};
use std::cell::Cell;

/// Φw = τ over random robots: trees of all joint types, fixed or floating, and with `mimic` joints if the backend takes them.
///
/// # Errors
/// The smallest robot that fails, and how.
pub fn regressor_predicts_random_robots(build: &Builder, mimic: bool) -> Result<Measured, Failure> {
    let largest = Cell::new(0.0);
    let robots = (any::<u64>(), 1..12_usize, any::<bool>(), any::<bool>());
    let config = Config { failure_persistence: None, ..Config::default() };
    let mut runner = TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let outcome = runner.run(&robots, |(seed, joints, floating_base, follow)| {
        let options = RandomTreeOptions { joints, floating_base, mimic: mimic && follow, fixed_links: true };
        let refused = |error: &dyn std::fmt::Display| TestCaseError::fail(format!("{options:?}: {error}"));
        let tree = random_tree(seed, &options).map_err(|error| refused(&error))?;
        let measured =
            regressor_predicts_inverse_dynamics(build, &tree, seed, 5).map_err(|error| refused(&error))?;
        largest.set(worse(largest.get(), measured.value));
        Ok(())
    });
    outcome.map_err(|error| Failure::Wrong(error.to_string()))?;
    Measured::check("Φw against inverse dynamics of random robots", largest.get(), 1e-8, "")
}
