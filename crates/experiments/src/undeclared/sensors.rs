//! From what a perfect logger would write to what a real one does: noise, quanta, jitter.

use super::plant::Record;
use super::rng::CaseRng;
use phiw_dynamics::{JointType, Tree};
use serde::Serialize;
use std::f64::consts::TAU;
use std::fmt::Write;

/// Finest and coarsest encoder: quanta of a turn.
const ENCODER_BITS: [i32; 2] = [15, 20];
/// Quantum of a slide's encoder \[m\].
const SLIDE_QUANTUM: f64 = 1e-6;

/// When samples are taken and what is stamped on them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind", content = "share")]
pub enum Clock {
    /// Evenly, and stamped so.
    Even,
    /// Jittered by this share of the period, and stamped truly.
    Truthful(f64),
    /// Taken at jittered times, stamped evenly.
    JitteredSamples(f64),
    /// Taken evenly, stamped with jitter.
    JitteredStamps(f64),
}

/// Sensors and sampling of one case.
#[derive(Clone, Debug, Serialize)]
pub struct Sensors {
    /// Samples a second \[Hz\].
    pub rate: f64,
    /// Standard deviation of the torque's noise \[N·m\], joint by joint.
    pub torque_noise: Vec<f64>,
    /// Correlation time of that noise \[s\]; 0 if it is white.
    pub correlation_time: f64,
    /// Quantum of the encoders \[rad, m\], joint by joint.
    pub quantum: Vec<f64>,
    /// Standard deviation of the angle before it is quantised, in quanta.
    pub angle_noise: f64,
    /// The clock.
    pub clock: Clock,
    /// What else happens to a log of the widened suites.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub logging: Option<super::logging::Logging>,
}

impl Sensors {
    /// Draws sensors for joints whose torques have these root mean squares.
    pub fn draw(tree: &Tree, torque: &[f64], rng: &mut CaseRng) -> Self {
        let rate = if torque.len() > 10 { 250.0 } else { rng.pick(&[250.0, 400.0, 500.0, 800.0, 1000.0]) };
        let correlation_time = if rng.chance(0.4) { rng.log_uniform(0.005, 0.05) } else { 0.0 };
        let highest: f64 = if correlation_time > 0.0 { 0.03 } else { 0.06 };
        let share = rng.log_uniform(0.005, highest);
        let noise = |torque: &f64| torque * (share * rng.log_uniform(0.7, 1.4)).clamp(0.005, highest);
        let torque_noise = torque.iter().map(noise).collect();
        let bits = ENCODER_BITS[0] + rng.index((ENCODER_BITS[1] - ENCODER_BITS[0] + 1) as usize) as i32;
        let quantum = |joint| match tree.joint(joint).joint_type {
            JointType::Prismatic => SLIDE_QUANTUM,
            _ => TAU / f64::from(bits).exp2(),
        };
        let quantum = (0..torque.len()).map(quantum).collect();
        let angle_noise = if rng.chance(0.25) { rng.uniform(1.0, 2.0) } else { 0.0 };
        let jitter = rng.uniform(0.05, 0.2);
        let clock = match rng.index(10) {
            0..=5 => Clock::Even,
            6 | 7 => Clock::Truthful(jitter),
            8 => Clock::JitteredSamples(jitter),
            _ => Clock::JitteredStamps(jitter),
        };
        Sensors { rate, torque_noise, correlation_time, quantum, angle_noise, clock, logging: None }
    }

    /// Gives the encoders of all turning joints so many bits.
    pub fn set_encoder_bits(&mut self, tree: &Tree, bits: i32) {
        for (joint, quantum) in self.quantum.iter_mut().enumerate() {
            if tree.joint(joint).joint_type != JointType::Prismatic {
                *quantum = TAU / f64::from(bits).exp2();
            }
        }
    }

    /// True times of the samples and the stamps on them, from `start` on.
    pub fn times(&self, start: f64, duration: f64, rng: &mut CaseRng) -> [Vec<f64>; 2] {
        let period = 1.0 / self.rate;
        let even: Vec<f64> =
            (0..(duration * self.rate) as usize).map(|k| start + k as f64 * period).collect();
        let mut jittered = |share: f64| -> Vec<f64> {
            // Never before the start, where nobody was logging.
            even.iter()
                .map(|time| time + share * period * rng.uniform(-1.0, 1.0))
                .map(|t| t.max(start))
                .collect()
        };
        match self.clock {
            Clock::Even => [even.clone(), even],
            Clock::Truthful(share) => {
                let times = jittered(share);
                [times.clone(), times]
            }
            Clock::JitteredSamples(share) => [jittered(share), even],
            Clock::JitteredStamps(share) => [even.clone(), jittered(share)],
        }
    }

    /// The log's text: `t,q.*,tau.*`.
    pub fn log(&self, tree: &Tree, record: &Record, stamps: &[f64], rng: &mut CaseRng) -> String {
        let joints = tree.joint_count();
        let mut text = String::with_capacity(record.times.len() * (12 + 22 * joints));
        text.push('t');
        for prefix in ["q", "tau"] {
            tree.joint_names().for_each(|joint| {
                let _ = write!(text, ",{prefix}.{joint}");
            });
        }
        text.push('\n');
        let mut noise: Vec<f64> = (0..joints).map(|_| rng.normal()).collect();
        for (sample, stamp) in stamps.iter().enumerate() {
            let _ = write!(text, "{stamp:.7}");
            for joint in 0..joints {
                let quantum = self.quantum[joint];
                let seen = record.states.q(sample, joint) / quantum + self.angle_noise * rng.normal();
                let _ = write!(text, ",{:.9}", seen.round() * quantum);
            }
            if sample > 0 {
                let elapsed = record.times[sample] - record.times[sample - 1];
                for noise in &mut noise {
                    *noise = self.next_noise(*noise, elapsed, rng.normal());
                }
            }
            for joint in 0..joints {
                let torque = record.torque[sample * joints + joint] + self.torque_noise[joint] * noise[joint];
                let _ = write!(text, ",{torque:.6}");
            }
            text.push('\n');
        }
        text
    }

    /// A first-order autoregression of unit variance; white where the correlation time is nought.
    fn next_noise(&self, noise: f64, elapsed: f64, innovation: f64) -> f64 {
        if self.correlation_time == 0.0 {
            return innovation;
        }
        let kept = (-elapsed / self.correlation_time).exp();
        kept * noise + (1.0 - kept * kept).sqrt() * innovation
    }
}
