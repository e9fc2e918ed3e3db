//! Equation (18) of all runs of an arm: which parameters are well estimated.

use super::arm::{Arm, Footing};
use super::report::Results;
use phiw_identification::accuracy::Reliability;

/// All parameters of an arm after an iteration (0: the initial models).
pub fn of_arm(results: &Results, footing: Footing, arm: Arm, iteration: usize) -> Vec<Reliability> {
    let of_parameter = |(index, facts): (usize, &super::setup::ParameterFacts)| {
        let runs = results.of(footing, arm).filter_map(|run| run.scores.get(iteration));
        let estimates: Vec<f64> = runs.map(|score| score.parameters[index]).collect();
        Reliability::of(&estimates, facts.value)
    };
    results.settings.parameters.iter().enumerate().map(of_parameter).collect()
}
