//! The robot under test: what is true of it, and what is declared.

use super::arguments::Method;
use super::whole_body::{self, Standing};
use crate::environment;
use anyhow::Context;
use phiw_curriculum::motion::Motion;
use phiw_dynamics::inertia::InertialParameters;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use phiw_dynamics::{Foot, Tree, World};
use phiw_effects::Catalogue;
use phiw_estimation::{Robot, RobotModel};
use phiw_identification::EffectSpec;
use phiw_plant::{Friction, GainSettings, Gains, PlantEffect, apparent_inertia, least_apparent_inertia};
use phiw_zmp::{Stance, SupportPolygon, feet_from_toml};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Robots of 18 joints and 132 base parameters, and one with legs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum SubjectName {
    /// models/upper_body18.urdf, on a pedestal that stands free.
    UpperBody18,
    /// The Torobo of the shared data, as in the paper. Its file knows neither the weight of its base nor what
    /// it stands on: 25 kg on a square of 0.4 m are taken.
    Torobo,
    /// models/humanoid30.urdf on its own feet, with a base that floats.
    WholeBody,
}

/// Joints of the 20-joint Torobo that the paper's robot has not.
const HELD: [&str; 2] = ["torso/joint_3", "head/joint_1"];
/// Viscous friction: share of the torque limit that it takes at the speed limit. A real drive has some
/// percent.
const VISCOUS_SHARE: f64 = 0.02;
/// The fastest that a joint is taken to be [rad/s]; the Torobo's file has placeholders.
const FASTEST: f64 = 4.0;
/// Inertia of each rotor of the Torobo \[kg·m²\], as its file says in words since a URDF has no place for it.
const TOROBO_ARMATURE: f64 = 0.1;
/// Time between the configurations at which the joints' inertias are looked at \[s\].
const INERTIA_EVERY_S: f64 = 0.1;
/// Base of the Torobo: mass \[kg\], half a side of its square sole and height of its centre \[m\].
const BASE: [f64; 3] = [25.0, 0.2, 0.2];

/// A robot, its truth, and how it is set up.
pub struct Subject {
    /// Where its URDF is.
    pub urdf: PathBuf,
    /// Joints that are held.
    pub hold: Vec<(String, f64)>,
    /// On a fixed base.
    pub tree: Tree,
    /// On a floating base, where it can stand.
    pub floating: Tree,
    /// What is under it.
    pub feet: Vec<Foot>,
    /// What its ZMP must not leave.
    pub stance: Stance,
    /// The link on the floor.
    pub base_link: InertialParameters,
    /// Coefficients of viscous friction \[N·m·s/rad\].
    pub viscous: Vec<f64>,
    /// Inertia of each rotor at its joint \[kg·m²\]; empty where nobody says. The plant has it.
    pub rotor_inertia: Vec<f64>,
    /// Whether it is declared.
    pub declares_rotors: bool,
    /// K_p and K_d.
    pub gains: Gains,
    /// Its legs on the floor, for a robot with legs. `tree` then has virtual joints for the base; `viscous`
    /// and `gains` are of the motors.
    pub standing: Option<Standing>,
}

impl Subject {
    /// Reads the robot. Commands are held for `control_period_s`.
    ///
    /// # Errors
    /// A file is not there, or is not a robot.
    pub fn read(name: SubjectName, control_period_s: f64) -> anyhow::Result<Self> {
        let root = environment::workspace_root()?;
        let (urdf, hold) = match name {
            SubjectName::WholeBody => return whole_body::subject(),
            SubjectName::UpperBody18 => (root.join("models/upper_body18.urdf"), Vec::new()),
            SubjectName::Torobo => (
                root.join("../shared/data/robots/torobo20/torobo20.urdf"),
                HELD.map(|joint| (joint.to_owned(), 0.0)).to_vec(),
            ),
        };
        let read = |floating_base: bool| {
            let options = UrdfOptions { floating_base, held: hold.clone(), ..UrdfOptions::default() };
            read_urdf_file(&urdf, &options).map(|reading| reading.tree)
        };
        let (tree, mut floating) = (read(false)?, read(true)?);
        let feet = match name {
            SubjectName::UpperBody18 => {
                let path = root.join("models/upper_body18.support.toml");
                let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
                feet_from_toml(&text, &floating)?
            }
            _ => {
                let [mass, half, height] = BASE;
                let moment = mass * (half * half / 3.0 + height * height);
                let base =
                    [mass, 0.0, 0.0, mass * height, moment, 0.0, moment, 0.0, 0.0, mass * half * half / 1.5];
                let mut parameters = floating.inertial_parameters();
                parameters[..base.len()].copy_from_slice(&base);
                floating.set_inertial_parameters(&parameters)?;
                let sole =
                    vec![[half, half, 0.0], [-half, half, 0.0], [-half, -half, 0.0], [half, -half, 0.0]];
                vec![Foot { body: 0, sole }]
            }
        };
        let corners: Vec<[f64; 2]> =
            feet.iter().flat_map(|foot| &foot.sole).map(|&[x, y, _]| [x, y]).collect();
        let support = SupportPolygon::from_points(&corners)?;
        let stance = Stance::new(support.bounds().polygon()?, [0.0, 0.0], 0.0)?;
        let viscous = viscous_frictions(&tree);
        let gains = arm_gains(&tree, &viscous, control_period_s)?;
        let base_link = floating.bodies()[0].inertial;
        let (rotor_inertia, declares_rotors, standing) = (Vec::new(), false, None);
        Ok(Subject {
            urdf,
            hold,
            tree,
            floating,
            feet,
            stance,
            base_link,
            viscous,
            rotor_inertia,
            declares_rotors,
            gains,
            standing,
        })
    }

