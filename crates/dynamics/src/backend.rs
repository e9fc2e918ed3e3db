//! The contracts between algorithms that need a robot's dynamics, or a robot that moves, and what provides
//! them.

use crate::DimensionError;
use crate::check::check_size;

/// Largest distance of a base's quaternion's length from 1 that [`SimulationBackend::set_state`] accepts.
const QUATERNION_TOLERANCE: f64 = 1e-6;

/// Why a backend could not do what was asked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BackendError {
    /// A slice does not fit the robot.
    #[error(transparent)]
    Dimension(#[from] DimensionError),
    /// The world does not fit the robot.
    #[error(transparent)]
    World(#[from] crate::WorldError),
    /// A number given to the backend is NaN or infinite.
    #[error("{what} has an element that is not a finite number")]
    NotFinite {
        /// Which argument.
        what: &'static str,
    },
    /// A floating base's quaternion is not of unit length.
    #[error("the base's quaternion has length {length}, not 1: normalise it")]
    NotUnitQuaternion {
        /// Its length.
        length: f64,
    },
    /// The time step is not positive or not finite.
    #[error("the time step is {dt} s: it must be positive and finite")]
    TimeStep {
        /// The step \[s\].
        dt: f64,
    },
    /// The robot's motion can not be computed.
    #[error(
        "the acceleration is not finite: the mass matrix is singular (a moving link without mass?) or the motion has diverged"
    )]
    Singular,
    /// What the backend itself reports.
    #[error("{backend}: {message}")]
    Backend {
        /// The backend's name.
        backend: &'static str,
        /// Its message.
        message: String,
    },
}

/// A robot's dynamics, whoever computes them: the analytic algorithms here, a physics engine, or another
/// library.
///
/// This is the half that computes. It needs no simulator: who has one implements [`SimulationBackend`] as
/// well, and who knows how the bodies move implements [`BodyKinematics`](crate::BodyKinematics), for the
/// regressor and the ZMP.
///
/// **Coordinates** are those of [`crate::Tree`]: the configuration `q` is `[x, y, z, qx, qy, qz, qw]` of a
/// floating base (absent on a fixed one), then one position for each joint of
/// [`joint_names`](Self::joint_names), in their order; the velocity `v` is the base's linear and angular
/// velocity in its own frame, then one for each joint. Accelerations and generalised forces follow `v`. SI
/// units throughout.
///
/// `inverse_dynamics` and `forward_dynamics` are the robot's own equation `M(q)·a + h(q, v) = force`, without
/// contacts, friction or noise.
pub trait DynamicsBackend {
    /// The backend's name, for messages.
    fn name(&self) -> &str;

    /// The joints that move by themselves, in the order of their coordinates.
    fn joint_names(&self) -> &[String];

    /// Elements of a velocity: one for each joint, six more for a floating base.
    fn velocity_size(&self) -> usize;

    /// Elements of a configuration: one for each joint, seven more for a floating base.
    fn configuration_size(&self) -> usize;

    /// The generalised force that the motion needs.
    ///
    /// # Errors
    /// A slice does not fit the robot, or the backend fails.
    fn inverse_dynamics(
        &mut self,
        q: &[f64],
        v: &[f64],
        a: &[f64],
        force: &mut [f64],
    ) -> Result<(), BackendError>;

    /// The mass matrix `M(q)`: dense, symmetric, row by row, with the inertia of rotors.
    ///
    /// This one asks for inverse dynamics once for each column and once more, and allocates; a backend that
    /// has the matrix gives it. What [`base_wrench`](Self::base_wrench) tells after it is of no motion.
    ///
    /// # Errors
    /// A slice does not fit the robot, or the backend fails.
    fn mass_matrix(&mut self, q: &[f64], matrix: &mut [f64]) -> Result<(), BackendError> {
        let size = self.velocity_size();
        check_size("the mass matrix", matrix.len(), size * size)?;
        let still = vec![0.0; size];
        let (mut unit, mut bias, mut force) = (still.clone(), still.clone(), still.clone());
        self.inverse_dynamics(q, &still, &still, &mut bias)?;
        for column in 0..size {
            unit[column] = 1.0;
            self.inverse_dynamics(q, &still, &unit, &mut force)?;
            unit[column] = 0.0;
            for row in 0..size {
                matrix[row * size + column] = force[row] - bias[row];
            }
        }
        Ok(())
    }

