//! Who computes the physics.

use anyhow::Context;
use phiw_dynamics::{AnalyticBackend, BackendError, SimulationBackend, Tree, World};
use phiw_sim_mujoco::MujocoBackend;
use phiw_sim_rapier::RapierBackend;
use serde::Serialize;

/// A backend under the plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Engine {
    /// MuJoCo, with its Runge-Kutta integrator.
    Mujoco,
    /// Rapier, with four sub-iterations a step (a whole body on its feet has more).
    Rapier,
    /// The workspace's own algorithms.
    Analytic,
}

/// Sub-iterations of Rapier's step of 1 ms: four beat Euler by far, and more cost more than they tell here.
const RAPIER_ITERATIONS: usize = 4;

impl Engine {
    /// A robot in this engine.
    pub fn build(self, tree: &Tree, world: &World) -> Result<Box<dyn SimulationBackend>, BackendError> {
        Ok(match self {
            Engine::Mujoco => {
                Box::new(MujocoBackend::new(tree, world).map_err(|error| BackendError::Backend {
                    backend: "mujoco",
                    message: error.to_string(),
                })?)
            }
            Engine::Rapier => {
                Box::new(RapierBackend::new(tree, world)?.with_solver_iterations(RAPIER_ITERATIONS)?)
            }
            Engine::Analytic => Box::new(AnalyticBackend::in_world(tree.clone(), world)?),
        })
    }

    /// Longest integration step \[s\].
    pub fn longest_step_s(self) -> f64 {
        match self {
            Engine::Rapier => 1e-3,
            Engine::Mujoco | Engine::Analytic => 5e-4,
        }
    }

    /// Whether the engine is there and takes the robot.
    ///
    /// # Errors
    /// It is not, or does not.
    pub fn check(self, tree: &Tree) -> anyhow::Result<()> {
        self.build(tree, &World::default()).map(|_| ()).with_context(|| format!("{self:?}"))
    }
}
