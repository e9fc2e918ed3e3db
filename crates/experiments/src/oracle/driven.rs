//! A plant with everything that MJCF has for a drive, carried into MuJoCo and driven along a motion.
//!
//! The plant is known: bodies, rotors, viscous and dry friction, a spring, a transmission that two joints
//! share, and torques that come after their commands. A log of it is identified with all of that declared,
//! and exported. MuJoCo's robot and our model then follow the same motion, each under the command that the
//! plant needs for it and a weak loop of its own. The loop keeps a motion together whose dry friction would
//! let the smallest difference grow; it is too weak to hide a mechanism that is missing, which [`compare`]
//! shows by leaving each out.

use super::export::{Identified, identified, possible_design};
use super::python::Python;
use crate::consistent::robots::Robot;
use phiw_dynamics::random_tree::RandomNumbers;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{AnalyticBackend, Tree, Workspace};
use phiw_identification::EffectSpec;
use phiw_identification::reproduction::Plant;
use phiw_telemetry::Recording;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::path::Path;

/// What runs in Python.
const SCRIPT: &str = include_str!("driven_oracle.py");
/// What is declared.
const DECLARED: [&str; 6] = [
    "viscous_friction",
    "coulomb_friction",
    "rotor_inertia",
    "joint_spring:joint_2",
    "transmission_coupling:joint_2+joint_3",
    "time_delay:joint_1+joint_2+joint_3",
];
/// RMS of the position's difference over the RMS about its mean, and the same of the loop's command over the
/// torque: what may differ between MuJoCo and our model.
const TOLERANCE: f64 = 5e-3;
/// Step \[s\] and length \[s\] of the motion.
const STEP: f64 = 1e-4;
const LENGTH_S: f64 = 2.0;
/// Natural frequency \[rad/s\] of the loop under the joint's own inertia; critically damped.
const LOOP: f64 = 10.0;

const URDF: &str = r#"<robot name="driven">
  <link name="base"/>
  <link name="link_1"><inertial><origin xyz="0.02 0.01 0.1"/><mass value="5"/>
    <inertia ixx="0.05" iyy="0.06" izz="0.04" ixy="0.003" ixz="0" iyz="-0.002"/></inertial></link>
  <link name="link_2"><inertial><origin xyz="0.2 0.03 -0.01"/><mass value="3"/>
    <inertia ixx="0.02" iyy="0.07" izz="0.08" ixy="0" ixz="0.004" iyz="0"/></inertial></link>
  <link name="link_3"><inertial><origin xyz="0.15 -0.02 0.02"/><mass value="1.5"/>
    <inertia ixx="0.005" iyy="0.02" izz="0.021" ixy="0.001" ixz="0" iyz="0"/></inertial></link>
  <joint name="joint_1" type="continuous"><parent link="base"/><child link="link_1"/><origin xyz="0 0 0.3"/><axis xyz="0 0 1"/></joint>
  <joint name="joint_2" type="continuous"><parent link="link_1"/><child link="link_2"/><origin xyz="0.05 0 0.2" rpy="0.2 0 0"/>
    <axis xyz="0 1 0"/></joint>
  <joint name="joint_3" type="continuous"><parent link="link_2"/><child link="link_3"/><origin xyz="0.4 0 0" rpy="0 0 0.5"/>
    <axis xyz="0 1 0"/></joint>
</robot>
"#;

/// What the plant has beside its bodies.
struct Truth {
    viscous: [f64; 3],
    coulomb: [f64; 3],
    rotor: [f64; 3],
    /// Of joint 2: stiffness \[N·m/rad\], and where it is slack \[rad\].
    spring: [f64; 2],
    /// Of the sum of joints 2 and 3: damping, inertia, friction.
    shared: [f64; 3],
    /// From a command to its torque \[s\].
    delay: f64,
}

const TRUTH: Truth = Truth {
    viscous: [4.0, 2.5, 1.2],
    coulomb: [5.0, 4.0, 1.5],
    rotor: [0.3, 0.25, 0.1],
    spring: [12.0, 0.3],
    shared: [0.5, 0.04, 1.2],
    delay: 0.006,
};
/// Speed over which the plant's friction turns \[rad/s\].
const WIDTH: f64 = 0.004;