    /// The acceleration under a generalised force; for a floating base its first six elements push the base.
    ///
    /// # Errors
    /// A slice does not fit the robot, the mass matrix is singular, or the backend fails.
    fn forward_dynamics(
        &mut self,
        q: &[f64],
        v: &[f64],
        force: &[f64],
        acceleration: &mut [f64],
    ) -> Result<(), BackendError>;

    /// The wrench that the world gives to the robot at its base, along the world's axes: force \[N\], then
    /// moment about the world's origin \[N·m\]. The measured ZMP comes from it.
    ///
    /// It belongs to the motion of the last [`inverse_dynamics`](Self::inverse_dynamics) (what the base must
    /// be given), or of the last [`step`](SimulationBackend::step) of a simulation at the instant at which
    /// the step began, whichever came later; zero before either. Bodies that move are counted; the root link
    /// of a fixed base is not, as its inertia is not part of the robot.
    fn base_wrench(&self) -> [f64; 6];
}

/// A robot that moves in a world of its own, which may hold a floor or noise: the half that simulates.
///
/// The state is the backend's. [`step`](Self::step) moves it on; inverse and forward dynamics leave it as it
/// is.
pub trait SimulationBackend: DynamicsBackend {
    /// Copies the present state into `q` and `v`.
    ///
    /// # Errors
    /// A slice does not fit the robot.
    fn state(&self, q: &mut [f64], v: &mut [f64]) -> Result<(), BackendError>;

    /// Puts the robot into a state.
    ///
    /// # Errors
    /// A slice does not fit the robot, a number is not finite, or a base's quaternion is not unit (to 1e-6).
    fn set_state(&mut self, q: &[f64], v: &[f64]) -> Result<(), BackendError>;

    /// Moves the state on by `dt` \[s\] under constant joint torques, one for each joint \[N·m, N\].
    ///
    /// A floating base is moved by gravity and by the contacts of the backend's world alone. After an error
    /// the state is unchanged.
    ///
    /// # Errors
    /// The slice does not fit the robot, a number is not finite, `dt` is not positive, or the motion
    /// diverges.
    fn step(&mut self, torque: &[f64], dt: f64) -> Result<(), BackendError>;

    /// The part of [`base_wrench`](DynamicsBackend::base_wrench) that the floor gave to one foot of the world
    /// in the last [`step`](Self::step), about the world's origin as well, as a force plate under that foot
    /// would say; `foot` counts [`World::feet`](crate::World::feet). None from a backend without contacts,
    /// and before a step.
    fn foot_wrench(&self, foot: usize) -> Option<[f64; 6]> {
        let _ = foot;
        None
    }

    /// What every backend checks before it takes a state over, for implementations of
    /// [`set_state`](Self::set_state).
    ///
    /// # Errors
    /// Those of [`set_state`](Self::set_state).
    fn check_state(&self, q: &[f64], v: &[f64]) -> Result<(), BackendError> {
        check_size("the configuration q", q.len(), self.configuration_size())?;
        check_size("the velocity v", v.len(), self.velocity_size())?;
        check_finite("the configuration q", q)?;
        check_finite("the velocity v", v)?;
        let is_floating = self.velocity_size() > self.joint_names().len();
        if is_floating {
            let length = q[3..7].iter().map(|x| x * x).sum::<f64>().sqrt();
            if (length - 1.0).abs() > QUATERNION_TOLERANCE {
                return Err(BackendError::NotUnitQuaternion { length });
            }
        }
        Ok(())
    }

    /// What every backend checks before a step, for implementations of [`step`](Self::step).
    ///
    /// # Errors
    /// The slice does not fit the robot, a number is not finite, or `dt` is not positive.
    fn check_step(&self, torque: &[f64], dt: f64) -> Result<(), BackendError> {
        check_size("the joint torque", torque.len(), self.joint_names().len())?;
        check_finite("the joint torque", torque)?;
        if !(dt.is_finite() && dt > 0.0) {
            return Err(BackendError::TimeStep { dt });
        }
        Ok(())
    }
}

/// An error if an element is NaN or infinite.
pub(crate) fn check_finite(what: &'static str, values: &[f64]) -> Result<(), BackendError> {
    if values.iter().all(|value| value.is_finite()) { Ok(()) } else { Err(BackendError::NotFinite { what }) }
}
