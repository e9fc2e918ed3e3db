//! The runs of a folder, and the page that is made of them.

use super::arm::{Arm, Footing};
use super::page::Page;
use super::run_file::{self, RunFile};
use super::score::Score;
use super::setup::Settings;
use super::subject::SubjectName;
use super::{figures, numbers, secrets};
use anyhow::{Context, ensure};
use phiw_curriculum::IterationRecord;
use std::path::Path;

/// All runs of a folder that are done.
pub struct Results {
    /// What they share.
    pub settings: Settings,
    /// The runs, by footing, arm and seed.
    pub runs: Vec<RunFile>,
    /// Runs that are not done.
    pub unfinished: usize,
}

impl Results {
    /// Reads a folder.
    ///
    /// # Errors
    /// A file does not read, or there are no runs.
    pub fn read(out: &Path) -> anyhow::Result<Self> {
        let settings = Settings::read(out)?;
        let mut runs = Vec::new();
        for path in run_file::all(out)? {
            runs.push(RunFile::read(&path)?.with_context(|| path.display().to_string())?);
        }
        let all = runs.len();
        runs.retain(|run| run.run.ended.is_some());
        ensure!(!runs.is_empty(), "{} holds no run that is done", out.display());
        runs.sort_by_key(|run| (run.footing, run.arm, run.secret, run.run.seed));
        Ok(Results { settings, unfinished: all - runs.len(), runs })
    }

    /// The runs of an arm.
    pub fn of(&self, footing: Footing, arm: Arm) -> impl Iterator<Item = &RunFile> + Clone {
        self.runs.iter().filter(move |run| run.footing == footing && run.arm == arm && run.secret.is_none())
    }

    /// Whether there are runs that are comparable with the paper's: of a plant without a secret, and with a
    /// model that does not grow.
    pub fn compared(&self) -> bool {
        self.runs.iter().any(|run| run.secret.is_none() && run.arm != Arm::Closed)
    }

    /// How the robot is held in the runs that are compared: one with legs stands on them, and so does one of
    /// which there are no other runs.
    pub fn home(&self) -> Footing {
        let bolted = self.runs.iter().any(|run| run.footing == Footing::Fixed);
        match self.settings.robot {
            SubjectName::WholeBody => Footing::Standing,
            _ if !bolted => Footing::Standing,
            _ => Footing::Fixed,
        }
    }

    /// Whether there are runs of an arm.
    pub fn has(&self, footing: Footing, arm: Arm) -> bool {
        self.of(footing, arm).next().is_some()
    }

    /// A number of each run's score, initial model first: `[0..=iterations][run]`.
    pub fn scores(&self, footing: Footing, arm: Arm, value: impl Fn(&Score) -> Option<f64>) -> Vec<Vec<f64>> {
        let at = |iteration: usize| {
            let score = |run: &RunFile| run.scores.get(iteration).and_then(&value);
            self.of(footing, arm).filter_map(score).collect()
        };
        (0..=self.settings.iterations).map(at).collect()
    }

    /// A number of each run's records: `[iteration][run]`.
    pub fn records(
        &self,
        footing: Footing,
        arm: Arm,
        value: impl Fn(&IterationRecord) -> Option<f64>,
    ) -> Vec<Vec<f64>> {
        let at = |iteration: usize| {
            let record = |run: &RunFile| run.run.history.get(iteration).and_then(&value);
            self.of(footing, arm).filter_map(record).collect()
        };
        (0..self.settings.iterations).map(at).collect()
    }

    /// The run that stands for all.
    pub fn representative(&self) -> Option<&RunFile> {
        self.runs.iter().find(|run| !run.details.is_empty())
    }
}

/// The whole page.
pub fn page(results: &Results) -> String {
    let settings = &results.settings;
    let mut page = Page::new("The curriculum, against the paper");
    let seeds = results.of(results.home(), Arm::Curriculum).count();
    page.say(&format!(
        "{} parameters, {} motions to choose from and {} held out ({}), {} on {}, noise of {} % of the torque limits, {} iterations, \
         {seeds} seeds, initial model: {:?}; estimated by {:?}, prior {:?}; α follows {:?}.",
        settings.parameters.len(),
        settings.dataset.len(),
        settings.held_out.len(),
        settings.motions,
        format!("{:?}", settings.robot).to_lowercase(),
        settings.backend,
        100.0 * settings.noise,
        settings.iterations,
        settings.initial,
        settings.estimator,
        settings.prior,
        settings.relaxation,
    ));
    if results.unfinished > 0 {
        page.say(&format!("{} runs are not done and left out.", results.unfinished));
    }
    if results.compared() {
        page.heading("Numbers, beside the paper's");
        page.table(&["what", "paper", "here", "why"], &numbers::rows(results));
        figures::draw(results, &mut page);
    }
    let secrets = secrets::rows(results);
    if !secrets.is_empty() {
        page.heading("Effects that nobody declared");
        page.say(
            "After the last iteration, medians over the seeds: without and with the loop closed. “Found” is the \
             right kind on the right joints; another name is any effect beside that one. Where a secret is and \
             how large follows from the seed: it takes 12 to 30 % of the RMS torque that the references ask of \
             its joint. How many standard deviations it is from nothing, over all logs of a run with the loop \
             closed, is √(2·gain) of its kind on its joints in the score test.",
        );
        page.table(&secrets::HEAD, &secrets);
    }
    page.render()
}
