//! What a logger or a drive does to a log beyond noise and quanta: colour, tails, filters, dead bands, steps,
//! a velocity that is late.

use super::plant::Record;
use super::push::Push;
use super::rng::CaseRng;
use super::sensors::{Clock, Sensors};
use super::situation::Situation;
use super::smoothing::Smoothing;
use super::trajectory::Trajectory;
use phiw_dynamics::{JointType, Tree};
use serde::Serialize;
use std::collections::BTreeSet;
use std::f64::consts::TAU;
use std::fmt::Write;

/// Share of outliers and their size, for [`Tails::Contaminated`].
const OUTLIERS: [f64; 2] = [0.02, 8.0];
/// What velocity columns are multiplied by when somebody took the wrong unit: revolutions a minute, the other
/// direction. Degrees are refused as such.
const WRONG_UNITS: [f64; 2] = [9.549_296_6, -1.0];

/// Fewest bits of the encoders whose steps hide how late a difference is.
const COARSE_BITS: i32 = 12;
/// How many times coarser the encoders of slides are where joints stick.
const COARSER_SLIDES: f64 = 100.0;

/// The shape of the noise's innovations, all of unit variance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Tails {
    /// Normal.
    Normal,
    /// Student's t with three degrees of freedom.
    Student,
    /// Normal, with outliers.
    Contaminated,
}

/// A low-pass of the drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DriveFilter {
    /// Corner frequency \[Hz\].
    pub corner: f64,
    /// Whether the filter's delay stays in the log; else it runs forwards and backwards.
    pub causal: bool,
}

/// A `qd` column.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VelocityColumn {
    /// How much later than the position it is \[s\].
    pub lag: f64,
    /// What it is multiplied by.
    pub scale: f64,
    /// Speeds below this are written as 0 \[rad/s, m/s\], joint by joint.
    pub dead_band: Vec<f64>,
    /// Standard deviation of its noise \[rad/s, m/s\], joint by joint.
    pub noise: Vec<f64>,
}

/// A `qd` column that is made of the positions as they are read.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DifferencedVelocity {
    /// Corner of the first-order low-pass over the differences \[Hz\]; none without.
    pub corner: Option<f64>,
}

impl DifferencedVelocity {
    /// The next value of the column, from its last one and a step of the position in the time that it took.
    fn next(self, last: f64, step: f64, time: f64) -> f64 {
        let share = self.corner.map_or(1.0, |corner| 1.0 - (-TAU * corner * time).exp());
        last + share * (step / time - last)
    }
}

/// Everything that the situations ask of a logger.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Logging {
    /// Shape of the torque's noise.
    pub tails: Tails,
    /// Low-pass over torque and noise.
    pub filter: Option<DriveFilter>,
    /// What smooths the torque afterwards, if anything does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smoothing: Option<Smoothing>,
    /// A velocity column; none is written without.
    pub velocity: Option<VelocityColumn>,
    /// A velocity column of the positions as they are read; none is written without.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub differenced: Option<DifferencedVelocity>,
    /// Torques below this are written as 0 \[N·m, N\], joint by joint.
    pub dead_band: Vec<f64>,
    /// Steps of the torque \[N·m, N\], joint by joint; 0 for none.
    pub torque_step: Vec<f64>,
    /// Samples for which a torque is held until it is renewed.
    #[serde(skip_serializing_if = "is_one")]
    pub held_samples: usize,
    /// Standard deviation of the zeros of each log's torques \[N·m, N\], joint by joint; empty for none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub torque_zero: Vec<f64>,
    /// Samples for which each joint's position is held until it is read anew; empty for none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub held_positions: Vec<usize>,
    /// Who pushes the robot meanwhile.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pushes: Vec<Push>,
    /// What its clock and its memory do.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rough: Option<RoughClock>,
}

/// A logger that rounds its stamps and loses rows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RoughClock {
    /// What stamps are rounded to \[s\].
    pub step: f64,
    /// Share of the rows that are lost one by one.
    pub lost: f64,
    /// Rows that are lost in one burst, at most.
    pub burst: usize,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
fn is_one(count: &usize) -> bool {
    *count == 1
}

