#![doc = include_str!("../README.md")]
#![warn(missing_docs)]

mod banded;
mod bayesian;
mod body_prior;
mod command;
mod concentrated;
mod encoders;
mod error;
mod estimator;
mod evidence;
mod foresight;
mod free_directions;
mod in_order;
mod least_squares;
mod likelihood;
mod logged;
mod misfit;
mod motion_log;
mod prior;
mod profile;
mod readings;
mod response;
mod robot;
mod score;
mod sensitivity;
mod settings;
mod smoothing;
mod stored;
mod torques;

pub use bayesian::{BayesianLeastSquares, LogNoise};
pub use concentrated::{ConcentratedLikelihood, ConcentratedSettings, TorqueNoise};
pub use error::EstimationError;
pub use estimator::{Estimate, Estimator};
pub use evidence::{Evidence, EvidenceSettings, Instant, RowsAt, grouped_factor};
pub use least_squares::{LeastSquares, WeightedLeastSquares};
pub use likelihood::MotionLikelihood;
pub use logged::{Logged, LoggedSettings};
pub use misfit::TorqueMisfit;
pub use motion_log::{Asked, MotionLog};
pub use prior::ParameterPrior;
pub use readings::Readings;
pub use robot::{KnownEffect, Robot, RobotModel};
pub use score::Gain;
pub use settings::{NewtonSettings, ScoreSettings};
pub use torques::torques_along;
