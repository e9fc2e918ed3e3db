//! Frictions of one joint, with and without memory. Shapes are written from the literature, not from the
//! catalogue.

use super::plant::Scene;
use std::f64::consts::FRAC_2_PI;

/// Step on which frictions with memory are integrated \[s\].
pub const FINE_STEP: f64 = 2.5e-4;

/// How the sign of the speed is smoothed.
#[derive(Clone, Copy, Debug)]
pub enum Sign {
    /// tanh(v/w).
    Tanh,
    /// v/√(v² + w²).
    Algebraic,
    /// 2/π·atan(v/w).
    Arctan,
}

impl Sign {
    /// The sign of `speed`, smooth over `width`.
    pub fn of(self, speed: f64, width: f64) -> f64 {
        match self {
            Sign::Tanh => (speed / width).tanh(),
            Sign::Algebraic => speed / speed.hypot(width),
            Sign::Arctan => FRAC_2_PI * (speed / width).atan(),
        }
    }
}

/// A friction, for a unit scale \[N·m or what makes it one\].
#[derive(Clone, Debug)]
pub enum Friction {
    /// q̇.
    Viscous,
    /// sign(q̇), with the width of the case.
    Coulomb,
    /// Coulomb friction from bristles that bend this far \[rad\]: negligible against any motion.
    CoulombLuGre { distance: f64 },
    /// More friction in one direction: viscous, and `coulomb` times a speed \[rad/s\] of Coulomb.
    Asymmetric { positive: bool, coulomb: f64 },
    /// exp(−|q̇/vs|^δ)·sign(q̇).
    Stribeck { speed: f64, exponent: f64 },
    /// The same, from LuGre bristles whose steady state has that curve (Canudas de Wit et al. 1995).
    StribeckLuGre { speed: f64, exponent: f64, distance: f64 },
    /// q̇·|q̇|.
    Quadratic,
    /// |τ of the rigid body|·sign(q̇).
    LoadDependent,
    /// |τ of the rigid body|·q̇.
    LoadAndSpeed,
    /// The torque of the rigid body over the one efficiency where it drives, times the other where it is
    /// driven, less that torque itself; of one unit the losses are as they are.
    Efficiency { driving: f64, driven: f64 },
    /// exp(−t/T) of viscous over a speed \[s/rad\] and Coulomb friction, over the session's time, or that of
    /// each motion (`cold_again`).
    Thermal { time_constant: f64, viscous: f64, cold_again: bool },
    /// Maxwell slip: springs that slip, each with its yield distance \[rad\] and its share of the force.
    Maxwell { elements: Vec<[f64; 2]> },
    /// Dahl (1968), with the distance over which it rises \[rad\] and its exponent.
    Dahl { distance: f64, exponent: f64 },
}

impl Friction {
    /// Torque at the scene's times.
    pub fn torque(&self, scene: &Scene, joint: usize, scale: f64) -> Vec<f64> {
        let sign = |v| scene.ordinary.sign(v);
        let coulomb = scene.ordinary.coulomb[joint];
        match self {
            Friction::CoulombLuGre { distance } => {
                from_fine(scene, joint, |v, _| lugre(v, *distance, |_| scale))
            }
            Friction::StribeckLuGre { speed, exponent, distance } => {
                let steady = |v: f64| coulomb + scale * (-(v / speed).abs().powf(*exponent)).exp();
                let mut torque = from_fine(scene, joint, |v, _| lugre(v, *distance, steady));
                // The bristles are the joint's whole dry friction: what the plant adds as its declared share
                // goes out.
                for (sample, torque) in torque.iter_mut().enumerate() {
                    *torque -= coulomb * sign(scene.motor.v(sample, joint));
                }
                torque
            }
            Friction::Maxwell { elements } => from_fine(scene, joint, |_, q| maxwell(q, elements, scale)),
            Friction::Dahl { distance, exponent } => {
                from_fine(scene, joint, |_, q| dahl(q, *distance, *exponent, scale))
            }
            _ => (0..scene.times.len())
                .map(|sample| {
                    let v = scene.motor.v(sample, joint);
                    let shape = match self {
                        Friction::Viscous => v,
                        Friction::Asymmetric { positive, coulomb } => {
                            let direction = if *positive { 1.0 } else { -1.0 };
                            if v * direction > 0.0 { v + coulomb * sign(v) } else { 0.0 }
                        }
                        Friction::Stribeck { speed, exponent } => {
                            (-(v / speed).abs().powf(*exponent)).exp() * sign(v)
                        }
                        Friction::Quadratic => v * v.abs(),
                        Friction::LoadDependent => scene.rigid(sample, joint).abs() * sign(v),
                        Friction::LoadAndSpeed => scene.rigid(sample, joint).abs() * v,
                        Friction::Efficiency { driving, driven } => {
                            let load = scene.rigid(sample, joint);
                            let motor = if load * v > 0.0 { load / driving } else { load * driven };
                            (motor - load) * sign(v).abs()
                        }
                        Friction::Thermal { time_constant, viscous, cold_again } => {
                            let since = if *cold_again { scene.motion.start } else { 0.0 };
                            let time = scene.times[sample] - since;
                            (-time / time_constant).exp() * (viscous * v + sign(v))
                        }
                        _ => sign(v),
                    };
                    scale * shape
                })
                .collect(),
        }
    }
}

