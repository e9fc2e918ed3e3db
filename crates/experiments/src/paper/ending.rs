//! When the curriculum could have ended: criteria, applied to runs that went on.
//!
//! A criterion only looks back, so what it would have left is the beginning of a run that did not have it.

use super::arm::Arm;
use super::report::Results;
use super::run_file::RunFile;
use phiw_curriculum::end::{Certain, Converged, EndCriterion, EndReason};
use phiw_report::statistics::median;

/// Iterations after which a run would have ended by a criterion; all of them if it would not.
pub fn ended_after(run: &RunFile, criterion: &dyn EndCriterion) -> usize {
    let history = &run.run.history;
    let converged = |count: &usize| criterion.reason(&history[..*count]) == Some(EndReason::Converged);
    (1..=history.len()).find(converged).unwrap_or(history.len())
}

/// What ending by a criterion costs and saves, against the fixed count.
pub struct Savings {
    /// The criterion, in words.
    pub criterion: &'static str,
    /// Runs.
    pub runs: usize,
    /// Runs that would have ended earlier.
    pub earlier: usize,
    /// Mean number of iterations that a run would have had.
    pub iterations: f64,
    /// The fixed count after which the median torque error is the same, between two of them by interpolation.
    pub same_error_after: f64,
    /// Median torque error then, and after all iterations \[N·m\].
    pub rmse_torque: [f64; 2],
    /// Median RMSE_w then, and after all iterations.
    pub rmse_w: [f64; 2],
}

/// Over the curriculum's runs, for each criterion; none if there are none.
pub fn savings(results: &Results) -> Vec<Savings> {
    let criteria: [(_, &dyn EndCriterion); 2] = [
        ("torques settle within 2 % and cond within 10 %", &Converged::default()),
        ("torques known within 0.3 of their noise", &Certain::default()),
    ];
    criteria.into_iter().filter_map(|(name, criterion)| of(results, name, criterion)).collect()
}

fn of(results: &Results, name: &'static str, criterion: &dyn EndCriterion) -> Option<Savings> {
    let (mut ends, mut torque, mut w) = (Vec::new(), [Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
    for run in results.of(results.home(), Arm::Curriculum) {
        let end = ended_after(run, criterion);
        let (then, after) = (run.scores.get(end)?, run.scores.last()?);
        ends.push((end, run.run.history.len()));
        for (place, score) in [then, after].into_iter().enumerate() {
            torque[place].push(score.rmse_torque);
            w[place].push(score.rmse_w);
        }
    }
    let fixed = results.scores(results.home(), Arm::Curriculum, |score| Some(score.rmse_torque));
    let fixed: Vec<f64> = fixed.iter().map(|errors| median(errors)).collect();
    let rmse_torque = torque.map(|values| median(&values));
    (!ends.is_empty()).then(|| Savings {
        criterion: name,
        runs: ends.len(),
        earlier: ends.iter().filter(|(end, all)| end < all).count(),
        iterations: ends.iter().map(|(end, _)| *end as f64).sum::<f64>() / ends.len() as f64,
        same_error_after: count_with(&fixed, rmse_torque[0]),
        rmse_torque,
        rmse_w: w.map(|values| median(&values)),
    })
}

/// Where a falling series, `[0..]`, reaches a value; its end if it does not.
fn count_with(series: &[f64], value: f64) -> f64 {
    let reached = series.iter().position(|error| *error <= value);
    match reached {
        None => series.len().saturating_sub(1) as f64,
        Some(0) => 0.0,
        Some(next) => {
            let [before, after] = [series[next - 1], series[next]];
            (next - 1) as f64 + (before - value) / (before - after)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::count_with;

    #[test]
    fn a_value_between_two_counts_is_reached_between_them() {
        let series = [8.0, 4.0, 2.0, 1.0];
        for (value, count) in [(9.0, 0.0), (4.0, 1.0), (3.0, 1.5), (1.0, 3.0), (0.5, 3.0)] {
            assert_eq!(count_with(&series, value), count, "{value}");
        }
    }
}
