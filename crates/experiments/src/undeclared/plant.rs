//! The plant: rigid body, declared friction and the secrets, and what an ideal logger would write down.

use super::friction::{Sign, interpolate};
use super::secret::{Form, Secret};
use super::trajectory::Trajectory;
use phiw_dynamics::{Tree, Workspace};

/// The effects that the physics has on every joint and that are declared to the tracer.
#[derive(Clone, Debug)]
pub struct Ordinary {
    /// Viscous friction \[N·m·s/rad\].
    pub viscous: Vec<f64>,
    /// Coulomb friction \[N·m\].
    pub coulomb: Vec<f64>,
    /// Rotor inertia \[kg·m²\].
    pub rotor: Vec<f64>,
    /// Constant offset \[N·m\].
    pub offset: Vec<f64>,
    /// Speed over which the sign is smoothed \[rad/s\].
    pub width: f64,
    /// How it is smoothed.
    pub smoothing: Sign,
}

impl Ordinary {
    /// The smoothed sign of a speed.
    pub fn sign(&self, speed: f64) -> f64 {
        self.smoothing.of(speed, self.width)
    }

    fn torque(&self, joint: usize, speed: f64, acceleration: f64) -> f64 {
        self.viscous[joint] * speed
            + self.coulomb[joint] * self.sign(speed)
            + self.rotor[joint] * acceleration
            + self.offset[joint]
    }
}

/// Positions, speeds and accelerations of all joints, sample by sample.
#[derive(Clone, Debug)]
pub struct States {
    joints: usize,
    /// `[q, v, a]`, each samples × joints.
    values: [Vec<f64>; 3],
}

impl States {
    /// The motion at the given session times.
    pub fn of_motion(motion: &Trajectory, times: &[f64]) -> Self {
        let joints = motion.joints.len();
        let mut values = [0; 3].map(|_| Vec::with_capacity(times.len() * joints));
        for &time in times {
            for joint in 0..joints {
                for (values, value) in values.iter_mut().zip(motion.state(joint, time)) {
                    values.push(value);
                }
            }
        }
        States { joints, values }
    }

    /// Position of a joint.
    pub fn q(&self, sample: usize, joint: usize) -> f64 {
        self.values[0][sample * self.joints + joint]
    }
    /// Speed of a joint.
    pub fn v(&self, sample: usize, joint: usize) -> f64 {
        self.values[1][sample * self.joints + joint]
    }
    /// Acceleration of a joint.
    pub fn a(&self, sample: usize, joint: usize) -> f64 {
        self.values[2][sample * self.joints + joint]
    }
    /// Replaces the state of a joint.
    pub fn set(&mut self, sample: usize, joint: usize, state: [f64; 3]) {
        for (values, value) in self.values.iter_mut().zip(state) {
            values[sample * self.joints + joint] = value;
        }
    }
    /// Positions, speeds and accelerations of all joints at one sample.
    pub fn at(&self, sample: usize) -> [&[f64]; 3] {
        [0, 1, 2].map(|part| &self.values[part][sample * self.joints..][..self.joints])
    }
    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.values[0].len() / self.joints
    }
}

/// What is known at some times of one motion when the torques of secrets are computed.
pub struct Scene<'a> {
    /// The robot as declared.
    pub tree: &'a Tree,
    /// Declared friction.
    pub ordinary: &'a Ordinary,
    /// The motion of the links.
    pub motion: &'a Trajectory,
    /// Session times \[s\].
    pub times: &'a [f64],
    /// States of the links.
    pub link: States,
    /// States of the motors, which the encoders see: apart from the links only behind an elastic
    /// transmission.
    pub motor: States,
    /// Torque of the rigid body, samples × joints.
    rigid: Vec<f64>,
}

impl Scene<'_> {
    /// Torque of the rigid body.
    pub fn rigid(&self, sample: usize, joint: usize) -> f64 {
        self.rigid[sample * self.tree.joint_count() + joint]
    }
}

/// What a perfect logger would write: samples × joints.
#[derive(Clone, Debug)]
pub struct Record {
    /// Session times \[s\].
    pub times: Vec<f64>,
    /// States as logged.
    pub states: States,
    /// Torque as logged.
    pub torque: Vec<f64>,
    /// What the declared model with true parameters gives for the states as logged.
    pub ideal: Vec<f64>,
}

impl Record {
    /// What the secrets did to the torque of a joint.
    pub fn effect(&self, joint: usize) -> impl Iterator<Item = f64> {
        let joints = self.states.joints;
        (0..self.times.len())
            .map(move |sample| self.torque[sample * joints + joint] - self.ideal[sample * joints + joint])
    }
}

