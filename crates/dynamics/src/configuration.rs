//! Configurations: the neutral one, and moving along a velocity.

use crate::check::check_size;
use crate::{DimensionError, Placement, Tree, Vec3};

/// Below this angle \[rad\] the exponential's coefficients come from their series: the neglected terms vanish
/// in rounding.
const SMALL_ANGLE: f64 = 1e-4;

impl Tree {
    /// The configuration with all coordinates zero and a floating base at the origin, upright.
    pub fn neutral_configuration(&self) -> Vec<f64> {
        let mut q = vec![0.0; self.configuration_size()];
        if self.is_floating() {
            q[6] = 1.0;
        }
        q
    }

    /// Where the configuration is after moving with the constant velocity `v` for the time `duration`.
    ///
    /// A floating base moves along a screw (the exponential of its body velocity), and its quaternion stays
    /// unit.
    ///
    /// # Errors
    /// A slice does not fit this robot.
    pub fn integrate(
        &self,
        q: &[f64],
        v: &[f64],
        duration: f64,
        result: &mut [f64],
    ) -> Result<(), DimensionError> {
        self.check_state(q, v)?;
        check_size("the resulting configuration", result.len(), self.configuration_size())?;
        let (mut first_q, mut first_v) = (0, 0);
        if self.is_floating() {
            let moved = move_base(q, v, duration);
            result[..7].copy_from_slice(&moved);
            (first_q, first_v) = (7, 6);
        }
        for (index, &velocity) in v[first_v..].iter().enumerate() {
            result[first_q + index] = q[first_q + index] + velocity * duration;
        }
        Ok(())
    }
}

/// The base's seven coordinates after a constant body velocity.
fn move_base(q: &[f64], v: &[f64], duration: f64) -> [f64; 7] {
    let linear = Vec3([v[0], v[1], v[2]]).scale(duration);
    let turn = Vec3([v[3], v[4], v[5]]).scale(duration);
    let angle_squared = turn.dot(turn);
    let angle = angle_squared.sqrt();
    // (1 − cos θ)/θ², (θ − sin θ)/θ³, sin(θ/2)/θ
    let (versine, lag, half_sine) = if angle < SMALL_ANGLE {
        (0.5 - angle_squared / 24.0, 1.0 / 6.0 - angle_squared / 120.0, 0.5 - angle_squared / 48.0)
    } else {
        (
            (1.0 - angle.cos()) / angle_squared,
            (angle - angle.sin()) / (angle_squared * angle),
            (0.5 * angle).sin() / angle,
        )
    };
    let swept = linear + turn.cross(linear).scale(versine) + turn.cross(turn.cross(linear)).scale(lag);
    let Placement { rotation, translation } = crate::motion::floating_placement(q);
    let [x, y, z] = (translation + rotation * swept).0;
    let [tx, ty, tz] = turn.scale(half_sine).0;
    let [qx, qy, qz, qw] =
        normalised(quaternion_product([q[3], q[4], q[5], q[6]], [tx, ty, tz, (0.5 * angle).cos()]));
    [x, y, z, qx, qy, qz, qw]
}

/// Hamilton's product of quaternions `(x, y, z, w)`.
pub(crate) fn quaternion_product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    let (u, v) = (Vec3([a[0], a[1], a[2]]), Vec3([b[0], b[1], b[2]]));
    let [x, y, z] = (u.cross(v) + v.scale(a[3]) + u.scale(b[3])).0;
    [x, y, z, a[3] * b[3] - u.dot(v)]
}

/// The quaternion scaled to unit length.
pub(crate) fn normalised(quaternion: [f64; 4]) -> [f64; 4] {
    let norm = quaternion.iter().map(|x| x * x).sum::<f64>().sqrt();
    quaternion.map(|x| x / norm)
}
