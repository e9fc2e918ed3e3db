//! Why a command failed, and with which exit status.

use crate::fleet::PlanError;
use phiw_curriculum::CurriculumError;
use phiw_dynamics::urdf::UrdfError;
use phiw_estimation::EstimationError;
use phiw_identification::IdentificationError;
use phiw_identification::checks::InputError;
use phiw_identification::effect::EffectError;
use phiw_identification::shard::ShardError;
use phiw_residual::trace::UnknownThreshold;
use phiw_telemetry::LogError;
use std::io;
use std::path::PathBuf;

/// Why a command failed: one message that names the file, the place and the mend.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A threshold that does not exist.
    #[error("--threshold: {0}")]
    Threshold(#[from] UnknownThreshold),
    /// A file cannot be read.
    #[error("{}: {}", path.display(), unreadable(source))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A folder, a pipe or a device in the place of a file.
    #[error("{}: this is no regular file; name a file", path.display())]
    NotAFile {
        /// What was named.
        path: PathBuf,
    },
    /// A file of more bytes than such a file has.
    #[error("{}: it has more than {most} bytes, which no such file needs; check the path", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The limit \[bytes\].
        most: u64,
    },
    /// A file that is no text.
    #[error("{}: this is not text but {looks_like}; name a text file in UTF-8", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// What its bytes look like.
        looks_like: &'static str,
    },
    /// The URDF is not one that can be worked with.
    #[error("{}: {source}", path.display())]
    Urdf {
        /// The URDF.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<UrdfError>,
    },
    /// A robot's file is MJCF, and is not read.
    #[error("{}: {source}", path.display())]
    Mjcf {
        /// The file.
        path: PathBuf,
        /// Why.
        source: Box<phiw_mjcf::MjcfReadError>,
    },
    /// A plan that cannot be made or used.
    #[error("{}: {source}", path.display())]
    Plan {
        /// The plan.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<PlanError>,
    },
    /// A file of factors that cannot be used.
    #[error("{}: {source}", path.display())]
    Shard {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: ShardError,
    },
    /// A log that the plan does not know.
    #[error("{}: the plan has no log of this content among its {logs}; plan again with it, or leave it out", log.display())]
    NotInPlan {
        /// The log.
        log: PathBuf,
        /// Logs of the plan.
        logs: usize,
    },
    /// A log that is not what it was.
    #[error("{}: the log of this name has changed since the plan was made; plan again", log.display())]
    LogChanged {
        /// The log.
        log: PathBuf,
    },
    /// A log that is named twice.
    #[error("{}: this log is named twice; name it once", log.display())]
    LogTwice {
        /// The log.
        log: PathBuf,
    },
    /// A log in two files of factors.
    #[error("{}: the factors of {log} are in {} too; give them once", second.display(), first.display())]
    FactorsTwice {
        /// The log.
        log: String,
        /// A file that has them.
        first: PathBuf,
        /// Another one.
        second: PathBuf,
    },
    /// Logs of the plan without factors.
    #[error("the factors of {} are missing; reduce {} with phiw reduce and give the file, \
         too", first_of(logs), if logs.len() == 1 { "it" } else { "them" })]
    FactorsMissing {
        /// The logs.
        logs: Vec<String>,
    },
    /// A model file that is none.
    #[error("{}: not a model.json of phiw: {source}", path.display())]
    NotAModel {
        /// The file.
        path: PathBuf,
        /// What the reader says.
        source: serde_json::Error,
    },
    /// A model file whose numbers cannot be a model's.
    #[error("{}: {source}", path.display())]
    Model {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<IdentificationError>,
    },
    /// A model file that holds no robot.
    #[error(
        "{}: this model.json holds no robot, since an earlier phiw wrote it; write it again with `phiw identify` or `phiw explain`",
        path.display()
    )]
    ModelWithoutRobot {
        /// The file.
        path: PathBuf,
    },
    /// The robot in a model file is not one that can be worked with.
    #[error("{}: the robot in it: {source}", path.display())]
    RobotOfModel {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<UrdfError>,
    },
    /// A joint that the model holds elsewhere.
    #[error(
        "--hold {joint}={asked}: {} is of the robot with this joint held at {held}; identify a model with it held at {asked}", path.display()
    )]
    HeldElsewhere {
        /// The file.
        path: PathBuf,
        /// The joint.
        joint: String,
        /// Where it should be held \[rad, m\].
        asked: f64,
        /// Where the model holds it \[rad, m\].
        held: f64,
    },
    /// A joint that is held in the logs, but moves in the model that is simulated.
    #[error(
        "--hold {joint}: {} moves this joint, so a simulation needs its torque; identify a model with it held", path.display()
    )]
    HeldInSimulation {
        /// The model.
        path: PathBuf,
        /// The joint.
        joint: String,
    },
    /// A model that no motion follows from.
    #[error(
        "{}: it cannot be simulated: M(q) is not positive definite at {t:.3} s of {}{bodies}; predict torques with it, or identify it from motion \
         that tells more", path.display(), log.display()
    )]
    NotPositiveDefinite {
        /// The model.
        path: PathBuf,
        /// The log.
        log: PathBuf,
        /// Where in the log \[s\].
        t: f64,
        /// Which bodies cannot exist, in words.
        bodies: String,
    },
    /// A physics engine that this program was built without.
    #[error(
        "--backend {backend}: this phiw is built without physics engines; build it with `cargo install phiw --features simulators`, or leave the option \
         out"
    )]
    BackendAbsent {
        /// The engine.
        backend: &'static str,
    },
    /// Something is known of a link that no joint carries.
    #[error(
        "the link `{link}` of --mass, --inside or --mirrored is carried by no joint that moves; those are {links}"
    )]
    UnknownLink {
        /// What was named.
        link: String,
        /// The links that joints carry.
        links: String,
    },
    /// The total mass leaves nothing to the links without a known mass.
    #[error(
        "--total-mass {total} kg leaves nothing beside the links of --mass, {of_links} kg together: leave one of the two out"
    )]
    TotalMass {
        /// The total \[kg\].
        total: f64,
        /// The sum of the links' \[kg\].
        of_links: f64,
    },
    /// Logs without a stretch to reproduce.
    #[error(
        "{logs}: no stretch of {needed} s without a gap, which a reproduction needs; record longer motion"
    )]
    NothingToReproduce {
        /// The logs.
        logs: String,
        /// The shortest window \[s\].
        needed: f64,
    },
    /// A model that cannot be moved on.
    #[error("the simulation failed: {0}")]
    Simulation(phiw_identification::reproduction::PlantError),
    /// A model file of another robot.
    #[error("{} does not fit {}: {source}", path.display(), urdf.display())]
    ModelOfAnother {
        /// The model.
        path: PathBuf,
        /// The robot.
        urdf: PathBuf,
        /// The first difference.
        source: Box<IdentificationError>,
    },
    /// The robot's base floats.
    #[error("{}: the robot's base floats, and a log does not hold its motion; make its joint of type floating a fixed one", path.display())]
    FloatingBase {
        /// The URDF.
        path: PathBuf,
    },
    /// The folder for the results is a file, or lies below one.
    #[error("--out {}: `{}` is a file; name a folder that is there or can be made", out.display(), file.display())]
    OutIsFile {
        /// The folder asked for.
        out: PathBuf,
        /// The file that is in the way.
        file: PathBuf,
    },
    /// The file for the result is a folder.
    #[error("--out {}: this is a folder; name a file in it, such as {}", out.display(), out.join("result.csv").display())]
    OutIsFolder {
        /// What was asked for.
        out: PathBuf,
    },
    /// A result cannot be written there.
    #[error(transparent)]
    Output(#[from] phiw_result_folder::ResultError),
    /// A motion would get the name of its own reason.
    #[error("--out {}: this is the motion's file, a log; its reason goes beside it as .json: name it \
         {}", out.display(), out.with_extension("csv").display())]
    MotionNamedJson {
        /// What was asked for.
        out: PathBuf,
    },
    /// A marker map that is none.
    #[error("{}: {source}", path.display())]
    Map {
        /// The map.
        path: PathBuf,
        /// What is wrong with it.
        source: phiw_bspline_retarget::human::MapError,
    },
    /// A robot that cannot follow a person.
    #[error("{}: {source}", path.display())]
    Robot {
        /// The URDF.
        path: PathBuf,
        /// What is wrong with it.
        source: phiw_bspline_retarget::robot::RobotError,
    },
    /// A marker recording that cannot be read.
    #[error(transparent)]
    Recording(phiw_bspline_retarget::markers::RecordingError),
    /// A marker recording that cannot be retargeted.
    #[error("{}: {source}", path.display())]
    Retarget {
        /// The recording.
        path: PathBuf,
        /// Why.
        source: phiw_bspline_retarget::RetargetError,
    },
    /// A recording whose static trial cannot be used.
    #[error("{}: its static trial tells nothing: {reason}", path.display())]
    StaticTrial {
        /// The recording.
        path: PathBuf,
        /// Why: names the trial.
        reason: String,
    },
    /// Two recordings of the same name.
    #[error("{} and {} have the same name, and so would their motions: retarget them into two folders", first.display(), second.display())]
    SameName {
        /// One.
        first: PathBuf,
        /// The other.
        second: PathBuf,
    },
    /// Static trials only.
    #[error("--c3d names static trials only; name the recordings of motions")]
    NoMotion,
    /// A folder without motions.
    #[error("{}: there are no motions (*.csv) in this folder; make some with `phiw retarget`", folder.display())]
    NoMotions {
        /// The folder.
        folder: PathBuf,
    },
    /// A log that is no motion.
    #[error("{}: {source}", path.display())]
    Motion {
        /// The log.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<CurriculumError>,
    },
    /// A log of which no motions at the controller's rate can be made.
    #[error("{}: {source} (--estimator least-squares takes any log)", path.display())]
    LogForNext {
        /// The log.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<EstimationError>,
    },
    /// A joint that no motion moves.
    #[error(
        "{}: joint `{joint}` moves by {travel:.1e} {unit} in all motions, so none can tell anything of it; add motions that move it, \
         or hold it with --hold {joint}={position:.4}", folder.display()
    )]
    JointStandsStill {
        /// The motions.
        folder: PathBuf,
        /// The joint.
        joint: String,
        /// Its largest travel \[rad, m\].
        travel: f64,
        /// Unit of the travel.
        unit: &'static str,
        /// Where it stands \[rad, m\].
        position: f64,
    },
    /// A support file that does not fit the robot.
    #[error("{}: {source}", path.display())]
    Support {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: phiw_zmp::FeetError,
    },
    /// Feet that give no support.
    #[error("{}: {source}", path.display())]
    Stance {
        /// The support file.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<phiw_curriculum::constraint::StanceError>,
    },
    /// Every motion would topple the robot.
    #[error("{0} (--model takes one)")]
    Refused(CurriculumError),
    /// The choice of a motion.
    #[error(transparent)]
    Curriculum(#[from] CurriculumError),
    /// The identified parameters cannot be written as a URDF.
    #[error("identified.urdf: {0}")]
    IdentifiedUrdf(Box<UrdfError>),
    /// The identified parameters cannot be written as MJCF.
    #[error("identified.xml: {0}")]
    IdentifiedMjcf(phiw_mjcf::MjcfError),
    /// No code can be generated of the model.
    #[error("generated code: {0}")]
    Generated(phiw_codegen::CodegenError),
    /// All logs of the training together.
    #[error("{logs}: {source}")]
    TrainingLogs {
        /// Their names.
        logs: String,
        /// What is wrong with them.
        source: Box<InputError>,
    },
    /// The logs, the effects or the fit.
    #[error(transparent)]
    Identification(#[from] IdentificationError),
    /// Whoever asked for the work wants it no more.
    #[error("interrupted")]
    Interrupted,
    /// A result that cannot be written as JSON.
    #[error("{file}: {source}")]
    Json {
        /// The file.
        file: &'static str,
        /// What the writer says.
        source: serde_json::Error,
    },
}

impl From<EstimationError> for Error {
    fn from(error: EstimationError) -> Self {
        CurriculumError::from(error).into()
    }
}

impl From<EffectError> for Error {
    fn from(error: EffectError) -> Self {
        IdentificationError::from(error).into()
    }
}

impl From<LogError> for Error {
    fn from(error: LogError) -> Self {
        IdentificationError::from(error).into()
    }
}

impl From<InputError> for Error {
    fn from(error: InputError) -> Self {
        IdentificationError::from(error).into()
    }
}

/// Logs that a message names.
const LOGS_NAMED: usize = 5;

/// The first of some logs, and how many there are more.
fn first_of(logs: &[String]) -> String {
    let named = logs[..logs.len().min(LOGS_NAMED)].join(", ");
    match logs.len().saturating_sub(LOGS_NAMED) {
        0 => named,
        more => format!("{named} and {more} more"),
    }
}

fn unreadable(source: &io::Error) -> String {
    match source.kind() {
        io::ErrorKind::NotFound => "no such file; check the path".to_owned(),
        _ => format!("can't be read: {source}"),
    }
}
