#![doc = include_str!("../README.md")]
#![warn(missing_docs)]

mod candidates;
mod constraint;
mod contest;
mod curriculum;
mod end;
mod error;
mod estimation;
mod experiment;
mod growth;
mod margin;
mod measured;
mod motion;
mod motion_limits;
mod planner;
mod random;
mod record;
mod relaxation;
mod rivalry;
mod robot;
mod score_test;
pub mod selection;
mod stance;
pub mod standing;
mod steps;
mod triangle;
mod whiteness;

pub use candidates::{Candidate, Candidates};
pub use constraint::{Constraint, Safety, Unconstrained, ZmpConstraint};
pub use contest::{Contender, ScoreTestSettings, Winner, rivals_to_separate, unconfirmed};
pub use curriculum::{Curriculum, CurriculumSettings, unreliable_model};
pub use end::{Certain, Converged, EndCriterion, FixedCount};
pub use error::CurriculumError;
pub use estimation::{
    BayesianLeastSquares, Estimate, Estimator, Evidence, EvidenceSettings, Gain, Instant, LeastSquares,
    LogNoise, MotionLikelihood, NewtonSettings, Prior, RowsAt, ScoreSettings, WeightedLeastSquares,
};
pub use experiment::{Experiment, Trial};
pub use growth::{Found, Growth, SessionSettings, TraceResidual};
pub use margin::MotionMargin;
pub use measured::Measured;
pub use motion::{Motion, MotionDataset, MotionTolerance};
pub use motion_limits::{Excess, MotionLimits, Unrest};
pub use planner::{Belief, MeasuredSoFar, NoneAllowed, Permission, Plan, Policy, permission, plan};
pub use record::{EndReason, IterationRecord, Run};
pub use relaxation::{
    ConditionRelaxation, ConstantReduction, Learnt, Maximum, Relaxation, Scale, UncertaintyRelaxation,
};
pub use rivalry::Rivalry;
pub use robot::{KnownEffect, Robot, RobotModel};
pub use score_test::ScoreTest;
pub use selection::Selection;
pub use stance::{StanceError, StanceSettings};
pub use steps::StepTolerance;
pub use triangle::Triangle;
pub use whiteness::WhitenessSettings;
