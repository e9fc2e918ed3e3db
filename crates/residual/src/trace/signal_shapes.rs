//! Shapes without a name: broken lines over one signal, for whatever a torque may follow.

use super::stage::Fixed;
use phiw_dynamics::Tree;
use phiw_effects::{Constants, OwnTorque, ParameterKind, SignalRanges, smooth_sign};
use phiw_identification::{Effect, Needs, Sample};

/// A signal, as in `report.json`, and broken lines over it in one joint's torque.
pub(super) type Shape = (String, Box<dyn Effect>);

/// Nodes over the joint's own signals, and over those of other joints.
const OWN_NODES: usize = 10;
const OTHER_NODES: usize = 6;
/// The signal of swings over the time.
pub(super) const SWINGS: &str = "swings";
/// Swings over the time that are tried.
const LINES: usize = 2;
/// Speeds and torques bend most near nothing: nodes stand evenly over asinh of the signal over this share of
/// its RMS, up to this many times its RMS.
const FINE: f64 = 0.05;
const FAR: f64 = 3.0;

/// Shapes over the own signals of the joint `row`; `lines` are the angular frequencies \[rad/s\] at which its
/// residual swings.
pub(super) fn own_shapes(fixed: &Fixed<'_>, row: usize, ranges: &SignalRanges, lines: &[f64]) -> Vec<Shape> {
    let lines: Vec<f64> = lines.iter().copied().take(LINES).collect();
    let range = &ranges.joints[row];
    let speed = range.velocity_rms.max(1e-9);
    let torque = range.torque_rms.max(1e-9);
    let (start, end) = ranges.session;
    let position = Nodes::even(range.position, OWN_NODES);
    let (speeds, torques) = (Nodes::dense_at_zero(speed, OWN_NODES), Nodes::dense_at_zero(torque, OWN_NODES));
    let time = Nodes::even((start, end), OTHER_NODES);
    let shape = |signal: &str, count: usize, columns: ShapeColumns| {
        let needs = Needs { torque: signal == "tau", ..Default::default() };
        (signal.to_owned(), effect(fixed, row, count, needs, columns))
    };
    vec![
        shape(
            "q",
            // Once as it is, once with the sign of the velocity: friction may follow the position.
            2 * OWN_NODES,
            Box::new(move |sample, out| {
                position.write(sample.q()[row], &mut out[..OWN_NODES]);
                let sign = smooth_sign(sample.qd()[row], FINE * speed);
                let (plain, signed) = out.split_at_mut(OWN_NODES);
                signed.iter_mut().zip(plain).for_each(|(signed, plain)| *signed = sign * *plain);
            }),
        ),
        shape("qd", OWN_NODES, Box::new(move |sample, out| speeds.write(sample.qd()[row], out))),
        shape(
            "qdd",
            2,
            Box::new(move |sample, out| {
                let acceleration = sample.qdd()[row];
                out.copy_from_slice(&[acceleration, acceleration.abs()]);
            }),
        ),
        shape(
            "tau",
            OWN_NODES + 1,
            Box::new(move |sample, out| {
                let torque = sample.reference_torque().get(row).copied().unwrap_or_default();
                torques.write(torque, &mut out[..OWN_NODES]);
                out[OWN_NODES] = torque.abs() * smooth_sign(sample.qd()[row], FINE * speed);
            }),
        ),
        shape("t", OTHER_NODES, Box::new(move |sample, out| time.write(sample.time(), out))),
        shape(
            SWINGS,
            2 * lines.len(),
            Box::new(move |sample, out| {
                for (pair, line) in out.chunks_exact_mut(2).zip(&lines) {
                    (pair[0], pair[1]) = (line * sample.time()).sin_cos();
                }
            }),
        ),
    ]
}

/// Joints right before and right behind the joint `row` in the tree.
pub(super) fn neighbours(tree: &Tree, row: usize) -> Vec<usize> {
    let before = |joint: usize, other: usize| {
        let parent = tree.joint(joint).parent.map(|parent| &tree.bodies()[parent]);
        parent.is_some_and(|parent| parent.joint == tree.joint(other).joint)
    };
    (0..tree.joint_count()).filter(|&other| before(row, other) || before(other, row)).collect()
}

/// Shapes over the positions and speeds of the joints `others`, in the torque of the joint `row`.
pub(super) fn other_shapes(
    fixed: &Fixed<'_>,
    row: usize,
    others: impl IntoIterator<Item = usize>,
    ranges: &SignalRanges,
) -> Vec<Shape> {
    let of_joint = |other: usize| {
        let range = &ranges.joints[other];
        let name = &fixed.tree.joint(other).joint;
        let position = Nodes::even(range.position, OTHER_NODES);
        let speed = Nodes::dense_at_zero(range.velocity_rms.max(1e-9), OTHER_NODES);
        let shape = |columns: ShapeColumns| effect(fixed, row, OTHER_NODES, Needs::default(), columns);
        [
            (format!("q.{name}"), shape(Box::new(move |sample, out| position.write(sample.q()[other], out)))),
            (format!("qd.{name}"), shape(Box::new(move |sample, out| speed.write(sample.qd()[other], out)))),
        ]
    };
    others.into_iter().flat_map(of_joint).collect()
}

/// Writes the columns of one sample.
type ShapeColumns = Box<dyn Fn(&Sample<'_>, &mut [f64]) + Send + Sync>;

fn effect(
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
struct Nodes {
    /// The signal is bent by asinh over this, or not at all where it is infinite.
    fine: f64,
    first: f64,
    step: f64,
}

impl Nodes {
    fn even((first, last): (f64, f64), count: usize) -> Self {
        Nodes { fine: f64::INFINITY, first, step: (last - first).max(1e-9) / (count - 1) as f64 }
    }

    fn dense_at_zero(rms: f64, count: usize) -> Self {
        let last = (FAR / FINE).asinh();
        Nodes { fine: FINE * rms, first: -last, step: 2.0 * last / (count - 1) as f64 }
    }

    fn write(&self, signal: f64, columns: &mut [f64]) {
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
