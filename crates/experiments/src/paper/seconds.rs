//! The torque error against the seconds that the robot has moved.

use super::arm::{Arm, Footing};
use super::page::Page;
use super::report::Results;
use super::run_file::RunFile;
use phiw_report::plot::{ErrorGrowth, GrowthLine, Line, error_growth};
use phiw_report::statistics::median;

/// The arms, as far as there are runs of them.
const ARMS: [Arm; 9] = [
    Arm::Curriculum,
    Arm::TorqueOptimal,
    Arm::TorquePerSecond,
    Arm::Random,
    Arm::FourierInitial,
    Arm::FourierTrue,
    Arm::Greedy,
    Arm::TaskA,
    Arm::TaskB,
];

/// Lines that a picture can tell apart.
const COLOURS: usize = 6;

/// Seconds of motion \[s\] and torque error \[N·m\] before the first iteration and after each, medians over
/// the runs of each arm.
pub fn of_arms(results: &Results, footing: Footing) -> Vec<(Arm, Vec<[f64; 2]>)> {
    let arms = ARMS.into_iter().filter(|&arm| results.has(footing, arm));
    arms.map(|arm| {
        let errors = results.scores(footing, arm, |score| Some(score.rmse_torque));
        let seconds = |iterations: usize| {
            let runs = results.of(footing, arm).map(|run| duration_s(results, run, iterations));
            median(&runs.collect::<Vec<f64>>())
        };
        let points = errors.iter().enumerate().map(|(index, errors)| [seconds(index), median(errors)]);
        (arm, points.collect())
    })
    .collect()
}

/// How long the first motions of a run were together \[s\].
fn duration_s(results: &Results, run: &RunFile, iterations: usize) -> f64 {
    let of_motion = |name: &str| {
        let facts = results.settings.dataset.iter().find(|motion| motion.name == name);
        facts.map_or(results.settings.fourier_s, |motion| motion.duration_s)
    };
    // The sum of nothing would be −0.
    run.run.history.iter().take(iterations).fold(0.0, |sum, record| sum + of_motion(&record.motion))
}

/// The picture, of as many arms as have colours of their own.
pub fn draw(results: &Results, page: &mut Page) {
    let arms = of_arms(results, results.home());
    let columns: Vec<[Vec<f64>; 2]> = arms
        .iter()
        .map(|(_, points)| [0, 1].map(|k| points.iter().map(|point| point[k]).collect()))
        .collect();
    let lines: Vec<GrowthLine<'_>> = arms
        .iter()
        .zip(&columns)
        .take(COLOURS)
        .map(|((arm, _), [x, y])| GrowthLine { name: arm.name(), line: Line { x, y } })
        .collect();
    let plot = ErrorGrowth { lines: &lines, x_label: "seconds of motion [s]", y_label: "RMSE_τ [N·m]" };
    page.picture(error_growth(&plot).as_str(), "Medians over the seeds, on motions that no run ever saw.");
}
