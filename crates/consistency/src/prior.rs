//! Priors for all bodies of a robot, possible whatever its description says.

use crate::small_matrix::Square;
use crate::{PARAMETERS_PER_BODY, PseudoInertia};

/// What is taken for a body of which a robot's description says nothing, or nothing possible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PriorSettings {
    /// Mass of a body without mass, over the mean mass of those that have one. A link without inertia in a
    /// URDF is mostly a bracket or a frame, seldom a casting.
    pub least_mass: f64,
    /// Where no body has a mass: that of a body, over the cube of the robot's length \[kg/m³\]. Arms of 0.2
    /// to 3 m weigh 50 to 200 of these for each link.
    pub density: f64,
    /// Radius of gyration, over the robot's length, of a body without extent, and the least along any axis of
    /// one that is impossible. A point mass in a URDF is some flange or load.
    pub least_radius: f64,
    /// The least that a possible body's may be: below that it is as good as flat, and any error of the
    /// tensor's last digits decides whether it is possible.
    pub flat: f64,
}

impl Default for PriorSettings {
    fn default() -> Self {
        PriorSettings { least_mass: 0.05, density: 100.0, least_radius: 0.05, flat: 1e-3 }
    }
}

/// The bodies of a robot's description, each one that is impossible replaced by the nearest thing that is
/// possible: mass and centre of mass stay where there is a mass, and the second moments about the centre are
/// lifted to those of a small body. `length` is the robot's own \[m\], such as the mean distance between
/// joints.
pub fn possible_priors(
    description: &[[f64; PARAMETERS_PER_BODY]],
    length: f64,
    settings: &PriorSettings,
) -> Vec<[f64; PARAMETERS_PER_BODY]> {
    let length = if length.is_finite() && length > 0.0 { length } else { 1.0 };
    let masses: Vec<f64> =
        description.iter().map(|body| body[0]).filter(|mass| mass.is_finite() && *mass > 0.0).collect();
    let least_mass = match masses.len() {
        0 => settings.density * length.powi(3),
        count => settings.least_mass * masses.iter().sum::<f64>() / count as f64,
    };
    description.iter().map(|body| possible(body, least_mass, length, settings)).collect()
}

fn possible(
    body: &[f64; PARAMETERS_PER_BODY],
    least_mass: f64,
    length: f64,
    settings: &PriorSettings,
) -> [f64; PARAMETERS_PER_BODY] {
    let is_finite = body.iter().all(|value| value.is_finite());
    if !is_finite || body[0] <= 0.0 {
        return sphere(least_mass, settings.least_radius * length);
    }
    let (mass, whole) = (body[0], PseudoInertia::of_parameters(body).0);
    let center: [f64; 3] = std::array::from_fn(|axis| whole.at(axis, 3) / mass);
    let about_center =
        Square::from_fn(3, |row, column| whole.at(row, column) - mass * center[row] * center[column]);
    let (moments, axes) = about_center.eigen();
    let flat = mass * (settings.flat * length).powi(2);
    if moments.iter().all(|moment| *moment >= flat) {
        return *body;
    }
    let least = mass * (settings.least_radius * length).powi(2);
    let lifted = Square::from_fn(3, |row, column| if row == column { moments[row].max(least) } else { 0.0 });
    let lifted = axes.congruence(&lifted);
    PseudoInertia(Square::from_fn(4, |row, column| match (row, column) {
        (3, 3) => mass,
        (3, axis) | (axis, 3) => mass * center[axis],
        _ => lifted.at(row, column) + mass * center[row] * center[column],
    }))
    .parameters()
}

/// A body of this mass at its joint's origin, with this radius of gyration along each axis.
fn sphere(mass: f64, radius: f64) -> [f64; PARAMETERS_PER_BODY] {
    let moment = 2.0 * mass * radius * radius;
    [mass, 0.0, 0.0, 0.0, moment, 0.0, moment, 0.0, 0.0, moment]
}

#[cfg(test)]
mod tests {
    use super::{PriorSettings, possible_priors};
    use crate::PseudoInertia;

    #[test]
    fn every_prior_is_possible_and_what_was_possible_stays() {
        let ball = [2.0, 0.2, 0.0, 0.0, 0.1, 0.0, 0.12, 0.0, 0.0, 0.12];
        let point = [3.0, 0.3, 0.6, 0.0, 0.12, -0.06, 0.03, 0.0, 0.0, 0.15];
        let bodies = [
            ball,
            [0.0; 10],
            point,
            [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.1, 0.0, 0.0, 0.1],
            [-1.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.1, 0.0, 0.0, 0.1],
            [f64::NAN; 10],
        ];
        let settings = PriorSettings::default();
        let priors = possible_priors(&bodies, 0.4, &settings);
        assert_eq!(priors[0], ball);
        assert_eq!(priors[2][..4], point[..4]);
        for prior in priors.iter().chain(&possible_priors(&[[0.0; 10]; 3], f64::NAN, &settings)) {
            assert!(PseudoInertia::of_parameters(prior).is_possible(), "{prior:?}");
        }
    }
}