impl Logging {
    /// Draws what a situation asks for, and changes the sensors to it. `torque`, `speed`: root mean squares
    /// of each joint.
    pub fn draw(
        situation: Situation,
        tree: &Tree,
        [torque, speed]: [&[f64]; 2],
        sensors: &mut Sensors,
        rng: &mut CaseRng,
    ) -> Self {
        use Situation::{
            Colour, DeadBand, DriveFilter as Filter, HeavyTails, LateFilter, LateVelocity, LongColour, Mixed,
            NoiseJoints, NoisyPositions, Quantised, ShortColour, Sticking, White,
        };
        let joints = torque.len();
        sensors.correlation_time = match situation {
            White | HeavyTails | Filter | LateFilter | Quantised => 0.0,
            ShortColour => rng.log_uniform(0.005, 0.05),
            Colour => rng.log_uniform(0.05, 0.3),
            LongColour => rng.log_uniform(0.3, 1.0),
            Mixed => rng.log_uniform(0.005, 0.3),
            NoiseJoints if rng.chance(0.5) => rng.log_uniform(0.005, 0.3),
            _ if rng.chance(0.5) => rng.log_uniform(0.005, 0.05),
            _ => 0.0,
        };
        let share = rng.log_uniform(0.005, if situation == Quantised { 0.02 } else { 0.05 });
        sensors.torque_noise =
            torque.iter().map(|torque| torque * share * rng.log_uniform(0.7, 1.4)).collect();
        if situation == NoiseJoints {
            for _ in 0..1 + rng.index((joints / 3).max(1)) {
                let joint = rng.index(joints);
                sensors.torque_noise[joint] = torque[joint] * rng.log_uniform(0.5, 3.0);
            }
        }
        let heavy = situation == HeavyTails || (situation == Mixed && rng.chance(0.5));
        let tails = match rng.chance(0.5) {
            _ if !heavy => Tails::Normal,
            true => Tails::Student,
            false => Tails::Contaminated,
        };
        let corner = rng.log_uniform(4.0, 20.0);
        let filter = matches!(situation, Filter | LateFilter)
            .then_some(DriveFilter { corner, causal: situation == LateFilter });
        let mut torque_step = vec![0.0; joints];
        if matches!(situation, Quantised | Mixed) {
            let steps = rng.log_uniform(0.5, 4.0);
            torque_step = sensors.torque_noise.iter().map(|noise| noise * steps).collect();
        }
        if matches!(situation, Quantised | Sticking) {
            let fewest_bits = if situation == Quantised { 11 } else { 13 };
            sensors.set_encoder_bits(tree, fewest_bits + rng.index(3) as i32);
        }
        if situation == Sticking {
            let slides = (0..joints).filter(|&joint| tree.joint(joint).joint_type == JointType::Prismatic);
            slides.for_each(|joint| sensors.quantum[joint] *= COARSER_SLIDES);
        }
        let mut velocity = matches!(situation, LateVelocity | Mixed).then(|| VelocityColumn {
            lag: rng.log_uniform(0.02, 0.2),
            scale: if rng.chance(0.25) { rng.pick(&WRONG_UNITS) } else { 1.0 },
            dead_band: vec![0.0; joints],
            noise: speed.iter().map(|speed| 0.001 * speed).collect(),
        });
        let mut dead_band = vec![0.0; joints];
        if situation == DeadBand && rng.chance(0.5) {
            let share = rng.log_uniform(0.02, 0.1);
            dead_band = torque.iter().map(|torque| share * torque).collect();
        } else if situation == DeadBand {
            let share = rng.log_uniform(0.05, 0.2);
            velocity = Some(VelocityColumn {
                lag: 0.0,
                scale: 1.0,
                dead_band: speed.iter().map(|speed| share * speed).collect(),
                noise: speed.iter().map(|speed| 0.001 * speed).collect(),
            });
        }
        // These came later: they draw last, so that the others are what they were.
        if situation == Situation::LowRate {
            sensors.rate = rng.pick(&[20.0, 40.0, 50.0, 100.0, 125.0]);
        }
        if situation == NoisyPositions {
            let angle = rng.log_uniform(5e-4, 5e-3);
            sensors.angle_noise = 2.0;
            for (joint, quantum) in sensors.quantum.iter_mut().enumerate() {
                let slides = tree.joint(joint).joint_type == JointType::Prismatic;
                *quantum = if slides { 0.1 } else { 1.0 } * angle / sensors.angle_noise;
            }
        }
        let held_samples = match situation {
            Situation::HeldTorque => 2 + rng.index((sensors.rate / 25.0) as usize - 1).min(18),
            _ => 1,
        };
        let rough = (situation == Situation::RoughClock).then(|| {
            sensors.clock = Clock::Even;
            RoughClock {
                step: if sensors.rate < 450.0 { 0.001 } else { 0.0005 },
                lost: rng.log_uniform(0.001, 0.03),
                burst: rng.index((0.4 * sensors.rate) as usize),
            }
        });
        let smoothing = (situation == Situation::SmoothedTorque).then(|| {
            let corner = rng.log_uniform(3.0, 12.0);
            if rng.chance(0.5) { Smoothing::Means { corner } } else { Smoothing::Butterworth { corner } }
        });
        let mut torque_zero = Vec::new();
        if situation == Situation::ShiftingZeros {
            let one = rng.index(joints);
            torque_zero.extend(torque.iter().enumerate().map(|(joint, torque)| {
                let share = rng.log_uniform(0.02, 0.3);
                if joint == one || rng.chance(0.6) { share * torque } else { 0.0 }
            }));
        }
        let mut held_positions = Vec::new();
        if situation == Situation::HeldPositions {
            let held = 2 + rng.index((sensors.rate / 40.0) as usize - 1).min(8);
            let all = rng.chance(0.5);
            let first = rng.index(joints);
            held_positions.extend((0..joints).map(|joint| if all || joint >= first { held } else { 1 }));
        }
        let differenced = (situation == Situation::DifferencedVelocity)
            .then(|| DifferencedVelocity { corner: rng.chance(0.5).then(|| rng.log_uniform(20.0, 80.0)) });
        if differenced.is_some() && rng.chance(0.5) {
            sensors.set_encoder_bits(tree, COARSE_BITS + rng.index(3) as i32);
        }
        let pushes = if situation == Situation::Pushes { Push::draw(rng) } else { Vec::new() };
        Logging {
            tails,
            filter,
            smoothing,
            velocity,
            differenced,
            dead_band,
            torque_step,
            held_samples,
            torque_zero,
            held_positions,
            pushes,
            rough,
        }
    }

