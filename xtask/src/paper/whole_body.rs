//! The humanoid on its feet: 30 joints, a base that floats, identified from the wrenches under its feet and the torques.
//!
//! Its base is six joints without motors, so that the same curriculum runs. Its feet stay on the floor: what can be told of it are the base parameters of
//! *these* motions, which are fewer than those of a robot that may move its feet.

mod pelvis;

use super::subject::{FASTEST, Subject, VISCOUS_SHARE, arm_gains};
use crate::environment;
use crate::plant_experiment::engine::Engine;
use anyhow::{Context, ensure};
use pelvis::PelvisMotion;
use phiw_curriculum::standing::{
    Feet, StandingFeedForward, StandingRobot, VIRTUAL_JOINTS, WrenchNoise, with_virtual_base,
};
use phiw_curriculum::{Motion, Robot, SimulatedRobot};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{BackendError, DynamicsBackend, Foot, PARAMETERS_PER_BODY, Tree, World};
use phiw_identification::EffectSpec;
use phiw_plant::{Effect, Sensors, Timing, feet_from_toml};
use phiw_regressor::BaseParameters;
use phiw_residual::catalogue::Catalogue;
use phiw_sim_mujoco::{Integrator, MujocoBackend};
use phiw_zmp::{Stance, SupportPolygon};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Joints without motors, and the bodies without mass between them.
const BASE: usize = VIRTUAL_JOINTS.len();
const MASSLESS: [usize; BASE - 1] = [0, 1, 2, 3, 4];
/// Time between two commands \[s\], and longest integration step. A foot weighs a kilogram: with the arms' 10 ms the damping that an ankle needs to
/// carry the body makes the foot flutter as soon as an edge of its sole is free, and the robot falls.
const CONTROL_PERIOD_S: f64 = 0.001;
const LONGEST_STEP_S: f64 = 5e-4;
/// Hip, knee and ankle pitch in which it stands \[rad\]: the ankles under the hips, which puts the middle of the soles under the arms' reach.
const CROUCH: [(&str, f64); 3] = [("hip_pitch", -0.40), ("knee", 0.81), ("ankle_pitch", -0.41)];
/// Gain of the legs over their torque limits \[1/rad\], and K_d over K_p \[s\]: stiff enough that the ankles alone hold it upright, whose weight
/// topples it with 530 N·m/rad.
const LEG_STIFFNESS: f64 = 12.0;
const LEG_DAMPING_S: f64 = 0.004;
/// Sensors under the feet, as data sheets of six-axis sensors for 1 kN have them.
const WRENCH_NOISE: WrenchNoise = WrenchNoise { force_n: 1.0, moment_nm: 0.1 };
/// Height of the base over the sensors \[m\]: the lever by which their forces' noise is noise of the moments at the base.
const LEVER_M: f64 = 0.75;
/// States in which base parameters are sought, and how far they go from the stance: base \[m, rad\], speeds \[rad/s\] and accelerations.
const STATES: usize = 200;
const REACH: [f64; BASE] = [0.05, 0.05, 0.05, 0.3, 0.2, 0.15];
const LOWERED_M: f64 = 0.06;
const BRISK: [f64; 2] = [3.0, 10.0];
/// Share of its pelvis motion by which a motion is made smaller until the legs can follow.
const SMALLER: f64 = 0.85;
const TRIES: usize = 20;

/// What a robot with legs stands on, and how.
pub struct Standing {
    /// Its feet on the floor.
    pub feet: Feet,
    /// The configuration, with virtual joints, in which it stands at first.
    pub stance: Vec<f64>,
    /// Its legs' joints.
    legs: Vec<usize>,
    base: BaseParameters,
}

