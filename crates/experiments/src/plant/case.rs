//! One case: a robot with a secret, three motions, three logs, and what the tracer says of them.

use super::Arguments;
use super::engine::Engine;
use super::score::{Scored, score};
use super::secret::SecretKind;
use crate::undeclared::report_file::Report;
use crate::undeclared::tracer::Tracer;
use anyhow::{Context, bail};
use phiw_dynamics::random_tree::{RandomNumbers, random_state};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{Tree, Workspace, World};
use phiw_plant::{
    ComputedTorque, Friction, GainSettings, Gains, MultiSine, Plant, PlantEffect, PlantSetup, Reference,
    RigidBodyModel, Sensors, Timing, least_apparent_inertia,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// Highest frequency of the motions \[Hz\], and the shares of range and speed that they use.
const HIGHEST_HZ: f64 = 1.2;
const USED: [f64; 2] = [0.6, 0.7];
/// Gains that are small, so that tracking is poor.
const GAINS: GainSettings =
    GainSettings { bandwidth: 8.0, stiffness: 0.15, gravity: 0.0, held_inertia: 0.04, held_friction: 0.0 };
/// Least inertia of a rotor behind its gear, over the effort limit \[kg·m²/(N·m)\]: in light joints it
/// outweighs the link.
const ROTOR: f64 = 1e-3;
/// Postures over which a joint's least inertia is sought.
const POSES: usize = 50;
/// How wrong each of the controller's parameters may be.
const WRONG: f64 = 0.4;
/// Step of an encoder: 19 bits.
const QUANTUM: f64 = std::f64::consts::TAU / 524_288.0;
/// Time between two logs \[s\].
const PAUSE_S: f64 = 5.0;

/// The robot of the experiment, with what its drives have and is declared.
pub struct Robot {
    /// Its URDF, as handed to the tracer.
    pub urdf: &'static str,
    /// What it declares.
    pub tree: Tree,
    /// Its rotors.
    pub world: World,
    /// Speed over which frictions' signs turn \[rad/s\].
    pub sign_width: f64,
}

/// All joints at one time of a reference.
pub struct Sample {
    /// Time \[s\].
    pub t_s: f64,
    /// Angles \[rad\].
    pub q: Vec<f64>,
    /// Speeds.
    pub v: Vec<f64>,
    /// Accelerations.
    pub a: Vec<f64>,
    /// Torques of the declared robot \[N·m\].
    pub torque: Vec<f64>,
}

impl Robot {
    /// The 18-joint upper body.
    ///
    /// # Errors
    /// The model does not read.
    pub fn read() -> anyhow::Result<Self> {
        let urdf = include_str!("../../../../models/upper_body18.urdf");
        let tree = read_urdf(urdf, &UrdfOptions::default()).context("models/upper_body18.urdf")?.tree;
        let joints = tree.joint_count();
        let mut matrix = vec![0.0; joints * joints];
        tree.mass_matrix(&vec![0.0; joints], &mut Workspace::new(&tree), &mut matrix)?;
        let rotor = |joint: usize| {
            let limits = tree.joint(joint).limits;
            (0.15 * matrix[joint * (joints + 1)]).max(ROTOR * limits.effort)
        };
        let rotor_inertia = (0..joints).map(rotor).collect();
        let world = World { rotor_inertia, ..World::default() };
        Ok(Robot { urdf, tree, world, sign_width: 0.01 })
    }

    /// The joint before a joint.
    pub fn parent(&self, joint: usize) -> Option<usize> {
        self.tree.joint(joint).parent.map(|body| self.tree.bodies()[body].velocity_index)
    }

    /// Small gains, critically damped, that stay stable when commands are held for `period_s`.
    fn gains(&self, rotor_inertia: &[f64], period_s: f64) -> anyhow::Result<Gains> {
        let mut rng = RandomNumbers::new(1);
        let poses = (0..POSES).map(|_| random_state(&self.tree, &mut rng).q);
        let inertia = least_apparent_inertia(&self.tree, rotor_inertia, poses)?;
        Ok(Gains::held(&self.tree, &inertia, &[], period_s, &GAINS)?)
    }

    /// Frictions that every joint has.
    fn frictions(&self, joint: usize) -> [Friction; 2] {
        let limits = self.tree.joint(joint).limits;
        [
            Friction::Viscous { coefficient: 0.02 * limits.effort / limits.velocity },
            Friction::Coulomb { torque: 0.012 * limits.effort, width: self.sign_width },
        ]
    }

    /// What the declared robot needs along a reference.
    fn samples(&self, reference: &MultiSine) -> anyhow::Result<Vec<Sample>> {
        let joints = self.tree.joint_count();
        let mut workspace = Workspace::new(&self.tree);
        let frictions: Vec<[Friction; 2]> = (0..joints).map(|joint| self.frictions(joint)).collect();
        let sample = |k: usize| {
            let [mut q, mut v, mut a, mut torque] = [0; 4].map(|_| vec![0.0; joints]);
            let t_s = 0.02 * k as f64;
            reference.at(t_s, &mut q, &mut v, &mut a);
            self.tree.inverse_dynamics(&q, &v, &a, &mut workspace, &mut torque)?;
            for (joint, torque) in torque.iter_mut().enumerate() {
                *torque += self.world.rotor_inertia[joint] * a[joint]
                    + frictions[joint].iter().map(|law| law.torque(v[joint], 0.0, 0.0)).sum::<f64>();
            }
            Ok(Sample { t_s, q, v, a, torque })
        };
        (0..(50.0 * reference.duration_s()) as usize).map(sample).collect()
    }
}

/// What a case is about; all else follows from the seed.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// The engine.
    pub engine: Engine,
    /// The secret's kind.
    pub kind: SecretKind,
    /// The seed.
    pub seed: u64,
}

