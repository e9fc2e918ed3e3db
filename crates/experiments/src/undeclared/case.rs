//! One case: a robot, its motions, its secrets and its sensors, all from one seed.

use super::draw::{Survey, catalogue, outside, renewed};
use super::friction::{Friction, Sign};
use super::kind::{Kind, Name};
use super::plant::{Ordinary, Record, States, record, rigid_torque};
use super::rng::{CaseRng, Stream};
use super::robot::Robot;
use super::secret::{Form, Secret};
use super::sensors::Sensors;
use super::suite::{NewForm, Spec, Suite};
use super::trajectory::{JointMotion, Reach, Trajectory};
use super::visibility::Absorber;

/// Length of a log \[s\].
pub const DURATION: f64 = 20.0;
/// When the logs of a session start \[s\].
pub const STARTS: [f64; 3] = [0.0, 25.0, 50.0];
/// What the stamps of a session count from long before it \[s\].
const LONG_SINCE: f64 = 20_000.0;
/// Smallest and largest size of an effect.
pub const SIZES: [f64; 2] = [0.05, 0.3];
/// Factors of a torque in [`Suite::LargeGains`], and as often one over them.
const LARGE_FACTORS: [f64; 2] = [1.6, 3.0];
/// How much of an effect the declared model must leave over, in units of the torque noise.
pub const VISIBLE: f64 = 0.5;
/// The same for what the tracer must not call explained.
pub const VISIBLE_OUTSIDE: f64 = 1.0;
/// Rate at which sizes are measured \[Hz\].
pub const SIZE_RATE: f64 = 100.0;
/// Friction is drawn in proportion to the rigid body's torque, or to this share of the joint's limit if that
/// is more: a wrist has next to no load and yet its gears.
const LEAST_LEVEL: f64 = 0.04;
/// Attempts at a case on one robot before the next robot is tried.
const ATTEMPTS_PER_ROBOT: u64 = 8;

/// A drawn case.
pub struct Case<'a> {
    /// What it is about.
    pub spec: Spec,
    /// The robot.
    pub robot: &'a Robot,
    /// How many draws were thrown away because an effect could not be seen or not be made as large as asked.
    pub rejected: u64,
    /// Declared friction.
    pub ordinary: Ordinary,
    /// Effects that are declared to the tracer.
    pub declared: Vec<Kind>,
    /// What is not.
    pub secrets: Vec<Drawn>,
    /// Motions of the two training logs and the validation log.
    pub motions: Vec<Trajectory>,
    /// Motions of the logs of the clean robot, where a model is held.
    pub clean_motions: Vec<Trajectory>,
    /// The sensors.
    pub sensors: Sensors,
    /// Effects of the wide suites' plants that are declared, in forms of their own.
    pub plant: Vec<Secret>,
    /// Joints that never move, and where they stand: the tracer is told to hold them.
    pub still: Vec<(usize, f64)>,
    /// The attempt that it was drawn in.
    pub attempt: u64,
}

/// A secret and what was measured of it when it was drawn.
pub struct Drawn {
    /// The secret.
    pub secret: Secret,
    /// RMS of its torque over that of the joint without it, for the joint that feels it most.
    pub size: f64,
    /// RMS of what the declared model cannot absorb, in units of the noise, where most of it is left.
    pub visible: f64,
    /// Joints where it is large and certain enough that it has to be named; all of its joints, but in the
    /// wide suites.
    pub material: Vec<usize>,
}

impl<'a> Case<'a> {
    /// Draws the case of a spec. `None` if no robot can have it, which no spec of the suites is known to
    /// bring about.
    pub fn draw(spec: &Spec, robots: &'a [Robot]) -> Option<Self> {
        let attempts = ATTEMPTS_PER_ROBOT * 2 * robots.len() as u64;
        (0..attempts).find_map(|attempt| {
            let robot = &robots[(spec.robot + (attempt / ATTEMPTS_PER_ROBOT) as usize) % robots.len()];
            match spec.situation {
                Some(situation) => super::wide::draw(spec, situation, robot, attempt),
                None => Self::attempt(spec, robot, attempt),
            }
        })
    }

