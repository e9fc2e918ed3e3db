//! Everything that all runs share, and what of it decides their results.

use super::arguments::{
    Detector, EstimatorName, Initial, Method, NoiseIn, PriorName, RelaxationName, RunArguments,
};
use super::arm::Arm;
use super::fourier::FourierMotions;
use super::method;
use super::motions::Motions;
use super::run_file;
use super::subject::{Subject, SubjectName};
use super::tasks::two_tasks;
use crate::plant::case;
use crate::plant::engine::Engine;
use crate::plant::secret::SecretKind;
use anyhow::{Context, ensure};
use phiw::console::Console;
use phiw_curriculum::constraint::ZmpConstraint;
use phiw_curriculum::motion::{Motion, MotionDataset};
use phiw_curriculum::planner::NoneAllowed;
use phiw_curriculum::relaxation::Relaxation;
use phiw_curriculum::selection::MotionCandidates;
use phiw_curriculum::{Experiment, unreliable_model};
use phiw_dynamics::inertia::PARAMETERS_PER_BODY;
use phiw_dynamics::{Workspace, World};
use phiw_estimation::{Evidence, MotionLog, Robot, RobotModel, RowsAt};
use phiw_identification::EffectSpec;
use phiw_identification::model::{parameter_name, standard_unit};
use phiw_plant::{Coupling, PlantEffect, Sensors, Timing};
use phiw_regressor::factor::Factor;
use phiw_report::statistics::median;
use phiw_simulated_robot::{FeedForward, KnownOfController, SimulatedRobot};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// What runs share.
pub struct Setup {
    /// What decides the results, for files.
    pub settings: Settings,
    /// The robot and its truth.
    pub subject: Subject,
    /// As declared.
    pub robot: Robot,
    /// The true belief.
    pub truth: RobotModel,
    /// Motions to choose from.
    pub dataset: MotionDataset,
    /// Their factors.
    pub candidates: MotionCandidates,
    /// The motions of arms that do not choose from the dataset.
    pub fourier: BTreeMap<Arm, FourierMotions>,
    /// The constraint (12).
    pub constraint: ZmpConstraint,
    /// Equation (20), or what stands for it.
    pub relaxation: Box<dyn Relaxation>,
    /// Motions to validate on.
    pub held_out: Vec<Motion>,
    /// The logs of the plant without a secret on them.
    pub validation: Validation,
}

/// Logs of held-out motions, and what they are under the declared columns.
pub struct Validation {
    /// The logs, without noise.
    pub logs: Vec<MotionLog>,
    /// R of [Φ f], and the number of samples T.
    pub declared: (Factor, f64),
    /// The true parameters of what is declared, in this plant.
    pub truth: Vec<f64>,
}

/// What decides the results of a run, beside its arm and seed. Runs with different settings are never mixed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Who computes the physics.
    pub backend: String,
    /// The robot.
    pub robot: SubjectName,
    /// The motions, in words, and the number that tells them from others.
    pub motions: String,
    /// See [`Motions`].
    pub digest: String,
    /// The motions to choose from.
    pub dataset: Vec<MotionFacts>,
    /// Names of those held out.
    pub held_out: Vec<String>,
    /// How long Fourier motions are: as the dataset's in the middle \[s\].
    #[serde(default)]
    pub fourier_s: f64,
    /// The two tasks of the task-specific models.
    pub tasks: [String; 2],
    /// The whole method, if one was named.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub method: Option<Method>,
    /// How parameters are estimated.
    pub estimator: EstimatorName,
    /// What the estimate falls back on.
    #[serde(default)]
    pub prior: PriorName,
    /// The rate of false falls that the constraint is asked for; none where uncertainty does not count.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub false_fall_rate: Option<f64>,
    /// How many times slower motions are done beside those as they were recorded.
    #[serde(default)]
    pub slower: Vec<f64>,
    /// What α follows.
    #[serde(default)]
    pub relaxation: RelaxationName,
    /// Who looks for what the model lacks.
    #[serde(default)]
    pub detector: Detector,
    /// Torque noise over the torque limit.
    pub noise: f64,
    /// Where it is.
    #[serde(default)]
    pub noise_in: NoiseIn,
    /// Iterations.
    pub iterations: usize,
    /// How many initial models.
    pub initial: Initial,
    /// The parameters: name, unit and true value of each.
    pub parameters: Vec<ParameterFacts>,
    /// Corners of the support \[m\].
    pub support: Vec<[f64; 2]>,
    /// The point that the support shrinks to \[m\].
    #[serde(default)]
    pub about: [f64; 2],
}

