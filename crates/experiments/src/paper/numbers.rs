//! The paper's numbers, and ours beside them.

use super::arguments::RelaxationName;
use super::arm::{Arm, Footing};
use super::reliability;
use super::report::Results;
use super::run_file::RunFile;
use phiw_identification::accuracy::{Reliability, ReliabilityCriterion};
use phiw_report::statistics::median;

use Arm::{Curriculum, Greedy, Random, TaskA, TaskB, TorqueOptimal};
use Footing::Standing;

/// Share of a log in which a base stands still that does not rock.
const STEADY: f64 = 0.95;

/// Rows of the comparison: what, the paper's, ours, and why they differ.
pub fn rows(results: &Results) -> Vec<[String; 4]> {
    let mut rows = Vec::new();
    let mut row = |what: &str, paper: &str, here: String, why: &str| {
        rows.push([what.to_owned(), paper.to_owned(), here, why.to_owned()]);
    };
    let (last, home) = (results.settings.iterations, results.home());
    row("D, base parameters with viscous friction", "132", results.settings.parameters.len().to_string(), "");
    let medians = |series: &[Vec<f64>], digits: usize| {
        series.iter().map(|values| format!("{:.digits$}", median(values))).collect::<Vec<_>>().join(", ")
    };
    let rmse = results.scores(home, Curriculum, |score| Some(score.rmse_w));
    row(
        "RMSE_w (17), median: initial, then each iteration",
        "…, 0.243",
        medians(&rmse, 3),
        "in the units of the parameters, mixed: it depends on the robot",
    );
    for (name, value) in
        [("the same logs, least squares (4)", 0), ("the same logs, weighted least squares", 1)]
    {
        let series = results.scores(home, Curriculum, |score| match value {
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
    let count = |arm: Arm, iteration: usize| {
        let all = reliability::of_arm(results, home, arm, iteration);
        let criterion = ReliabilityCriterion::default();
        let [well, with_bias] = [Reliability::well, Reliability::well_with_bias]
            .map(|test| all.iter().filter(|parameter| test(parameter, &criterion)).count());
        format!("{well} ({with_bias} with bias counted)")
    };
    row(
        "well estimated by (18): initial model",
        "76",
        count(Curriculum, 0),
        "how many parameters are small depends on the robot",
    );
    row("well estimated by (18): last iteration", "100", count(Curriculum, last), "");
    let others = || [Random, TorqueOptimal, Greedy].into_iter().filter(|&arm| results.has(home, arm));
    for arm in others() {
        row(&format!("well estimated by (18): last iteration, {}", arm.name()), "", count(arm, last), "");
    }
    for arm in others() {
        let rmse = results.scores(home, arm, |score| Some(score.rmse_w));
        row(
            &format!("RMSE_w (17), median: initial, each iteration: {}", arm.name()),
            "",
            medians(&rmse, 3),
            "",
        );
    }
    let cond = |arm: Arm| results.records(home, arm, |record| record.condition_number);
    row("cond(Φ), median by iteration: curriculum", "falls, see figure 7", medians(&cond(Curriculum), 0), "");
    if results.has(home, Random) {
        row("cond(Φ), median by iteration: random", "above it", medians(&cond(Random), 0), "");
    }
    for arm in others().filter(|arm| *arm != Random) {
        row(&format!("cond(Φ), median by iteration: {}", arm.name()), "", medians(&cond(arm), 0), "");
    }
    let alpha = results.records(home, Curriculum, |record| Some(record.alpha));
    row(
        "α, median by iteration",
        "0.74, …, 0.3",
        medians(&alpha, 2),
        match results.settings.relaxation {
            RelaxationName::Condition => {
                "α_max by the share of motions; a such that the second α is 0.8 α_max, as cond has another scale here"
            }
            RelaxationName::Uncertainty => {
                "α_max by the share of motions; then in proportion to how uncertain the torques of all motions are, the second α 0.8 α_max"
            }
        },
    );
    let motions = results.settings.dataset.len() as f64;
    let share = results.records(home, Curriculum, |record| Some(100.0 * record.allowed as f64 / motions));
    row("motions allowed, median by iteration [%]", "5, …", medians(&share, 0), "");
    let torque = [(Curriculum, "lowest, figure 8"), (TaskA, "higher"), (TaskB, "higher")];
    for (arm, paper) in torque.into_iter().chain(others().map(|arm| (arm, ""))) {
        let name = match arm {
            TaskA => format!("only “{}”", results.settings.tasks[0]),
            TaskB => format!("only “{}”", results.settings.tasks[1]),
            _ => arm.name().to_owned(),
        };
        let series = results.scores(home, arm, |score| Some(score.rmse_torque));
        if results.has(home, arm) {
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
    let measured_s: Vec<String> = [Curriculum, TaskA, TaskB]
        .into_iter()
        .chain(others())
        .filter(|&arm| results.has(home, arm))
        .map(|arm| format!("{} {:.0}", arm.name(), measured_s(results, home, arm)))
        .collect();
    row(
        "measured in all iterations [s], median",
        "",
        measured_s.join(", "),
        "errors fall with the time that is measured, and tasks differ in how long they take",
    );
    for arm in [Curriculum, Random, TorqueOptimal, Greedy] {
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
            let alpha = results.records(Standing, arm, |record| Some(record.alpha));
            row(
                &format!("standing freely, {}: RMSE_w, median; α", arm.name()),
                "",
                format!("{}; {}", medians(&rmse, 3), medians(&alpha, 2)),
                "rows in which the base rocks do not count: where noise rattles it all the time nothing is learnt, and α stays",
            );
        }
    }
    for savings in super::ending::savings(results) {
        let ([then, after], [then_w, after_w]) = (savings.rmse_torque, savings.rmse_w);
        row(
            &format!(
                "end when {}: iterations, mean, of {last}; error with those and with all",
                savings.criterion
            ),
            "left for the future",
            format!(
                "{:.2} ({} of {} runs end earlier), a fixed count takes {:.2} to the same torque error; torque error {then:.2} N·m, {after:.2} with all; RMSE_w {then_w:.3}, {after_w:.3} with all",
                savings.iterations, savings.earlier, savings.runs, savings.same_error_after
            ),
            "each motion averages more of the noise away, so fewer of them cannot leave quite the same error",
        );
    }
    rows
}

/// How long all motions of a run were, median over the runs \[s\].
fn measured_s(results: &Results, footing: Footing, arm: Arm) -> f64 {
    let duration_s = |name: &str| {
        let facts = results.settings.dataset.iter().find(|motion| motion.name == name);
        facts.map_or(f64::NAN, |motion| motion.duration_s)
    };
    let of_run = |run: &RunFile| run.run.history.iter().map(|record| duration_s(&record.motion)).sum();
    median(&results.of(footing, arm).map(of_run).collect::<Vec<f64>>())
}

/// The rows as text, and what closing the loop is worth.
pub fn plain(results: &Results) -> String {
    let secrets = super::secrets::rows(results);
    let tables: Vec<String> = secrets
        .iter()
        .map(|row| {
            let pairs = super::secrets::HEAD.iter().zip(row).map(|(head, cell)| format!("{head}: {cell}"));
            pairs.collect::<Vec<_>>().join(", ") + "\n"
        })
        .collect();
    if !results.compared() {
        return tables.concat();
    }
    let line = |[what, paper, here, _]: &[String; 4]| format!("{what}\n    paper: {paper}    here: {here}\n");
    rows(results).iter().map(line).chain(tables).collect()
}
