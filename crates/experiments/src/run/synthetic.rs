//! Logs of a robot with gears that follows Fourier motions, row by row.

use anyhow::Context;
use phiw_dynamics::{JointType, Tree, Workspace};
use phiw_telemetry::{LogColumns, LogWriter};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;
use std::path::Path;

/// Sines of a joint's motion.
const HARMONICS: usize = 5;
/// Frequency of the first \[Hz\]; the others are near its multiples.
const FREQUENCY: f64 = 0.1;
/// Share of the joint's range and of its speed limit that the motion uses.
const USED: f64 = 0.8;
/// Frictions at full speed and rotor inertia, over the joint's torque limit (and its speed limit where they
/// need one).
const VISCOUS: f64 = 0.08;
const COULOMB: f64 = 0.06;
const ROTOR: f64 = 0.01;
/// Torque noise over the torque limit, and noise of a position \[rad, m\].
const TORQUE_NOISE: f64 = 0.004;
const POSITION_NOISE: f64 = 2e-5;
/// Speed within which Coulomb friction turns round, over the speed limit.
const REVERSAL: f64 = 0.005;
/// Limits of a joint whose URDF names none \[rad or m; rad/s or m/s; N·m or N\].
const UNLIMITED: [f64; 3] = [2.0, 2.0, 50.0];

/// Friction of a motor that two joints share, over the smaller of their torque limits.
const SHARED: f64 = 0.06;

/// A robot with viscous and Coulomb friction and rotor inertia on every joint.
pub struct Plant {
    tree: Tree,
    joints: Vec<Joint>,
    /// Two joints whose motors turn with the sum of their speeds, which nobody declares.
    shared: Option<[usize; 2]>,
}

/// What the motion and the gear of a joint go by.
#[derive(Clone, Copy)]
struct Joint {
    center: f64,
    /// Half of the range.
    reach: f64,
    speed: f64,
    effort: f64,
}

/// Amplitude, angular frequency, phase.
type Sines = [[f64; 3]; HARMONICS];

impl Plant {
    /// A robot whose gears go by its limits.
    pub fn new(tree: Tree) -> Self {
        let joints = (0..tree.joint_count()).map(|joint| Joint::of(&tree, joint)).collect();
        Plant { tree, joints, shared: None }
    }

    /// The same with a differential behind two joints.
    pub fn with_shared_motor(mut self, joints: [usize; 2]) -> Self {
        self.shared = Some(joints);
        self
    }

    /// Writes a log of `rows` rows at `rate` Hz in constant memory; `progress` is told the rows done now and
    /// then.
    pub fn write_log(
        &self,
        path: &Path,
        seed: u64,
        rows: u64,
        rate: f64,
        progress: &mut dyn FnMut(u64),
    ) -> anyhow::Result<()> {
        let names: Vec<String> = self.tree.joint_names().map(str::to_owned).collect();
        let columns = LogColumns { torque: true, ..LogColumns::default() };
        let mut writer = LogWriter::create(path, &names, columns)?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let sines: Vec<Sines> = self.joints.iter().map(|joint| joint.motion(&mut rng)).collect();
        let count = self.joints.len();
        let mut workspace = Workspace::new(&self.tree);
        let [mut q, mut v, mut a, mut tau] = [(); 4].map(|()| vec![0.0; count]);
        let mut noise = || -> f64 { StandardNormal.sample(&mut rng) };
        for row in 0..rows {
            let t = row as f64 / rate;
            for (joint, sines) in sines.iter().enumerate() {
                (q[joint], v[joint], a[joint]) = (self.joints[joint].center, 0.0, 0.0);
                for [amplitude, omega, phase] in sines {
                    let (sine, cosine) = (omega * t + phase).sin_cos();
                    q[joint] += amplitude * sine;
                    v[joint] += amplitude * omega * cosine;
                    a[joint] -= amplitude * omega * omega * sine;
                }
            }
            self.tree.inverse_dynamics(&q, &v, &a, &mut workspace, &mut tau)?;
            if let Some([first, second]) = self.shared {
                let gear = |joint: usize| (self.joints[joint].effort, self.joints[joint].speed);
                let ((effort, speed), (other_effort, other_speed)) = (gear(first), gear(second));
                let (effort, speed) = (effort.min(other_effort), speed.min(other_speed));
                let sum = v[first] + v[second];
                let torque = SHARED * effort * (sum / speed + (sum / (REVERSAL * speed)).tanh());
                tau[first] += torque;
                tau[second] += torque;
            }
            for (index, joint) in self.joints.iter().enumerate() {
                tau[index] += joint.gear(v[index], a[index]) + TORQUE_NOISE * joint.effort * noise();
                q[index] += POSITION_NOISE * noise();
            }
            writer.write(t, &[&q, &tau]).with_context(|| format!("cannot write {}", path.display()))?;
            if row % 10_000 == 0 {
                progress(row);
            }
        }
        writer.finish().with_context(|| format!("cannot write {}", path.display()))?;
        Ok(())
    }
}

impl Joint {
    fn of(tree: &Tree, joint: usize) -> Self {
        let body = tree.joint(joint);
        let [range, speed, effort] = UNLIMITED;
        let range = if body.joint_type == JointType::Prismatic { 0.25 * range } else { range };
        let (lower, upper) = (body.limits.lower.max(-range), body.limits.upper.min(range));
        let limit = |limit: f64, absent: f64| if limit.is_finite() && limit > 0.0 { limit } else { absent };
        Joint {
            center: 0.5 * (lower + upper),
            reach: 0.5 * (upper - lower),
            speed: limit(body.limits.velocity, speed).min(2.0 * speed),
            effort: limit(body.limits.effort, effort),
        }
    }

    /// A random motion that uses the range, or the speed, as far as it may.
    fn motion(&self, rng: &mut ChaCha8Rng) -> Sines {
        let mut sines: Sines = std::array::from_fn(|harmonic| {
            let frequency = FREQUENCY * ((harmonic + 1) as f64 + rng.random_range(-0.3..0.3));
            [rng.random_range(0.3..1.0) / (harmonic + 1) as f64, TAU * frequency, rng.random_range(0.0..TAU)]
        });
        let way: f64 = sines.iter().map(|[amplitude, ..]| amplitude).sum();
        let speed: f64 = sines.iter().map(|[amplitude, omega, _]| amplitude * omega).sum();
        let scale = USED * (self.reach / way).min(self.speed / speed);
        sines.iter_mut().for_each(|[amplitude, ..]| *amplitude *= scale);
        sines
    }

    /// Torque of friction and rotor.
    fn gear(&self, v: f64, a: f64) -> f64 {
        let friction = VISCOUS * v / self.speed + COULOMB * (v / (REVERSAL * self.speed)).tanh();
        self.effort * (friction + ROTOR * a / self.speed)
    }
}