    /// The log's text: `t`, `q.*`, `qd.*` if there is such a column, `tau.*`.
    pub fn log(
        &self,
        sensors: &Sensors,
        tree: &Tree,
        motion: &Trajectory,
        record: &Record,
        stamps: &[f64],
        rng: &mut CaseRng,
    ) -> String {
        let joints = tree.joint_count();
        let torque = self.torque(sensors, tree, record, rng);
        let mut read = vec![0.0; joints];
        let mut text = String::with_capacity(record.times.len() * (12 + 32 * joints));
        text.push('t');
        let has_velocity = self.velocity.is_some() || self.differenced.is_some();
        let prefixes: &[&str] = if has_velocity { &["q", "qd", "tau"] } else { &["q", "tau"] };
        // Of each joint, position and velocity of the row before, and the row's time.
        let mut before: Option<(f64, Vec<[f64; 2]>)> = None;
        for prefix in prefixes {
            tree.joint_names().for_each(|joint| {
                let _ = write!(text, ",{prefix}.{joint}");
            });
        }
        text.push('\n');
        let lost = self.rough.as_ref().map_or_else(BTreeSet::new, |rough| rough.lost_rows(stamps.len(), rng));
        for (sample, stamp) in stamps.iter().enumerate().filter(|(sample, _)| !lost.contains(sample)) {
            let stamp = self.rough.as_ref().map_or(*stamp, |rough| (stamp / rough.step).round() * rough.step);
            let _ = write!(text, "{stamp:.7}");
            for joint in 0..joints {
                let quantum = sensors.quantum[joint];
                let seen = record.states.q(sample, joint) / quantum + sensors.angle_noise * rng.normal();
                if self.held_positions.get(joint).is_none_or(|held| sample.is_multiple_of(*held)) {
                    read[joint] = seen.round() * quantum;
                }
                let _ = write!(text, ",{:.9}", read[joint]);
            }
            if let Some(velocity) = &self.velocity {
                for joint in 0..joints {
                    let [_, speed, _] = motion.state(joint, record.times[sample] - velocity.lag);
                    let speed = if speed.abs() < velocity.dead_band[joint] {
                        0.0
                    } else {
                        velocity.scale * (speed + velocity.noise[joint] * rng.normal())
                    };
                    let _ = write!(text, ",{speed:.7}");
                }
            }
            if let Some(differenced) = self.differenced {
                let next = |joint: usize| match &before {
                    Some((time, rows)) => {
                        let [position, last] = rows[joint];
                        [read[joint], differenced.next(last, read[joint] - position, stamp - time)]
                    }
                    None => [read[joint], 0.0],
                };
                let row: Vec<[f64; 2]> = (0..joints).map(next).collect();
                row.iter().for_each(|[_, speed]| {
                    let _ = write!(text, ",{speed:.7}");
                });
                before = Some((stamp, row));
            }
            for joint in 0..joints {
                let _ = write!(text, ",{:.6}", torque[sample * joints + joint]);
            }
            text.push('\n');
        }
        text
    }

