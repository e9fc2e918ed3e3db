//! When the curriculum could have ended: the criterion, applied to runs that went on.
//!
//! A criterion only looks back, so what it would have left is the beginning of a run that did not have it.

use super::arm::Arm;
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

/// What ending by the criterion costs and saves, against the fixed count.
pub struct Savings {
    /// Runs.
    pub runs: usize,
    /// Runs that would have ended earlier.
    pub earlier: usize,
    /// Mean number of iterations that a run would have saved.
    pub saved: f64,
    /// Median torque error then, and after all iterations \[N·m\].
    pub rmse_torque: [f64; 2],
    /// Median RMSE_w then, and after all iterations.
    pub rmse_w: [f64; 2],
}

/// Over the curriculum's runs; none if there are none.
pub fn savings(results: &Results) -> Option<Savings> {
    let (mut saved, mut torque, mut w) = (Vec::new(), [Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
    for run in results.of(results.home(), Arm::Curriculum) {
        let end = ended_after(run);
        let (then, after) = (run.scores.get(end)?, run.scores.last()?);
        saved.push((run.run.history.len() - end) as f64);
        for (place, score) in [then, after].into_iter().enumerate() {
            torque[place].push(score.rmse_torque);
            w[place].push(score.rmse_w);
        }
    }
    let runs = saved.len();
    (runs > 0).then(|| Savings {
        runs,
        earlier: saved.iter().filter(|saved| **saved > 0.0).count(),
        saved: saved.iter().sum::<f64>() / runs as f64,
        rmse_torque: torque.map(|values| median(&values)),
        rmse_w: w.map(|values| median(&values)),
    })
}
