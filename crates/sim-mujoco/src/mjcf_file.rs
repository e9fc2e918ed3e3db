//! A robot that an MJCF file describes, as MuJoCo reads it.

use crate::MujocoError;
use crate::simulation::{Simulation, Sizes};
use phiw_dynamics::check::check_size;
use phiw_dynamics::{DimensionError, Tree};

/// A robot on a fixed base as MuJoCo reads it from MJCF, with all that the file says: armature, damping,
/// friction, springs and tendons are in its torques. For checking what is written for MuJoCo.
pub struct MjcfFile {
    simulation: Simulation,
    joints: usize,
}

impl MjcfFile {
    /// Reads the text of a file with the bodies of `tree`, in its order, and no mesh.
    ///
    /// # Errors
    /// MuJoCo is not found, or refuses the text; [`MujocoError::Layout`] if it has other bodies or joints.
    pub fn read(text: &str, tree: &Tree) -> Result<Self, MujocoError> {
        Self::read_sized(text, tree.bodies().len(), tree.bodies().len())
    }

    /// Reads the text of a file with this many joints and bodies, of hinges and slides alone.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_sized(text: &str, joints: usize, bodies: usize) -> Result<Self, MujocoError> {
        let sizes = Sizes { positions: joints, velocities: joints, bodies };
        Ok(MjcfFile { simulation: Simulation::of_text(text, sizes)?, joints })
    }

    /// The torques that a motion needs \[N·m, N\].
    ///
    /// # Errors
    /// A slice has not one number for each joint.
    pub fn inverse_dynamics(
        &mut self,
        q: &[f64],
        v: &[f64],
        a: &[f64],
        torque: &mut [f64],
    ) -> Result<(), DimensionError> {
        for (what, length) in [("q", q.len()), ("v", v.len()), ("a", a.len()), ("torque", torque.len())] {
            check_size(what, length, self.joints)?;
        }
        self.simulation.position_mut().copy_from_slice(q);
        self.simulation.velocity_mut().copy_from_slice(v);
        self.simulation.acceleration_mut().copy_from_slice(a);
        self.simulation.inverse();
        torque.copy_from_slice(self.simulation.inverse_force());
        Ok(())
    }
}