/// A motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotionFacts {
    /// Its name.
    pub name: String,
    /// Its task.
    pub task: String,
    /// How long it takes \[s\].
    pub duration_s: f64,
    /// cond(Φ) of it alone.
    #[serde(deserialize_with = "super::infinite::number")]
    pub condition_number: f64,
}

/// A parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterFacts {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its true value.
    pub value: f64,
}

/// File of the settings.
const FILE: &str = "setup.json";
/// The stream of the validation, apart from all runs'.
const VALIDATION_SEED: u64 = u64::MAX;
/// The stream of the secrets of a seed.
const SECRET_STREAM: u64 = 1;
/// What stands for rounding where there is no noise, over the torque limit.
pub(super) const NOISELESS: f64 = 1e-3;

impl Setup {
    /// Reads robot and motions, retargets what is not there, and measures the validation motions. `console`
    /// shows how far that is.
    ///
    /// # Errors
    /// Something is not there or does not read.
    pub fn new(arguments: &RunArguments, out: &Path, console: &Console) -> anyhow::Result<Self> {
        let timing = timing(arguments.backend);
        let subject = Subject::read(arguments.robot, timing.control_period_s)?
            .with_rotors((arguments.robot, arguments.method), timing.control_period_s)?;
        match subject.standing {
            Some(_) => ensure!(
                arguments.secret.is_empty(),
                "effects that nobody declared are not for a robot on its feet"
            ),
            None => arguments.backend.check(&subject.tree)?,
        }
        let robot = subject.robot()?;
        let truth = subject.truth(&robot)?;
        let motions = match &arguments.motions {
            Some(folder) => Motions::of_folder(folder, &subject)?,
            None => {
                let (source, folder) = (arguments.dataset, out.join("motions"));
                Motions::retargeted(source, arguments.per_task, &subject, &folder, console)?
            }
        };
        let slower = method::slower(arguments, &subject);
        let dataset = MotionDataset::new(subject.tree.joint_count(), motions.identification)?;
        let subject = match arguments.method {
            Some(Method::Ours) => {
                let all = dataset.motions().iter().chain(&motions.validation);
                subject.with_gains_for(all, timing.control_period_s)?
            }
            _ => subject,
        };
        let dataset = dataset.with_slower(&slower)?;
        let weights = subject.row_weights(if arguments.noise > 0.0 { arguments.noise } else { NOISELESS });
        let candidates = MotionCandidates::new(&robot, robot.declared(), &dataset, &weights)?.determined();
        let (prior, relaxation) = method::method(arguments, &subject);
        let relaxation_of_alpha = method::relaxation(relaxation, arguments.method);
        let false_fall_rate = method::false_fall_rate(arguments, &subject);
        let constraint = method::constraint(&subject.stance, false_fall_rate, arguments.noise);
        let settings = Settings {
            backend: format!("{:?}", arguments.backend).to_lowercase(),
            robot: arguments.robot,
            motions: method::motions_in_words(arguments, &subject).to_owned(),
            digest: motions.digest,
            dataset: dataset
                .motions()
                .iter()
                .zip(candidates.all())
                .map(|(motion, candidate)| MotionFacts {
                    name: motion.name.clone(),
                    task: motion.task.clone(),
                    duration_s: motion.duration_s(),
                    condition_number: candidate.condition_number,
                })
                .collect(),
            held_out: motions.validation.iter().map(|motion| motion.name.clone()).collect(),
            fourier_s: median(&dataset.motions().iter().map(Motion::duration_s).collect::<Vec<f64>>()),
            tasks: two_tasks(&robot, &truth, &dataset, &constraint, relaxation_of_alpha.as_ref())?,
            method: arguments.method,
            estimator: arguments.estimator(),
            prior,
            false_fall_rate,
            slower,
            relaxation,
            detector: arguments.detector,
            noise: arguments.noise,
            noise_in: arguments.noise_in,
            iterations: arguments.iterations,
            initial: arguments.initial,
            parameters: parameter_facts(&robot, &truth)?,
            support: subject.stance.support().corners().to_vec(),
            about: subject.stance.about(),
        };
        let mut setup = Setup {
            constraint,
            relaxation: relaxation_of_alpha,
            validation: Validation { logs: Vec::new(), declared: (Factor::empty(0), 0.0), truth: Vec::new() },
            held_out: motions.validation,
            settings,
            subject,
            robot,
            truth,
            dataset,
            candidates,
            fourier: BTreeMap::new(),
        };
        setup.validation = setup.validation(arguments.backend, &[])?;
        let models = [
            (Arm::FourierInitial, setup.initial_of_all_seeds()),
            (Arm::FourierTrue, Some(setup.truth.clone())),
        ];
        for (arm, model) in models.into_iter().filter(|(arm, _)| arguments.arm.contains(arm)) {
            let told = |done: usize| {
                let what = format!("optimising motions, {}", arm.name());
                console.progress(&what, done as u64, arguments.iterations as u64);
            };
            if let Some(model) = model {
                setup.fourier.insert(arm, FourierMotions::optimised(&setup, &model, &told)?);
            }
        }
        Ok(setup)
    }

