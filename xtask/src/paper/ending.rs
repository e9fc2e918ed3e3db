//! When the curriculum could have ended: the criterion, applied to runs that went on.
//!
//! A criterion only looks back, so what it would have left is the beginning of a run that did not have it.

use super::arm::{Arm, Footing};
use super::report::{Results, median};
use super::run_file::RunFile;
use phiw_curriculum::{Converged, EndCriterion, EndReason};

/// Iterations after which a run would have ended; all of them if it had not converged.
pub fn ended_after(run: &RunFile) -> usize {
    let criterion = Converged::default();
    let history = &run.run.history;
    let converged = |count: &usize| criterion.reason(&history[..*count]) == Some(EndReason::Converged);
    (1..=history.len()).find(converged).unwrap_or(history.len())
}

/// Medians over the curriculum's runs: iterations, RMSE_w then, RMSE_w after all.
pub fn saved(results: &Results) -> Option<[f64; 3]> {
    let mut columns = [Vec::new(), Vec::new(), Vec::new()];
    for run in results.of(Footing::Fixed, Arm::Curriculum) {
        let end = ended_after(run);
        columns[0].push(end as f64);
        columns[1].push(run.scores.get(end)?.rmse_w);
        columns[2].push(run.scores.last()?.rmse_w);
    }
    if columns[0].is_empty() { None } else { Some(columns.map(|column| median(&column))) }
}