/// What is asked of MuJoCo.
#[derive(Serialize)]
struct Case<'a> {
    step: f64,
    stiffness: &'a [f64],
    damping: &'a [f64],
    /// What is left out of the file, one after the other.
    without: &'a [&'a str],
}

/// What MuJoCo has done.
#[derive(Deserialize)]
struct Answer {
    reader: String,
    /// What was left out of the file.
    without: String,
    q: Vec<f64>,
    command: Vec<f64>,
}

/// What is left out to see whether the comparison would notice.
const LEFT_OUT: [&str; 7] = ["", "armature", "damping", "frictionloss", "stiffness", "tendon", "delay"];

/// Prints how MuJoCo's motion differs from ours; whether it agrees with all that is in the file, and differs
/// without any one thing.
///
/// # Errors
/// The log cannot be written, or the script fails.
pub fn compare(pythons: &[Python], seed: u64) -> anyhow::Result<bool> {
    let folder = tempfile::tempdir()?;
    let path = |name: &str| folder.path().join(name);
    let tree = read_urdf(URDF, &UrdfOptions::default())?.tree;
    std::fs::write(path("robot.urdf"), URDF)?;
    for (name, seed) in [("train.csv", seed), ("validate.csv", seed + 1)] {
        log(&tree, seed)?.write_csv(&path(name))?;
    }
    let robot = Robot {
        name: "driven",
        urdf: path("robot.urdf"),
        train: vec![path("train.csv")],
        validate: vec![path("validate.csv")],
    };
    let identified = identified(&robot, &DECLARED, folder.path())?;
    let delay = delay(&identified);
    println!(
        "\nA plant with all mechanisms, identified and driven; delay {:.3} ms of {:.3} ms\n",
        1e3 * delay,
        1e3 * TRUTH.delay
    );
    let motion = Driven::new(&identified, delay)?;
    let ours = motion.run(&identified, delay)?;
    motion.write(folder.path())?;
    println!("| program | left out | position, difference | command, difference |\n|---|---|--:|--:|");
    let mut agrees = true;
    for python in pythons {
        let text = python.run(SCRIPT, [folder.path()])?;
        for answer in serde_json::from_str::<Vec<Answer>>(&text)? {
            let position = share(&ours.q, &answer.q, 3);
            let command = share(&ours.command, &answer.command, 3);
            println!(
                "| {} | {} | {:.3} % | {:.3} % |",
                answer.reader,
                if answer.without.is_empty() { "nothing" } else { &answer.without },
                100.0 * position,
                100.0 * command
            );
            let close = position < TOLERANCE && command < TOLERANCE;
            agrees &= close == answer.without.is_empty();
        }
    }
    let verdict = if agrees { "as it must be" } else { "NOT as it must be" };
    println!(
        "\n{verdict}: below {:.1} % with all of the file, above without any one thing.",
        100.0 * TOLERANCE
    );
    Ok(agrees)
}

/// The delay from a command to its torque that was identified \[s\].
fn delay(identified: &Identified) -> f64 {
    let is_delay = |spec: &EffectSpec| spec.kind == "time_delay";
    let effects = identified.model.effects.iter().enumerate();
    let late = effects.filter(|(_, effect)| is_delay(&effect.spec)).map(|(index, effect)| {
        let corrected = effect.spec.constants.get("delay").copied().unwrap_or_default();
        corrected + identified.model.consistent_effect(index, 0).unwrap_or_default()
    });
    -late.sum::<f64>()
}