/// Torque of the rigid body for all samples.
pub fn rigid_torque<'t>(states: &States, tree_at: impl Fn(usize) -> &'t Tree) -> Vec<f64> {
    let joints = states.joints;
    let mut torque = vec![0.0; states.samples() * joints];
    let mut workspace = Workspace::new(tree_at(0));
    for (sample, torque) in torque.chunks_exact_mut(joints).enumerate() {
        let [q, v, a] = states.at(sample);
        let solved = tree_at(sample).inverse_dynamics(q, v, a, &mut workspace, torque);
        debug_assert!(solved.is_ok(), "the sizes come from the tree itself");
    }
    torque
}

/// Runs the plant along a motion and notes what a perfect logger would see at the given session times.
pub fn record(
    tree: &Tree,
    ordinary: &Ordinary,
    secrets: &[&Secret],
    motion: &Trajectory,
    times: &[f64],
) -> Record {
    let joints = tree.joint_count();
    let (mut states, mut torque) = true_torque(tree, ordinary, secrets, motion, times);
    // The sensor is late first, then wrong.
    for secret in secrets.iter().filter(|secret| matches!(secret.form, Form::Delay | Form::ClockDrift)) {
        let late = |time: f64| match secret.form {
            Form::ClockDrift => secret.scale * (time - motion.start),
            _ => secret.scale,
        };
        let earlier: Vec<f64> = times.iter().map(|&time| time - late(time)).collect();
        let (_, delayed) = true_torque(tree, ordinary, secrets, motion, &earlier);
        for sample in 0..times.len() {
            for &joint in &secret.joints {
                torque[sample * joints + joint] = delayed[sample * joints + joint];
            }
        }
    }
    for secret in secrets {
        match &secret.form {
            Form::Distortion(distortion) => {
                for (sample, row) in torque.chunks_exact_mut(joints).enumerate() {
                    for &joint in &secret.joints {
                        row[joint] += secret.scale * distortion.added(&states, sample, joint, row);
                    }
                }
            }
            Form::Gain => over(&mut torque, joints, &secret.joints, |torque| torque * (1.0 + secret.scale)),
            Form::DeadBand => {
                over(&mut torque, joints, &secret.joints, |torque| {
                    if torque.abs() < secret.scale { 0.0 } else { torque }
                });
            }
            _ => {}
        }
    }
    if let Some(excess) = &motion.excess {
        for (sample, time) in times.iter().enumerate() {
            let place = (time - motion.start) / excess.step;
            torque[sample * joints + excess.joint] += interpolate(&excess.torque, place);
        }
    }
    for secret in secrets.iter().filter(|secret| matches!(secret.form, Form::EncoderOffset)) {
        for sample in 0..times.len() {
            for &joint in &secret.joints {
                let [q, v, a] = states.at(sample).map(|all| all[joint]);
                states.set(sample, joint, [q - secret.scale, v, a]);
            }
        }
    }
    let mut ideal = rigid_torque(&states, |_| tree);
    add_ordinary(&mut ideal, ordinary, &states);
    Record { times: times.to_vec(), states, torque, ideal }
}

fn over(torque: &mut [f64], joints: usize, which: &[usize], change: impl Fn(f64) -> f64) {
    for row in torque.chunks_exact_mut(joints) {
        for &joint in which {
            row[joint] = change(row[joint]);
        }
    }
}

fn add_ordinary(torque: &mut [f64], ordinary: &Ordinary, states: &States) {
    for (sample, row) in torque.chunks_exact_mut(states.joints).enumerate() {
        for (joint, torque) in row.iter_mut().enumerate() {
            *torque += ordinary.torque(joint, states.v(sample, joint), states.a(sample, joint));
        }
    }
}

/// States at the motors and torques that the motors deliver, at the given times.
fn true_torque(
    tree: &Tree,
    ordinary: &Ordinary,
    secrets: &[&Secret],
    motion: &Trajectory,
    times: &[f64],
) -> (States, Vec<f64>) {
    let link = States::of_motion(motion, times);
    let loads = super::load::Loads::new(tree, secrets);
    let rigid = rigid_torque(&link, |sample| loads.tree_at(times[sample]));
    let mut motor = link.clone();
    for secret in secrets.iter().filter(|secret| matches!(secret.form, Form::Elasticity)) {
        for &joint in &secret.joints {
            super::elasticity::deflect(&mut motor, &loads, motion, times, joint, secret.scale);
        }
    }
    let mut torque = rigid.clone();
    add_ordinary(&mut torque, ordinary, &motor);
    let scene = Scene { tree, ordinary, motion, times, link, motor, rigid };
    for secret in secrets {
        secret.add_torque(&scene, &mut torque);
    }
    (scene.motor, torque)
}