    /// The torque as logged, samples × joints: noise, filter, dead band and steps, in this order.
    fn torque(&self, sensors: &Sensors, tree: &Tree, record: &Record, rng: &mut CaseRng) -> Vec<f64> {
        let joints = sensors.torque_noise.len();
        let mut torque = record.torque.clone();
        self.pushes.iter().for_each(|push| push.add_torque(tree, record, &mut torque));
        for joint in 0..joints {
            let noise = self.noise(&record.times, sensors.correlation_time, rng);
            // Drawn only where there is one, so that logs of other situations stay what they were.
            let zero = self.torque_zero.get(joint).map_or(0.0, |std| std * rng.normal());
            for (row, noise) in torque.chunks_exact_mut(joints).zip(noise) {
                row[joint] += sensors.torque_noise[joint] * noise + zero;
            }
            if self.filter.is_some() || self.smoothing.is_some() {
                let mut column: Vec<f64> = torque.iter().skip(joint).step_by(joints).copied().collect();
                if let Some(filter) = &self.filter {
                    filter.apply(&record.times, &mut column);
                }
                if let Some(smoothing) = &self.smoothing {
                    smoothing.apply(sensors.rate, &mut column);
                }
                for (row, value) in torque.chunks_exact_mut(joints).zip(column) {
                    row[joint] = value;
                }
            }
            for row in torque.chunks_exact_mut(joints) {
                if row[joint].abs() < self.dead_band[joint] {
                    row[joint] = 0.0;
                }
                if self.torque_step[joint] > 0.0 {
                    row[joint] = (row[joint] / self.torque_step[joint]).round() * self.torque_step[joint];
                }
            }
        }
        for held in torque.chunks_mut(joints * self.held_samples) {
            let (first, others) = held.split_at_mut(joints);
            others.chunks_exact_mut(joints).for_each(|row| row.copy_from_slice(first));
        }
        torque
    }

    /// Noise of unit variance: a first-order autoregression of this correlation time \[s\], white where that
    /// is nought.
    pub fn noise(&self, times: &[f64], correlation_time: f64, rng: &mut CaseRng) -> Vec<f64> {
        let mut level = rng.normal();
        let mut previous = times.first().copied().unwrap_or(0.0);
        let next = |&time: &f64| {
            let innovation = self.tails.draw(rng);
            let kept =
                if correlation_time > 0.0 { (-(time - previous) / correlation_time).exp() } else { 0.0 };
            previous = time;
            level = kept * level + (1.0 - kept * kept).sqrt() * innovation;
            level
        };
        times.iter().map(next).collect()
    }
}

impl Tails {
    /// A draw of unit variance.
    fn draw(self, rng: &mut CaseRng) -> f64 {
        match self {
            Tails::Normal => rng.normal(),
            Tails::Student => {
                let square: f64 = (0..3).map(|_| rng.normal().powi(2)).sum();
                // Its variance is 3.
                rng.normal() / (square / 3.0).sqrt() / 3.0_f64.sqrt()
            }
            Tails::Contaminated => {
                let [share, size] = OUTLIERS;
                let scale = if rng.chance(share) { size } else { 1.0 };
                scale * rng.normal() / (1.0 - share + share * size * size).sqrt()
            }
        }
    }
}

impl RoughClock {
    /// The rows that are lost, never the first or the last.
    fn lost_rows(&self, rows: usize, rng: &mut CaseRng) -> BTreeSet<usize> {
        let inside = 1..rows - 1;
        let mut lost: BTreeSet<usize> = inside.clone().filter(|_| rng.chance(self.lost)).collect();
        let begin = rng.index(rows);
        lost.extend((begin..begin + self.burst).filter(|row| inside.contains(row)));
        lost
    }
}

impl DriveFilter {
    /// Two poles at the corner: one after the other in time, or one in each direction.
    pub fn apply(&self, times: &[f64], values: &mut [f64]) {
        let pass = |values: &mut [f64], elapsed: &dyn Fn(usize) -> f64| {
            let mut level = values.first().copied().unwrap_or(0.0);
            for (index, value) in values.iter_mut().enumerate().skip(1) {
                level += (1.0 - (-elapsed(index) * TAU * self.corner).exp()) * (*value - level);
                *value = level;
            }
        };
        let forwards = |index: usize| times[index] - times[index - 1];
        pass(values, &forwards);
        if self.causal {
            pass(values, &forwards);
        } else {
            let last = times.len();
            values.reverse();
            pass(values, &|index| times[last - index] - times[last - index - 1]);
            values.reverse();
        }
    }
}