impl Case {
    /// Simulates, traces and scores.
    ///
    /// # Errors
    /// The plant can not be built or run, or a file cannot be written. A tracer that fails is a score, not an
    /// error.
    pub fn run(&self, robot: &Robot, tracer: &Tracer, arguments: &Arguments) -> anyhow::Result<Scored> {
        let temporary = tempfile::tempdir()?;
        let name = format!("{:?}_{}_{}", self.engine, self.kind.name(), self.seed).to_lowercase();
        let folder = match &arguments.keep {
            Some(keep) => keep.join(&name),
            None => temporary.path().join(&name),
        };
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let motions: Vec<MultiSine> = (0..3)
            .map(|_| MultiSine::random(&robot.tree, arguments.duration, HIGHEST_HZ, USED, &mut rng))
            .collect();
        let mut samples = Vec::new();
        for motion in &motions {
            samples.extend(robot.samples(motion)?);
        }
        let secret = self.kind.draw(robot, &samples, &mut rng);
        let joints = secret.iter().flat_map(|effect| effect.joints(&robot.tree));
        let secret_joints: Vec<String> = joints.map(|joint| robot.tree.joint(joint).joint.clone()).collect();
        if let Some(keep) = &arguments.keep {
            let path = keep.join(format!("{name}.truth.txt"));
            std::fs::write(&path, format!("{secret:#?}\n{secret_joints:?}\n"))
                .with_context(|| path.display().to_string())?;
        }
        write(&folder, "robot.urdf", robot.urdf)?;
        let start = Instant::now();
        let mut tracking = self.log(robot, secret, &motions, &TRAINED, &folder, arguments, &mut rng)?;
        if self.kind.needs_held_model() {
            tracking =
                tracking.max(self.log(robot, Vec::new(), &motions, &CLEAN, &folder, arguments, &mut rng)?);
        }
        let simulated_s = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let report = self.trace(tracer, &folder);
        let traced_s = start.elapsed().as_secs_f64();
        Ok(score(self, &secret_joints, report, tracking, [simulated_s, traced_s]))
    }

