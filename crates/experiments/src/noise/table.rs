//! The table.

use super::cell::{Cell, Outcome};
use clap::ValueEnum;
use phiw_report::statistics::median;

/// Its head.
pub const HEAD: &str = "| sensors | noise in | ρ | estimator | RMSE_w | worst | torque error \\[N·m\\] | worst | worse than the start | bound | refuted | forced |\n|---|---|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|";

/// The row of a cell.
pub fn row(cell: &Cell, outcomes: &[Outcome]) -> String {
    let of = |number: &dyn Fn(&Outcome) -> f64| outcomes.iter().map(number).collect::<Vec<f64>>();
    let (rmse, torque) = (of(&|outcome| outcome.rmse_w[1]), of(&|outcome| outcome.torque[1]));
    let worst = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    let is_worse = |outcome: &&Outcome| {
        [outcome.rmse_w, outcome.torque].iter().any(|[first, last]| last.is_nan() || last > first)
    };
    let bounds: Vec<f64> = outcomes.iter().filter_map(|outcome| outcome.bound).collect();
    let bound = if bounds.is_empty() { "–".to_owned() } else { format!("{:.3}", median(&bounds)) };
    format!(
        "| {} | {} | {} | {} | {:.3} | {:.2} | {:.2} | {:.1} | {} of {} | {} | {} | {} of {} |",
        name(&cell.sensors),
        name(&cell.noise_in),
        cell.correlation,
        name(&cell.estimator),
        median(&rmse),
        worst(&rmse),
        median(&torque),
        worst(&torque),
        outcomes.iter().filter(is_worse).count(),
        outcomes.len(),
        bound,
        outcomes.iter().map(|outcome| outcome.refuted).sum::<usize>(),
        outcomes.iter().map(|outcome| outcome.forced).sum::<usize>(),
        outcomes.len() * 5,
    )
}

fn name<T: ValueEnum>(value: &T) -> String {
    value.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}
