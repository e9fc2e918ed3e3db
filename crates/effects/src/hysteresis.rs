//! Friction with memory: presliding and backlash.

use crate::columns::{Formula, OwnTorque, ParameterKind};
use crate::fitted::FittedEffect;
use crate::kind::{Constants, EffectKind, Refinement, SignalRanges, around, constant, values};
use phiw_dynamics::Tree;
use phiw_identification::Effect;
use phiw_identification::effect::Sample;

/// A torque that depends on the way since the last reversal (Dahl 1968): dz = (1 − sign(q̇)·z)·dq /
/// `presliding`.
///
/// z runs to ±1 over the presliding distance; with Coulomb friction declared beside it, the fit shares the
/// torque between the two.
pub struct Hysteresis;

const PRESLIDING: &str = "presliding";

impl EffectKind for Hysteresis {
    fn name(&self) -> &str {
        "hysteresis"
    }
    fn scan(&self, site: &[usize], ranges: &SignalRanges) -> Vec<Constants> {
        let (lower, upper) = ranges.joints[site[0]].position;
        values(PRESLIDING, (0..8).map(|halvings| 0.3 * (upper - lower) * 0.5_f64.powi(halvings)))
    }
    fn refine(&self, &Refinement { found, step, .. }: &Refinement<'_>) -> Vec<Constants> {
        around(found, PRESLIDING, step)
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
        let formula = Dahl { joint: site[0], presliding: constant(constants, PRESLIDING, 0.05) };
        let parameters = [("fh", ParameterKind::Torque, 0.0)];
        Box::new(OwnTorque::new(self.name(), tree, site[0], constants, &parameters, formula))
    }
}

struct Dahl {
    joint: usize,
    presliding: f64,
}

impl Formula for Dahl {
    /// State z and the position that it was reached at.
    type Memory = Option<(f64, f64)>;

    fn columns(&self, memory: &mut Self::Memory, sample: &Sample<'_>, columns: &mut [f64]) {
        let position = sample.q()[self.joint];
        // The motion before the log is unknown: the hysteresis starts relaxed.
        let (state, before) = memory.unwrap_or((0.0, position));
        let way = position - before;
        // The exact solution over a monotonic step.
        let direction = if way < 0.0 { -1.0 } else { 1.0 };
        let state = direction - (direction - state) * (-way.abs() / self.presliding).exp();
        *memory = Some((state, position));
        columns[0] = state;
    }
}