    /// The same with the rotors that the robot's file knows of, in a whole method: the paper's has no column
    /// for them.
    ///
    /// # Errors
    /// None that a robot that was read can cause.
    pub fn with_rotors(
        self,
        (name, method): (SubjectName, Option<Method>),
        control_period_s: f64,
    ) -> anyhow::Result<Self> {
        let (SubjectName::Torobo, Some(method)) = (name, method) else { return Ok(self) };
        let rotor_inertia = vec![TOROBO_ARMATURE; self.tree.joint_count()];
        let inertia = apparent_inertia(&self.tree, &rotor_inertia, &self.tree.neutral_configuration())?;
        let settings = GainSettings::default();
        let gains = Gains::held(&self.tree, &inertia, &self.viscous, control_period_s, &settings)?;
        Ok(Subject { rotor_inertia, declares_rotors: method == Method::Ours, gains, ..self })
    }

    /// The same with gains for what each joint feels least in any of these motions: with its hand turned a
    /// wrist feels a fifth of what it feels in the neutral configuration, and gains that are made for that
    /// and held for a period are unstable there. On its feet it keeps the gains that it has.
    ///
    /// # Errors
    /// A motion is not of this robot.
    pub fn with_gains_for<'a>(
        self,
        motions: impl Iterator<Item = &'a Motion>,
        control_period_s: f64,
    ) -> anyhow::Result<Self> {
        if self.standing.is_some() {
            return Ok(self);
        }
        let configurations = |motion: &'a Motion| {
            let every = ((INERTIA_EVERY_S / motion.period_s()).round() as usize).max(1);
            (0..motion.samples()).step_by(every).map(|sample| motion.sample(sample)[0].to_vec())
        };
        let all = motions.flat_map(configurations).chain([self.tree.neutral_configuration()]);
        let inertia = least_apparent_inertia(&self.tree, &self.rotor_inertia, all)?;
        let settings = GainSettings::default();
        let gains = Gains::held(&self.tree, &inertia, &self.viscous, control_period_s, &settings)?;
        Ok(Subject { gains, ..self })
    }

    /// What is declared.
    ///
    /// # Errors
    /// None that a robot that was read can cause.
    pub fn robot(&self) -> anyhow::Result<Robot> {
        match &self.standing {
            Some(standing) => standing.robot(),
            None => {
                let kinds = match self.declares_rotors {
                    true => &["viscous_friction", "rotor_inertia"][..],
                    false => &["viscous_friction"],
                };
                let joints: Vec<&str> = self.tree.joint_names().collect();
                let of_kind = |kind: &&str| -> Vec<EffectSpec> {
                    joints.iter().map(|joint| EffectSpec::new(kind, &[*joint])).collect()
                };
                let declared = kinds.iter().flat_map(of_kind).collect();
                Ok(Robot::new(self.tree.clone(), self.base_link, declared, Catalogue::default())?)
            }
        }
    }

    /// What is true.
    ///
    /// # Errors
    /// As above.
    pub fn truth(&self, robot: &Robot) -> anyhow::Result<RobotModel> {
        let rotors = if self.declares_rotors { self.rotor_inertia.as_slice() } else { &[] };
        Ok(robot.truth(&[&self.viscous, rotors].concat())?)
    }

    /// The frictions and the rotors, in the plant.
    pub fn frictions(&self) -> Vec<PlantEffect> {
        let friction = |(joint, &coefficient): (usize, &f64)| PlantEffect::Friction {
            joint,
            law: Friction::Viscous { coefficient },
        };
        let rotor = |(joint, &inertia): (usize, &f64)| PlantEffect::RotorInertia { joint, inertia };
        let rotors = self.rotor_inertia.iter().enumerate().map(rotor);
        self.viscous.iter().enumerate().map(friction).chain(rotors).collect()
    }

    /// The floor, for a robot that stands on it.
    pub fn floor(&self) -> World {
        World { feet: self.feet.clone(), ..World::default() }
    }

    /// Standard deviation of the torques' noise \[N·m\], as a share of the limits; of virtual joints that of
    /// the sensors under the feet.
    pub fn torque_noise(&self, share: f64) -> Vec<f64> {
        let base = self.standing.as_ref().map(Standing::base_noise);
        let noise = |joint: usize| match base.as_ref().and_then(|base| base.get(joint)) {
            Some(&noise) => noise,
            None => share * self.tree.joint(joint).limits.effort,
        };
        (0..self.tree.joint_count()).map(noise).collect()
    }

    /// What the rows of each torque are multiplied with before motions are compared: 1 as in the paper. On
    /// feet the rows of the base are of other units and a hundred times sharper, so there each is counted in
    /// its own noise.
    pub fn row_weights(&self, share: f64) -> Vec<f64> {
        match self.standing {
            Some(_) => self.torque_noise(share).iter().map(|noise| 1.0 / noise).collect(),
            None => vec![1.0; self.tree.joint_count()],
        }
    }

    /// The rows whose error is the torque error (19): motors, not virtual joints.
    pub fn judged_rows(&self) -> Vec<f64> {
        let motors = self.viscous.len();
        (0..self.tree.joint_count())
            .map(|joint| f64::from(u8::from(joint + motors >= self.tree.joint_count())))
            .collect()
    }

    /// The joints that motions of people move.
    pub fn moved_joints(&self) -> Vec<String> {
        match &self.standing {
            Some(standing) => standing.upper_joints(),
            None => self.tree.joint_names().map(str::to_owned).collect(),
        }
    }
}

