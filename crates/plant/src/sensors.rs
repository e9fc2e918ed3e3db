//! From what the plant did to what its log says: sampling, noise, quanta, delays, jitter.

use crate::error::check_value;
use crate::{History, PlantEffect, PlantError};
use phiw_dynamics::{Tree, check_size};
use phiw_telemetry::Recording;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

/// When samples are taken, and what is stamped on them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Clock {
    /// Evenly, and stamped so.
    Even,
    /// Up to this share of the period early or late, stamped with the true time.
    StampedJitter(f64),
    /// Up to this share of the period early or late, stamped as if even.
    HiddenJitter(f64),
}

/// Which velocities and accelerations a log has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Derivatives {
    /// None: encoders measure positions alone.
    #[default]
    Unlogged,
    /// The drives' own, as a simulator knows them: without noise, the acceleration a mean over the torque's
    /// window.
    Exact,
    /// Central differences of the logged positions over their stamps, and of these velocities again: what is
    /// made of encoders alone. One-sided in the first and the last row.
    Differences,
}

/// Sensors and sampling. Lists have one element for each joint, or none for a perfect sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensors {
    /// Time between two rows of the log \[s\].
    pub period_s: f64,
    /// Standard deviation of the angles' white noise \[rad, m\].
    pub angle_noise: Vec<f64>,
    /// Step of the encoders \[rad, m\].
    pub angle_quantum: Vec<f64>,
    /// Standard deviation of the torques' white noise \[N·m, N\].
    pub torque_noise: Vec<f64>,
    /// The logged torque is a mean over this time around the stamp \[s\]; 0 is the present value. A sampled
    /// controller's torque jumps with each command, so the present value would be half a control period ahead
    /// of the motion it makes.
    pub torque_window_s: f64,
    /// All logged torques are this old \[s\].
    pub torque_delay_s: f64,
    /// The clock.
    pub clock: Clock,
    /// Which velocities and accelerations the log has.
    pub derivatives: Derivatives,
}

impl Default for Sensors {
    /// The paper's: perfect, every 10 ms.
    fn default() -> Self {
        Sensors {
            period_s: 0.01,
            angle_noise: Vec::new(),
            angle_quantum: Vec::new(),
            torque_noise: Vec::new(),
            torque_window_s: 0.01,
            torque_delay_s: 0.0,
            clock: Clock::Even,
            derivatives: Derivatives::Unlogged,
        }
    }
}

impl Sensors {
    /// Without any error: exact positions, velocities and accelerations, and the command itself, every
    /// `period_s` \[s\]. If that is the control period, a row's torque is the one that is held until the next
    /// row.
    pub fn exact(period_s: f64) -> Self {
        Sensors { period_s, torque_window_s: 0.0, derivatives: Derivatives::Exact, ..Sensors::default() }
    }

    /// The same with encoders of 2^`bits` steps a turn on each of `joints` revolute joints, and velocities
    /// and accelerations from their differences. The step of a prismatic joint's encoder is a length: set
    /// [`Self::angle_quantum`].
    pub fn with_encoder_bits(self, bits: u8, joints: usize) -> Self {
        let angle_quantum = vec![TAU * 0.5_f64.powi(i32::from(bits)); joints];
        Sensors { angle_quantum, derivatives: Derivatives::Differences, ..self }
    }

    pub(crate) fn check(&self, tree: &Tree) -> Result<(), PlantError> {
        let lists = [
            ("the angle noise", &self.angle_noise),
            ("the encoders' quantum", &self.angle_quantum),
            ("the torque noise", &self.torque_noise),
        ];
        for (what, list) in lists {
            if !list.is_empty() {
                check_size(what, list.len(), tree.joint_count())?;
            }
            for &value in list {
                check_value(|| what.to_owned(), value, "≥ 0", |value| value >= 0.0)?;
            }
        }
        check_value(|| "the sampling period".to_owned(), self.period_s, "> 0", |value| value > 0.0)?;
        check_value(|| "the torque's window".to_owned(), self.torque_window_s, "≥ 0", |value| value >= 0.0)?;
        check_value(|| "the torque's delay".to_owned(), self.torque_delay_s, "a finite number", |_| true)?;
        if let Clock::StampedJitter(share) | Clock::HiddenJitter(share) = self.clock {
            check_value(
                || "the clock's jitter".to_owned(),
                share,
                "in [0, 0.5)",
                |x| (0.0..0.5).contains(&x),
            )?;
        }
        Ok(())
    }

