//! The command line.

pub use crate::argument_values::held_joint;
use crate::argument_values::{held_in_words, positive, quoted, share, threshold};
pub use crate::export::ExportArguments;
pub use crate::identify_arguments::IdentifyArguments;
pub use crate::in_memory::InMemory;
pub use crate::map::MapArguments;
pub use crate::session_arguments::SessionArguments;
pub use crate::simulate::Backend;

use crate::fleet::{PlanArguments, ReduceArguments};
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

/// What was asked for.
#[derive(Debug, Parser)]
#[command(name = "phiw", version, about = "Identify a robot from its URDF and logs")]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Fit the declared model to logs: model.json, report.json, report.html, identified.urdf,
    /// identified.xml (MJCF).
    Identify(IdentifyArguments),
    /// The same, then close the loop: find what the model lacks, add it, and report the error before and
    /// after.
    Explain(ExplainArguments),
    /// Predict the torques of logs with an identified model: per row the torque, its standard deviation, what
    /// was measured beyond it, and each effect's share.
    Predict(PredictArguments),
    /// Reproduce logs with an identified model and with its URDF, driven by the measured torque: how fast
    /// they go another way than the robot.
    Simulate(SimulateArguments),
    /// Write an identified model as other programs take it: C99 and Rust without allocation, a URDF without
    /// geometry, MJCF, a table of the joints' drives.
    Export(ExportArguments),
    /// Say what is in logs before anything is fitted: late velocities, torques that are missing or clipped,
    /// units, clocks, and what to do about it.
    Check(CheckArguments),
    /// Write a first map of a log's columns: which is which signal of which joint, in what unit, guessed by
    /// names and ranges.
    Map(MapArguments),
    /// Turn marker recordings of people into motions of the robot: for each a log without torques, and what
    /// it is worth.
    Retarget(RetargetArguments),
    /// Choose the motion that a real robot should run next, given what has been measured: one iteration of
    /// the curriculum.
    Next(NextArguments),
    /// Decide over all logs what `phiw reduce` and `phiw identify --plan` need to work on each log by itself,
    /// on as many machines as one likes.
    Plan(PlanArguments),
    /// Reduce logs of a plan to their factors, which are all that `phiw identify --plan` needs of them.
    Reduce(ReduceArguments),
}

impl Command {
    /// Whether nothing but errors is to be printed.
    pub fn quiet(&self) -> bool {
        match self {
            Command::Identify(identify) => identify.session.quiet,
            Command::Explain(explain) => explain.session.quiet,
            Command::Predict(predict) => predict.quiet,
            Command::Simulate(simulate) => simulate.quiet,
            Command::Export(export) => export.quiet,
            Command::Check(check) => check.quiet,
            Command::Map(map) => map.quiet,
            Command::Retarget(retarget) => retarget.quiet,
            Command::Next(next) => next.quiet,
            Command::Plan(plan) => plan.quiet,
            Command::Reduce(reduce) => reduce.quiet,
        }
    }
}

/// Arguments of `phiw explain`.
#[derive(Clone, Debug, Default, Args)]
pub struct ExplainArguments {
    /// Robot, logs and declared model.
    #[command(flatten)]
    pub session: SessionArguments,
    /// A model.json of `phiw identify` or `phiw explain`: its parameters are held, and what has changed since
    /// is sought.
    #[arg(long, value_name = "MODEL.json")]
    pub model: Option<PathBuf>,
    /// Trace again on this many bootstrap draws of the training motion, and say how often each effect is
    /// named.
    #[arg(long, value_name = "COUNT", default_value_t = 0)]
    pub draws: u32,
    /// Effects that are not sought: a kind anywhere, or on the joints named. Declared effects stay.
    #[arg(long, value_name = "KIND[:JOINT[+JOINT…]],…", value_delimiter = ',')]
    pub exclude: Vec<String>,
    /// Probability of naming anything where nothing is missing, for all logs and candidates together; 0.01 by
    /// default.
    #[arg(long, value_name = "PROBABILITY", value_parser = share)]
    pub false_name_rate: Option<f64>,
    /// Other values for the numbers that decide what has a name (`Thresholds` of phiw-residual), to calibrate
    /// them.
    #[arg(long, value_name = "NAME=VALUE,…", value_delimiter = ',', value_parser = threshold, hide = true)]
    pub threshold: Vec<(String, f64)>,
}