/// Integrates over the whole motion on the fine grid and reads the result at the scene's times.
fn from_fine(scene: &Scene, joint: usize, integrate: impl Fn(&[f64], &[f64]) -> Vec<f64>) -> Vec<f64> {
    let motion = scene.motion;
    let steps = (motion.duration / FINE_STEP).ceil() as usize + 1;
    let states: Vec<_> =
        (0..steps).map(|step| motion.state(joint, motion.start + step as f64 * FINE_STEP)).collect();
    let [positions, speeds]: [Vec<f64>; 2] =
        [0, 1].map(|part| states.iter().map(|state| state[part]).collect());
    let torque = integrate(&speeds, &positions);
    let read = |&time: &f64| interpolate(&torque, (time - motion.start) / FINE_STEP);
    scene.times.iter().map(read).collect()
}

/// Coulomb friction of this size \[N·m, N\] from bristles that bend `distance` far \[rad, m\].
pub fn lugre_along(scene: &Scene, joint: usize, distance: f64, size: f64) -> Vec<f64> {
    from_fine(scene, joint, |speeds, _| lugre(speeds, distance, |_| size))
}

/// Linear between grid points, constant outside.
pub fn interpolate(values: &[f64], place: f64) -> f64 {
    let place = place.clamp(0.0, (values.len() - 1) as f64);
    let index = (place as usize).min(values.len().saturating_sub(2));
    let rest = place - index as f64;
    values[index] + rest * (values[(index + 1).min(values.len() - 1)] - values[index])
}

/// LuGre's bristles without micro-damping: ż = v − σ|v|/g·z, force σz; exact for the mean speed of each step.
pub fn lugre(speeds: &[f64], distance: f64, steady: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut force = 0.0;
    let mut previous = speeds[0];
    let advance = |&speed: &f64| {
        let v = 0.5 * (previous + speed);
        previous = speed;
        let end = steady(v) * v.signum();
        // The bristles' deflection reaches `distance` where the force reaches its steady state.
        force = end + (force - end) * (-v.abs() * FINE_STEP / distance).exp();
        force
    };
    speeds.iter().map(advance).collect()
}

/// Springs in parallel, each of which slips at its share of the force (Iwan 1966).
pub fn maxwell(positions: &[f64], elements: &[[f64; 2]], scale: f64) -> Vec<f64> {
    let mut forces = vec![0.0; elements.len()];
    let mut previous = positions[0];
    let advance = |&position: &f64| {
        let way = position - previous;
        previous = position;
        for (force, &[distance, share]) in forces.iter_mut().zip(elements) {
            let limit = scale * share;
            *force = (*force + way * limit / distance).clamp(-limit, limit);
        }
        forces.iter().sum()
    };
    positions.iter().map(advance).collect()
}

/// dF/dq = σ·|1 − F/f·sign(q̇)|^α.
pub fn dahl(positions: &[f64], distance: f64, exponent: f64, scale: f64) -> Vec<f64> {
    let mut force = 0.0_f64;
    let mut previous = positions[0];
    let advance = |&position: &f64| {
        let way = position - previous;
        previous = position;
        let room = 1.0 - force / scale * way.signum();
        force += way * scale / distance * room.signum() * room.abs().powf(exponent);
        force
    };
    positions.iter().map(advance).collect()
}

#[cfg(test)]
mod tests {
    use super::{FINE_STEP, dahl, lugre, maxwell};

    fn motion() -> [Vec<f64>; 2] {
        let time = |step: usize| step as f64 * FINE_STEP;
        let angle = |t: f64| 0.4 * (1.3 * t).sin() + 0.1 * (7.0 * t).sin();
        let speed = |t: f64| 0.52 * (1.3 * t).cos() + 0.7 * (7.0 * t).cos();
        [
            (0..80_000).map(|step| angle(time(step))).collect(),
            (0..80_000).map(|step| speed(time(step))).collect(),
        ]
    }

    /// Over whole cycles, once the first is over, a friction with memory only takes energy, and stays within
    /// its limit.
    fn check(force: &[f64], limit: f64, positions: &[f64]) {
        let work: f64 = positions
            .windows(2)
            .zip(force.windows(2))
            .map(|(q, f)| 0.5 * (f[0] + f[1]) * (q[1] - q[0]))
            .sum();
        assert!(work > 0.0, "friction gave {work} J away");
        assert!(force.iter().all(|force| force.abs() <= limit * (1.0 + 1e-9)));
        assert!(force.iter().any(|force| force.abs() > 0.5 * limit), "it never came near its limit");
        // Stored energy is bounded by limit × distance: the deficit of the running work can be no larger.
        let mut running = 0.0_f64;
        let mut highest = 0.0_f64;
        for (q, f) in positions.windows(2).zip(force.windows(2)) {
            running += 0.5 * (f[0] + f[1]) * (q[1] - q[0]);
            highest = highest.max(running);
            assert!(highest - running <= limit * 0.1, "{} J came back", highest - running);
        }
    }

    #[test]
    fn frictions_with_memory_dissipate() {
        let [positions, speeds] = motion();
        check(&lugre(&speeds, 1e-4, |_| 3.0), 3.0, &positions);
        check(&lugre(&speeds, 1e-4, |v| 2.0 + (-(v / 0.1).abs().powf(0.7)).exp()), 3.0, &positions);
        check(&maxwell(&positions, &[[0.02, 0.3], [0.05, 0.3], [0.1, 0.4]], 2.0), 2.0, &positions);
        check(&dahl(&positions, 0.05, 1.0, 2.0), 2.0, &positions);
        check(&dahl(&positions, 0.05, 1.5, 2.0), 2.0, &positions);
    }

    #[test]
    fn bristles_of_no_length_are_coulomb_friction() {
        let [_, speeds] = motion();
        let force = lugre(&speeds, 1e-6, |_| 3.0);
        for (force, speed) in force.iter().zip(&speeds).filter(|(_, speed)| speed.abs() > 0.05) {
            assert!((force - 3.0 * speed.signum()).abs() < 1e-3);
        }
    }
}
