//! Shapes over the signals of other joints.

use super::shape::{Nodes, OTHER_NODES, Shape, Torque, of_torque, torque_of};
use phiw_dynamics::Tree;
use phiw_identification::effect::Needs;

/// Joints right before and right behind the joint `row` in the tree.
pub(super) fn neighbours(tree: &Tree, row: usize) -> Vec<usize> {
    let before = |joint: usize, other: usize| {
        let parent = tree.joint(joint).parent.map(|parent| &tree.bodies()[parent]);
        parent.is_some_and(|parent| parent.joint == tree.joint(other).joint)
    };
    (0..tree.joint_count()).filter(|&other| before(row, other) || before(other, row)).collect()
}

/// Nodes over each of two positions.
const PLANE_NODES: usize = 5;

/// Broken lines over the position and the speed of another joint, products of both joints' speeds, and what
/// is bilinear between nodes over both positions: a cable that pulls at a link further on.
pub(super) fn motion_of(torque: &Torque<'_>, other: usize) -> [Shape; 4] {
    let range = &torque.ranges.joints[other];
    let name = &torque.fixed.tree.joint(other).joint;
    let (row, own_speed, speed) = (torque.row, torque.speed(), range.velocity_rms.max(1e-9));
    let position = Nodes::even(range.position, OTHER_NODES);
    let speeds = Nodes::dense_at_zero(speed, OTHER_NODES);
    let [of_position, of_speed] = ["q", "qd"].map(|signal| format!("{signal}.{name}"));
    let plane = [row, other].map(|joint| Nodes::even(torque.ranges.joints[joint].position, PLANE_NODES));
    [
        torque.shape(
            &[&of_position],
            OTHER_NODES,
            Needs::default(),
            Box::new(move |sample, out| position.write(sample.q()[other], out)),
        ),
        torque.shape(
            &[&of_speed],
            OTHER_NODES,
            Needs::default(),
            Box::new(move |sample, out| speeds.write(sample.qd()[other], out)),
        ),
        torque.shape(
            &["qd", &of_speed],
            2,
            Needs::default(),
            Box::new(move |sample, out| {
                let (own, other) = (sample.qd()[row] / own_speed, sample.qd()[other] / speed);
                out.copy_from_slice(&[own * other, own.abs() * other]);
            }),
        ),
        torque.shape(
            &["q", &of_position],
            PLANE_NODES * PLANE_NODES,
            Needs::default(),
            Box::new(move |sample, out| {
                let mut lines = [[0.0; PLANE_NODES]; 2];
                for ((line, nodes), joint) in lines.iter_mut().zip(plane).zip([row, other]) {
                    nodes.write(sample.q()[joint], line);
                }
                for (columns, own) in out.chunks_exact_mut(PLANE_NODES).zip(lines[0]) {
                    columns.iter_mut().zip(lines[1]).for_each(|(column, other)| *column = own * other);
                }
            }),
        ),
    ]
}

/// The torque of another joint: a sensor, or a transmission, that feels it.
pub(super) fn torque_of_joint(torque: &Torque<'_>, other: usize) -> Shape {
    let rms = torque.ranges.joints[other].torque_rms.max(1e-9);
    let signal = format!("tau.{}", torque.fixed.tree.joint(other).joint);
    torque.shape(
        &[&signal],
        1,
        of_torque(),
        Box::new(move |sample, out| out[0] = torque_of(sample, other) / rms),
    )
}
