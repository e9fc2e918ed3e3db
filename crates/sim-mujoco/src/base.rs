//! Between phiw's coordinates of a floating base and MuJoCo's.
//!
//! phiw (Pinocchio) has `[position, quaternion xyzw]` and the linear and angular velocity in the base's
//! frame, of which accelerations are the time derivatives, component by component. MuJoCo has `[position,
//! quaternion wxyz]`, the linear velocity along the world's axes, and the angular velocity in the base's
//! frame. With the base's rotation `R`, linear velocity `v` and angular velocity `ω`:
//!
//! - velocity: `ẋ = R·v`
//! - acceleration: `ẍ = R·(a + ω × v)`
//! - force: power must be the same, so `f_world = R·f`, and the moment stays.
//!
//! Joints are the same in both, after the base.

use phiw_dynamics::{Mat3, Vec3};

/// A state of motion in MuJoCo's coordinates.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Motion {
    pub position: Vec<f64>,
    pub velocity: Vec<f64>,
    pub acceleration: Vec<f64>,
}

impl Motion {
    pub fn zero(positions: usize, velocities: usize) -> Self {
        Motion {
            position: vec![0.0; positions],
            velocity: vec![0.0; velocities],
            acceleration: vec![0.0; velocities],
        }
    }
}

/// The base's rotation, from phiw's configuration; the quaternion need not be quite unit.
pub(crate) fn rotation(q: &[f64]) -> Mat3<f64> {
    let [_, _, _, w, x, y, z] = position_to(q);
    Mat3::from_quaternion([x, y, z, w])
}

/// MuJoCo's position of the base, its quaternion normalised.
pub(crate) fn position_to(q: &[f64]) -> [f64; 7] {
    let length = q[3..7].iter().map(|x| x * x).sum::<f64>().sqrt();
    [q[0], q[1], q[2], q[6] / length, q[3] / length, q[4] / length, q[5] / length]
}

/// phiw's position of the base.
pub(crate) fn position_from(position: &[f64]) -> [f64; 7] {
    let [x, y, z, qw, qx, qy, qz] = std::array::from_fn(|i| position[i]);
    [x, y, z, qx, qy, qz, qw]
}

/// MuJoCo's velocity of the base, or force on it.
pub(crate) fn velocity_to(rotation: Mat3<f64>, v: &[f64]) -> [f64; 6] {
    halves(rotation * first(v), second(v))
}

/// phiw's velocity of the base, or force on it.
pub(crate) fn velocity_from(rotation: Mat3<f64>, velocity: &[f64]) -> [f64; 6] {
    halves(rotation.transpose_mul(first(velocity)), second(velocity))
}

/// MuJoCo's acceleration of the base, which moves with phiw's velocity `v`.
pub(crate) fn acceleration_to(rotation: Mat3<f64>, v: &[f64], a: &[f64]) -> [f64; 6] {
    halves(rotation * (first(a) + second(v).cross(first(v))), second(a))
}

/// phiw's acceleration of the base, which moves with phiw's velocity `v`.
pub(crate) fn acceleration_from(rotation: Mat3<f64>, v: &[f64], acceleration: &[f64]) -> [f64; 6] {
    halves(rotation.transpose_mul(first(acceleration)) - second(v).cross(first(v)), second(acceleration))
}

fn first(vector: &[f64]) -> Vec3<f64> {
    Vec3([vector[0], vector[1], vector[2]])
}

fn second(vector: &[f64]) -> Vec3<f64> {
    Vec3([vector[3], vector[4], vector[5]])
}

fn halves(Vec3([a, b, c]): Vec3<f64>, Vec3([d, e, f]): Vec3<f64>) -> [f64; 6] {
    [a, b, c, d, e, f]
}
