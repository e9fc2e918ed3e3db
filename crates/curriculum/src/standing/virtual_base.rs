//! A floating base as a chain of six joints without motors (Mistry, Schaal & Yamane 2009).
//!
//! A base that floats has seven coordinates and six velocities in its own frame. As a chain of three slides
//! and three hinges without mass it has six of each, like all other joints, and everything that is made for a
//! robot on a fixed base works for it: the "torque" of a virtual joint is the part of the floor's wrench
//! along it. The price is a singularity where the base leans by 90°, long after a fall.

use phiw_dynamics::Mat3;
use std::fmt::Write;

/// The virtual joints, in their order: slides along the world's axes, then turns about z, y and x.
pub const VIRTUAL_JOINTS: [&str; 6] = ["base_x", "base_y", "base_z", "base_yaw", "base_pitch", "base_roll"];

const AXES: [&str; 6] = ["1 0 0", "0 1 0", "0 0 1", "0 0 1", "0 1 0", "1 0 0"];

/// The URDF with the virtual joints before its root link, to be read with a fixed base. Bodies 0 to 4 of the
/// tree have no mass, body 5 is the root.
///
/// None if the text does not end like a URDF, or has such joints already.
pub fn with_virtual_base(urdf: &str, root_link: &str) -> Option<String> {
    let (robot, rest) = urdf.rsplit_once("</robot>")?;
    if VIRTUAL_JOINTS.iter().any(|joint| urdf.contains(&format!("\"{joint}\""))) {
        return None;
    }
    let mut text = String::from(robot);
    let mut parent = "virtual_world".to_owned();
    // Writing to a string does not fail.
    let _ = writeln!(text, "<link name=\"{parent}\"/>");
    for (index, (joint, axis)) in VIRTUAL_JOINTS.iter().zip(AXES).enumerate() {
        let kind = if index < 3 { "prismatic" } else { "continuous" };
        let child = if index == 5 { root_link.to_owned() } else { format!("{joint}_link") };
        let _ = writeln!(
            text,
            "<joint name=\"{joint}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/><axis xyz=\"{axis}\"/></joint>"
        );
        if index < 5 {
            let _ = writeln!(text, "<link name=\"{child}\"/>");
        }
        parent = child;
    }
    Some(text + "</robot>" + rest)
}

/// Positions and velocities of the virtual joints for the seven coordinates of a floating base and its
/// velocity in its own frame, linear then angular.
pub fn base_coordinates(base: &[f64; 7], velocity: &[f64; 6]) -> [[f64; 6]; 2] {
    let [x, y, z, quaternion @ ..] = *base;
    let Mat3(r) = Mat3::from_quaternion(quaternion);
    let (yaw, roll) = (r[1][0].atan2(r[0][0]), r[2][1].atan2(r[2][2]));
    let pitch = (-r[2][0]).atan2(r[2][1].hypot(r[2][2]));
    let along = |axis: usize| (0..3).map(|k| r[axis][k] * velocity[k]).sum();
    let [_, _, _, wx, wy, wz] = *velocity;
    let ((sr, cr), (sp, cp)) = (roll.sin_cos(), pitch.sin_cos());
    let yawing = (wy * sr + wz * cr) / cp;
    let speeds = [along(0), along(1), along(2), yawing, wy * cr - wz * sr, wx + yawing * sp];
    [[x, y, z, yaw, pitch, roll], speeds]
}

#[cfg(test)]
mod tests {
    use super::*;
    use phiw_dynamics::random_tree::{RandomNumbers, random_state};
    use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
    use phiw_dynamics::{Placement, Workspace};

    const URDF: &str = include_str!("../../../../models/humanoid30.urdf");

    /// The chain and the floating base are the same robot: places of all links, and the torques of its
    /// joints.
    #[test]
    fn the_chain_moves_like_a_floating_base() {
        let floating =
            read_urdf(URDF, &UrdfOptions { floating_base: true, ..UrdfOptions::default() }).unwrap().tree;
        let text = with_virtual_base(URDF, &floating.bodies()[0].link).unwrap();
        let chain = read_urdf(&text, &UrdfOptions::default()).unwrap().tree;
        assert_eq!(chain.joint_count(), floating.joint_count() + 6);
        assert!(chain.joint_names().skip(6).eq(floating.joint_names()));
        assert!(with_virtual_base(&text, "pelvis").is_none());
        let mut rng = RandomNumbers::new(3);
        for _ in 0..20 {
            let state = random_state(&floating, &mut rng);
            let base: [f64; 7] = std::array::from_fn(|k| state.q[k]);
            let velocity: [f64; 6] = std::array::from_fn(|k| state.v[k]);
            let [q_base, v_base] = base_coordinates(&base, &velocity);
            let (mut q, mut v) = (q_base.to_vec(), v_base.to_vec());
            q.extend_from_slice(&state.q[7..]);
            v.extend_from_slice(&state.v[6..]);
            let [mut places, mut others] =
                [&floating, &chain].map(|tree| vec![Placement::identity(); tree.bodies().len()]);
            floating.forward_kinematics(&state.q, &mut places).unwrap();
            chain.forward_kinematics(&q, &mut others).unwrap();
            for (one, other) in places.iter().zip(&others[5..]) {
                assert!((0..3).all(|k| (one.translation.0[k] - other.translation.0[k]).abs() < 1e-9));
            }
            // Velocity products and gravity: with the accelerations that the free fall of one gives, the
            // other needs no force either.
            let mut falling = vec![0.0; floating.velocity_size()];
            let still = vec![0.0; floating.velocity_size()];
            floating
                .forward_dynamics(&state.q, &state.v, &still, &mut Workspace::new(&floating), &mut falling)
                .unwrap();
            // The last hundredth of a millisecond of the chain's velocity, by integrating the floating base.
            let step = 1e-6;
            let moved = |sign: f64| {
                let (mut next_q, half) = (state.q.clone(), sign * step);
                let v: Vec<f64> = state.v.iter().zip(&falling).map(|(v, a)| v + half * a).collect();
                let middle: Vec<f64> =
                    state.v.iter().zip(&falling).map(|(v, a)| v + 0.5 * half * a).collect();
                floating.integrate(&state.q, &middle, half, &mut next_q).unwrap();
                let base: [f64; 7] = std::array::from_fn(|k| next_q[k]);
                let velocity: [f64; 6] = std::array::from_fn(|k| v[k]);
                base_coordinates(&base, &velocity)[1]
            };
            let (after, before) = (moved(1.0), moved(-1.0));
            let mut a: Vec<f64> = (0..6).map(|k| (after[k] - before[k]) / (2.0 * step)).collect();
            a.extend_from_slice(&falling[6..]);
            let mut force = vec![0.0; chain.velocity_size()];
            let needed = chain.inverse_dynamics(&q, &v, &a, &mut Workspace::new(&chain), &mut force);
            needed.unwrap();
            let largest = force.iter().fold(0.0_f64, |largest, force| largest.max(force.abs()));
            assert!(largest < 1e-2, "{largest}");
        }
    }
}
