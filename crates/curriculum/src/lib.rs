#![doc = include_str!("../README.md")]
#![warn(missing_docs)]

mod candidates;
mod constraint;
mod controller;
mod curriculum;
mod end;
mod error;
mod estimation;
mod experiment;
mod growth;
mod measured;
mod motion;
mod record;
mod relaxation;
mod rivalry;
mod robot;
mod score_test;
pub mod selection;
pub mod standing;
mod steps;
mod triangle;
mod whiteness;

pub use candidates::{Candidate, Candidates};
pub use constraint::{Constraint, Safety, Unconstrained, ZmpConstraint};
pub use controller::{Controller, FeedForward};
pub use curriculum::{Curriculum, Plan, unreliable_model};
pub use end::{Certain, Converged, EndCriterion, EndReason, FixedCount};
pub use error::CurriculumError;
pub use estimation::{
    Estimate, Estimator, Evidence, Gain, Instant, LeastSquares, MotionLikelihood, Prior, RowsAt,
    WeightedLeastSquares,
};
pub use experiment::{BuildBackend, Experiment, SimulatedRobot, Trial};
pub use growth::{Found, Growth, TraceResidual};
pub use measured::Measured;
pub use motion::{Motion, MotionDataset};
pub use record::{IterationRecord, Run};
pub use relaxation::{ConditionRelaxation, Learnt, Maximum, Relaxation, Scale, UncertaintyRelaxation};
pub use rivalry::Rivalry;
pub use robot::{KnownEffect, Robot, RobotModel};
pub use score_test::ScoreTest;
pub use selection::Selection;
pub use steps::StepTolerance;
pub use triangle::Triangle;
