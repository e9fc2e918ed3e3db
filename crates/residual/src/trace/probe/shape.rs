//! Columns without a name over some signals, for whatever a torque may follow.

use crate::trace::residuals::ResidualShape;
use crate::trace::stage::Fixed;
use phiw_effects::{Constants, OwnTorque, ParameterKind, SignalRanges, smooth_sign};
use phiw_identification::Effect;
use phiw_identification::effect::{Needs, Sample};

/// Columns over some signals in one joint's torque, whose heights are fitted.
pub(super) struct Shape {
    /// The signals, as in `report.json`.
    pub signals: Vec<String>,
    /// The columns.
    pub effect: Box<dyn Effect>,
    /// A residual follows the signals if the columns foretell this share of its variance on other folds.
    /// Columns over noise foretell less than nothing of it: they were fitted to other noise.
    pub least_share: f64,
}

/// The torque whose residual is looked at, and what is known of its joint.
#[derive(Clone, Copy)]
pub(super) struct Torque<'a> {
    pub fixed: &'a Fixed<'a>,
    pub row: usize,
    pub ranges: &'a SignalRanges,
    /// Over what the residual swings.
    pub peaks: &'a ResidualShape,
}

/// Share of a residual's variance that is enough to follow signals.
const LEAST_SHARE: f64 = 0.05;
/// Nodes over the joint's own signals, and over those of other joints.
pub(super) const OWN_NODES: usize = 10;
pub(super) const OTHER_NODES: usize = 6;
/// Speeds and torques bend most near nothing: nodes stand evenly over asinh of the signal over this share of
/// its RMS, up to this many times its RMS.
const FINE: f64 = 0.05;
const FAR: f64 = 3.0;

impl Torque<'_> {
    /// RMS of the joint's speed \[rad/s, m/s\].
    pub fn speed(&self) -> f64 {
        self.ranges.joints[self.row].velocity_rms.max(1e-9)
    }

    /// RMS of the joint's torque \[N·m, N\].
    pub fn torque(&self) -> f64 {
        self.ranges.joints[self.row].torque_rms.max(1e-9)
    }

    /// The sign of the joint's speed.
    pub fn sign(&self) -> impl Fn(&Sample<'_>) -> f64 + Copy + Send + Sync + use<> {
        let (row, width) = (self.row, FINE * self.speed());
        move |sample| smooth_sign(sample.qd()[row], width)
    }

    /// `count` columns over some signals.
    pub fn shape(&self, signals: &[&str], count: usize, needs: Needs, columns: ShapeColumns) -> Shape {
        let signals = signals.iter().map(|signal| (*signal).to_owned()).collect();
        let effect = nameless_columns(self.fixed, self.row, count, needs, columns);
        Shape { signals, effect, least_share: LEAST_SHARE }
    }
}

/// What columns over the torque of the model need.
pub(super) fn of_torque() -> Needs {
    Needs { total_torque: true, ..Needs::default() }
}

/// The model's torque of a joint, its effects in it.
pub(super) fn torque_of(sample: &Sample<'_>, joint: usize) -> f64 {
    sample.total_torque().get(joint).copied().unwrap_or_default()
}

/// Writes the columns of one sample.
pub(in crate::trace) type ShapeColumns = Box<dyn Fn(&Sample<'_>, &mut [f64]) + Send + Sync>;

/// `count` columns in one joint's torque, as an effect without a name.
pub(in crate::trace) fn nameless_columns(
    fixed: &Fixed<'_>,
    row: usize,
    count: usize,
    needs: Needs,
    columns: ShapeColumns,
) -> Box<dyn Effect> {
    let parameters = vec![("height", ParameterKind::Torque, f64::NEG_INFINITY); count];
    let formula = move |sample: &Sample<'_>, out: &mut [f64]| columns(sample, out);
    Box::new(OwnTorque::new("shape", fixed.tree, row, &Constants::new(), &parameters, formula).needing(needs))
}

/// Nodes of a broken line: each column is one at its node, and falls to nothing at the next ones.
#[derive(Clone, Copy)]
pub(super) struct Nodes {
    /// The signal is bent by asinh over this, or not at all where it is infinite.
    fine: f64,
    first: f64,
    step: f64,
}

impl Nodes {
    pub fn even((first, last): (f64, f64), count: usize) -> Self {
        Nodes { fine: f64::INFINITY, first, step: (last - first).max(1e-9) / (count - 1) as f64 }
    }

    pub fn dense_at_zero(rms: f64, count: usize) -> Self {
        let last = (FAR / FINE).asinh();
        Nodes { fine: FINE * rms, first: -last, step: 2.0 * last / (count - 1) as f64 }
    }

    pub fn write(&self, signal: f64, columns: &mut [f64]) {
        let bent = if self.fine.is_finite() { (signal / self.fine).asinh() } else { signal };
        let place = ((bent - self.first) / self.step).clamp(0.0, (columns.len() - 1) as f64);
        columns.fill(0.0);
        let before = (place as usize).min(columns.len() - 2);
        columns[before + 1] = place - before as f64;
        columns[before] = 1.0 - columns[before + 1];
    }
}

#[cfg(test)]
mod tests {
    use super::Nodes;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn broken_lines_add_up_to_one(signal in -5.0..5.0f64, even in any::<bool>()) {
            let nodes = if even { Nodes::even((-1.0, 2.0), 7) } else { Nodes::dense_at_zero(0.6, 7) };
            let mut columns = [0.0; 7];
            nodes.write(signal, &mut columns);
            prop_assert!((columns.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            prop_assert!(columns.iter().all(|column| *column >= 0.0));
            // A broken line through the nodes' own places is the signal itself.
            if even && (-1.0..2.0).contains(&signal) {
                let line: f64 = (0..7).map(|node| columns[node] * (-1.0 + 0.5 * node as f64)).sum();
                prop_assert!((line - signal).abs() < 1e-12);
            }
        }
    }
}