    fn attempt(spec: &Spec, robot: &'a Robot, attempt: u64) -> Option<Self> {
        let rng = |stream| CaseRng::new(spec.seed, attempt, stream);
        let (mut secret_rng, mut plant_rng, mut motion_rng) =
            (rng(Stream::Secret), rng(Stream::Plant), rng(Stream::Motion));
        let joints = choose_joints(spec, robot, &mut secret_rng)?;
        let reach =
            spec.secrets.iter().zip(&joints).find(|(name, _)| **name == Name::Catalogue(Kind::EndStop));
        let reach = reach.map(|(_, &joint)| Reach { joint, upper: secret_rng.chance(0.5) });
        // Bristles hold a force at rest, and springs ring after a jerk: for them the robot keeps moving.
        let restless = spec.has(Kind::CoulombFriction)
            || spec.has(Kind::StribeckFriction)
            || spec.has(Kind::JointElasticity)
            || spec.has(Kind::ActuatorSaturation);
        let motions = draw_motions(robot, reach, restless, &mut motion_rng);
        let clean_motions =
            if spec.held { draw_motions(robot, None, restless, &mut motion_rng) } else { Vec::new() };
        let (ordinary, declared) = draw_ordinary(spec, robot, &motions, &mut plant_rng);

        let times: Vec<Vec<f64>> = motions.iter().map(|motion| even_times(motion, SIZE_RATE)).collect();
        let survey = survey(robot, &ordinary, &motions, &times, reach);
        let sensors = Sensors::draw(&robot.tree, &survey.torque, &mut plant_rng);
        let mut case = Case {
            spec: spec.clone(),
            robot,
            rejected: attempt,
            ordinary,
            declared,
            secrets: Vec::new(),
            motions,
            clean_motions,
            sensors,
            plant: Vec::new(),
            still: Vec::new(),
            attempt,
        };
        for (&name, &joint) in spec.secrets.iter().zip(&joints) {
            let drawn = case.draw_secret(name, joint, &survey, &times, &mut secret_rng)?;
            case.secrets.push(drawn);
        }
        Some(case)
    }

    fn draw_secret(
        &mut self,
        name: Name,
        joint: usize,
        survey: &Survey,
        times: &[Vec<f64>],
        rng: &mut CaseRng,
    ) -> Option<Drawn> {
        let (mut joints, form, scale) = match name {
            Name::Catalogue(kind) => catalogue(kind, joint, survey, rng)?,
            Name::Outside(stranger) => outside(stranger, joint, survey, rng)?,
        };
        let new_form = self.spec.new_form().filter(|_| self.secrets.is_empty());
        let form = match new_form {
            Some(new) => renewed(form, new, rng)?,
            None => form,
        };
        // A coupling may drive; a spring does not push away.
        let scale: f64 = if new_form == Some(NewForm::OverTwoJoints) { scale.abs() } else { scale };
        joints.sort_unstable();
        let wanted = rng.log_uniform(SIZES[0], SIZES[1]);
        let mut secret = Secret { name, joints, form, scale };
        let (tree, ordinary) = (&self.robot.tree, &self.ordinary);
        let is_large_gain = self.spec.suite == Suite::LargeGains && name == Name::Catalogue(Kind::TorqueGain);
        let size = match secret.form {
            _ if is_large_gain => {
                let factor = rng.log_uniform(LARGE_FACTORS[0], LARGE_FACTORS[1]);
                secret.scale = if rng.chance(0.5) { factor } else { 1.0 / factor } - 1.0;
                secret.size(tree, ordinary, &self.motions, times)
            }
            Form::Saturation => {
                super::saturation::install(&mut secret, wanted, tree, ordinary, &mut self.motions, rng)?
            }
            _ => secret.calibrate(wanted, tree, ordinary, &self.motions, times),
        };
        if !is_large_gain && !(0.98 * SIZES[0]..=1.02 * SIZES[1]).contains(&size) {
            return None;
        }
        let noise = &self.sensors.torque_noise;
        let coarse_rate = if survey.speed.len() > 10 { 6.0 } else { 20.0 };
        let records: Vec<Record> = self.motions[..2]
            .iter()
            .map(|motion| record(tree, ordinary, &[&secret], motion, &even_times(motion, coarse_rate)))
            .collect();
        let mut absorber = if self.spec.held {
            Absorber::held(survey, noise)
        } else {
            Absorber::new(tree, ordinary, &self.declared, &records, noise)
        };
        if let Name::Catalogue(kind) = name {
            absorber.add_simpler(kind, joint, &records);
            if kind == Kind::DriveEfficiency {
                absorber.add(self.of_load(joint, coarse_rate));
            }
        }
        let visible = absorber.visible(&records);
        let enough = if matches!(name, Name::Outside(_)) { VISIBLE_OUTSIDE } else { VISIBLE };
        (visible >= enough && felt_in_every_log(&secret, tree, ordinary, &self.motions, times))
            .then(|| Drawn { material: secret.joints.clone(), secret, size, visible })
    }