/// Arguments of `phiw predict`.
#[derive(Clone, Debug, Default, Args)]
pub struct PredictArguments {
    /// A model.json of `phiw identify` or `phiw explain`; it holds the robot, too.
    #[arg(long, value_name = "MODEL.json")]
    pub model: PathBuf,
    /// Logs; torques are compared where a log has them.
    #[arg(value_name = "LOG", required = true)]
    pub logs: Vec<PathBuf>,
    /// What the columns of the logs mean: topics, units, gears, currents (docs/log-maps.md). Without it they
    /// are named as in a log of phiw.
    #[arg(long, value_name = "MAP.toml")]
    pub map: Option<PathBuf>,
    /// Joints that stand still in the logs, at 0 or at a value (rad, m); they need no column. What the model
    /// holds need not be named. In a name, * stands for any letters and ? for one: --hold 'left_*'.
    #[arg(long, value_name = "JOINT[=VALUE],…", value_delimiter = ',', value_parser = held_joint)]
    pub hold: Vec<(String, f64)>,
    /// Cut-off of the low-pass over positions (Hz); by default the model's.
    #[arg(long, value_name = "HZ")]
    pub cutoff_hz: Option<f64>,
    /// Cut-off of the low-pass over the model's columns and the torque alike (Hz); by default the model's.
    #[arg(long, value_name = "HZ")]
    pub parallel_cutoff_hz: Option<f64>,
    /// The predictions, one row for each row of the logs that can be used (CSV).
    #[arg(long, value_name = "FILE.csv")]
    pub out: PathBuf,
    /// Print nothing but errors.
    #[arg(long)]
    pub quiet: bool,
    /// What stands in memory for the files.
    #[arg(skip)]
    pub in_memory: InMemory,
}

/// Arguments of `phiw simulate`.
#[derive(Clone, Debug, Default, Args)]
pub struct SimulateArguments {
    /// A model.json of `phiw identify` or `phiw explain`; it holds the robot, too.
    #[arg(long, value_name = "MODEL.json")]
    pub model: PathBuf,
    /// Logs with measured torques.
    #[arg(value_name = "LOG", required = true)]
    pub logs: Vec<PathBuf>,
    /// What the columns of the logs mean: topics, units, gears, currents (docs/log-maps.md). Without it they
    /// are named as in a log of phiw.
    #[arg(long, value_name = "MAP.toml")]
    pub map: Option<PathBuf>,
    /// Joints that stand still, as the model was made with; they need not be named. In a name, * stands for
    /// any letters and ? for one: --hold 'left_*'.
    #[arg(long, value_name = "JOINT[=VALUE],…", value_delimiter = ',', value_parser = held_joint)]
    pub hold: Vec<(String, f64)>,
    /// What computes the motion; the engines only where phiw was built with the feature `simulators`.
    #[arg(long, value_enum, default_value_t = Backend::Analytic)]
    pub backend: Backend,
    /// Folder for simulation.json, simulation.csv and the picture simulation.svg; it is made if it is absent.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Print nothing but errors.
    #[arg(long)]
    pub quiet: bool,
}

