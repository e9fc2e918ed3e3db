//! Friction with memory: presliding and backlash.

use crate::bristles::LONGEST_BRISTLES;
use crate::columns::{Formula, OwnTorque, ParameterKind};
use crate::fitted::FittedEffect;
use crate::kind::{Constants, EffectKind, Refinement, SignalRanges, around, constant, product, values};
use phiw_dynamics::Tree;
use phiw_identification::Effect;
use phiw_identification::effect::Sample;

/// A torque that depends on the way since the last reversal (Dahl 1968):
/// dz = (1 − sign(q̇)·z)^`exponent`·dq / `presliding`.
///
/// z runs to ±1: within the presliding distance where the exponent is zero (a spring that slips, backlash
/// that is taken up), ever more slowly where it is one or more. With Coulomb friction declared beside it, the
/// fit shares the torque between the two.
pub struct Hysteresis;

const PRESLIDING: &str = "presliding";
const EXPONENT: &str = "exponent";
/// Exponents to try beside one, and how much longer the presliding distance may be with them.
const EXPONENTS: [f64; 3] = [0.0, 0.5, 2.0];
const LONGER: [f64; 3] = [1.0, 1.5, 2.2];

impl EffectKind for Hysteresis {
    fn name(&self) -> &str {
        "hysteresis"
    }
    fn scan(&self, site: &[usize], ranges: &SignalRanges) -> Vec<Constants> {
        let (lower, upper) = ranges.joints[site[0]].position;
        values(PRESLIDING, (0..8).map(|halvings| 0.3 * (upper - lower) * 0.5_f64.powi(halvings)))
    }
    fn refine(&self, &Refinement { found, step, .. }: &Refinement<'_>) -> Vec<Constants> {
        let mut near = around(found, PRESLIDING, step);
        let own = constant(found, PRESLIDING, 0.05);
        // A shorter one is of bristles, whose exponent is one.
        if step == 0 && own > LONGEST_BRISTLES {
            let ways = values(PRESLIDING, LONGER.map(|longer| longer * own));
            near.extend(product(&values(EXPONENT, EXPONENTS), &ways));
        }
        near.extend(around(found, EXPONENT, step));
        near
    }
    fn mends_turning(&self) -> bool {
        true
    }
    fn way_of_turning(&self, found: &Constants) -> Option<f64> {
        found.get(PRESLIDING).copied()
    }
    fn telling_motion(&self) -> &'static str {
        "small slow strokes of growing size about one position"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        format!(
            "The torque of {} depends on the way since the last reversal: {} over {:.4} {}.",
            found.joints(),
            found.quantity(0),
            found.constant(PRESLIDING),
            found.unit_of_position()
        )
    }
    fn form_of(&self) -> &'static [&'static str] {
        &["viscous_friction", "coulomb_friction"]
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let formula = Dahl {
            joint: site[0],
            presliding: constant(constants, PRESLIDING, 0.05),
            exponent: constant(constants, EXPONENT, 1.0),
        };
        let parameters = [("fh", ParameterKind::Torque, 0.0)];
        Box::new(OwnTorque::new(self.name(), tree, site[0], constants, &parameters, formula))
    }
}

struct Dahl {
    joint: usize,
    presliding: f64,
    exponent: f64,
}

impl Dahl {
    /// The state after a way \[rad, m\] without a reversal: the exact solution of du = −u^exponent·d|q| /
    /// `presliding` for u = 1 − sign(q̇)·z.
    fn after(&self, state: f64, way: f64) -> f64 {
        let direction = if way < 0.0 { -1.0 } else { 1.0 };
        let (left, way) = (1.0 - direction * state, way.abs() / self.presliding);
        let power = 1.0 - self.exponent;
        let left = if power.abs() < 1e-6 {
            left * (-way).exp()
        } else {
            // Where the exponent is below one, nothing is left after a finite way.
            let base = left.powf(power) - power * way;
            if base > 0.0 && left > 0.0 { base.powf(1.0 / power) } else { 0.0 }
        };
        direction * (1.0 - left)
    }
}

impl Formula for Dahl {
    /// State z and the position that it was reached at.
    type Memory = Option<(f64, f64)>;

    fn columns(&self, memory: &mut Self::Memory, sample: &Sample<'_>, columns: &mut [f64]) {
        let position = sample.q()[self.joint];
        // The motion before the log is unknown: the hysteresis starts relaxed.
        let (state, before) = memory.unwrap_or((0.0, position));
        let state = self.after(state, position - before);
        *memory = Some((state, position));
        columns[0] = state;
    }
}

#[cfg(test)]
mod tests {
    use super::Dahl;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn a_step_is_dahls_equation_integrated(
            exponent in prop_oneof![Just(0.0), Just(1.0), 0.3..2.5f64],
            state in -1.0..1.0f64,
            way in -0.3..0.3f64,
        ) {
            const STEPS: usize = 200_000;
            let dahl = Dahl { joint: 0, presliding: 0.1, exponent };
            let step = way / STEPS as f64;
            let mut z = state;
            for _ in 0..STEPS {
                z += (1.0 - step.signum() * z).max(0.0).powf(exponent) * step / dahl.presliding;
                z = z.clamp(-1.0, 1.0);
            }
            prop_assert!((dahl.after(state, way) - z).abs() < 1e-3, "{} {z}", dahl.after(state, way));
        }
    }
}
