//! Oscillations that a torque excites: a base that gives way, a liquid, a load that hangs.

use super::shape::{Shape, Torque, of_torque, torque_of};
use phiw_effects::Formula;
use phiw_identification::effect::Sample;

/// Oscillations that are tried, at the strongest frequencies of the residual over the time.
const OSCILLATIONS: usize = 2;
/// Damping ratio: of little damping, but so much that what was before a block is forgotten in it.
const DAMPING: f64 = 0.05;
/// Share of a residual's variance that is enough: the frequencies were chosen on the same residual.
const LEAST_SHARE: f64 = 0.25;

/// What lightly damped masses do that the joint's torque of the model pushes at.
pub(super) fn excited(torque: &Torque<'_>) -> Option<Shape> {
    let strongest = torque.peaks.time_frequencies.get(torque.row).into_iter().flatten().copied();
    let frequencies: Vec<f64> = strongest.take(OSCILLATIONS).collect();
    let count = 2 * frequencies.len();
    let oscillators = Oscillators { row: torque.row, load: torque.torque(), frequencies };
    let shape = torque.shape_with_memory(&["tau", "t"], count, of_torque(), oscillators);
    (count > 0).then_some(Shape { least_share: LEAST_SHARE, ..shape })
}

/// Oscillators of unit stiffness that a torque pushes at: their deflection and their velocity over ω.
struct Oscillators {
    row: usize,
    load: f64,
    /// ω of each \[rad/s\].
    frequencies: Vec<f64>,
}

impl Formula for Oscillators {
    type Memory = Vec<[f64; 2]>;

    fn columns(&self, memory: &mut Self::Memory, sample: &Sample<'_>, columns: &mut [f64]) {
        let push = torque_of(sample, self.row) / self.load;
        // At first each has given way to what pushes at it.
        memory.resize(self.frequencies.len(), [push, 0.0]);
        for ((state, frequency), out) in
            memory.iter_mut().zip(&self.frequencies).zip(columns.chunks_exact_mut(2))
        {
            *state = after(*state, push, frequency * sample.period());
            out.copy_from_slice(state);
        }
    }
}

/// An oscillator's deflection and velocity over ω after the `phase` ω·Δt of a constant push: exact.
fn after([deflection, velocity]: [f64; 2], push: f64, phase: f64) -> [f64; 2] {
    let damped = (1.0 - DAMPING * DAMPING).sqrt();
    let (sine, cosine) = (damped * phase).sin_cos();
    let decay = (-DAMPING * phase).exp();
    let from = deflection - push;
    [
        push + decay * (from * cosine + (velocity + DAMPING * from) / damped * sine),
        decay * (velocity * cosine - (from + DAMPING * velocity) / damped * sine),
    ]
}

#[cfg(test)]
mod tests {
    use super::{DAMPING, after};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn an_oscillator_solves_its_equation(
            deflection in -1.0..1.0f64, velocity in -1.0..1.0f64, push in -1.0..1.0f64, phase in 0.0..3.0f64,
        ) {
            // x'' = push − x − 2ζx', over the phase, by the midpoint rule.
            const STEPS: usize = 4000;
            let step = phase / STEPS as f64;
            let rate = |[x, v]: [f64; 2]| [v, push - x - 2.0 * DAMPING * v];
            let mut state = [deflection, velocity];
            for _ in 0..STEPS {
                let [x, v] = rate(state);
                let [x, v] = rate([state[0] + 0.5 * step * x, state[1] + 0.5 * step * v]);
                state = [state[0] + step * x, state[1] + step * v];
            }
            let exact = after([deflection, velocity], push, phase);
            prop_assert!((exact[0] - state[0]).abs() < 1e-6 && (exact[1] - state[1]).abs() < 1e-6);
        }
    }
}
