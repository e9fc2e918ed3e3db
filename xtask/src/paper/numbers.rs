//! The paper's numbers, and ours beside them.

use super::arm::{Arm, Footing};
use super::reliability;
use super::report::{Results, median};
use super::run_file::RunFile;

use Arm::{Curriculum, Greedy, Random, TaskA, TaskB};
use Footing::{Fixed, Standing};

/// Share of a log in which a base stands still that does not rock.
const STEADY: f64 = 0.95;

/// Rows of the comparison: what, the paper's, ours, and why they differ.
pub fn rows(results: &Results) -> Vec<[String; 4]> {
    let mut rows = Vec::new();
    let mut row = |what: &str, paper: &str, here: String, why: &str| {
        rows.push([what.to_owned(), paper.to_owned(), here, why.to_owned()]);
    };
    let last = results.settings.iterations;
    row("D, base parameters with viscous friction", "132", results.settings.parameters.len().to_string(), "");
    let medians = |series: &[Vec<f64>], digits: usize| {
        series.iter().map(|values| format!("{:.digits$}", median(values))).collect::<Vec<_>>().join(", ")
    };
    let rmse = results.scores(Fixed, Curriculum, |score| Some(score.rmse_w));
    row(
        "RMSE_w (17), median: initial, then each iteration",
        "…, 0.243",
        medians(&rmse, 3),
        "in the units of the parameters, mixed: it depends on the robot",
    );
    for (name, value) in
        [("the same logs, least squares (4)", 0), ("the same logs, weighted least squares", 1)]
    {
        let series = results.scores(Fixed, Curriculum, |score| match value {
            0 => score.rmse_w_least_squares,
            _ => score.rmse_w_weighted,
        });
        row(
            name,
            "…, 0.243",
            medians(&series[1..], 3),
            "the noise moves the robot, and is not in the log: the columns of Φ are correlated with it, which (4) takes for physics; more logs do not help",
        );
    }
    let count = |iteration: usize| {
        let all = reliability::of_arm(results, Fixed, Curriculum, iteration);
        let [well, with_bias] = [reliability::Reliability::well, reliability::Reliability::well_with_bias]
            .map(|test| all.iter().filter(|parameter| test(parameter)).count());
        format!("{well} ({with_bias} with bias counted)")
    };
    row(
        "well estimated by (18): initial model",
        "76",
        count(0),
        "how many parameters are small depends on the robot",
    );
    row("well estimated by (18): last iteration", "100", count(last), "");
    let cond = |arm: Arm| results.records(Fixed, arm, |record| record.condition_number);
    row("cond(Φ), median by iteration: curriculum", "falls, see figure 7", medians(&cond(Curriculum), 0), "");
    row("cond(Φ), median by iteration: random", "above it", medians(&cond(Random), 0), "");
    let alpha = results.records(Fixed, Curriculum, |record| Some(record.alpha));
    row(
        "α, median by iteration",
        "0.74, …, 0.3",
        medians(&alpha, 2),
        "α_max by the share of motions; a such that the second α is 0.8 α_max, as cond has another scale here",
    );
    let motions = results.settings.dataset.len() as f64;
    let share = results.records(Fixed, Curriculum, |record| Some(100.0 * record.allowed as f64 / motions));
    row("motions allowed, median by iteration [%]", "5, …", medians(&share, 0), "");
    for (arm, paper) in [(Curriculum, "lowest, figure 8"), (TaskA, "higher"), (TaskB, "higher")] {
        let name = match arm {
            TaskA => format!("only “{}”", results.settings.tasks[0]),
            TaskB => format!("only “{}”", results.settings.tasks[1]),
            _ => "curriculum".to_owned(),
        };
        let series = results.scores(Fixed, arm, |score| Some(score.rmse_torque));
        if results.has(Fixed, arm) {
            row(
                &format!(
                    "torque error (19) on held-out motions [N·m], median: initial, each iteration: {name}"
                ),
                paper,
                medians(&series, 2),
                "",
            );
        }
    }
    for arm in [Curriculum, Random, Greedy] {
        let runs = results.of(Standing, arm);
        let total = runs.clone().count();
        if total > 0 {
            let history = || runs.clone().flat_map(|run| &run.run.history);
            let fell = |run: &&RunFile| run.run.history.iter().any(|record| record.fell_at_s.is_some());
            let falls = history().filter(|record| record.fell_at_s.is_some()).count();
            let rocked =
                history().filter(|record| record.fell_at_s.is_none() && record.still_share < STEADY).count();
            row(
                &format!(
                    "standing freely, {}: seeds with a fall; falls, and motions on which the base rocked, of all motions",
                    arm.name()
                ),
                "none reported",
                format!(
                    "{} of {total}; {falls} and {rocked} of {}",
                    runs.clone().filter(fell).count(),
                    history().count()
                ),
                "",
            );
            let rmse = results.scores(Standing, arm, |score| Some(score.rmse_w));
            row(&format!("standing freely, {}: RMSE_w, median", arm.name()), "", medians(&rmse, 3), "");
        }
    }
    if let Some([iterations, then, five]) = super::ending::saved(results) {
        row(
            "end criterion: iterations, RMSE_w then and after all (medians)",
            "left for the future",
            format!("{iterations:.0}, {then:.3}, {five:.3}"),
            "",
        );
    }
    rows
}

/// The rows as text.
pub fn plain(results: &Results) -> String {
    rows(results)
        .iter()
        .map(|[what, paper, here, _]| format!("{what}\n    paper: {paper}    here: {here}\n"))
        .collect()
}
