//! A robot whose truth is known, and logs of it.

use phiw_dynamics::random_tree::RandomNumbers;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{Tree, Workspace};
use phiw_telemetry::Recording;
use std::f64::consts::TAU;

/// The robot: the arm of the PUMA 560, its wrist held.
const URDF: &str = include_str!("../../../../models/puma560.urdf");
const HELD: [&str; 3] = ["joint_4", "joint_5", "joint_6"];
const JOINTS: usize = 3;
/// Rows a second, and seconds of a log.
const RATE: f64 = 100.0;
const SECONDS: f64 = 40.0;
/// Sines of a joint's motion, and the frequency of the first \[Hz\].
const HARMONICS: usize = 5;
const FREQUENCY: f64 = 0.1;
/// Torque noise over the RMS of the joint's torque.
const NOISE: f64 = 0.03;
/// Correlation of coloured noise from one row to the next: 0.1 s.
const CORRELATION: f64 = 0.9;
/// Steps of a coarse encoder in a turn.
const STEPS: f64 = 16_384.0;
/// Speed over which friction turns where its sign is smooth \[rad/s\].
const WIDTH: f64 = 0.03;

/// What is imperfect about the logs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Situation {
    /// White noise of the torque.
    White,
    /// Noise that is correlated over a tenth of a second.
    Coloured,
    /// White noise, and positions in steps.
    Quantised,
    /// White noise, and friction that turns smoothly.
    SmoothSign,
}

impl Situation {
    /// All, in the order of the table.
    pub const ALL: [Situation; 4] =
        [Situation::White, Situation::Coloured, Situation::Quantised, Situation::SmoothSign];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Situation::White => "white noise",
            Situation::Coloured => "AR(1), 0.1 s",
            Situation::Quantised => "quantised encoder",
            Situation::SmoothSign => "smooth sign",
        }
    }
}

/// The truth of one robot.
pub struct Truth {
    /// Its bodies.
    pub tree: Tree,
    /// Viscous friction \[N·m·s/rad, N·s/m\], Coulomb friction and offset \[N·m, N\] of each joint.
    pub friction: Vec<[f64; 3]>,
    width: f64,
    noise: Vec<f64>,
    sines: Vec<[[f64; 3]; HARMONICS]>,
    situation: Situation,
}

impl Truth {
    /// The robot with friction, noise and a motion from a seed.
    ///
    /// # Errors
    /// None is known: the robot can be read.
    pub fn new(seed: u64, situation: Situation) -> anyhow::Result<Self> {
        let held = HELD.iter().map(|joint| ((*joint).to_owned(), 0.0)).collect();
        let tree = read_urdf(URDF, &UrdfOptions { held, ..UrdfOptions::default() })?.tree;
        let mut random = RandomNumbers::new(seed ^ 0x5eed);
        let sines = (0..JOINTS)
            .map(|_| {
                std::array::from_fn(|harmonic| {
                    let frequency = FREQUENCY * (harmonic + 1) as f64 + random.uniform(0.0, 0.08);
                    [random.uniform(0.1, 0.4), TAU * frequency, random.uniform(0.0, TAU)]
                })
            })
            .collect();
        let width = if situation == Situation::SmoothSign { WIDTH } else { 0.0 };
        let mut truth = Truth {
            tree,
            friction: vec![[0.0; 3]; JOINTS],
            width,
            noise: vec![0.0; JOINTS],
            sines,
            situation,
        };
        let torque = truth.clean(1.0)?.tau;
        for joint in 0..JOINTS {
            let own = torque.iter().skip(joint).step_by(JOINTS);
            let rms = (own.map(|torque| torque * torque).sum::<f64>() / (RATE * SECONDS)).sqrt();
            let share = |random: &mut RandomNumbers| rms * random.uniform(0.1, 0.4);
            truth.friction[joint] = [share(&mut random), share(&mut random), share(&mut random) - 0.25 * rms];
            truth.noise[joint] = NOISE * rms;
        }
        Ok(truth)
    }

    /// A log of the motion, `speed` times as fast; `noise` numbers the noise.
    ///
    /// # Errors
    /// As [`Truth::new`].
    pub fn log(&self, speed: f64, noise: u64) -> anyhow::Result<Recording> {
        let mut random = RandomNumbers::new(noise);
        let mut log = self.clean(speed)?;
        let mut coloured = [0.0; JOINTS];
        for (place, torque) in log.tau.iter_mut().enumerate() {
            let joint = place % JOINTS;
            let white = gauss(&mut random);
            coloured[joint] = match self.situation {
                Situation::Coloured => {
                    CORRELATION * coloured[joint] + (1.0 - CORRELATION * CORRELATION).sqrt() * white
                }
                _ => white,
            };
            *torque += self.noise[joint] * coloured[joint];
        }
        if self.situation == Situation::Quantised {
            let step = TAU / STEPS;
            log.q.iter_mut().for_each(|q| *q = (*q / step).round() * step);
        }
        Ok(log)
    }

    fn clean(&self, speed: f64) -> anyhow::Result<Recording> {
        let joints = self.tree.joint_names().map(str::to_owned).collect();
        let mut log = Recording { joints, ..Recording::default() };
        let (mut workspace, mut torque) = (Workspace::new(&self.tree), vec![0.0; JOINTS]);
        for row in 0..(SECONDS * RATE) as usize {
            let t = row as f64 / RATE;
            let sum = |term: &dyn Fn([f64; 3]) -> f64| -> Vec<f64> {
                self.sines.iter().map(|sines| sines.iter().map(|sine| term(*sine)).sum()).collect()
            };
            let q = sum(&|[a, w, p]| a * (speed * w * t + p).sin());
            let v = sum(&|[a, w, p]| a * speed * w * (speed * w * t + p).cos());
            let a = sum(&|[a, w, p]| -a * (speed * w).powi(2) * (speed * w * t + p).sin());
            self.tree.inverse_dynamics(&q, &v, &a, &mut workspace, &mut torque)?;
            for (joint, [viscous, coulomb, offset]) in self.friction.iter().enumerate() {
                let sign = if self.width > 0.0 { (v[joint] / self.width).tanh() } else { v[joint].signum() };
                torque[joint] += viscous * v[joint] + coulomb * sign + offset;
            }
            log.t.push(t);
            log.q.extend(q);
            log.tau.extend_from_slice(&torque);
        }
        Ok(log)
    }
}

/// A standard normal number (Box & Muller 1958).
fn gauss(random: &mut RandomNumbers) -> f64 {
    let radius = (-2.0 * random.uniform(f64::MIN_POSITIVE, 1.0).ln()).sqrt();
    radius * (TAU * random.uniform(0.0, 1.0)).cos()
}
