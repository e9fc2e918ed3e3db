//! The paper's numbers, and ours beside them.

use super::arm::{Arm, Footing};
use super::ending::Savings;
use super::reasons;
use super::reliability;
use super::report::Results;
use super::run_file::RunFile;
use phiw_curriculum::KeptBalance;
use phiw_curriculum::end::EndReason;
use phiw_identification::accuracy::{Reliability, ReliabilityCriterion};
use phiw_report::statistics::median;

use Arm::{
    Curriculum, FourierInitial, FourierTrue, Greedy, Random, TaskA, TaskB, TorqueOptimal, TorquePerSecond,
};

use Footing::Standing;

/// Share of a log in which a base stands still that does not rock.
const STEADY: f64 = 0.95;

/// Rows of the comparison: what, the paper's, ours, and why they differ.
pub fn rows(results: &Results) -> Vec<[String; 4]> {
    let mut table = Table { results, home: results.home(), rows: Vec::new() };
    table.parameters();
    table.well_estimated();
    table.parameters_of_others();
    table.choices();
    table.torques();
    table.seconds();
    table.kept();
    for arm in [Curriculum, Random, TorqueOptimal, TorquePerSecond, Greedy, FourierInitial, FourierTrue] {
        table.standing(arm);
    }
    for savings in super::ending::savings(results) {
        table.ending(&savings);
    }
    table.rows
}

/// The comparison, as far as it is made.
struct Table<'a> {
    results: &'a Results,
    /// How the base was held in the runs that all arms have.
    home: Footing,
    rows: Vec<[String; 4]>,
}

/// The median of each iteration.
fn medians(series: &[Vec<f64>], digits: usize) -> String {
    series.iter().map(|values| format!("{:.digits$}", median(values))).collect::<Vec<_>>().join(", ")
}