/// Arguments of `phiw check`.
#[derive(Clone, Debug, Args)]
pub struct CheckArguments {
    /// The robot's URDF, or MuJoCo's MJCF.
    #[arg(long, value_name = "ROBOT.urdf")]
    pub urdf: PathBuf,
    /// Logs: CSV, MCAP, ROS bags, LeRobot folders, npz.
    #[arg(value_name = "LOG", required = true)]
    pub logs: Vec<PathBuf>,
    /// What the columns of the logs mean: topics, units, gears, currents (docs/log-maps.md). Without it they
    /// are named as in a log of phiw.
    #[arg(long, value_name = "MAP.toml")]
    pub map: Option<PathBuf>,
    /// Joints of the URDF that do not move, at 0 or at a value (rad, m); they need no column in the log. In a
    /// name, * stands for any letters and ? for one: --hold 'left_*'.
    #[arg(long, value_name = "JOINT[=VALUE],…", value_delimiter = ',', value_parser = held_joint)]
    pub hold: Vec<(String, f64)>,
    /// Folder for check.json and check.html, the same as numbers and as a page; it is made if it is absent.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print nothing but errors.
    #[arg(long)]
    pub quiet: bool,
    /// What stands in memory for the files.
    #[arg(skip)]
    pub in_memory: InMemory,
}

impl CheckArguments {
    /// The same as a session on the logs.
    pub fn session(&self) -> SessionArguments {
        SessionArguments {
            urdf: self.urdf.clone(),
            train: self.logs.clone(),
            map: self.map.clone(),
            hold: self.hold.clone(),
            quiet: self.quiet,
            in_memory: self.in_memory.clone(),
            ..SessionArguments::default()
        }
    }

    /// The command line that gives these arguments to `phiw`, quoted for a shell.
    pub fn command_line(&self) -> String {
        let mut words = vec!["phiw check --urdf".to_owned()];
        let mut path = |path: &PathBuf| words.push(quoted(&path.display().to_string()));
        path(&self.urdf);
        self.logs.iter().for_each(&mut path);
        let [map, out] = [&self.map, &self.out].map(Option::as_ref);
        let hold: Vec<String> = self.hold.iter().map(held_in_words).collect();
        let hold = (!hold.is_empty()).then(|| PathBuf::from(hold.join(",")));
        for (name, value) in [("--map", map), ("--hold", hold.as_ref()), ("--out", out)] {
            words
                .extend(value.iter().map(|value| format!("{name} {}", quoted(&value.display().to_string()))));
        }
        words.join(" ")
    }
}

/// Arguments of `phiw retarget`.
#[derive(Clone, Debug, Args)]
pub struct RetargetArguments {
    /// The robot's URDF, or MuJoCo's MJCF.
    #[arg(long, value_name = "ROBOT.urdf")]
    pub urdf: PathBuf,
    /// Recordings: C3D, TRC, BVH (LAFAN1), npz of AMASS or SMPL-X, or CSV of named points (`t`, `<point>.x`,
    /// `<point>.y`, `<point>.z` in metres, or in the map's `units`).
    #[arg(long, visible_alias = "recordings", value_name = "FILE", required = true, num_args = 1..)]
    pub c3d: Vec<PathBuf>,
    /// Which marker sits where; by default the built-in map that names most markers of the recordings.
    #[arg(long, value_name = "MAP.toml")]
    pub map: Option<PathBuf>,
    /// Joints of the URDF that do not move, at 0 or at a value (rad, m). In a name, * stands for any letters
    /// and ? for one: --hold 'left_*'.
    #[arg(long, value_name = "JOINT[=VALUE],…", value_delimiter = ',', value_parser = held_joint)]
    pub hold: Vec<(String, f64)>,
    /// Torso and head follow reach and gaze of the hands: for recordings that hold neither. The results say
    /// so.
    #[arg(long)]
    pub torso_from_reach: bool,
    /// Keep joint velocities inside the URDF's limits, too.
    #[arg(long)]
    pub velocity_limits: bool,
    /// Time between the control points of the splines (s).
    #[arg(long, value_name = "S", default_value_t = 0.2, value_parser = positive)]
    pub interval: f64,
    /// How velocities and accelerations come about.
    #[arg(long, value_enum, default_value_t = Derivatives::Analytic)]
    pub derivatives: Derivatives,
    /// What a motion is written as.
    #[arg(long, value_enum, default_value_t = MotionFormat::Csv)]
    pub format: MotionFormat,
    /// Folder for the results; it is made if it is absent. What is done in it with the same settings is not
    /// done again.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Print nothing but errors.
    #[arg(long)]
    pub quiet: bool,
}

