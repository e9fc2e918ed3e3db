//! The torques that are added, as formulas of the measured motion.

use super::log::{MeasuredLog, Signals};
use std::f64::consts::TAU;

/// An effect on one joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
#[value(rename_all = "snake_case")]
pub enum Form {
    /// Linear in the position, about one that is off the middle.
    JointSpring,
    /// A constant.
    TorqueOffset,
    /// Three and a third periods over the joint's range.
    TorqueRipple,
    /// The logged torque is too large by the share.
    TorqueGain,
    /// In proportion to the acceleration.
    RotorInertia,
    /// Viscous in one direction only.
    AsymmetricFriction,
    /// More friction at low speed.
    StribeckFriction,
    /// In proportion to v·|v|.
    QuadraticFriction,
    /// Lags behind the position by a twentieth of its range.
    Hysteresis,
    /// In proportion to the torque that is delivered.
    LoadDependentFriction,
    /// Dies out over a third of the first log.
    ThermalDrift,
    /// A spring in the last 15 % of the range.
    EndStop,
    /// In proportion to the velocity of the next joint.
    TransmissionCoupling,
    /// The torque is logged 15 ms late.
    TimeDelay,
}

/// A form on a joint, in its size.
pub struct Scale {
    /// The form.
    pub form: Form,
    /// The joint that feels it.
    pub joint: usize,
    /// The joint whose motion makes it, where that is another.
    pub other: usize,
    factor: f64,
    /// RMS of the joint's torque with the effect over the same without it.
    pub growth: f64,
    /// Lowest, middle (median) and highest position.
    positions: [f64; 3],
    /// RMS of the velocity.
    velocity: f64,
    /// How long it takes to die out \[s\].
    time_constant: f64,
}

/// How late a torque is logged \[s\].
const LATE_S: f64 = 0.015;

impl Form {
    /// All of them.
    pub const ALL: [Form; 14] = [
        Form::JointSpring,
        Form::TorqueOffset,
        Form::TorqueRipple,
        Form::TorqueGain,
        Form::RotorInertia,
        Form::AsymmetricFriction,
        Form::StribeckFriction,
        Form::QuadraticFriction,
        Form::Hysteresis,
        Form::LoadDependentFriction,
        Form::ThermalDrift,
        Form::EndStop,
        Form::TransmissionCoupling,
        Form::TimeDelay,
    ];

    /// The name that is asked for.
    pub fn kind(self) -> &'static str {
        match self {
            Form::JointSpring => "joint_spring",
            Form::TorqueOffset => "torque_offset",
            Form::TorqueRipple => "torque_ripple",
            Form::TorqueGain => "torque_gain",
            Form::RotorInertia => "rotor_inertia",
            Form::AsymmetricFriction => "asymmetric_friction",
            Form::StribeckFriction => "stribeck_friction",
            Form::QuadraticFriction => "quadratic_friction",
            Form::Hysteresis => "hysteresis",
            Form::LoadDependentFriction => "load_dependent_friction",
            Form::ThermalDrift => "thermal_drift",
            Form::EndStop => "end_stop",
            Form::TransmissionCoupling => "transmission_coupling",
            Form::TimeDelay => "time_delay",
        }
    }

    /// Other names for the same torque: friction of what the motor delivers, friction included, is a loss by
    /// the direction of power.
    pub fn equals(self) -> &'static [&'static str] {
        match self {
            Form::LoadDependentFriction => &["drive_efficiency"],
            _ => &[],
        }
    }
}

impl Scale {
    /// The size that gives `share` of the joint's torque (RMS) over the training logs; a gain has the share
    /// itself, and a delay its 15 ms.
    pub fn of(form: Form, joint: usize, training: &[MeasuredLog], share: f64) -> Self {
        let all = |pick: fn(&Signals) -> &Vec<f64>| -> Vec<f64> {
            training.iter().flat_map(|log| pick(&log.signals[joint]).iter().copied()).collect()
        };
        let mut q = all(|signals| &signals.q);
        q.sort_by(f64::total_cmp);
        let longest = training.iter().map(MeasuredLog::duration).fold(0.0, f64::max);
        let mut scale = Scale {
            form,
            joint,
            other: (joint + 1) % training[0].signals.len(),
            factor: 1.0,
            growth: 1.0,
            positions: [q[0], q[q.len() / 2], q[q.len() - 1]],
            velocity: rms(&all(|signals| &signals.v)),
            time_constant: 0.35 * longest,
        };
        scale.factor = match form {
            Form::TorqueGain => share,
            Form::TimeDelay => 1.0,
            _ => {
                let added: Vec<f64> = training.iter().flat_map(|log| scale.torque(log, 0.0)).collect();
                share * rms(&all(|signals| &signals.torque)) / rms(&added)
            }
        };
        let with = |log: &MeasuredLog| -> Vec<f64> {
            let own = &log.signals[joint].torque;
            own.iter().zip(scale.torque(log, 0.0)).map(|(torque, added)| torque + added).collect()
        };
        let with: Vec<f64> = training.iter().flat_map(with).collect();
        scale.growth = rms(&with) / rms(&all(|signals| &signals.torque));
        scale
    }