    /// Runs a plant through the motions and writes its logs. Returns the largest RMS tracking error of a
    /// joint \[rad\].
    #[allow(clippy::too_many_arguments, reason = "what a log is made of")]
    fn log(
        &self,
        robot: &Robot,
        secret: Vec<PlantEffect>,
        motions: &[MultiSine],
        names: &[&str],
        folder: &Path,
        arguments: &Arguments,
        rng: &mut ChaCha8Rng,
    ) -> anyhow::Result<f64> {
        let joints = robot.tree.joint_count();
        // A kind that is sought is no joint's by nature, or it would not be one joint's secret.
        let natural = |law: &Friction| law.kind() != self.kind.effect_kind();
        let mut effects: Vec<PlantEffect> = (0..joints)
            .flat_map(|joint| {
                robot
                    .frictions(joint)
                    .into_iter()
                    .filter(natural)
                    .map(move |law| PlantEffect::Friction { joint, law })
            })
            .collect();
        effects.extend(secret);
        let mut world = robot.world.clone();
        if self.kind == SecretKind::RotorInertia {
            world.rotor_inertia.clear();
        }
        let mut wrong = robot.tree.clone();
        let parameters: Vec<f64> = wrong
            .inertial_parameters()
            .iter()
            .map(|parameter| parameter * rng.random_range(1.0 - WRONG..1.0 + WRONG))
            .collect();
        wrong.set_inertial_parameters(&parameters)?;
        let gains = robot.gains(&world.rotor_inertia, arguments.period)?;
        let controller = ComputedTorque::new(RigidBodyModel::new(wrong, Vec::new())?, gains);
        let setup = PlantSetup {
            effects,
            actuator_noise: arguments.noise,
            sensors: Sensors {
                period_s: arguments.period,
                torque_window_s: arguments.period,
                angle_quantum: vec![QUANTUM; joints],
                ..Sensors::default()
            },
            timing: Timing {
                control_period_s: arguments.period,
                longest_step_s: self.engine.longest_step_s(),
                ..Timing::default()
            },
            ..PlantSetup::new(controller)
        };
        let mut plant = Plant::new(&robot.tree, &world, setup, |tree, world| self.engine.build(tree, world))?;
        let mut tracking: f64 = 0.0;
        for (motion, name) in motions.iter().zip(names) {
            let run = plant.run(motion, arguments.duration, rng)?;
            plant.rest(PAUSE_S);
            tracking = run.tracking_error.iter().copied().fold(tracking, f64::max);
            run.recording.write_csv(&folder.join(name))?;
        }
        Ok(tracking)
    }

    fn trace(&self, tracer: &Tracer, folder: &Path) -> anyhow::Result<Report> {
        let declared: Vec<&str> = ["viscous_friction", "coulomb_friction", "rotor_inertia"]
            .into_iter()
            .filter(|kind| *kind != self.kind.name())
            .collect();
        let run = |task: &str, logs: &[&str; 3], out: &str, model: Option<&str>| {
            let mut command = Command::new(&tracer.program);
            command.current_dir(folder).env("RAYON_NUM_THREADS", tracer.threads.to_string());
            command.args([task, "--urdf", "robot.urdf", "--train", logs[0], logs[1], "--validate", logs[2]]);
            command.args(["--declare", &declared.join(","), "--out", out]);
            command.args(model.iter().flat_map(|model| ["--model", model]));
            let output = command.output().context("phiw")?;
            if !output.status.success() {
                bail!("phiw {task}: {}", String::from_utf8_lossy(&output.stderr).trim());
            }
            Ok(())
        };
        let held = self.kind.needs_held_model();
        if held {
            run("identify", &CLEAN, "clean", None)?;
        }
        run("explain", &TRAINED, "out", held.then_some("clean/model.json"))?;
        let path = folder.join("out/report.json");
        let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        serde_json::from_str(&text).with_context(|| path.display().to_string())
    }
}

const TRAINED: [&str; 3] = ["train_a.csv", "train_b.csv", "validate.csv"];
const CLEAN: [&str; 3] = ["clean_a.csv", "clean_b.csv", "clean_c.csv"];

fn write(folder: &Path, name: &str, text: &str) -> anyhow::Result<()> {
    let path = folder.join(name);
    std::fs::write(&path, text).with_context(|| path.display().to_string())
}
