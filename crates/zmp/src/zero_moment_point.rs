//! The zero moment point, by two models of the robot.

use crate::CenterOfMass;

/// Which of the two ZMPs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ZmpModel {
    /// All mass in the centre of mass, paper's equation (8): angular momentum about it is left out.
    #[default]
    PointMass,
    /// The bodies as they are, with their angular momentum: where a force plate sees it.
    MultiBody,
}

/// The ZMP of a point mass on the floor `z = floor_height` \[m\], paper's equation (8):
/// `x − (z − l_z) ẍ / (z̈ + g)`, and so for y.
///
/// `gravity` is in the world frame \[m/s²\], usually `[0, 0, −9.81]`; a level component of it counts like an
/// acceleration. None where the robot does not press on the floor (`z̈ + g ≤ 0`) or has no centre of mass.
#[inline]
pub fn point_mass_zmp(center: &CenterOfMass, gravity: [f64; 3], floor_height: f64) -> Option<[f64; 2]> {
    let push = |axis: usize| center.acceleration[axis] - gravity[axis];
    let presses = center.mass > 0.0 && push(2) > 0.0;
    presses.then(|| {
        let time_constant_squared = (center.position[2] - floor_height) / push(2);
        [0, 1].map(|axis| center.position[axis] - time_constant_squared * push(axis))
    })
}

/// The ZMP on the floor `z = floor_height` \[m\] of the wrench that the floor gives to the robot: force
/// \[N\], then moment about the world's origin \[N·m\], along the world's axes.
///
/// It is the point of the floor about which the moment has no level component (Vukobratović and Borovac
/// 2004); as long as it is inside the support polygon it is the centre of pressure. None where the robot does
/// not press on the floor.
#[inline]
pub fn multi_body_zmp(wrench: [f64; 6], floor_height: f64) -> Option<[f64; 2]> {
    let [force_x, force_y, force_z, moment_x, moment_y, _] = wrench;
    let at = |level: f64| level / force_z;
    (force_z > 0.0).then(|| [at(floor_height * force_x - moment_y), at(floor_height * force_y + moment_x)])
}
