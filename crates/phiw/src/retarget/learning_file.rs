//! A motion as programs that learn to track motions read it: a npz with the joints and all bodies over time.
//!
//! The names are those of the motion files of BeyondMimic, Isaac Lab and mjlab: `fps` \[Hz\], `joint_pos`,
//! `joint_vel` `[frame, joint]` \[rad, m, /s\], `body_pos_w` `[frame, body, 3]` \[m\], `body_quat_w` `[frame,
//! body, 4]` (w, x, y, z), `body_lin_vel_w`, `body_ang_vel_w` \[m/s, rad/s\], along the world's axes and at
//! the body's origin. `joint_names` and `body_names` say what they are of: the robot's moving joints, and the
//! links that they carry. The base stands at the origin.

use phiw_bspline_retarget::npz::{Array, NpzWriter};
use phiw_dynamics::{DimensionError, Mat3, Placement, Tree, Vec3};
use std::io;

/// The file's bytes; positions and velocities are `[frame × joint]`.
pub fn learning_file(tree: &Tree, rate_hz: f64, q: &[f64], qd: &[f64]) -> io::Result<Vec<u8>> {
    let bodies = Bodies::over(tree, q, qd).map_err(|error| io::Error::other(error.to_string()))?;
    let (joints, count) = (tree.joint_count(), tree.bodies().len());
    let frames = q.len() / joints.max(1);
    let mut writer = NpzWriter::default();
    let mut put = |name: &str, shape: &[usize], values: Vec<f64>| {
        writer.numbers(name, &Array { shape: shape.to_vec(), values });
    };
    put("fps", &[1], vec![rate_hz]);
    put("joint_pos", &[frames, joints], q.to_vec());
    put("joint_vel", &[frames, joints], qd.to_vec());
    put("body_pos_w", &[frames, count, 3], bodies.positions);
    put("body_quat_w", &[frames, count, 4], bodies.quaternions);
    put("body_lin_vel_w", &[frames, count, 3], bodies.linear);
    put("body_ang_vel_w", &[frames, count, 3], bodies.angular);
    writer.names("joint_names", &tree.joint_names().map(str::to_owned).collect::<Vec<_>>());
    writer.names("body_names", &tree.bodies().iter().map(|body| body.link.clone()).collect::<Vec<_>>());
    writer.finish()
}

/// Where all bodies are and how they move, frame by frame.
#[derive(Default)]
struct Bodies {
    positions: Vec<f64>,
    quaternions: Vec<f64>,
    linear: Vec<f64>,
    angular: Vec<f64>,
}

impl Bodies {
    fn over(tree: &Tree, q: &[f64], qd: &[f64]) -> Result<Self, DimensionError> {
        let (joints, count) = (tree.joint_count(), tree.bodies().len());
        let mut bodies = Bodies::default();
        let mut placements = vec![Placement::identity(); count];
        let mut jacobian = vec![0.0; 6 * tree.velocity_size()];
        let mut before: Vec<[f64; 4]> = Vec::new();
        for (q, qd) in q.chunks_exact(joints.max(1)).zip(qd.chunks_exact(joints.max(1))) {
            tree.forward_kinematics(q, &mut placements)?;
            let mut now = Vec::with_capacity(count);
            for (body, placement) in placements.iter().enumerate() {
                bodies.positions.extend(placement.translation.0);
                let quaternion = quaternion(&placement.rotation);
                // A quaternion and its negative are one rotation: the one that goes on from the frame before.
                let along = before.get(body).map_or(1.0, |before| dot(before, &quaternion));
                let quaternion = quaternion.map(|value| if along < 0.0 { -value } else { value });
                bodies.quaternions.extend(quaternion);
                now.push(quaternion);
                tree.point_jacobian(&placements, body, Vec3([0.0; 3]), &mut jacobian)?;
                let rate = |row: &[f64]| row.iter().zip(qd).map(|(a, b)| a * b).sum::<f64>();
                let rates: Vec<f64> = jacobian.chunks_exact(joints.max(1)).map(rate).collect();
                bodies.linear.extend(&rates[..3]);
                bodies.angular.extend(&rates[3..]);
            }
            before = now;
        }
        Ok(bodies)
    }
}

