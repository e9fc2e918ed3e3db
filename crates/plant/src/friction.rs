//! Frictions without memory: torques of the joint's present speed.

use crate::numbers::Numbers;

/// A friction that depends on the joint's speed. What the joint must deliver against it has the sign of the
/// motion.
///
/// `width` is the speed over which a sign turns, tanh(q̇/width) \[rad/s, m/s\]; torques are in N·m or N,
/// joint speeds in rad/s or m/s.
#[derive(Clone, Debug, PartialEq)]
pub enum Friction {
    /// fv·q̇.
    Viscous {
        /// fv \[N·m·s/rad, N·s/m\].
        coefficient: f64,
    },
    /// fc·sign(q̇).
    Coulomb {
        /// fc.
        torque: f64,
        /// See the type.
        width: f64,
    },
    /// fv·q̇ + fc·sign(q̇), in one direction only.
    Asymmetric {
        /// Whether it brakes motion to larger angles, or to smaller ones.
        positive: bool,
        /// fv \[N·m·s/rad, N·s/m\].
        coefficient: f64,
        /// fc.
        torque: f64,
        /// See the type.
        width: f64,
    },
    /// fs·exp(−|q̇/vs|^δ)·sign(q̇): what stiction has beyond Coulomb friction.
    Stribeck {
        /// fs.
        torque: f64,
        /// vs.
        speed: f64,
        /// δ.
        exponent: f64,
        /// See the type.
        width: f64,
    },
    /// f2·q̇·|q̇|.
    Quadratic {
        /// f2 \[N·m·s²/rad², N·s²/m²\].
        coefficient: f64,
    },
    /// μ·|torque that goes into the rigid body|·sign(q̇).
    LoadDependent {
        /// μ.
        coefficient: f64,
        /// See the type.
        width: f64,
    },
    /// The torque that goes into the rigid body, over `driving` where it has the sign of the motion, times
    /// `driven` where it has not: what a transmission delivers of what it is given, either way.
    Efficiency {
        /// Efficiency from the motor to the load, in (0, 1].
        driving: f64,
        /// Efficiency from the load to the motor, in [0, 1].
        driven: f64,
        /// See the type.
        width: f64,
    },
    /// exp(−t/T)·(fv·q̇ + fc·sign(q̇)) over the time t since the plant was switched on.
    Thermal {
        /// fv at t = 0 \[N·m·s/rad, N·s/m\].
        coefficient: f64,
        /// fc at t = 0.
        torque: f64,
        /// T \[s\].
        time_constant_s: f64,
        /// See the type.
        width: f64,
    },
}

impl Friction {
    /// Torque at a speed, `t_s` after the plant was switched on, with the torque `load` going into the rigid
    /// body.
    pub fn torque(&self, speed: f64, t_s: f64, load: f64) -> f64 {
        let sign = |width: f64| (speed / width).tanh();
        match *self {
            Friction::Viscous { coefficient } => coefficient * speed,
            Friction::Coulomb { torque, width } => torque * sign(width),
            Friction::Asymmetric { positive, coefficient, torque, width } => {
                if (speed > 0.0) == positive {
                    coefficient * speed + torque * sign(width)
                } else {
                    0.0
                }
            }
            Friction::Stribeck { torque, speed: fall, exponent, width } => {
                torque * (-(speed / fall).abs().powf(exponent)).exp() * sign(width)
            }
            Friction::Quadratic { coefficient } => coefficient * speed * speed.abs(),
            Friction::LoadDependent { coefficient, width } => coefficient * load.abs() * sign(width),
            Friction::Efficiency { driving, driven, width } => {
                let at_motor = if load * speed > 0.0 { load / driving } else { load * driven };
                (at_motor - load) * sign(width).abs()
            }
            Friction::Thermal { coefficient, torque, time_constant_s, width } => {
                (-t_s / time_constant_s).exp() * (coefficient * speed + torque * sign(width))
            }
        }
    }

    /// The name of its kind in files.
    pub fn kind(&self) -> &'static str {
        match self {
            Friction::Viscous { .. } => "viscous_friction",
            Friction::Coulomb { .. } => "coulomb_friction",
            Friction::Asymmetric { .. } => "asymmetric_friction",
            Friction::Stribeck { .. } => "stribeck_friction",
            Friction::Quadratic { .. } => "quadratic_friction",
            Friction::LoadDependent { .. } => "load_dependent_friction",
            Friction::Efficiency { .. } => "drive_efficiency",
            Friction::Thermal { .. } => "thermal_drift",
        }
    }

    /// Its numbers.
    pub(crate) fn numbers(&self) -> Numbers {
        let numbers = |not_negative, positive| Numbers { not_negative, positive, ..Numbers::default() };
        match *self {
            Friction::Viscous { coefficient } | Friction::Quadratic { coefficient } => {
                numbers(vec![("coefficient", coefficient)], vec![])
            }
            Friction::Coulomb { torque, width } => numbers(vec![("torque", torque)], vec![("width", width)]),
            Friction::Asymmetric { coefficient, torque, width, .. } => {
                numbers(vec![("coefficient", coefficient), ("torque", torque)], vec![("width", width)])
            }
            Friction::Stribeck { torque, speed, exponent, width } => numbers(
                vec![("torque", torque)],
                vec![("speed", speed), ("exponent", exponent), ("width", width)],
            ),
            Friction::LoadDependent { coefficient, width } => {
                numbers(vec![("coefficient", coefficient)], vec![("width", width)])
            }
            Friction::Efficiency { driving, driven, width } => numbers(
                vec![("driven", driven), ("1 − driving", 1.0 - driving), ("1 − driven", 1.0 - driven)],
                vec![("driving", driving), ("width", width)],
            ),
            Friction::Thermal { coefficient, torque, time_constant_s, width } => numbers(
                vec![("coefficient", coefficient), ("torque", torque)],
                vec![("time constant", time_constant_s), ("width", width)],
            ),
        }
    }
}
