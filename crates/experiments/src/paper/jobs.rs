//! The runs to be done, and doing them in parallel.

use super::arguments::RunArguments;
use super::arm::{Arm, Footing};
use super::run_file::RunFile;
use super::setup::{Setup, Validation};
use super::subject::SubjectName;
use crate::plant::engine::Engine;
use crate::plant::secret::SecretKind;
use phiw_curriculum::end::{EndReason, FixedCount};
use phiw_curriculum::{Curriculum, CurriculumError, CurriculumRun, CurriculumSettings, unreliable_model};
use phiw_estimation::RowsAt;
use phiw_plant::PlantEffect;
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
    /// What is in the plant that nobody declared.
    pub secret: Option<SecretKind>,
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

/// All runs that the arguments ask for, seed by seed, so that an interrupted experiment has some of every
/// arm.
pub fn all(arguments: &RunArguments) -> Vec<Job> {
    let mut jobs = Vec::new();
    let kinds = arguments.secret.iter().copied().map(Some);
    // A robot with legs stands on them.
    let footings = match arguments.robot {
        SubjectName::WholeBody => &[Footing::Standing][..],
        _ => &arguments.footing,
    };
    let control = if arguments.secret.is_empty() { arguments.seeds } else { arguments.control };
    for seed in arguments.first_seed..arguments.first_seed + arguments.seeds.max(control) {
        let own = seed - arguments.first_seed;
        let kinds = kinds.clone().filter(|_| own < arguments.seeds);
        for secret in kinds.chain((own < control).then_some(None)) {
            for &footing in footings {
                for &arm in &arguments.arm {
                    let representative =
                        seed == arguments.first_seed && arm == Arm::Curriculum && secret.is_none();
                    jobs.push(Job { arm, footing, secret, seed, representative, backend: arguments.backend });
                }
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
    // Runs beside each other with the same secret are judged on the same logs.
    let alike: Vec<&[Job]> =
        jobs.chunk_by(|one, other| one.secret == other.secret && one.seed == other.seed).collect();
    let do_alike = |jobs: &&[Job]| -> anyhow::Result<Vec<Outcome>> {
        let secret = match jobs[0].secret {
            Some(kind) => setup.secret(kind, jobs[0].seed)?,
            None => Vec::new(),
        };
        let mut own = None;
        if !secret.is_empty() && !jobs.iter().all(|job| job.is_done(out)) {
            own = Some(setup.validation(jobs[0].backend, &secret)?);
        }
        let validation = own.as_ref().unwrap_or(&setup.validation);
        let run = |job: &Job| job.run(setup, &secret, validation, out, &left, progress);
        jobs.par_iter().map(run).collect()
    };
    let outcomes: Vec<Vec<Outcome>> = alike.par_iter().map(do_alike).collect::<anyhow::Result<_>>()?;
    Ok(if outcomes.concat().contains(&Outcome::Stopped) { Outcome::Stopped } else { Outcome::Done })
}

impl Job {
    fn is_done(&self, out: &Path) -> bool {
        matches!(RunFile::read(&RunFile::path(out, self)), Ok(Some(file)) if file.run.ended.is_some())
    }

    fn run(
        &self,
        setup: &Setup,
        secret: &[PlantEffect],
        validation: &Validation,
        out: &Path,
        left: &AtomicUsize,
        progress: &(dyn Fn(u64) + Sync),
    ) -> anyhow::Result<Outcome> {
        let path = RunFile::path(out, self);
        let mut file = match RunFile::read(&path)? {
            Some(file) => file,
            None => self.begin(setup, secret)?,
        };
        progress(file.run.history.len() as u64);
        if file.run.ended.is_some() {
            return Ok(Outcome::Done);
        }
        let standing = self.footing == Footing::Standing;
        let experiment = setup.trial_ground(self.backend, standing, setup.settings.noise, secret);
        let (dataset, candidates) = setup.motions_of(self.arm);
        let selection = self.arm.selection(dataset, &setup.settings.tasks);
        let estimator = setup.estimator(&file.run.initial);
        let growth = setup.growth(&file.run.initial);
        let curriculum = Curriculum {
            robot: &setup.robot,
            dataset,
            candidates,
            experiment: experiment.as_ref(),
            selection: selection.as_ref(),
            constraint: self.arm.constraint(&setup.constraint),
            relaxation: setup.relaxation.as_ref(),
            estimator: estimator.as_ref(),
            growth: (self.arm == Arm::Closed).then_some(growth.as_ref()),
            end: &FixedCount(setup.settings.iterations),
            rows_at: RowsAt::Periods,
            settings: CurriculumSettings { none_allowed: setup.none_allowed(), ..Default::default() },
        };
        while file.run.ended.is_none() {
            if left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1)).is_err() {
                return Ok(Outcome::Stopped);
            }
            if self.representative {
                file.details.extend(setup.detail(&curriculum, &file.run)?);
            }
            if file.scores.is_empty() {
                file.scores.push(setup.score(&file.run.initial, None, validation)?);
            }
            match curriculum.step(&mut file.run) {
                // Nothing is run, and what was believed stays.
                Err(CurriculumError::NothingSafe { .. } | CurriculumError::FellOnAll { .. }) => {
                    file.run.ended = Some(EndReason::NothingAllowed);
                }
                step => step?,
            }
            let score = setup.score(&file.run.model, file.run.evidence.as_ref(), validation)?;
            let last = file.run.ended == Some(EndReason::NothingAllowed);
            let scores = if last { setup.settings.iterations + 1 } else { file.scores.len() + 1 };
            file.scores.resize(scores, score);
            if file.run.ended.is_some() {
                file.detection = setup.detection(&file)?;
                file.run.evidence = None;
                file.run.certainty = None;
                file.run.logs.clear();
                file.run.rivals.clear();
            }
            file.write(&path)?;
            progress(1);
        }
        Ok(Outcome::Done)
    }

    fn begin(&self, setup: &Setup, secret: &[PlantEffect]) -> anyhow::Result<RunFile> {
        let own = || unreliable_model(&setup.truth, self.seed);
        let initial = setup.initial_of_all_seeds().unwrap_or_else(own);
        let tree = setup.robot.tree();
        let name = |&joint: &usize| tree.joint_names().nth(joint).unwrap_or_default().to_owned();
        let joints: Vec<usize> = secret.iter().flat_map(|effect| effect.joints(tree)).collect();
        Ok(RunFile {
            arm: self.arm,
            footing: self.footing,
            secret: self.secret,
            secret_joints: joints.iter().map(name).collect(),
            scores: Vec::new(),
            run: CurriculumRun::new(self.seed, initial),
            details: Vec::new(),
            detection: None,
        })
    }
}