/// A log: sums of sines, and the command that the plant needs for them.
fn log(tree: &Tree, seed: u64) -> anyhow::Result<Recording> {
    let (rate, seconds) = (500.0, 60.0);
    let mut random = RandomNumbers::new(seed);
    let sines: Vec<[[f64; 3]; 6]> = (0..3)
        .map(|_| {
            std::array::from_fn(|harmonic| {
                let frequency = 0.25 * (harmonic + 1) as f64 + random.uniform(0.0, 0.15);
                [random.uniform(0.1, 0.35), TAU * frequency, random.uniform(0.0, TAU)]
            })
        })
        .collect();
    let mut recording =
        Recording { joints: tree.joint_names().map(str::to_owned).collect(), ..Recording::default() };
    let mut workspace = Workspace::new(tree);
    for row in 0..(seconds * rate) as usize {
        let t = row as f64 / rate;
        recording.q.extend(sum(&sines, t)[0]);
        // The command is ahead of the motion.
        let [q, v, a] = sum(&sines, t + TRUTH.delay);
        let torque = torque(tree, &mut workspace, [&q, &v, &a])?;
        recording.tau.extend(torque.map(|torque| torque + 0.01 * random.uniform(-1.0, 1.0)));
        recording.t.push(t);
    }
    Ok(recording)
}

/// Position, velocity and acceleration of a sum of sines.
fn sum(sines: &[[[f64; 3]; 6]], t: f64) -> [[f64; 3]; 3] {
    std::array::from_fn(|order| {
        std::array::from_fn(|joint| {
            let term = |[amplitude, rate, phase]: &[f64; 3]| {
                let angle = rate * t + phase;
                match order {
                    0 => amplitude * angle.sin(),
                    1 => amplitude * rate * angle.cos(),
                    _ => -amplitude * rate * rate * angle.sin(),
                }
            };
            sines[joint].iter().map(term).sum()
        })
    })
}

/// The plant's torque.
fn torque(
    tree: &Tree,
    workspace: &mut Workspace<f64>,
    [q, v, a]: [&[f64; 3]; 3],
) -> anyhow::Result<[f64; 3]> {
    let mut torque = [0.0; 3];
    tree.inverse_dynamics(q, v, a, workspace, &mut torque)?;
    for joint in 0..3 {
        torque[joint] += TRUTH.rotor[joint] * a[joint]
            + TRUTH.viscous[joint] * v[joint]
            + TRUTH.coulomb[joint] * (v[joint] / WIDTH).tanh();
    }
    torque[1] += TRUTH.spring[0] * (q[1] - TRUTH.spring[1]);
    let (speed, acceleration) = (v[1] + v[2], a[1] + a[2]);
    let [damping, inertia, friction] = TRUTH.shared;
    let shared = damping * speed + inertia * acceleration + friction * (speed / WIDTH).tanh();
    torque[1] += shared;
    torque[2] += shared;
    Ok(torque)
}

/// A motion to follow: a row each [`STEP`].
struct Driven {
    /// Wanted positions and velocities.
    q: Vec<f64>,
    v: Vec<f64>,
    /// The command that the plant needs for them.
    command: Vec<f64>,
    stiffness: Vec<f64>,
    damping: Vec<f64>,
}

/// What a robot has done.
struct Followed {
    q: Vec<f64>,
    command: Vec<f64>,
}

/// Position, velocity and acceleration that are wanted at a time: from rest, and each joint turns.
fn wanted(t: f64) -> [[f64; 3]; 3] {
    const STROKES: [[f64; 2]; 3] = [[0.5, 0.9], [0.4, 1.1], [0.6, 1.4]];
    std::array::from_fn(|order| {
        std::array::from_fn(|joint| {
            let [stroke, frequency] = STROKES[joint];
            let rate = TAU * frequency;
            let t = t.max(0.0);
            match order {
                0 => 0.5 * stroke * (1.0 - (rate * t).cos()),
                1 => 0.5 * stroke * rate * (rate * t).sin(),
                _ => 0.5 * stroke * rate * rate * (rate * t).cos(),
            }
        })
    })
}

