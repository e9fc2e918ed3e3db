//! Checks over random robots, which shrink to the smallest that fails.

use crate::body_kinematics::{
    floor_wrench_over_kinematics_is_the_base_wrench, regressor_over_kinematics_predicts_inverse_dynamics,
};
use crate::dynamics::regressor_predicts_inverse_dynamics;
use crate::measured::worse;
use crate::{Builder, Failure, Measured};
use phiw_dynamics::random_tree::{RandomTreeOptions, random_tree};
use phiw_dynamics::{BodyKinematics, DynamicsBackend};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestRng, TestRunner};
use std::cell::Cell;

/// Φw = τ over random robots, and the floor's wrench, over the tree's kinematics and the backend's own: trees
/// of all joint types, fixed or floating, and with `mimic` joints if the backend takes them.
///
/// # Errors
/// The smallest robot that fails, and how.
pub fn regressor_predicts_random_robots<B>(build: &Builder<B>, mimic: bool) -> Result<Measured, Failure>
where
    B: DynamicsBackend + BodyKinematics + ?Sized,
    Failure: From<B::Error>,
{
    let largest = Cell::new(0.0);
    let robots = (any::<u64>(), 1..12_usize, any::<bool>(), any::<bool>());
    let config = Config { failure_persistence: None, ..Config::default() };
    let mut runner = TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let outcome = runner.run(&robots, |(seed, joints, floating_base, follow)| {
        let options = RandomTreeOptions { joints, floating_base, mimic: mimic && follow, fixed_links: true };
        let refused = |error: &dyn std::fmt::Display| TestCaseError::fail(format!("{options:?}: {error}"));
        let tree = random_tree(seed, &options).map_err(|error| refused(&error))?;
        for measured in [
            regressor_predicts_inverse_dynamics(build, &tree, seed, 5),
            regressor_over_kinematics_predicts_inverse_dynamics(build, &tree, seed, 5),
            floor_wrench_over_kinematics_is_the_base_wrench(build, &tree, 5),
        ] {
            largest.set(worse(largest.get(), measured.map_err(|error| refused(&error))?.value));
        }
        Ok(())
    });
    outcome.map_err(|error| Failure::Wrong(error.to_string()))?;
    Measured::check("Φw against inverse dynamics of random robots", largest.get(), 1e-8, "")
}