    /// The held-out motions of a plant with or without a secret.
    ///
    /// # Errors
    /// The robot can not be run.
    pub fn validation(&self, backend: Engine, secret: &[PlantEffect]) -> anyhow::Result<Validation> {
        let logs = self.validation_logs(backend, secret)?;
        let declared = self.validation_of(&self.truth, &logs)?;
        Ok(Validation { logs, declared, truth: self.truth_beside(secret) })
    }

    /// The true parameters of what is declared beside a secret. Damping of a shaft that turns with two joints
    /// is damping of each of them, and only what crosses over is not declared.
    fn truth_beside(&self, secret: &[PlantEffect]) -> Vec<f64> {
        let mut truth = self.settings.truth();
        for effect in secret {
            let PlantEffect::Coupling(Coupling::SharedFriction { joints, coefficient, .. }) = effect else {
                continue;
            };
            for &joint in joints {
                let joint = &self.subject.tree.joint(joint).joint;
                let is_its =
                    |own: &&EffectSpec| own.kind == "viscous_friction" && own.joints[..] == [joint.clone()];
                let place = self.robot.declared().iter().position(|own| is_its(&own));
                // One parameter each.
                if let Some(own) = place.and_then(|place| truth.get_mut(self.robot.base().count() + place)) {
                    *own += coefficient;
                }
            }
        }
        truth
    }

    /// The initial model that all seeds share, if they do.
    pub fn initial_of_all_seeds(&self) -> Option<RobotModel> {
        (self.settings.initial == Initial::One).then(|| unreliable_model(&self.truth, 0))
    }

    /// What an arm chooses from.
    pub fn motions_of(&self, arm: Arm) -> (&MotionDataset, &MotionCandidates) {
        match self.fourier.get(&arm) {
            Some(own) => (&own.dataset, &own.candidates),
            None => (&self.dataset, &self.candidates),
        }
    }

    /// What happens where no motion is allowed: where uncertainty counts, nothing.
    pub fn none_allowed(&self) -> NoneAllowed {
        match self.settings.false_fall_rate {
            Some(_) => NoneAllowed::Refuse,
            None => NoneAllowed::LeastViolation,
        }
    }

    /// Where motions are tried: the robot in an engine with noise, and with what is in it that nobody
    /// declared. One with legs always stands.
    pub fn trial_ground(
        &self,
        backend: Engine,
        standing: bool,
        noise: f64,
        secret: &[PlantEffect],
    ) -> Box<dyn Experiment> {
        let (in_motion, in_log) = self.settings.noise_in.shares(noise);
        let mut experiment = self.experiment(backend, standing, in_motion);
        // What is held out is measured without noise, and exactly.
        if noise > 0.0 {
            experiment.measuring.torque_noise = in_log;
            experiment.measuring.logged = self.settings.noise_in.logged();
            if self.settings.method == Some(Method::Printed) {
                experiment.measuring.controller = KnownOfController::Nothing;
            }
            experiment.measuring.encoders =
                method::encoders(self.settings.method, experiment.timing.control_period_s);
        }
        experiment.effects.extend_from_slice(secret);
        match &self.subject.standing {
            Some(legs) => Box::new(self.subject.on_feet(legs, backend, noise, experiment.effects)),
            None => Box::new(experiment),
        }
    }

    /// The robot in an engine, bolted down or standing, with noise.
    pub fn experiment(&self, backend: Engine, standing: bool, noise: f64) -> SimulatedRobot {
        let (tree, world) = match standing {
            true => (self.subject.floating.clone(), self.subject.floor()),
            false => (self.subject.tree.clone(), World::default()),
        };
        SimulatedRobot {
            tree,
            world,
            effects: self.subject.frictions(),
            controller: Box::new(FeedForward { gains: self.subject.gains.clone() }),
            actuator_noise: noise,
            sensors: Sensors::exact(timing(backend).control_period_s),
            timing: timing(backend),
            fall_tilt_rad: 0.3,
            stance: (!standing).then(|| self.subject.stance.clone()),
            stillness: Default::default(),
            noise_correlation: 0.0,
            measuring: Default::default(),
            build: Box::new(move |tree, world| backend.build(tree, world)),
        }
    }