    /// What friction of a joint's load adds along the training motions: samples × joints.
    fn of_load(&self, joint: usize, rate: f64) -> Vec<f64> {
        let name = Name::Catalogue(Kind::LoadDependentFriction);
        let form = Form::Friction(Friction::LoadDependent);
        let secret = Secret { name, joints: vec![joint], form, scale: 1.0 };
        let one = |motion: &Trajectory| {
            let times = even_times(motion, rate);
            let record = record(&self.robot.tree, &self.ordinary, &[&secret], motion, &times);
            let added = record.torque.iter().zip(&record.ideal).map(|(torque, ideal)| torque - ideal);
            added.collect::<Vec<f64>>()
        };
        self.motions[..2].iter().flat_map(one).collect()
    }

    /// The same case with nothing undeclared: same robot, motions, sensors and noise.
    pub fn without_secrets(&self) -> Self {
        let mut motions = self.motions.clone();
        for motion in &mut motions {
            motion.excess = None;
        }
        Case {
            spec: self.spec.clone(),
            secrets: Vec::new(),
            ordinary: self.ordinary.clone(),
            declared: self.declared.clone(),
            clean_motions: self.clean_motions.clone(),
            sensors: self.sensors.clone(),
            plant: self.plant.clone(),
            still: self.still.clone(),
            motions,
            ..*self
        }
    }

    /// Names and texts of the logs: training, validation, and those of the clean robot where a model is held.
    pub fn logs(&self) -> Vec<(&'static str, String)> {
        let mut rng = CaseRng::new(self.spec.seed, self.attempt, Stream::Sensors);
        let plant: Vec<&Secret> = self.plant.iter().collect();
        let secrets: Vec<&Secret> =
            self.plant.iter().chain(self.secrets.iter().map(|drawn| &drawn.secret)).collect();
        let mut log = |motion: &Trajectory, secrets: &[&Secret]| {
            let [times, mut stamps] = self.sensors.times(motion.start, motion.duration, &mut rng);
            let since = match self.spec.new_form() {
                Some(NewForm::ColdAgain) => -motion.start,
                Some(NewForm::LongSince) => LONG_SINCE,
                _ => 0.0,
            };
            stamps.iter_mut().for_each(|stamp| *stamp += since);
            let record = record(&self.robot.tree, &self.ordinary, secrets, motion, &times);
            match &self.sensors.logging {
                Some(logging) => {
                    logging.log(&self.sensors, &self.robot.tree, motion, &record, &stamps, &mut rng)
                }
                None => self.sensors.log(&self.robot.tree, &record, &stamps, &mut rng),
            }
        };
        let mut logs = Vec::new();
        for (name, motion) in ["train_a", "train_b", "validate"].into_iter().zip(&self.motions) {
            logs.push((name, log(motion, &secrets)));
        }
        for (name, motion) in ["clean_a", "clean_b", "clean_c"].into_iter().zip(&self.clean_motions) {
            logs.push((name, log(motion, &plant)));
        }
        logs
    }
}

/// Times of an even grid over a motion.
pub fn even_times(motion: &Trajectory, rate: f64) -> Vec<f64> {
    (0..(motion.duration * rate) as usize).map(|k| motion.start + k as f64 / rate).collect()
}

