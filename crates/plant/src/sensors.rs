//! From what the plant did to what its log says: sampling, noise, quanta, delays, jitter.

use crate::error::check_value;
use crate::{Effect, History, PlantError};
use phiw_dynamics::{Tree, check_size};
use phiw_telemetry::Recording;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

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
    /// The logged torque is a mean over this time around the stamp \[s\]; 0 is the present value. A sampled controller's torque
    /// jumps when it is told to, so the present value would be half a control period ahead of the motion it makes.
    pub torque_window_s: f64,
    /// All logged torques are this old \[s\].
    pub torque_delay_s: f64,
    /// The clock.
    pub clock: Clock,
    /// Whether the log has velocities and accelerations too, as a simulator's would: without noise, the acceleration a mean
    /// over the torque's window.
    pub derivatives: bool,
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
            derivatives: false,
        }
    }
}

impl Sensors {
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
    pub(crate) fn encode(&self, joint: usize, angle: f64, random: &mut impl Rng) -> f64 {
        let noise = self.angle_noise.get(joint).copied().unwrap_or(0.0);
        let seen = if noise > 0.0 { angle + noise * normal(random) } else { angle };
        match self.angle_quantum.get(joint) {
            Some(&quantum) if quantum > 0.0 => (seen / quantum).round() * quantum,
            _ => seen,
        }
    }

    /// How long after the end of a motion the plant must still be known \[s\].
    pub(crate) fn margin_s(&self, effects: &[Effect]) -> f64 {
        let delays = effects.iter().filter_map(|effect| match effect {
            Effect::TimeDelay { delay_s, .. } => Some(*delay_s),
            _ => None,
        });
        // A negative delay is a torque ahead of its stamp.
        let earliest = delays.sum::<f64>() + self.torque_delay_s;
        self.torque_window_s + self.period_s + (-earliest).max(0.0)
    }

    /// The log of a history from time 0 to `end_s`, stamped from `origin_s` on, and the window of each row's torque.
    pub(crate) fn record(
        &self,
        tree: &Tree,
        history: &History,
        effects: &[Effect],
        [origin_s, end_s]: [f64; 2],
        random: &mut impl Rng,
    ) -> (Recording, Vec<[f64; 2]>) {
        let joints = history.joints;
        let (mut delays, mut offsets) = (vec![self.torque_delay_s; joints], vec![0.0; joints]);
        for effect in effects {
            match effect {
                Effect::TimeDelay { joints, delay_s } => {
                    joints.iter().for_each(|&joint| delays[joint] += delay_s)
                }
                Effect::EncoderOffset { joint, angle } => offsets[*joint] += angle,
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
                    [even + share * self.period_s * random.random_range(-1.0..=1.0); 2]
                }
                Clock::HiddenJitter(share) => {
                    [even + share * self.period_s * random.random_range(-1.0..=1.0), even]
                }
            };
            if taken + half > history.end_s() + 0.5 * history.step_s {
                break;
            }
            recording.t.push(origin_s + stamp);
            windows.push([taken - half, taken + half]);
            for joint in 0..joints {
                let angle = history.drive_angle_at(joint, taken) - offsets[joint];
                recording.q.push(self.encode(joint, angle, random));
                let [from, to] = [-half, half].map(|shift| taken - delays[joint] + shift);
                let noise = self.torque_noise.get(joint).copied().unwrap_or(0.0);
                let torque = history.mean(&history.command, joints, joint, from, to);
                recording.tau.push(if noise > 0.0 { torque + noise * normal(random) } else { torque });
                if self.derivatives {
                    let reach = half.max(history.step_s);
                    let [before, after] =
                        [-reach, reach].map(|shift| history.drive_speed_at(joint, taken + shift));
                    speeds.push(history.drive_speed_at(joint, taken));
                    accelerations.push((after - before) / (2.0 * reach));
                }
            }
        }
        if self.derivatives {
            (recording.qd, recording.qdd) = (Some(speeds), Some(accelerations));
        }
        (recording, windows)
    }
}

/// A draw from the standard normal distribution.
pub(crate) fn normal(random: &mut impl Rng) -> f64 {
    StandardNormal.sample(random)
}
