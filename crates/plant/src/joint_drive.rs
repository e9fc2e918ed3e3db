//! The physics of one joint's drive: all torques between actuator and rigid body.

use crate::{Friction, Mechanism, PlantEffect, Presliding};

/// The effects of one joint, and what they remember.
#[derive(Clone, Debug, Default)]
pub(crate) struct JointDrive {
    frictions: Vec<Friction>,
    /// Each with its memory.
    preslidings: Vec<(Presliding, Vec<f64>)>,
    /// Torques of the angle that are smooth, and those that a step must be solved for.
    smooth: Vec<Mechanism>,
    stops: Vec<Mechanism>,
    offset: f64,
    /// Product of all (1 + ε).
    gain: f64,
    saturation: f64,
    pub(crate) encoder_offset: f64,
    pub(crate) flexible: Option<Flexible>,
}

/// A motor behind a spring.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flexible {
    pub(crate) stiffness: f64,
    pub(crate) damping: f64,
    pub(crate) backlash: f64,
    /// Inertia of the motor \[kg·m², kg\].
    pub(crate) inertia: f64,
}

impl Flexible {
    /// Torque through the spring that is turned by `twist` at `rate`. Play has no torque, damping included.
    pub(crate) fn torque(&self, twist: f64, rate: f64) -> f64 {
        let beyond = twist.abs() - 0.5 * self.backlash;
        if beyond < 0.0 { 0.0 } else { self.stiffness * beyond * twist.signum() + self.damping * rate }
    }

    /// The twist at which the spring holds a torque at rest.
    pub(crate) fn twist(&self, torque: f64) -> f64 {
        if torque == 0.0 { 0.0 } else { torque / self.stiffness + 0.5 * self.backlash * torque.signum() }
    }
}

/// Where a drive is when a step begins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DriveStep {
    /// Angle at the beginning \[rad, m\].
    pub(crate) angle: f64,
    /// Speed at the beginning.
    pub(crate) speed: f64,
    /// Time since the plant was switched on \[s\].
    pub(crate) t_s: f64,
    /// Length of the step \[s\].
    pub(crate) step_s: f64,
    /// Torque that goes into the rigid body.
    pub(crate) load: f64,
}

impl JointDrive {
    /// One drive for each joint. `motors`: inertia of each rotor behind a spring.
    pub(crate) fn all(effects: &[PlantEffect], motors: &[f64]) -> Vec<JointDrive> {
        let mut drives =
            vec![JointDrive { gain: 1.0, saturation: f64::INFINITY, ..JointDrive::default() }; motors.len()];
        for effect in effects {
            match effect {
                PlantEffect::Friction { joint, law } => drives[*joint].frictions.push(law.clone()),
                PlantEffect::Presliding { joint, law } => {
                    drives[*joint].preslidings.push((law.clone(), vec![0.0; law.memory_size()]));
                }
                PlantEffect::Mechanism { joint, law } if law.is_stiff() => {
                    drives[*joint].stops.push(law.clone())
                }
                PlantEffect::Mechanism { joint, law } => drives[*joint].smooth.push(law.clone()),
                PlantEffect::TorqueOffset { joint, torque } => drives[*joint].offset += torque,
                PlantEffect::TorqueGain { joint, share } => drives[*joint].gain *= 1.0 + share,
                PlantEffect::Saturation { joint, torque } => {
                    drives[*joint].saturation = drives[*joint].saturation.min(*torque);
                }
                PlantEffect::EncoderOffset { joint, angle } => drives[*joint].encoder_offset += angle,
                PlantEffect::Flexibility { joint, stiffness, damping, backlash } => {
                    drives[*joint].flexible = Some(Flexible {
                        stiffness: *stiffness,
                        damping: *damping,
                        backlash: *backlash,
                        inertia: motors[*joint],
                    });
                }
                _ => {}
            }
        }
        drives
    }

    /// Forgets the way since the last reversal.
    pub(crate) fn reset(&mut self) {
        self.preslidings.iter_mut().for_each(|(_, memory)| memory.fill(0.0));
    }

    /// What the actuator delivers for a command.
    pub(crate) fn delivered(&self, command: f64) -> f64 {
        (command / self.gain).clamp(-self.saturation, self.saturation)
    }

    /// Whether a step must be solved for its torque.
    pub(crate) fn is_stiff(&self) -> bool {
        !(self.frictions.is_empty()
            && self.preslidings.is_empty()
            && self.stops.is_empty()
            && self.flexible.is_none())
    }

    /// Torque of the smooth effects over a step: at its middle.
    pub(crate) fn smooth_torque(&self, step: &DriveStep) -> f64 {
        let middle = step.angle + 0.5 * step.step_s * step.speed;
        self.offset + self.smooth.iter().map(|law| law.torque(middle)).sum::<f64>()
    }

    /// Torque of the stiff effects over a step at whose end the drive has `speed`: backward Euler, which is
    /// stable however steep they are.
    pub(crate) fn stiff_torque(&self, step: &DriveStep, speed: f64) -> f64 {
        let DriveStep { angle, t_s, step_s, load, .. } = *step;
        let frictions: f64 = self.frictions.iter().map(|law| law.torque(speed, t_s, load)).sum();
        let preslidings: f64 =
            self.preslidings.iter().map(|(law, memory)| law.torque(memory, speed, step_s)).sum();
        let stops: f64 = self.stops.iter().map(|law| law.torque(angle + step_s * speed)).sum();
        frictions + preslidings + stops
    }

    /// Remembers a step at whose end the drive has `speed`.
    pub(crate) fn advance(&mut self, speed: f64, step_s: f64) {
        self.preslidings.iter_mut().for_each(|(law, memory)| law.advance(memory, speed, step_s));
    }
}