fn choose_joints(spec: &Spec, robot: &Robot, rng: &mut CaseRng) -> Option<Vec<usize>> {
    let mut joints: Vec<usize> = Vec::new();
    for _ in &spec.secrets {
        let free: Vec<usize> = (0..robot.joints()).filter(|joint| !joints.contains(joint)).collect();
        let joint = match joints.last() {
            Some(&joint) if spec.together => joint,
            _ if free.is_empty() => return None,
            _ => rng.pick(&free),
        };
        joints.push(joint);
    }
    Some(joints)
}

/// Two training motions and the one that is held out, of periodic excitation, but for at most one from point
/// to point.
pub fn draw_motions(
    robot: &Robot,
    reach: Option<Reach>,
    restless: bool,
    rng: &mut CaseRng,
) -> Vec<Trajectory> {
    // At most one of the three is made of moves from point to point.
    let resting = if restless || rng.chance(0.55) { None } else { Some(rng.index(STARTS.len())) };
    let draw = |(number, start): (usize, f64)| {
        let draw = if resting == Some(number) { Trajectory::point_to_point } else { Trajectory::fourier };
        tamed(robot, draw(&robot.tree, rng, start, DURATION, reach), reach)
    };
    STARTS.into_iter().enumerate().map(draw).collect()
}

/// The motion, made so small that the joints can deliver it; one that has to come near a limit is left as it
/// is.
pub fn tamed(robot: &Robot, mut motion: Trajectory, reach: Option<Reach>) -> Trajectory {
    for _ in 0..12 {
        if peak_effort(robot, &motion) < 0.8 || reach.is_some() {
            break;
        }
        motion.shrink(0.85);
    }
    motion
}

/// Largest torque of the rigid body over the joint's limit.
fn peak_effort(robot: &Robot, motion: &Trajectory) -> f64 {
    let states = States::of_motion(motion, &even_times(motion, 25.0));
    let torque = rigid_torque(&states, |_| &robot.tree);
    let share = |(index, torque): (usize, &f64)| {
        torque.abs() / robot.tree.joint(index % robot.joints()).limits.effort
    };
    torque.iter().enumerate().map(share).fold(0.0, f64::max)
}

/// Friction and rotors in proportion to what the rigid body needs; what the secret is, only the secret's
/// joints have.
pub fn draw_ordinary(
    spec: &Spec,
    robot: &Robot,
    motions: &[Trajectory],
    rng: &mut CaseRng,
) -> (Ordinary, Vec<Kind>) {
    let joints = robot.joints();
    let mut squares = vec![[0.0; 3]; joints];
    let mut samples = 0.0;
    for motion in motions {
        let states = States::of_motion(motion, &even_times(motion, 25.0));
        let torque = rigid_torque(&states, |_| &robot.tree);
        samples += states.samples() as f64;
        for sample in 0..states.samples() {
            for (joint, squares) in squares.iter_mut().enumerate() {
                squares[0] += torque[sample * joints + joint].powi(2);
                squares[1] += states.v(sample, joint).powi(2);
                squares[2] += states.a(sample, joint).powi(2);
            }
        }
    }
    let rms: Vec<[f64; 3]> =
        squares.iter().map(|squares| squares.map(|square| (square / samples).sqrt())).collect();
    let level = |joint: usize| rms[joint][0].max(LEAST_LEVEL * robot.tree.joint(joint).limits.effort);
    let viscous = (0..joints).map(|joint| rng.uniform(0.05, 0.2) * level(joint) / rms[joint][1]).collect();
    let coulomb = (0..joints).map(|joint| rng.uniform(0.05, 0.25) * level(joint)).collect();
    let rotor = (0..joints).map(|joint| rng.uniform(0.03, 0.15) * level(joint) / rms[joint][2]).collect();
    let offset = (0..joints).map(|joint| rng.uniform(-0.08, 0.08) * level(joint)).collect();
    let width = rng.log_uniform(0.002, 0.05);
    let smoothing = if rng.chance(0.5) { Sign::Tanh } else { Sign::Algebraic };
    let mut ordinary = Ordinary { viscous, coulomb, rotor, offset, width, smoothing };
    let mut declared = Vec::new();
    let (with_rotor, with_offset) = (rng.chance(0.75), rng.chance(0.15));
    let mut settle = |kind: Kind, values: &mut Vec<f64>, wanted: bool| {
        // Against a held model the friction has grown; else only the secret's joints have any.
        if wanted && (spec.held || !spec.has(kind)) {
            declared.push(kind);
        } else {
            values.fill(0.0);
        }
    };
    settle(Kind::ViscousFriction, &mut ordinary.viscous, true);
    settle(Kind::CoulombFriction, &mut ordinary.coulomb, true);
    settle(Kind::RotorInertia, &mut ordinary.rotor, with_rotor);
    settle(Kind::TorqueOffset, &mut ordinary.offset, with_offset);
    (ordinary, declared)
}