    /// What an encoder says of a true angle.
    pub(crate) fn encode(&self, joint: usize, angle: f64, rng: &mut impl Rng) -> f64 {
        let noise = self.angle_noise.get(joint).copied().unwrap_or(0.0);
        let seen = if noise > 0.0 { angle + noise * normal(rng) } else { angle };
        match self.angle_quantum.get(joint) {
            Some(&quantum) if quantum > 0.0 => (seen / quantum).round() * quantum,
            _ => seen,
        }
    }

    /// How long after the end of a motion the plant must still be known \[s\].
    pub(crate) fn margin_s(&self, effects: &[PlantEffect]) -> f64 {
        let delays = effects.iter().filter_map(|effect| match effect {
            PlantEffect::TimeDelay { delay_s, .. } => Some(*delay_s),
            _ => None,
        });
        // A negative delay is a torque ahead of its stamp.
        let earliest = delays.sum::<f64>() + self.torque_delay_s;
        self.torque_window_s + self.period_s + (-earliest).max(0.0)
    }

    /// The log of a history from time 0 to `end_s`, stamped from `origin_s` on, and the window of each row's
    /// torque.
    pub(crate) fn record(
        &self,
        tree: &Tree,
        history: &History,
        effects: &[PlantEffect],
        [origin_s, end_s]: [f64; 2],
        rng: &mut impl Rng,
    ) -> (Recording, Vec<[f64; 2]>) {
        let joints = history.joints;
        let (mut delays, mut offsets) = (vec![self.torque_delay_s; joints], vec![0.0; joints]);
        for effect in effects {
            match effect {
                PlantEffect::TimeDelay { joints, delay_s } => {
                    joints.iter().for_each(|&joint| delays[joint] += delay_s)
                }
                PlantEffect::EncoderOffset { joint, angle } => offsets[*joint] += angle,
                _ => {}
            }
        }
        let half = 0.5 * self.torque_window_s;
        let mut recording =
            Recording { joints: tree.joint_names().map(str::to_owned).collect(), ..Recording::default() };
        let (mut speeds, mut accelerations, mut windows) = (Vec::new(), Vec::new(), Vec::new());
        // The end is part of the motion, whatever rounding says.
        let rows = (end_s / self.period_s + 1e-9).floor().max(0.0) as usize + 1;
        for row in 0..rows {
            let even = row as f64 * self.period_s;
            let [taken, stamp] = match self.clock {
                Clock::Even => [even, even],
                Clock::StampedJitter(share) => {
                    [even + share * self.period_s * rng.random_range(-1.0..=1.0); 2]
                }
                Clock::HiddenJitter(share) => {
                    [even + share * self.period_s * rng.random_range(-1.0..=1.0), even]
                }
            };
            if taken + half > history.end_s() + 0.5 * history.step_s {
                break;
            }
            recording.t.push(origin_s + stamp);
            windows.push([taken - half, taken + half]);
            for joint in 0..joints {
                let angle = history.drive_angle_at(joint, taken) - offsets[joint];
                recording.q.push(self.encode(joint, angle, rng));
                let [from, to] = [-half, half].map(|shift| taken - delays[joint] + shift);
                let noise = self.torque_noise.get(joint).copied().unwrap_or(0.0);
                let torque = history.mean(&history.command, joints, joint, from, to);
                recording.tau.push(if noise > 0.0 { torque + noise * normal(rng) } else { torque });
                if self.derivatives == Derivatives::Exact {
                    let reach = half.max(history.step_s);
                    let [before, after] =
                        [-reach, reach].map(|shift| history.drive_speed_at(joint, taken + shift));
                    speeds.push(history.drive_speed_at(joint, taken));
                    accelerations.push((after - before) / (2.0 * reach));
                }
            }
        }
        if self.derivatives == Derivatives::Differences {
            speeds = slopes(&recording.t, &recording.q, joints);
            accelerations = slopes(&recording.t, &speeds, joints);
        }
        if self.derivatives != Derivatives::Unlogged {
            (recording.qd, recording.qdd) = (Some(speeds), Some(accelerations));
        }
        (recording, windows)
    }
}

/// Central differences of the rows of `values` over their stamps, one-sided at both ends; 0 of a single row.
fn slopes(stamps: &[f64], values: &[f64], joints: usize) -> Vec<f64> {
    let last = stamps.len().saturating_sub(1);
    let slope = |index: usize| {
        let (row, joint) = (index / joints, index % joints);
        let [before, after] = [row.saturating_sub(1), (row + 1).min(last)];
        let change = values[after * joints + joint] - values[before * joints + joint];
        if after > before { change / (stamps[after] - stamps[before]) } else { 0.0 }
    };
    (0..values.len()).map(slope).collect()
}

/// A draw from the standard normal distribution.
pub(crate) fn normal(rng: &mut impl Rng) -> f64 {
    StandardNormal.sample(rng)
}