/// Arguments of `phiw next`.
#[derive(Clone, Debug, Args)]
pub struct NextArguments {
    /// The robot's URDF, or MuJoCo's MJCF.
    #[arg(long, value_name = "ROBOT.urdf")]
    pub urdf: PathBuf,
    /// Folder of motions to choose from, as `phiw retarget` writes them: logs with q, qd and qdd.
    #[arg(long, value_name = "DIR")]
    pub motions: PathBuf,
    /// Logs of what the robot has run so far.
    #[arg(long, value_name = "LOG", num_args = 1..)]
    pub measured: Vec<PathBuf>,
    /// What the columns of the logs mean: topics, units, gears, currents (docs/log-maps.md). Without it they
    /// are named as in a log of phiw.
    #[arg(long, value_name = "MAP.toml")]
    pub map: Option<PathBuf>,
    /// What the robot stands on (soles of links); without it the robot is taken as bolted down.
    #[arg(long, value_name = "SUPPORT.toml")]
    pub support: Option<PathBuf>,
    /// A model.json of `phiw identify` or `phiw explain` to take the parameters from, instead of fitting the
    /// logs.
    #[arg(long, value_name = "MODEL.json", conflicts_with = "declare")]
    pub model: Option<PathBuf>,
    /// Effects beside the rigid body, wherever they can act or on the joints named: viscous_friction,
    /// coulomb_friction:j1+j2, transmission_coupling:j5+j6, …
    #[arg(long, value_name = "KIND[:JOINT[+JOINT…]],…", value_delimiter = ',')]
    pub declare: Vec<String>,
    /// Joints of the URDF that do not move, at 0 or at a value (rad, m). In a name, * stands for any letters
    /// and ? for one: --hold 'left_*'.
    #[arg(long, value_name = "JOINT[=VALUE],…", value_delimiter = ',', value_parser = held_joint)]
    pub hold: Vec<(String, f64)>,
    /// How far off the URDF's inertial parameters may be, as a share of each body's magnitude: what the logs
    /// do not tell is taken from it.
    #[arg(long, value_name = "SHARE", default_value_t = 0.3, value_parser = positive)]
    pub urdf_error: f64,
    /// How the logs are estimated from. The first needs logs that say what the controller commanded
    /// (`tau_cmd.<joint>`) or was asked for (`qref.<joint>`); where one does not, the second is taken.
    #[arg(long, default_value = "unknown-noise")]
    pub estimator: NextEstimator,
    /// What makes a motion the best of those that are allowed.
    #[arg(long, default_value = "torque-per-second")]
    pub selection: NextSelection,
    /// Commands a second of the robot's controller (Hz); by default seen in the logs.
    #[arg(long, value_name = "HZ", value_parser = positive)]
    pub command_hz: Option<f64>,
    /// Slower versions of all motions beside them, so many times slower: --slower 2,4.
    #[arg(long, value_name = "TIMES,…", value_delimiter = ',', value_parser = positive)]
    pub slower: Vec<f64>,
    /// How often a motion that is allowed may leave the support, such as 0.001: so many standard deviations
    /// of the ZMP, by all that is not known of the robot and by the noise that moves it, are taken from its
    /// margin. By default none are: the standard deviation is told beside the margin.
    #[arg(long, value_name = "RATE", value_parser = positive)]
    pub false_fall_rate: Option<f64>,
    /// How far off the URDF may be for the link that stands on the floor, as a share of its magnitude; no log
    /// tells it, so weigh it and measure it. By default as --urdf-error.
    #[arg(long, value_name = "SHARE", value_parser = share, requires = "false_fall_rate")]
    pub base_error: Option<f64>,
    /// The part that the support is reduced by, 0 to 1; by default from cond(Φ), as in the paper's equation
    /// (20).
    #[arg(long, value_name = "ALPHA", value_parser = share)]
    pub alpha: Option<f64>,
    /// Cut-off of the low-pass over positions (Hz); by default chosen from the logs' spectra.
    #[arg(long, value_name = "HZ")]
    pub cutoff_hz: Option<f64>,
    /// Cut-off of the low-pass over the model's columns and the torque alike (Hz); by default the motion's
    /// bandwidth.
    #[arg(long, value_name = "HZ")]
    pub parallel_cutoff_hz: Option<f64>,
    /// The motion to run, as a log with the feed-forward torque; the reason goes beside it, with the
    /// extension .json.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Print nothing but errors.
    #[arg(long)]
    pub quiet: bool,
    /// What stands in memory for the files.
    #[arg(skip)]
    pub in_memory: InMemory,
}