/// What is known of the motions.
pub fn survey<'r>(
    robot: &'r Robot,
    ordinary: &Ordinary,
    motions: &[Trajectory],
    times: &[Vec<f64>],
    reach: Option<Reach>,
) -> Survey<'r> {
    let joints = robot.joints();
    let mut range = vec![[f64::NEG_INFINITY, f64::INFINITY]; joints];
    let mut arc = vec![[f64::INFINITY, f64::NEG_INFINITY]; joints];
    let mut squares = vec![[0.0; 2]; joints];
    let mut samples = 0.0;
    for (motion, times) in motions.iter().zip(times) {
        let record = record(&robot.tree, ordinary, &[], motion, times);
        samples += times.len() as f64;
        for joint in 0..joints {
            let positions = || (0..times.len()).map(|sample| record.states.q(sample, joint));
            let (lowest, highest) =
                (positions().fold(f64::INFINITY, f64::min), positions().fold(f64::NEG_INFINITY, f64::max));
            range[joint] = [range[joint][0].max(lowest), range[joint][1].min(highest)];
            arc[joint] = [arc[joint][0].min(lowest), arc[joint][1].max(highest)];
            for sample in 0..times.len() {
                squares[joint][0] += record.states.v(sample, joint).powi(2);
                squares[joint][1] += record.ideal[sample * joints + joint].powi(2);
            }
        }
    }
    for range in &mut range {
        // Logs that have no range in common: the middle of both, opened a little.
        if range[0] >= range[1] {
            let middle = 0.5 * (range[0] + range[1]);
            *range = [middle - 0.05, middle + 0.05];
        }
    }
    let rms = |part: usize| squares.iter().map(|square| (square[part] / samples).sqrt()).collect();
    let spans = motions.iter().map(|motion| [motion.start, motion.start + motion.duration]).collect();
    Survey {
        tree: &robot.tree,
        range,
        arc,
        speed: rms(0),
        torque: rms(1),
        width: ordinary.width,
        reach,
        spans,
    }
}

/// Whether each log shows the effect for a while: a stop that one of them never touches is not to be found
/// there.
pub fn felt_in_every_log(
    secret: &Secret,
    tree: &phiw_dynamics::Tree,
    ordinary: &Ordinary,
    motions: &[Trajectory],
    times: &[Vec<f64>],
) -> bool {
    if secret.name == Name::Catalogue(Kind::ThermalDrift) {
        return true; // it fades: later logs feel less of it, or nothing
    }
    motions.iter().zip(times).all(|(motion, times)| {
        let record = record(tree, ordinary, &[secret], motion, times);
        let most = |joint: usize| {
            let peak = record.effect(joint).fold(0.0, |peak: f64, effect| peak.max(effect.abs()));
            record.effect(joint).filter(|effect| effect.abs() > 0.1 * peak && peak > 0.0).count()
        };
        (0..tree.joint_count()).map(most).max().unwrap_or(0) as f64 >= 0.02 * times.len() as f64
    })
}

/// Whether a motion came out of a simulation.
pub fn is_simulated(motion: &Trajectory) -> bool {
    motion.joints.iter().any(|joint| matches!(joint, JointMotion::Simulated { .. }))
}
