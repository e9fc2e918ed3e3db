//! What a program that calls `phiw` is told by its exit status.

use crate::Error;
use phiw_curriculum::CurriculumError;
use phiw_identification::IdentificationError;
use phiw_result_folder::ResultError;
use phiw_telemetry::LogError;

impl Error {
    /// 2 if the command line or an input is wrong, 1 for anything else.
    pub fn exit_status(&self) -> u8 {
        match self {
            Error::Unreadable { .. }
            | Error::Threshold(_)
            | Error::NotAFile { .. }
            | Error::TooLarge { .. }
            | Error::NotText { .. }
            | Error::Plan { .. }
            | Error::Shard { .. }
            | Error::NotInPlan { .. }
            | Error::LogChanged { .. }
            | Error::LogTwice { .. }
            | Error::FactorsTwice { .. }
            | Error::FactorsMissing { .. }
            | Error::Urdf { .. }
            | Error::Mjcf { .. }
            | Error::FloatingBase { .. }
            | Error::NotAModel { .. }
            | Error::Model { .. }
            | Error::ModelOfAnother { .. }
            | Error::ModelWithoutRobot { .. }
            | Error::RobotOfModel { .. }
            | Error::HeldElsewhere { .. }
            | Error::HeldInSimulation { .. }
            | Error::NotPositiveDefinite { .. }
            | Error::BackendAbsent { .. }
            | Error::UnknownLink { .. }
            | Error::TotalMass { .. }
            | Error::NothingToReproduce { .. }
            | Error::Map { .. }
            | Error::Robot { .. }
            | Error::Recording(_)
            | Error::Retarget { .. }
            | Error::StaticTrial { .. }
            | Error::SameName { .. }
            | Error::NoMotion
            | Error::NoMotions { .. }
            | Error::Motion { .. }
            | Error::LogForNext { .. }
            | Error::JointStandsStill { .. }
            | Error::Support { .. }
            | Error::Stance { .. }
            | Error::Refused(_)
            | Error::OutIsFolder { .. }
            | Error::MotionNamedJson { .. }
            | Error::TrainingLogs { .. }
            | Error::Output(ResultError::Busy { .. } | ResultError::IsInput { .. })
            | Error::OutIsFile { .. } => 2,
            error if error.is_interruption() => 1,
            Error::Identification(IdentificationError::Regressor(_)) => 1,
            Error::Identification(_) => 2,
            Error::Curriculum(_)
            | Error::Simulation(_)
            | Error::Output(_)
            | Error::IdentifiedUrdf(_)
            | Error::IdentifiedMjcf(_)
            | Error::Generated(_)
            | Error::Interrupted
            | Error::Json { .. } => 1,
        }
    }

    /// Whether the work was called off (see [`Interruption`](phiw_identification::Interruption)).
    pub fn is_interruption(&self) -> bool {
        matches!(
            self,
            Error::Interrupted
                | Error::Identification(IdentificationError::Log(LogError::Interrupted))
                | Error::Curriculum(CurriculumError::Log(LogError::Interrupted))
                | Error::Curriculum(CurriculumError::Identification(IdentificationError::Log(
                    LogError::Interrupted
                )))
        )
    }
}