impl NextArguments {
    /// The same as a session on the measured logs.
    pub fn session(&self) -> SessionArguments {
        SessionArguments {
            urdf: self.urdf.clone(),
            train: self.measured.clone(),
            map: self.map.clone(),
            declare: self.declare.clone(),
            hold: self.hold.clone(),
            cutoff_hz: self.cutoff_hz,
            parallel_cutoff_hz: self.parallel_cutoff_hz,
            quiet: self.quiet,
            in_memory: self.in_memory.clone(),
            ..SessionArguments::default()
        }
    }
}

/// How `phiw next` estimates from logs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum NextEstimator {
    /// The likelihood of a motion that noise moves, which finds the noise out with the parameters.
    #[default]
    UnknownNoise,
    /// Equation (4) of the filtered logs, with the URDF as prior: the noise is taken to be in the log alone.
    LeastSquares,
}

/// What makes a motion the best of those that are allowed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NextSelection {
    /// In each second of it, it takes most of the uncertainty of the torques of all motions.
    #[default]
    TorquePerSecond,
    /// It makes cond(Φ) smallest: the paper's equation (11).
    Condition,
}

/// How velocities and accelerations come about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Derivatives {
    /// Those of the spline.
    Analytic,
    /// Backward differences of the samples, as in the paper.
    BackwardDifferences,
}

/// What a motion is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum MotionFormat {
    /// A log without torques, as phiw reads it.
    Csv,
    /// NumPy arrays, as programs that learn to track motions read them: `fps`, `joint_pos`, `joint_vel`,
    /// `body_pos_w`, `body_quat_w`, `body_lin_vel_w`, `body_ang_vel_w`, `joint_names`, `body_names`.
    Npz,
}

impl MotionFormat {
    /// How names of its files end.
    pub fn extension(self) -> &'static str {
        match self {
            MotionFormat::Csv => "csv",
            MotionFormat::Npz => "npz",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_reads_back() {
        let words = [
            "phiw",
            "identify",
            "--urdf",
            "a robot.urdf",
            "--train",
            "a.csv",
            "b'.csv",
            "--validate",
            "c.csv",
            "--declare",
            "viscous_friction,torque_offset",
            "--hold",
            "finger,torso=-0.25",
            "--cutoff-hz",
            "12.5",
            "--out",
            "out",
        ];
        let Command::Identify(read) = Arguments::try_parse_from(words).unwrap().command else {
            panic!("`identify` is read as another command");
        };
        assert_eq!(
            read.session.command_line("identify"),
            "phiw identify --urdf 'a robot.urdf' --train a.csv 'b'\\''.csv' --validate c.csv \
             --declare viscous_friction,torque_offset --hold finger,torso=-0.25 --cutoff-hz 12.5 --out out"
        );
        assert_eq!(read.session.hold, [("finger".to_owned(), 0.0), ("torso".to_owned(), -0.25)]);
    }

    #[test]
    fn wrong_command_lines_are_refused() {
        let identify = ["phiw", "identify", "--urdf", "r.urdf", "--train", "a.csv", "--out", "o"];
        for more in [
            &["--hold", "a=b"][..],
            &["--hold", "=1"],
            &["--hold", "a=inf"],
            &["--cutoff-hz", "x"],
            &["--gold"],
        ] {
            assert!(Arguments::try_parse_from(identify.iter().chain(more)).is_err(), "{more:?}");
        }
        assert!(Arguments::try_parse_from(&identify[..6]).is_err(), "--out is required");
    }
}
