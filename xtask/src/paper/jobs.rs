//! The runs to be done, and doing them in parallel.

use super::arguments::{Initial, RunArguments};
use super::arm::{Arm, Footing};
use super::run_file::RunFile;
use super::setup::Setup;
use crate::plant_experiment::engine::Engine;
use phiw_curriculum::{Curriculum, FixedCount, RowsAt, Run, unreliable_model};
use rayon::prelude::*;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// One run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Job {
    /// How motions are chosen.
    pub arm: Arm,
    /// How the base is held.
    pub footing: Footing,
    /// The seed.
    pub seed: u64,
    /// Whether it stands for all: more is kept of it.
    pub representative: bool,
    /// Who computes the physics.
    pub backend: Engine,
}

/// How it ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All runs are done.
    Done,
    /// It was told to stop before.
    Stopped,
}

/// All runs that the arguments ask for, seed by seed, so that an interrupted experiment has some of every arm.
pub fn all(arguments: &RunArguments) -> Vec<Job> {
    let mut jobs = Vec::new();
    for seed in arguments.first_seed..arguments.first_seed + arguments.seeds {
        for &footing in &arguments.footing {
            for &arm in &arguments.arm {
                let representative = seed == arguments.first_seed && arm == Arm::Curriculum;
                jobs.push(Job { arm, footing, seed, representative, backend: arguments.backend });
            }
        }
    }
    jobs
}

/// Does all runs that are not done. `progress` is told the iterations done, those done before included.
///
/// # Errors
/// A run fails, or its file can not be written.
pub fn do_all(
    setup: &Setup,
    jobs: &[Job],
    out: &Path,
    stop_after: Option<usize>,
    progress: &(dyn Fn(u64) + Sync),
) -> anyhow::Result<Outcome> {
    let left = AtomicUsize::new(stop_after.unwrap_or(usize::MAX));
    let outcomes: Vec<Outcome> =
        jobs.par_iter().map(|job| job.run(setup, out, &left, progress)).collect::<anyhow::Result<_>>()?;
    Ok(if outcomes.contains(&Outcome::Stopped) { Outcome::Stopped } else { Outcome::Done })
}

impl Job {
    fn run(
        &self,
        setup: &Setup,
        out: &Path,
        left: &AtomicUsize,
        progress: &(dyn Fn(u64) + Sync),
    ) -> anyhow::Result<Outcome> {
        let path = RunFile::path(out, self.arm, self.footing, self.seed);
        let mut file = match RunFile::read(&path)? {
            Some(file) => file,
            None => self.begin(setup)?,
        };
        progress(file.run.history.len() as u64);
        if file.run.ended.is_some() {
            return Ok(Outcome::Done);
        }
        let experiment =
            setup.experiment(self.backend, self.footing == Footing::Standing, setup.settings.noise);
        let selection = self.arm.selection(&setup.dataset, &setup.settings.tasks);
        let estimator = setup.estimator();
        let curriculum = Curriculum {
            robot: &setup.robot,
            dataset: &setup.dataset,
            candidates: &setup.candidates,
            experiment: &experiment,
            selection: selection.as_ref(),
            constraint: self.arm.constraint(&setup.constraint),
            relaxation: &setup.relaxation,
            estimator: estimator.as_ref(),
            end: &FixedCount(setup.settings.iterations),
            rows_at: RowsAt::Periods,
        };
        while file.run.ended.is_none() {
            if left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1)).is_err() {
                return Ok(Outcome::Stopped);
            }
            if self.representative {
                file.details.extend(setup.detail(&curriculum, &file.run)?);
            }
            curriculum.step(&mut file.run)?;
            file.scores.push(setup.score(&file.run.model, file.run.evidence.as_ref())?);
            if file.run.ended.is_some() {
                file.run.evidence = None;
            }
            file.write(&path)?;
            progress(1);
        }
        Ok(Outcome::Done)
    }

    fn begin(&self, setup: &Setup) -> anyhow::Result<RunFile> {
        let initial = match setup.settings.initial {
            Initial::One => unreliable_model(&setup.truth, 0),
            Initial::Each => unreliable_model(&setup.truth, self.seed),
        };
        Ok(RunFile {
            arm: self.arm,
            footing: self.footing,
            scores: vec![setup.score(&initial, None)?],
            run: Run::new(self.seed, initial),
            details: Vec::new(),
        })
    }
}