/// The humanoid of `models/`.
///
/// # Errors
/// A file is not there, or is not a robot.
pub fn subject() -> anyhow::Result<Subject> {
    let root = environment::workspace_root()?;
    let urdf = root.join("models/humanoid30.urdf");
    let read =
        |path: &std::path::Path| std::fs::read_to_string(path).with_context(|| path.display().to_string());
    let text = read(&urdf)?;
    let floating = read_urdf(&text, &UrdfOptions { floating_base: true, ..UrdfOptions::default() })?.tree;
    let chained = with_virtual_base(&text, &floating.bodies()[0].link)
        .context("models/humanoid30.urdf ends strangely")?;
    let tree = read_urdf(&chained, &UrdfOptions::default())?.tree;
    let feet = feet_from_toml(&read(&root.join("models/humanoid30.support.toml"))?, &floating)?;
    let standing = Standing::new(&tree, &feet)?;
    let corners: Vec<[f64; 2]> = standing
        .feet
        .all()
        .iter()
        .zip(&feet)
        .flat_map(|(standing, foot)| {
            foot.sole.iter().map(|&corner| standing.placement.point(phiw_dynamics::Vec3(corner)).0)
        })
        .map(|[x, y, _]| [x, y])
        .collect();
    let support = SupportPolygon::from_points(&corners)?.bounds().polygon()?;
    let about = support.centroid();
    let stance = Stance::new(support, about, 0.0)?;
    let joints = floating.joint_count();
    let limits = |joint: usize| floating.joint(joint).limits;
    let viscous: Vec<f64> = (0..joints)
        .map(|joint| VISCOUS_SHARE * limits(joint).effort / limits(joint).velocity.min(FASTEST))
        .collect();
    let mut gains = arm_gains(&floating, &viscous, CONTROL_PERIOD_S)?;
    for joint in standing.legs.iter().map(|&joint| joint - BASE) {
        gains.position[joint] = LEG_STIFFNESS * limits(joint).effort;
        gains.velocity[joint] = LEG_DAMPING_S * gains.position[joint];
    }
    let hold = standing.legs.iter().map(|&joint| (tree.joint(joint).joint.clone(), 0.0)).collect();
    Ok(Subject {
        urdf,
        hold,
        tree,
        floating,
        feet,
        stance,
        base_link: [0.0; PARAMETERS_PER_BODY],
        viscous,
        gains,
        standing: Some(standing),
    })
}

impl Standing {
    fn new(tree: &Tree, feet: &[Foot]) -> anyhow::Result<Self> {
        let own: Vec<Foot> = feet
            .iter()
            .map(|foot| Foot { body: foot.body + MASSLESS.len(), sole: foot.sole.clone() })
            .collect();
        let mut stance = vec![0.0; tree.joint_count()];
        for side in ["left", "right"] {
            for (joint, angle) in CROUCH {
                let name = format!("{side}_{joint}");
                stance[tree.joint_index(&name).with_context(|| format!("no joint {name}"))?] = angle;
            }
        }
        // So high that the soles lie on the floor.
        let placed = Feet::new(tree, &own, &stance)?;
        let sole = &placed.all()[0];
        stance[2] = -sole.placement.point(sole.sole).0[2];
        let feet = Feet::new(tree, &own, &stance)?;
        let legs: Vec<usize> = (0..own.len()).flat_map(|foot| feet.leg(foot)).collect();
        let base = base_parameters(&feet, &stance, &legs)?;
        Ok(Standing { feet, stance, legs, base })
    }

    /// The joints that are not in the legs: those that motions of people move.
    pub fn upper_joints(&self) -> Vec<String> {
        let tree = self.feet.tree();
        self.upper().map(|joint| tree.joint(joint).joint.clone()).collect()
    }

    fn upper(&self) -> impl Iterator<Item = usize> + '_ {
        (BASE..self.feet.tree().joint_count()).filter(|joint| !self.legs.contains(joint))
    }

    /// What is declared.
    ///
    /// # Errors
    /// None that a robot that was read can cause.
    pub fn robot(&self) -> anyhow::Result<Robot> {
        let tree = self.feet.tree().clone();
        let viscous = |joint: &str| EffectSpec::new("viscous_friction", &[joint]);
        let declared = tree.joint_names().skip(BASE).map(viscous).collect();
        let base_link = [0.0; PARAMETERS_PER_BODY];
        Ok(Robot::with_base(tree, self.base.clone(), base_link, declared, Catalogue::default())?)
    }

    /// A motion of the upper body on legs that sway, squat and twist: synthetic, from the motion's name alone, and as large as the legs can follow.
    ///
    /// # Errors
    /// The legs can not even stand.
    pub fn with_legs(&self, upper: &Motion) -> anyhow::Result<Motion> {
        let mut pelvis = PelvisMotion::of_name(&upper.name, upper.duration_s());
        for _ in 0..TRIES {
            if let Some(motion) = self.follow(upper, &pelvis)? {
                return Ok(motion);
            }
            pelvis = pelvis.times(SMALLER);
        }
        anyhow::bail!("{}: the legs can not follow the pelvis, however little it moves", upper.name)
    }

    /// None where a leg is beyond its limits.
    fn follow(&self, upper: &Motion, pelvis: &PelvisMotion) -> anyhow::Result<Option<Motion>> {
        let tree = self.feet.tree();
        let joints = tree.joint_count();
        ensure!(upper.joints() == self.upper().count(), "{} is not a motion of the upper body", upper.name);
        let all: Vec<usize> = (0..self.feet.all().len()).collect();
        let mut signals = [0; 3].map(|_| Vec::with_capacity(upper.samples() * joints));
        let mut state = [self.stance.clone(), vec![0.0; joints], vec![0.0; joints]];
        for sample in 0..upper.samples() {
            let moved = pelvis.at(sample as f64 * upper.period_s());
            let parts = upper.sample(sample);
            for ((values, part), moved) in state.iter_mut().zip(parts).zip(moved) {
                values[..BASE].copy_from_slice(&moved);
                self.upper().zip(part).for_each(|(joint, &value)| values[joint] = value);
            }
            state[0][..BASE].iter_mut().zip(&self.stance).for_each(|(value, stance)| *value += stance);
            let [q, v, a] = &mut state;
            if self.feet.close(&self.legs, &all, [q, v, a]).is_err() {
                return Ok(None);
            }
            let within = |&joint: &usize| {
                let limits = tree.joint(joint).limits;
                (limits.lower..=limits.upper).contains(&q[joint]) && v[joint].abs() <= limits.velocity
            };
            if !self.legs.iter().all(within) {
                return Ok(None);
            }
            signals.iter_mut().zip(&state).for_each(|(signal, values)| signal.extend_from_slice(values));
        }
        Ok(Some(Motion::new(&upper.name, &upper.task, joints, upper.period_s(), signals)?))
    }

    /// Bodies of the tree that do not move.
    pub fn foot_bodies(&self) -> Vec<usize> {
        self.feet.all().iter().map(|foot| foot.body).collect()
    }

    /// The noise in the rows of the virtual joints \[N, N·m\]: that of the sensors.
    pub fn base_noise(&self) -> [f64; BASE] {
        let feet = (self.feet.all().len() as f64).sqrt();
        let force = feet * WRENCH_NOISE.force_n;
        let moment = feet * WRENCH_NOISE.moment_nm.hypot(LEVER_M * WRENCH_NOISE.force_n);
        [force, force, force, moment, moment, moment]
    }
}

