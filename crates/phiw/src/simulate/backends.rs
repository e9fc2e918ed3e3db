//! What computes the motion: the algorithms of this workspace, or a physics engine where phiw was built with
//! them.

use crate::Error;
use phiw_dynamics::{AnalyticBackend, BackendError, DynamicsBackend, Tree};

/// What computes a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Backend {
    /// The algorithms of phiw-dynamics.
    #[default]
    Analytic,
    /// MuJoCo.
    Mujoco,
    /// Rapier.
    Rapier,
}

impl Backend {
    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Backend::Analytic => "analytic",
            Backend::Mujoco => "mujoco",
            Backend::Rapier => "rapier",
        }
    }
}

/// Whether the backend is part of this program.
///
/// # Errors
/// [`Error::BackendAbsent`].
pub(crate) fn check(backend: Backend) -> Result<(), Error> {
    match backend {
        Backend::Analytic => Ok(()),
        _ if cfg!(feature = "simulators") => Ok(()),
        absent => Err(Error::BackendAbsent { backend: absent.name() }),
    }
}

/// The robot in a backend.
///
/// # Errors
/// The engine cannot hold the robot, or is not here.
pub(crate) fn of(backend: Backend, tree: &Tree) -> Result<Box<dyn DynamicsBackend>, BackendError> {
    match backend {
        #[cfg(feature = "simulators")]
        Backend::Mujoco => {
            let engine = phiw_sim_mujoco::MujocoBackend::new(tree, &phiw_dynamics::World::default())?;
            Ok(Box::new(engine))
        }
        #[cfg(feature = "simulators")]
        Backend::Rapier => {
            Ok(Box::new(phiw_sim_rapier::RapierBackend::new(tree, &phiw_dynamics::World::default())?))
        }
        _ => Ok(Box::new(AnalyticBackend::new(tree.clone()))),
    }
}