    /// The held-out motions, run with the true model and without noise (section 5.1, equation 19): what is
    /// left of the error is the model's.
    ///
    /// # Errors
    /// The robot can not be run.
    pub fn validation_logs(&self, backend: Engine, secret: &[PlantEffect]) -> anyhow::Result<Vec<MotionLog>> {
        let experiment = self.trial_ground(backend, false, 0.0, secret);
        let measure = |(index, motion): (usize, &Motion)| -> anyhow::Result<MotionLog> {
            let mut rng = ChaCha8Rng::seed_from_u64(VALIDATION_SEED);
            rng.set_stream(index as u64);
            Ok(experiment.perform(&self.robot, &self.truth, motion, &mut rng)?.measured)
        };
        self.held_out.par_iter().enumerate().map(measure).collect()
    }

    /// R of [Φ f] of logs under a belief's columns, and their number of samples T.
    ///
    /// # Errors
    /// The belief is not of this robot.
    pub fn validation_of(&self, model: &RobotModel, logs: &[MotionLog]) -> anyhow::Result<(Factor, f64)> {
        let design = self.robot.design_of(model)?;
        let mut evidence = Evidence::none(&design, RowsAt::Periods)?.without_noise();
        for log in logs {
            evidence.add(&design, log)?;
        }
        let groups = evidence.factor().groups();
        let samples = groups.first().map_or(0, |group| group.factor.rows()) as f64;
        Ok((evidence.factor().combine(&self.subject.judged_rows())?, samples))
    }

    /// The effects that a seed hides in its plant: one, or of a family one for each joint.
    ///
    /// # Errors
    /// None that a robot that was read can cause.
    pub fn secret(&self, kind: SecretKind, seed: u64) -> anyhow::Result<Vec<PlantEffect>> {
        let tree = &self.subject.tree;
        let joints = tree.joint_count();
        let world = World { rotor_inertia: vec![0.0; joints], ..World::default() };
        let robot = case::Robot { urdf: "", tree: tree.clone(), world, sign_width: 0.01 };
        let mut workspace = Workspace::new(tree);
        let mut samples = Vec::new();
        for motion in self.dataset.motions().iter().step_by(7) {
            for index in (0..motion.samples()).step_by(10) {
                let [q, v, a] = motion.sample(index).map(<[f64]>::to_vec);
                let mut torque = vec![0.0; joints];
                tree.inverse_dynamics(&q, &v, &a, &mut workspace, &mut torque)?;
                torque
                    .iter_mut()
                    .zip(&v)
                    .zip(&self.subject.viscous)
                    .for_each(|((torque, v), viscous)| *torque += viscous * v);
                samples.push(case::Sample { t_s: index as f64 * motion.period_s(), q, v, a, torque });
            }
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(SECRET_STREAM);
        Ok(kind.draw(&robot, &samples, &mut rng))
    }
}

fn timing(backend: Engine) -> Timing {
    Timing { longest_step_s: backend.longest_step_s(), ..Timing::default() }
}

fn parameter_facts(robot: &Robot, truth: &RobotModel) -> anyhow::Result<Vec<ParameterFacts>> {
    let values = truth.parameters(robot)?;
    let base = robot.base().independent().iter().map(|&standard| {
        let unit = standard_unit(standard % PARAMETERS_PER_BODY).to_owned();
        (parameter_name(robot.tree(), standard), unit)
    });
    let design = robot.design(robot.declared())?;
    let effects = design.effect_parameter_info();
    let effects = effects.iter().map(|info| (format!("{}.{}", info.joint, info.name), info.unit.clone()));
    Ok(base
        .chain(effects)
        .zip(values)
        .map(|((name, unit), value)| ParameterFacts { name, unit, value })
        .collect())
}

impl Settings {
    /// The settings of a folder of runs.
    ///
    /// # Errors
    /// There are none.
    pub fn read(folder: &Path) -> anyhow::Result<Self> {
        let path = folder.join(FILE);
        let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        serde_json::from_str(&text).with_context(|| path.display().to_string())
    }

    /// Writes the settings, or checks that those that are there are the same.
    ///
    /// # Errors
    /// They are not.
    pub fn keep(&self, folder: &Path) -> anyhow::Result<()> {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        if folder.join(FILE).exists() {
            ensure!(
                Self::read(folder)? == *self,
                "{} holds runs with other settings: name another folder with --out, or delete it",
                folder.display()
            );
            return Ok(());
        }
        run_file::replace(&folder.join(FILE), serde_json::to_string_pretty(self)?.as_bytes())
    }

    /// The true parameter vector.
    pub fn truth(&self) -> Vec<f64> {
        self.parameters.iter().map(|parameter| parameter.value).collect()
    }
}