/// The viscous friction of each joint of a plant, from its limits \[N·m·s/rad\].
pub fn viscous_frictions(tree: &Tree) -> Vec<f64> {
    let limits = (0..tree.joint_count()).map(|joint| tree.joint(joint).limits);
    limits.map(|limits| VISCOUS_SHARE * limits.effort / limits.velocity.min(FASTEST)).collect()
}

/// Small gains, critically damped, that stay stable when commands are held for `control_period_s`.
///
/// # Errors
/// A list does not fit the robot.
pub fn arm_gains(tree: &Tree, viscous: &[f64], control_period_s: f64) -> anyhow::Result<Gains> {
    let inertia = apparent_inertia(tree, &[], &tree.neutral_configuration())?;
    Ok(Gains::held(tree, &inertia, viscous, control_period_s, &GainSettings::default())?)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 0.01;

    /// Raised arms and turned hands: gains of the neutral configuration are too stiff for some joint there.
    #[test]
    fn gains_are_no_stiffer_than_any_motion_allows() -> anyhow::Result<()> {
        let subject = Subject::read(SubjectName::UpperBody18, PERIOD_S)?;
        let (samples, joints) = (41, subject.tree.joint_count());
        let swing = |t_s: f64, q: &mut [f64], _: &mut [f64], _: &mut [f64]| {
            for (joint, q) in q.iter_mut().enumerate() {
                let limits = subject.tree.joint(joint).limits;
                let end = if joint % 2 == 0 { limits.lower } else { limits.upper };
                *q = 0.9 * end * (t_s / 4.0);
            }
        };
        let motion = Motion::of_reference("reach", "reach", joints, (samples, 0.1), swing)?;
        let too_stiff = |gains: &Gains| -> anyhow::Result<bool> {
            for sample in 0..samples {
                let inertia = apparent_inertia(&subject.tree, &[], motion.sample(sample)[0])?;
                let settings = GainSettings::default();
                let own = Gains::held(&subject.tree, &inertia, &subject.viscous, PERIOD_S, &settings)?;
                let mut pairs = gains.position.iter().zip(&own.position);
                if pairs.any(|(gain, most)| *gain > most * (1.0 + 1e-9)) {
                    return Ok(true);
                }
            }
            Ok(false)
        };
        assert!(too_stiff(&subject.gains)?);
        let gains = Subject::read(SubjectName::UpperBody18, PERIOD_S)?
            .with_gains_for([&motion].into_iter(), PERIOD_S)?
            .gains;
        assert!(!too_stiff(&gains)?);
        Ok(())
    }
}