    /// What is added along a log that begins `before` seconds after the first \[N·m, N\].
    pub fn torque(&self, log: &MeasuredLog, before: f64) -> Vec<f64> {
        let own = &log.signals[self.joint];
        let [lowest, middle, highest] = self.positions;
        let range = highest - lowest;
        let sign = |k: usize| (own.v[k] / (0.02 * self.velocity)).tanh();
        let mut slack = own.q[0];
        let play = 0.05 * range;
        let mut lag = |q: f64| {
            slack = slack.clamp(q - play, q + play);
            (q - slack) / play
        };
        let period = log.duration() / (log.t.len() - 1) as f64;
        let late = ((LATE_S / period).round() as usize).max(1);
        let mut at = |k: usize| -> f64 {
            let (q, v) = (own.q[k], own.v[k]);
            match self.form {
                Form::JointSpring => q - (middle + 0.1 * range),
                Form::TorqueOffset => 1.0,
                Form::TorqueRipple => (TAU * 3.3 * q / range + 1.0).sin(),
                Form::TorqueGain => own.torque[k],
                Form::RotorInertia => own.a[k],
                Form::AsymmetricFriction => v.max(0.0),
                Form::StribeckFriction => (-(v / (0.15 * self.velocity)).powi(2)).exp() * sign(k),
                Form::QuadraticFriction => v * v.abs(),
                Form::Hysteresis => lag(q),
                Form::LoadDependentFriction => own.torque[k].abs() * sign(k),
                Form::ThermalDrift => (-(log.t[k] - log.t[0] + before) / self.time_constant).exp() * sign(k),
                Form::EndStop => (q - (highest - 0.15 * range)).max(0.0),
                Form::TransmissionCoupling => log.signals[self.other].v[k],
                Form::TimeDelay => own.torque[k.saturating_sub(late)] - own.torque[k],
            }
        };
        (0..log.t.len()).map(|k| self.factor * at(k)).collect()
    }
}

/// Root mean square of what is a number.
fn rms(values: &[f64]) -> f64 {
    let there = values.iter().filter(|value| value.is_finite());
    let count = there.clone().count().max(1);
    (there.map(|value| value * value).sum::<f64>() / count as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::{Form, Scale, rms};
    use crate::added::log::MeasuredLog;
    use std::fmt::Write;

    /// Two joints that swing at 0.5 and 0.7 Hz for ten seconds.
    fn log() -> anyhow::Result<MeasuredLog> {
        let folder = tempfile::tempdir()?;
        let mut text = "t,q.a,q.b,tau.a,tau.b\n".to_owned();
        for k in 0..2000 {
            let t = f64::from(k) * 0.005;
            let (a, b) = ((3.1 * t).sin(), 0.4 * (4.4 * t).sin());
            writeln!(text, "{t},{a},{b},{},{}", 5.0 * a + 1.0, -2.0 * b)?;
        }
        let path = folder.path().join("log.csv");
        std::fs::write(&path, text)?;
        MeasuredLog::read(&path)
    }

    #[test]
    fn an_effect_has_the_share_of_the_torque_that_is_asked_for() -> anyhow::Result<()> {
        let logs = [log()?];
        let torque = rms(&logs[0].signals[0].torque);
        for form in Form::ALL.into_iter().filter(|form| *form != Form::TimeDelay) {
            let added = Scale::of(form, 0, &logs, 0.2).torque(&logs[0], 0.0);
            let share = rms(&added) / torque;
            assert!((share - 0.2).abs() < 1e-9, "{form:?}: {share}");
        }
        Ok(())
    }

    #[test]
    fn a_delay_logs_what_was_and_a_drift_goes_on_in_the_next_log() -> anyhow::Result<()> {
        let logs = [log()?];
        let late = Scale::of(Form::TimeDelay, 0, &logs, 0.2).torque(&logs[0], 0.0);
        let torque = &logs[0].signals[0].torque;
        assert!((torque[500] + late[500] - torque[497]).abs() < 1e-12);
        let drift = Scale::of(Form::ThermalDrift, 0, &logs, 0.2);
        let (first, next) = (drift.torque(&logs[0], 0.0), drift.torque(&logs[0], logs[0].duration()));
        assert!((next[700] / first[700] - (-1.0 / 0.35_f64).exp()).abs() < 1e-3);
        Ok(())
    }
}
