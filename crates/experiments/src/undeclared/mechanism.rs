//! Torques without memory that mechanisms add: springs, balancers, ripple, couplings, stops; and some that no
//! catalogue has.

use super::friction::interpolate;
use super::plant::Scene;

/// A torque that depends on the present state or time, for a unit scale.
#[derive(Clone, Debug)]
pub enum Mechanism {
    /// q̈.
    Rotor,
    /// 1.
    Offset,
    /// q − center.
    Spring { center: f64 },
    /// A spring between the base and a lever on the link: sinusoidal only if its rest length is nought.
    Balancer { zero: f64, arm: f64, rest: f64 },
    /// Cogging, with a second harmonic.
    Ripple { cycles: f64, phase: f64, second: f64, second_phase: f64 },
    /// Friction of what turns with the first of two joints and `ratio` times the second, felt by both:
    /// viscous over a speed, and Coulomb.
    SumFriction { viscous: f64, coulomb: f64, ratio: f64 },
    /// Each of two joints feels the other's acceleration (a rotor geared to both).
    AccelerationCoupling,
    /// The first feels the second's speed (`coulomb`: its sign).
    OneWay { driven: usize, driver: usize, coulomb: bool },
    /// Bumps of the position, each with its centre, its width \[rad, m\] and its share: a hose that catches
    /// and lets go.
    Bumps { bumps: Vec<[f64; 3]> },
    /// Sinusoids of the position, each with its periods a radian, its phase \[rad\] and its share: cogging
    /// of parts that turn at ratios of no small numbers.
    Beats { waves: Vec<[f64; 3]> },
    /// A spring on one side of a threshold.
    EndStop { threshold: f64, upper: bool, depth: f64, exponent: f64 },
    /// sin(ωt + φ).
    TimeSinusoid { frequency: f64, phase: f64 },
    /// qᵢ + qⱼ − center, on both.
    PositionCoupling { center: f64 },
    /// Cube of what goes beyond `half` from the centre.
    DeadZoneSpring { center: f64, half: f64 },
    /// A path over the session's time, on an even grid.
    RandomWalk { path: Vec<f64>, step: f64 },
    /// q̇ᵢ·q̇ⱼ on the first.
    SpeedProduct { felt: usize, other: usize },
    /// (1 + sin(Nq + φ))·sign(q̇).
    PositionFriction { cycles: f64, phase: f64 },
    /// exp(−((q − center)/width)²)·sign(q̇).
    TightSpot { center: f64, width: f64 },
    /// sign(q̇) in these parts of the session \[s\].
    FrictionJump { when: Vec<[f64; 2]> },
}

impl Mechanism {
    /// Torque on one of the joints that it acts on, at a sample.
    pub fn torque(&self, scene: &Scene, joints: &[usize], joint: usize, sample: usize) -> f64 {
        let states = &scene.motor;
        let (q, v) = (states.q(sample, joint), states.v(sample, joint));
        let sum = |part: fn(&super::plant::States, usize, usize) -> f64| -> f64 {
            joints.iter().map(|&joint| part(states, sample, joint)).sum()
        };
        match self {
            Mechanism::Rotor => states.a(sample, joint),
            Mechanism::Offset => 1.0,
            Mechanism::Spring { center } => q - center,
            Mechanism::Balancer { zero, arm, rest } => {
                let (sine, cosine) = (q - zero).sin_cos();
                let length = (1.0 + arm * arm - 2.0 * arm * cosine).sqrt();
                (1.0 - rest / length) * sine
            }
            Mechanism::Ripple { cycles, phase, second, second_phase } => {
                (cycles * q + phase).sin() + second * (2.0 * cycles * q + second_phase).sin()
            }
            Mechanism::SumFriction { viscous, coulomb, ratio } => {
                let geared = |own: usize| if own == joints[0] { 1.0 } else { *ratio };
                let speed: f64 = joints.iter().map(|&own| geared(own) * states.v(sample, own)).sum();
                geared(joint) * (viscous * speed + coulomb * scene.ordinary.sign(speed))
            }
            Mechanism::AccelerationCoupling => sum(super::plant::States::a) - states.a(sample, joint),
            Mechanism::OneWay { driven, driver, coulomb } if joint == *driven => {
                let speed = states.v(sample, *driver);
                if *coulomb { scene.ordinary.sign(speed) } else { speed }
            }
            Mechanism::OneWay { .. } => 0.0,
            Mechanism::Bumps { bumps } => {
                let bump =
                    |[center, width, share]: &[f64; 3]| share * (-0.5 * ((q - center) / width).powi(2)).exp();
                bumps.iter().map(bump).sum()
            }
            Mechanism::Beats { waves } => {
                let wave = |[cycles, phase, share]: &[f64; 3]| share * (cycles * q + phase).sin();
                waves.iter().map(wave).sum()
            }
            Mechanism::EndStop { threshold, upper, depth, exponent } => {
                let side = if *upper { 1.0 } else { -1.0 };
                side * ((q - threshold) * side / depth).max(0.0).powf(*exponent)
            }
            Mechanism::TimeSinusoid { frequency, phase } => (frequency * scene.times[sample] + phase).sin(),
            Mechanism::PositionCoupling { center } => sum(super::plant::States::q) - center,
            Mechanism::DeadZoneSpring { center, half } => {
                let out = q - center;
                out.signum() * (out.abs() - half).max(0.0).powi(3)
            }
            Mechanism::RandomWalk { path, step } => interpolate(path, scene.times[sample] / step),
            Mechanism::SpeedProduct { felt, other } if joint == *felt => v * states.v(sample, *other),
            Mechanism::SpeedProduct { .. } => 0.0,
            Mechanism::PositionFriction { cycles, phase } => {
                (1.0 + (cycles * q + phase).sin()) * scene.ordinary.sign(v)
            }
            Mechanism::TightSpot { center, width } => {
                (-((q - center) / width).powi(2)).exp() * scene.ordinary.sign(v)
            }
            Mechanism::FrictionJump { when } => {
                let time = scene.times[sample];
                let has_jumped = when.iter().any(|[from, to]| (*from..*to).contains(&time));
                if has_jumped { scene.ordinary.sign(v) } else { 0.0 }
            }
        }
    }
}
