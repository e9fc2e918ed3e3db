//! Shapes over the signals of the joint itself: over one of them, and over two at once.

use super::shape::{Nodes, OTHER_NODES, OWN_NODES, Shape, ShapeColumns, Torque, of_torque, torque_of};
use phiw_identification::effect::Needs;

/// Nodes over the time where another signal is multiplied with it: a friction that jumps in mid-log is known
/// to a part of a log.
const TIME_NODES: usize = 12;

/// Broken lines over one signal each.
pub(super) fn single(torque: &Torque<'_>) -> Vec<Shape> {
    let row = torque.row;
    let position = Nodes::even(torque.ranges.joints[row].position, OWN_NODES);
    let speeds = Nodes::dense_at_zero(torque.speed(), OWN_NODES);
    let torques = Nodes::dense_at_zero(torque.torque(), OWN_NODES);
    let time = Nodes::even(torque.ranges.session, OTHER_NODES);
    let sign = torque.sign();
    let plain = |signal: &str, count: usize, columns: ShapeColumns| {
        let needs = Needs { torque: signal == "tau", ..Needs::default() };
        torque.shape(&[signal], count, needs, columns)
    };
    vec![
        plain(
            "q",
            // Once as it is, once with the sign of the velocity: friction may follow the position.
            2 * OWN_NODES,
            Box::new(move |sample, out| {
                position.write(sample.q()[row], &mut out[..OWN_NODES]);
                let sign = sign(sample);
                let (plain, signed) = out.split_at_mut(OWN_NODES);
                signed.iter_mut().zip(plain).for_each(|(signed, plain)| *signed = sign * *plain);
            }),
        ),
        plain("qd", OWN_NODES, Box::new(move |sample, out| speeds.write(sample.qd()[row], out))),
        plain(
            "qdd",
            2,
            Box::new(move |sample, out| {
                let acceleration = sample.qdd()[row];
                out.copy_from_slice(&[acceleration, acceleration.abs()]);
            }),
        ),
        plain(
            "tau",
            OWN_NODES + 1,
            Box::new(move |sample, out| {
                let torque = sample.reference_torque().get(row).copied().unwrap_or_default();
                torques.write(torque, &mut out[..OWN_NODES]);
                out[OWN_NODES] = torque.abs() * sign(sample);
            }),
        ),
        torque.shape(
            &["tau"],
            OWN_NODES,
            of_torque(),
            Box::new(move |sample, out| torques.write(torque_of(sample, row), out)),
        ),
        plain("t", OTHER_NODES, Box::new(move |sample, out| time.write(sample.time(), out))),
    ]
}

/// Products of two signals: a torque constant that follows the speed, friction or a delay that follows the
/// time.
pub(super) fn products(torque: &Torque<'_>) -> Vec<Shape> {
    let row = torque.row;
    let (speed, load) = (torque.speed(), torque.torque());
    let position = Nodes::even(torque.ranges.joints[row].position, OTHER_NODES);
    let time = Nodes::even(torque.ranges.session, TIME_NODES);
    let sign = torque.sign();
    vec![
        torque.shape(
            &["tau", "qd"],
            6,
            of_torque(),
            Box::new(move |sample, out| {
                let (torque, v) = (torque_of(sample, row) / load, sample.qd()[row] / speed);
                let of_speed = [v, v.abs(), v * v];
                for (place, of_speed) in of_speed.into_iter().enumerate() {
                    (out[place], out[3 + place]) = (torque * of_speed, torque.abs() * of_speed);
                }
            }),
        ),
        torque.shape(
            &["tau", "q"],
            OTHER_NODES,
            of_torque(),
            Box::new(move |sample, out| {
                position.write(sample.q()[row], out);
                let torque = torque_of(sample, row) / load;
                out.iter_mut().for_each(|column| *column *= torque);
            }),
        ),
        torque.shape(
            &["q", "qd"],
            2 * OTHER_NODES,
            Needs::default(),
            Box::new(move |sample, out| {
                let (v, (linear, squared)) = (sample.qd()[row] / speed, out.split_at_mut(OTHER_NODES));
                position.write(sample.q()[row], linear);
                for (linear, squared) in linear.iter_mut().zip(squared) {
                    (*linear, *squared) = (*linear * v, *linear * v * v.abs());
                }
            }),
        ),
        torque.shape(
            &["t", "qd"],
            2 * TIME_NODES,
            Needs::default(),
            Box::new(move |sample, out| {
                let (signed, linear) = out.split_at_mut(TIME_NODES);
                time.write(sample.time(), signed);
                let (sign, v) = (sign(sample), sample.qd()[row] / speed);
                for (signed, linear) in signed.iter_mut().zip(linear) {
                    (*signed, *linear) = (*signed * sign, *signed * v);
                }
            }),
        ),
        torque.shape(
            &["t", "tau"],
            2 * TIME_NODES,
            Needs { rates: true, ..of_torque() },
            Box::new(move |sample, out| {
                let (gain, delay) = out.split_at_mut(TIME_NODES);
                time.write(sample.time(), gain);
                let torque = torque_of(sample, row) / load;
                let rate = sample.total_torque_rate().get(row).copied().unwrap_or_default() / load;
                for (gain, delay) in gain.iter_mut().zip(delay) {
                    (*gain, *delay) = (*gain * torque, *gain * rate);
                }
            }),
        ),
    ]
}
