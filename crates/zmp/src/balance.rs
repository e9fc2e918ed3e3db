//! What the floor must give to a robot at one instant of a motion.

use crate::{CenterOfMass, ZmpModel, multi_body_zmp, point_mass_zmp};

/// The state of a robot's balance at one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Balance {
    /// The centre of mass.
    pub center_of_mass: CenterOfMass,
    /// What the floor must give: force \[N\], then moment about the world's origin \[N·m\], along the world's
    /// axes.
    pub wrench: [f64; 6],
    /// Gravity in the world \[m/s²\].
    pub gravity: [f64; 3],
}

impl Balance {
    /// From sums over the bodies: mass, first moment in the world \[kg·m\], and the wrench.
    pub(crate) fn of_sums(mass: f64, moment: [f64; 3], wrench: [f64; 6], gravity: [f64; 3]) -> Self {
        let center_of_mass = CenterOfMass {
            mass,
            position: moment.map(|moment| moment / mass),
            // The force is M (c̈ − g).
            acceleration: [0, 1, 2].map(|axis| wrench[axis] / mass + gravity[axis]),
        };
        Balance { center_of_mass, wrench, gravity }
    }

    /// The ZMP on the floor `z = floor_height` \[m\]; see [`point_mass_zmp`] and [`multi_body_zmp`].
    #[inline]
    pub fn zmp(&self, model: ZmpModel, floor_height: f64) -> Option<[f64; 2]> {
        match model {
            ZmpModel::PointMass => point_mass_zmp(&self.center_of_mass, self.gravity, floor_height),
            ZmpModel::MultiBody => multi_body_zmp(self.wrench, floor_height),
        }
    }

    /// Rate of the angular momentum about the centre of mass \[N·m\]: what the two ZMPs differ by.
    ///
    /// `multi body − point mass = (−L̇_y, L̇_x) / f_z` with the floor's upward force f_z.
    pub fn angular_momentum_rate(&self) -> [f64; 3] {
        let ([x, y, z], [fx, fy, fz, mx, my, mz]) = (self.center_of_mass.position, self.wrench);
        [mx - (y * fz - z * fy), my - (z * fx - x * fz), mz - (x * fy - y * fx)]
    }
}