impl Subject {
    /// The humanoid in an engine; `noise` is the actuators', and without it the sensors have none either.
    pub fn on_feet(
        &self,
        standing: &Standing,
        backend: Engine,
        noise: f64,
        effects: Vec<Effect>,
    ) -> StandingRobot {
        let silent = WrenchNoise { force_n: 0.0, moment_nm: 0.0 };
        let plant = SimulatedRobot {
            tree: self.floating.clone(),
            world: self.floor(),
            effects,
            controller: Box::new(StandingFeedForward {
                gains: self.gains.clone(),
                feet: standing.feet.clone(),
                stance: standing.stance.clone(),
            }),
            actuator_noise: noise,
            sensors: Sensors::exact(CONTROL_PERIOD_S),
            timing: Timing {
                control_period_s: CONTROL_PERIOD_S,
                longest_step_s: LONGEST_STEP_S,
                ..Timing::default()
            },
            fall_tilt_rad: 0.3,
            build: Box::new(move |tree, world| build(backend, tree, world)),
        };
        let wrench_noise = if noise > 0.0 { WRENCH_NOISE } else { silent };
        StandingRobot { plant, feet: standing.feet.clone(), wrench_noise }
    }
}

/// The robot in an engine. MuJoCo tells its contact forces for the beginning of a step; they are those of all of it with the integrator that
/// looks there only.
fn build(backend: Engine, tree: &Tree, world: &World) -> Result<Box<dyn DynamicsBackend>, BackendError> {
    if backend != Engine::Mujoco {
        return backend.build(tree, world);
    }
    let mujoco = MujocoBackend::new(tree, world)
        .map_err(|error| BackendError::Backend { backend: "mujoco", message: error.to_string() })?;
    Ok(Box::new(mujoco.with_integrator(Integrator::Implicit)))
}

/// What motions with both feet on the floor can tell apart.
fn base_parameters(feet: &Feet, stance: &[f64], legs: &[usize]) -> anyhow::Result<BaseParameters> {
    let tree = feet.tree();
    let joints = tree.joint_count();
    let all: Vec<usize> = (0..feet.all().len()).collect();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut states: Vec<[Vec<f64>; 3]> = Vec::with_capacity(STATES);
    for _ in 0..10 * STATES {
        if states.len() == STATES {
            break;
        }
        let mut state = [stance.to_vec(), vec![0.0; joints], vec![0.0; joints]];
        for joint in (0..joints).filter(|joint| !legs.contains(joint)) {
            let limits = tree.joint(joint).limits;
            state[0][joint] = match REACH.get(joint) {
                Some(reach) => stance[joint] + reach * random.random_range(-1.0..1.0),
                None => random.random_range(limits.lower..limits.upper),
            };
            state[1][joint] = BRISK[0] * random.random_range(-1.0..1.0);
            state[2][joint] = BRISK[1] * random.random_range(-1.0..1.0);
        }
        state[0][2] -= LOWERED_M;
        let [q, v, a] = &mut state;
        if feet.close(legs, &all, [q, v, a]).is_ok() {
            states.push(state);
        }
    }
    ensure!(states.len() == STATES, "the legs reach too few places");
    let states = states.iter().map(|[q, v, a]| [q.as_slice(), v.as_slice(), a.as_slice()]);
    Ok(BaseParameters::of_states(tree, states, &MASSLESS, Default::default())?)
}
