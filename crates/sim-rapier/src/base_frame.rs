//! A floating base between two frames: ours, at the URDF's origin and moving with the base, and the engine's,
//! at the base's centre of mass with velocities along the world's axes.
//!
//! The engine takes the rate of its six base velocities for their acceleration; with the centre of mass at
//! the root's origin that is true, elsewhere the base drifts.

use phiw_dynamics::{Mat3, Placement, Spatial, Vec3};

/// Where a base is that the seven coordinates of a configuration place.
pub(crate) fn placement(q: &[f64]) -> Placement<f64> {
    let length = q[3..7].iter().map(|x| x * x).sum::<f64>().sqrt();
    Placement {
        rotation: Mat3::from_quaternion([q[3] / length, q[4] / length, q[5] / length, q[6] / length]),
        translation: Vec3([q[0], q[1], q[2]]),
    }
}

/// The two halves of the first six elements.
pub(crate) fn spatial(v: &[f64]) -> Spatial<f64> {
    Spatial { linear: Vec3([v[0], v[1], v[2]]), angular: Vec3([v[3], v[4], v[5]]) }
}

/// Writes both halves to the first six elements.
pub(crate) fn store(spatial: Spatial<f64>, to: &mut [f64]) {
    to[..3].copy_from_slice(&spatial.linear.0);
    to[3..6].copy_from_slice(&spatial.angular.0);
}

/// Velocity in the engine's coordinates. `center` is the centre of mass in the base's frame.
pub(crate) fn engine_velocity(rotation: Mat3<f64>, center: Vec3<f64>, own: Spatial<f64>) -> Spatial<f64> {
    Spatial { linear: rotation * (own.linear + own.angular.cross(center)), angular: rotation * own.angular }
}

/// The inverse of [`engine_velocity`].
pub(crate) fn own_velocity(rotation: Mat3<f64>, center: Vec3<f64>, engine: Spatial<f64>) -> Spatial<f64> {
    let angular = rotation.transpose_mul(engine.angular);
    Spatial { linear: rotation.transpose_mul(engine.linear) - angular.cross(center), angular }
}

/// Acceleration in the engine's coordinates: that of the centre of mass along the world's axes, from the
/// base's spatial one.
pub(crate) fn engine_acceleration(
    rotation: Mat3<f64>,
    center: Vec3<f64>,
    velocity: Spatial<f64>,
    own: Spatial<f64>,
) -> Spatial<f64> {
    let Spatial { linear, angular } = own;
    let carried = velocity.angular.cross(velocity.linear + velocity.angular.cross(center));
    Spatial { linear: rotation * (linear + angular.cross(center) + carried), angular: rotation * angular }
}

/// The inverse of [`engine_acceleration`].
pub(crate) fn own_acceleration(
    rotation: Mat3<f64>,
    center: Vec3<f64>,
    velocity: Spatial<f64>,
    engine: Spatial<f64>,
) -> Spatial<f64> {
    let angular = rotation.transpose_mul(engine.angular);
    let carried = velocity.angular.cross(velocity.linear + velocity.angular.cross(center));
    Spatial { linear: rotation.transpose_mul(engine.linear) - angular.cross(center) - carried, angular }
}

/// Force and moment about the centre of mass along the world's axes, from those at the base's origin.
pub(crate) fn engine_force(rotation: Mat3<f64>, center: Vec3<f64>, own: Spatial<f64>) -> Spatial<f64> {
    Spatial { linear: rotation * own.linear, angular: rotation * (own.angular - center.cross(own.linear)) }
}

/// The inverse of [`engine_force`].
pub(crate) fn own_force(rotation: Mat3<f64>, center: Vec3<f64>, engine: Spatial<f64>) -> Spatial<f64> {
    let linear = rotation.transpose_mul(engine.linear);
    Spatial { linear, angular: rotation.transpose_mul(engine.angular) + center.cross(linear) }
}