impl Table<'_> {
    fn row(&mut self, what: &str, paper: &str, here: String, why: &str) {
        self.rows.push([what.to_owned(), paper.to_owned(), here, why.to_owned()]);
    }

    /// The arms that the paper does not compare in numbers, as far as there are runs of them.
    fn others(&self) -> Vec<Arm> {
        [Random, TorqueOptimal, TorquePerSecond, Greedy, FourierInitial, FourierTrue]
            .into_iter()
            .filter(|&arm| self.results.has(self.home, arm))
            .collect()
    }

    fn parameters(&mut self) {
        let (results, home) = (self.results, self.home);
        let count = results.settings.parameters.len().to_string();
        self.row("D, base parameters with viscous friction", "132", count, "");
        let rmse = results.scores(home, Curriculum, |score| Some(score.rmse_w));
        self.row(
            "RMSE_w (17), median: initial, then each iteration",
            "…, 0.243",
            medians(&rmse, 3),
            "in the units of the parameters, mixed: it depends on the robot",
        );
        let ordinary = results.scores(home, Curriculum, |score| score.rmse_w_least_squares);
        let weighted = results.scores(home, Curriculum, |score| score.rmse_w_weighted);
        for (name, series) in [
            ("the same logs, least squares (4)", ordinary),
            ("the same logs, weighted least squares", weighted),
        ] {
            self.row(
                name,
                "…, 0.243",
                medians(&series[1..], 3),
                reasons::of_least_squares(results.settings.noise_in),
            );
        }
    }

    fn well_estimated(&mut self) {
        let last = self.results.settings.iterations;
        let initial = self.count_well_estimated(Curriculum, 0);
        self.row(
            "well estimated by (18): initial model",
            "76",
            initial,
            "how many parameters are small depends on the robot",
        );
        let ours = self.count_well_estimated(Curriculum, last);
        self.row("well estimated by (18): last iteration", "100", ours, "");
        for arm in self.others() {
            let count = self.count_well_estimated(arm, last);
            self.row(&format!("well estimated by (18): last iteration, {}", arm.name()), "", count, "");
        }
    }

    fn count_well_estimated(&self, arm: Arm, iteration: usize) -> String {
        let all = reliability::of_arm(self.results, self.home, arm, iteration);
        let criterion = ReliabilityCriterion::default();
        let [well, with_bias] = [Reliability::well, Reliability::well_with_bias]
            .map(|test| all.iter().filter(|parameter| test(parameter, &criterion)).count());
        format!("{well} ({with_bias} with bias counted)")
    }

    fn parameters_of_others(&mut self) {
        for arm in self.others() {
            let rmse = self.results.scores(self.home, arm, |score| Some(score.rmse_w));
            let what = format!("RMSE_w (17), median: initial, each iteration: {}", arm.name());
            self.row(&what, "", medians(&rmse, 3), "");
        }
    }

    /// What was chosen, and from how much.
    fn choices(&mut self) {
        let (results, home) = (self.results, self.home);
        let cond = |arm: Arm| medians(&results.records(home, arm, |record| record.condition_number), 0);
        let ours = cond(Curriculum);
        self.row("cond(Φ), median by iteration: curriculum", "falls, see figure 7", ours, "");
        for arm in self.others() {
            let paper = if arm == Random { "above it" } else { "" };
            self.row(&format!("cond(Φ), median by iteration: {}", arm.name()), paper, cond(arm), "");
        }
        let alpha = results.records(home, Curriculum, |record| Some(record.alpha));
        self.row(
            "α, median by iteration",
            "0.74, …, 0.3",
            medians(&alpha, 2),
            reasons::of_alpha(results.settings.relaxation, results.settings.method),
        );
        let motions = results.settings.dataset.len() as f64;
        let share = results.records(home, Curriculum, |record| Some(100.0 * record.allowed as f64 / motions));
        self.row("motions allowed, median by iteration [%]", "5, …", medians(&share, 0), "");
    }

    fn torques(&mut self) {
        let (results, home) = (self.results, self.home);
        let papers = [(Curriculum, "lowest, figure 8"), (TaskA, "higher"), (TaskB, "higher")];
        let others = self.others().into_iter().map(|arm| (arm, ""));
        for (arm, paper) in papers.into_iter().chain(others).filter(|(arm, _)| results.has(home, *arm)) {
            let name = match arm {
                TaskA => format!("only “{}”", results.settings.tasks[0]),
                TaskB => format!("only “{}”", results.settings.tasks[1]),
                _ => arm.name().to_owned(),
            };
            let what = format!(
                "torque error (19) on held-out motions [N·m], median: initial, each iteration: {name}"
            );
            let series = results.scores(home, arm, |score| Some(score.rmse_torque));
            self.row(&what, paper, medians(&series, 2), "");
        }
    }

    /// What a second of the robot's time is worth.
    fn seconds(&mut self) {
        for (arm, points) in super::seconds::of_arms(self.results, self.home) {
            let cells: Vec<String> =
                points.iter().map(|[seconds, error]| format!("{seconds:.1} s {error:.2}")).collect();
            self.row(
                &format!("torque error (19) [N·m] after so many seconds of motion, medians: {}", arm.name()),
                "",
                cells.join(", "),
                "errors fall with the time that is measured, and motions differ in how long they take",
            );
        }
    }

    /// How often the constraint allowed nothing, and how the balance was kept on a base that is bolted down.
    fn kept(&mut self) {
        let (results, home) = (self.results, self.home);
        for arm in [Curriculum, TaskA, TaskB].into_iter().chain(self.others()) {
            let runs: Vec<&RunFile> = results.of(home, arm).collect();
            let history = || runs.iter().flat_map(|run| &run.run.history);
            let forced = history().filter(|record| record.forced).count();
            let refused = runs.iter().filter(|run| run.run.ended == Some(EndReason::NothingAllowed)).count();
            if results.has(home, arm) {
                self.row(
                    &format!(
                        "{}: iterations that were forced, and runs that ended since nothing was allowed",
                        arm.name()
                    ),
                    "none reported",
                    format!("{forced} of {}, {refused} of {}", history().count(), runs.len()),
                    "forced: the constraint allows no motion, and the one that violates it least is run",
                );
            }
            let kept: Vec<&KeptBalance> = history().filter_map(|record| record.kept.as_ref()).collect();
            if !kept.is_empty() {
                let outside =
                    kept.iter().filter(|kept| kept.margin_m.is_none_or(|margin| margin < 0.0)).count();
                let tipping = kept.iter().filter(|kept| kept.tipping_margin_m < 0.0).count();
                let time =
                    kept.iter().map(|kept| 100.0 * kept.outside_share).sum::<f64>() / kept.len() as f64;
                self.row(
                    &format!(
                        "{}: motions whose true ZMP left the support at an instant; in its mean over \
                         a fall's time; share of the time outside [%]",
                        arm.name()
                    ),
                    "none reported",
                    format!("{outside}, {tipping} of {}; {time:.1}", kept.len()),
                    reasons::of_balance(results.settings.noise_in),
                );
            }
        }
    }

    /// The runs of an arm on a base that may topple, if there are any.
    fn standing(&mut self, arm: Arm) {
        let results = self.results;
        let runs: Vec<&RunFile> = results.of(Standing, arm).collect();
        if runs.is_empty() {
            return;
        }
        let history = || runs.iter().flat_map(|run| &run.run.history);
        let fell = |run: &&&RunFile| run.run.history.iter().any(|record| record.fell_at_s.is_some());
        let falls = history().filter(|record| record.fell_at_s.is_some()).count();
        let rocked =
            history().filter(|record| record.fell_at_s.is_none() && record.still_share < STEADY).count();
        self.row(
            &format!(
                "standing freely, {}: seeds with a fall; falls, and motions on which the base rocked, of all motions",
                arm.name()
            ),
            "none reported",
            format!(
                "{} of {}; {falls} and {rocked} of {}",
                runs.iter().filter(fell).count(),
                runs.len(),
                history().count()
            ),
            "",
        );
        let rmse = results.scores(Standing, arm, |score| Some(score.rmse_w));
        let alpha = results.records(Standing, arm, |record| Some(record.alpha));
        self.row(
            &format!("standing freely, {}: RMSE_w, median; α", arm.name()),
            "",
            format!("{}; {}", medians(&rmse, 3), medians(&alpha, 2)),
            "rows in which the base rocks do not count: where noise rattles it all the time nothing is learnt, and α stays",
        );
    }

    fn ending(&mut self, savings: &Savings) {
        let last = self.results.settings.iterations;
        let ([then, after], [then_w, after_w]) = (savings.rmse_torque, savings.rmse_w);
        self.row(
            &format!(
                "end when {}: iterations, mean, of {last}; error with those and with all",
                savings.criterion
            ),
            "left for the future",
            format!(
                "{:.2} ({} of {} runs end earlier), a fixed count takes {:.2} to the same torque error; \
                 torque error {then:.2} N·m, {after:.2} with all; RMSE_w {then_w:.3}, {after_w:.3} with \
                 all",
                savings.iterations, savings.earlier, savings.runs, savings.same_error_after
            ),
            "each motion averages more of the noise away, so fewer of them cannot leave quite the same error",
        );
    }
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
