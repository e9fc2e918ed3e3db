//! The part of the command line that every command on measured logs has.

use crate::argument_values::{held_in_words, held_joint, inside, known_mass, positive, quoted, two_names};
use crate::in_memory::InMemory;
use clap::Args;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Robot, logs and declared model: what every command on measured logs takes.
#[derive(Clone, Debug, Default, Args, Serialize, Deserialize)]
pub struct SessionArguments {
    /// The robot's URDF, or MuJoCo's MJCF.
    #[arg(long, value_name = "ROBOT.urdf")]
    pub urdf: PathBuf,
    /// Logs that the model is fitted to: CSV, MCAP, ROS bags, LeRobot folders, npz.
    #[arg(long, value_name = "LOG", required = true, num_args = 1..)]
    pub train: Vec<PathBuf>,
    /// Logs that its error is measured on; without any, the last 30 % of each training log are held out.
    #[arg(long, value_name = "LOG", num_args = 1..)]
    pub validate: Vec<PathBuf>,
    /// What the columns of the logs mean: topics, units, gears, currents (docs/log-maps.md). Without it they
    /// are named as in a log of phiw.
    #[arg(long, value_name = "MAP.toml")]
    pub map: Option<PathBuf>,
    /// Effects beside the rigid body, wherever they can act or on the joints named: viscous_friction,
    /// coulomb_friction:j1+j2, transmission_coupling:j5+j6, …
    #[arg(long, value_name = "KIND[:JOINT[+JOINT…]],…", value_delimiter = ',')]
    pub declare: Vec<String>,
    /// Joints of the URDF that do not move, at 0 or at a value (rad, m); they need no column in the log. In a
    /// name, * stands for any letters and ? for one: --hold 'left_*'.
    #[arg(long, value_name = "JOINT[=VALUE],…", value_delimiter = ',', value_parser = held_joint)]
    pub hold: Vec<(String, f64)>,
    /// Masses that are known, as weighed (kg), of the links that joints carry; what is fixed to a link counts
    /// with it. They hold for the bodies that are written, not for least squares.
    #[arg(long, value_name = "LINK=KG,…", value_delimiter = ',', value_parser = known_mass)]
    pub mass: Vec<(String, f64)>,
    /// Mass of all links that move, as weighed (kg).
    #[arg(long, value_name = "KG", value_parser = positive)]
    pub total_mass: Option<f64>,
    /// Ellipsoids that hold all of a link's mass, what is fixed to it included: centre and half axes (m) in
    /// the frame of its joint, six numbers between blanks: --inside 'upper_arm=0.2 0 0 0.3 0.1 0.1'.
    #[arg(long, value_name = "LINK=X Y Z A B C,…", value_delimiter = ',', value_parser = inside)]
    #[serde(default)]
    pub inside: Vec<(String, [f64; 6])>,
    /// The same of all other links that have geometry in the URDF: the box around their boxes, cylinders,
    /// spheres and meshes (STL, OBJ), what is fixed to a link included. Meshes that are absent are said.
    #[arg(long)]
    #[serde(default)]
    pub inside_geometry: bool,
    /// Links that are mirror images of each other, left and right, with the robot at zero:
    /// --mirrored left_thigh=right_thigh.
    #[arg(long, value_name = "LINK=LINK,…", value_delimiter = ',', value_parser = two_names)]
    #[serde(default)]
    pub mirrored: Vec<(String, String)>,
    /// Folder of motions, as `phiw retarget` writes them: which of them would tell most of what the logs do
    /// not tell.
    #[arg(long, value_name = "DIR")]
    #[serde(default)]
    pub motions: Option<PathBuf>,
    /// Cut-off of the low-pass over positions (Hz); by default chosen from the logs' spectra.
    #[arg(long, value_name = "HZ")]
    pub cutoff_hz: Option<f64>,
    /// Cut-off of the low-pass over the model's columns and the torque alike (Hz); by default the motion's
    /// bandwidth.
    #[arg(long, value_name = "HZ")]
    pub parallel_cutoff_hz: Option<f64>,
    /// Folder for the results; it is made if it is absent.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Print nothing but errors.
    #[arg(long)]
    pub quiet: bool,
    /// What stands in memory for the files.
    #[arg(skip)]
    #[serde(skip)]
    pub in_memory: InMemory,
}

impl SessionArguments {
    /// The files that are read.
    pub fn inputs(&self) -> Vec<PathBuf> {
        let logs = self.train.iter().chain(&self.validate);
        std::iter::once(&self.urdf).chain(logs).chain(&self.map).cloned().collect()
    }

    /// The command line that gives these arguments to `phiw` and `command`, quoted for a shell.
    pub fn command_line(&self, command: &str) -> String {
        let mut words = vec!["phiw".to_owned(), command.to_owned()];
        let mut option = |name: &str, values: Vec<String>| {
            if !values.is_empty() {
                words.push(name.to_owned());
                words.extend(values.iter().map(|value| quoted(value)));
            }
        };
        let paths =
            |paths: &[PathBuf]| paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>();
        let list = |values: Vec<String>| if values.is_empty() { values } else { vec![values.join(",")] };
        let number = |value: Option<f64>| value.iter().map(f64::to_string).collect::<Vec<_>>();
        option("--urdf", paths(std::slice::from_ref(&self.urdf)));
        option("--train", paths(&self.train));
        option("--validate", paths(&self.validate));
        option("--map", paths(self.map.as_slice()));
        option("--declare", list(self.declare.clone()));
        option("--hold", list(self.hold.iter().map(held_in_words).collect()));
        option("--mass", list(self.mass.iter().map(|(link, mass)| format!("{link}={mass}")).collect()));
        option("--total-mass", number(self.total_mass));
        let in_words = |numbers: &[f64; 6]| numbers.map(|number| number.to_string()).join(" ");
        option(
            "--inside",
            list(self.inside.iter().map(|(link, numbers)| format!("{link}={}", in_words(numbers))).collect()),
        );
        option(
            "--mirrored",
            list(self.mirrored.iter().map(|(link, image)| format!("{link}={image}")).collect()),
        );
        if self.inside_geometry {
            words.push("--inside-geometry".to_owned());
        }
        let mut option = |name: &str, values: Vec<String>| {
            if !values.is_empty() {
                words.push(name.to_owned());
                words.extend(values.iter().map(|value| quoted(value)));
            }
        };
        option("--motions", paths(self.motions.as_slice()));
        option("--cutoff-hz", number(self.cutoff_hz));
        option("--parallel-cutoff-hz", number(self.parallel_cutoff_hz));
        option("--out", paths(std::slice::from_ref(&self.out)));
        words.join(" ")
    }
}