fn dot(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// w, x, y, z of a rotation, from its largest component (Shepperd 1978).
fn quaternion(rotation: &Mat3<f64>) -> [f64; 4] {
    let m = |row: usize, column: usize| rotation.0[row][column];
    let trace = m(0, 0) + m(1, 1) + m(2, 2);
    let largest = (0..3).max_by(|&a, &b| m(a, a).total_cmp(&m(b, b))).unwrap_or_default();
    if trace >= m(largest, largest) {
        let w = 0.5 * (1.0 + trace).sqrt();
        let scale = 0.25 / w;
        return [w, scale * (m(2, 1) - m(1, 2)), scale * (m(0, 2) - m(2, 0)), scale * (m(1, 0) - m(0, 1))];
    }
    let (i, j, k) = (largest, (largest + 1) % 3, (largest + 2) % 3);
    let own = 0.5 * (1.0 + m(i, i) - m(j, j) - m(k, k)).sqrt();
    let scale = 0.25 / own;
    let mut quaternion = [scale * (m(k, j) - m(j, k)), 0.0, 0.0, 0.0];
    quaternion[1 + i] = own;
    quaternion[1 + j] = scale * (m(j, i) + m(i, j));
    quaternion[1 + k] = scale * (m(k, i) + m(i, k));
    quaternion
}

#[cfg(test)]
mod tests {
    use super::*;
    use phiw_dynamics::random_tree::{RandomNumbers, RandomTreeOptions, random_tree};

    #[test]
    fn a_quaternion_gives_its_rotation_back() {
        let mut random = RandomNumbers::new(4);
        for _ in 0..500 {
            let mut q: [f64; 4] = std::array::from_fn(|_| random.uniform(-1.0, 1.0));
            let norm = dot(&q, &q).sqrt();
            q = q.map(|value| value / norm);
            let [w, x, y, z] = q;
            let found = quaternion(&Mat3::from_quaternion([x, y, z, w]));
            assert!((dot(&found, &q).abs() - 1.0).abs() < 1e-12, "{found:?} {q:?}");
        }
    }

    /// Velocities are the rates of the poses: against differences of them over a small step.
    #[test]
    fn bodies_move_as_fast_as_their_poses_change() {
        let options = RandomTreeOptions { joints: 6, mimic: true, ..RandomTreeOptions::default() };
        let tree = random_tree(11, &options).unwrap();
        let (joints, count) = (tree.joint_count(), tree.bodies().len());
        let mut random = RandomNumbers::new(2);
        let q: Vec<f64> = (0..joints).map(|_| random.uniform(-1.0, 1.0)).collect();
        let qd: Vec<f64> = (0..joints).map(|_| random.uniform(-1.0, 1.0)).collect();
        let step = 1e-6;
        let at = |sign: f64| q.iter().zip(&qd).map(move |(q, qd)| q + sign * step * qd).collect::<Vec<_>>();
        let frames = [at(-1.0), q.clone(), at(1.0)].concat();
        let bodies = Bodies::over(&tree, &frames, &qd.repeat(3)).unwrap();
        let frame = |values: &[f64], frame: usize, width: usize| {
            values[frame * count * width..(frame + 1) * count * width].to_vec()
        };
        let rate = |values: &[f64], width: usize| -> Vec<f64> {
            let (before, after) = (frame(values, 0, width), frame(values, 2, width));
            before.iter().zip(&after).map(|(a, b)| (b - a) / (2.0 * step)).collect()
        };
        for (found, expected) in frame(&bodies.linear, 1, 3).iter().zip(rate(&bodies.positions, 3)) {
            assert!((found - expected).abs() < 1e-7, "{found} {expected}");
        }
        // ω = 2·q̇·q⁻¹, of quaternions w, x, y, z.
        let (quaternions, rates) = (frame(&bodies.quaternions, 1, 4), rate(&bodies.quaternions, 4));
        let angular = frame(&bodies.angular, 1, 3);
        for ((q, rate), omega) in quaternions
            .as_chunks::<4>()
            .0
            .iter()
            .zip(rates.as_chunks::<4>().0)
            .zip(angular.as_chunks::<3>().0)
        {
            let ([w, x, y, z], [dw, dx, dy, dz]) = (*q, *rate);
            let expected = [
                2.0 * (-dw * x + dx * w - dy * z + dz * y),
                2.0 * (-dw * y + dx * z + dy * w - dz * x),
                2.0 * (-dw * z - dx * y + dy * x + dz * w),
            ];
            for (found, expected) in omega.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-7, "{omega:?} {expected}");
            }
        }
    }
}