impl Driven {
    fn new(identified: &Identified, delay: f64) -> anyhow::Result<Self> {
        let tree = &identified.tree;
        let (design, parameters) = possible_design(identified)?;
        let mut plant = plant(tree, &design, &parameters)?;
        let mut inertia = vec![0.0; 3];
        plant.inertia(&[0.0; 3], &mut inertia)?;
        let mut driven = Driven {
            q: Vec::new(),
            v: Vec::new(),
            command: Vec::new(),
            stiffness: inertia.iter().map(|inertia| inertia * LOOP * LOOP).collect(),
            damping: inertia.iter().map(|inertia| 2.0 * inertia * LOOP).collect(),
        };
        let mut workspace = Workspace::new(tree);
        for row in 0..steps() {
            let t = row as f64 * STEP;
            let [q, v, _] = wanted(t);
            driven.q.extend(q);
            driven.v.extend(v);
            let ahead = wanted(t + delay);
            driven.command.extend(torque(tree, &mut workspace, ahead.each_ref())?);
        }
        Ok(driven)
    }

    /// Our model along the motion.
    fn run(&self, identified: &Identified, delay: f64) -> anyhow::Result<Followed> {
        let (design, parameters) = possible_design(identified)?;
        let mut plant = plant(&identified.tree, &design, &parameters)?;
        let (mut q, mut v, mut a, mut before) = ([0.0; 3], [0.0; 3], [0.0; 3], [0.0; 3]);
        let mut followed = Followed { q: Vec::new(), command: Vec::new() };
        for row in 0..steps() {
            let at = 3 * row;
            followed.q.extend(q);
            let command: [f64; 3] = std::array::from_fn(|joint| {
                self.command[at + joint]
                    + self.stiffness[joint] * (self.q[at + joint] - q[joint])
                    + self.damping[joint] * (self.v[at + joint] - v[joint])
            });
            followed.command.extend(command);
            let torque = delayed(&followed.command, row as f64 - delay / STEP);
            plant.accelerate(row as f64 * STEP, [&q, &v, &torque, &before], &mut a)?;
            before = a;
            for joint in 0..3 {
                v[joint] += STEP * a[joint];
                q[joint] += STEP * v[joint];
            }
        }
        Ok(followed)
    }

    fn write(&self, folder: &Path) -> anyhow::Result<()> {
        let case =
            Case { step: STEP, stiffness: &self.stiffness, damping: &self.damping, without: &LEFT_OUT };
        std::fs::write(folder.join("driven.json"), serde_json::to_string(&case)?)?;
        for (name, values) in
            [("wanted_q", &self.q), ("wanted_v", &self.v), ("wanted_command", &self.command)]
        {
            let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
            std::fs::write(folder.join(name), bytes)?;
        }
        Ok(())
    }
}

fn steps() -> usize {
    (LENGTH_S / STEP).round() as usize
}

fn plant<'a>(
    tree: &Tree,
    design: &'a phiw_identification::Design,
    parameters: &[f64],
) -> anyhow::Result<Plant<'a>> {
    Ok(Plant::new(Box::new(AnalyticBackend::new(tree.clone()))).with_effects(design, parameters)?)
}

/// Rows of commands at a place between rows, nothing before the first.
fn delayed(commands: &[f64], place: f64) -> [f64; 3] {
    let row = place.floor();
    let share = place - row;
    let value = |row: f64, joint: usize| {
        if row < 0.0 { 0.0 } else { commands.get(3 * row as usize + joint).copied().unwrap_or_default() }
    };
    std::array::from_fn(|joint| (1.0 - share) * value(row, joint) + share * value(row + 1.0, joint))
}

/// RMS of a difference over the RMS of `ours` about its mean, the largest of the joints.
fn share(ours: &[f64], theirs: &[f64], joints: usize) -> f64 {
    let of_joint = |joint: usize| {
        let own = || ours.iter().skip(joint).step_by(joints);
        let count = own().count().max(1) as f64;
        let mean = own().sum::<f64>() / count;
        let spread: f64 = own().map(|value| (value - mean).powi(2)).sum();
        let pairs = own().zip(theirs.iter().skip(joint).step_by(joints));
        (pairs.map(|(ours, theirs)| (ours - theirs).powi(2)).sum::<f64>() / spread).sqrt()
    };
    if ours.len() == theirs.len() { (0..joints).map(of_joint).fold(0.0, f64::max) } else { f64::INFINITY }
}
