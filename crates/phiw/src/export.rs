//! `phiw export`: an identified model in the forms that other programs take.

use crate::Error;
use crate::actuator_table::{self, actuator_table};
use crate::exported::Carried;
use crate::generated_code;
use crate::identified_mjcf::{self, identified_mjcf};
use crate::identified_urdf::{self, identified_urdf};
use crate::model_file::ModelFile;
use crate::model_use::robot;
use crate::output::check_folder;
use crate::servo_file::{self, servo_file};
use crate::training_actuators;
use clap::Args;
use phiw_dynamics::urdf::without_geometry;
use phiw_effects::Catalogue;
use phiw_result_folder::{Disk, Lock, ResultFile, check_inputs, replace_folder};
use std::fmt::Write as _;
use std::path::PathBuf;

/// Name of the URDF without geometry.
pub const URDF_FILE: &str = "bodies.urdf";

/// Arguments of `phiw export`. Without a form all are written.
#[derive(Clone, Debug, Default, Args)]
pub struct ExportArguments {
    /// A model.json of `phiw identify` or `phiw explain`; it holds the robot, too.
    #[arg(long, value_name = "MODEL.json")]
    pub model: PathBuf,
    /// Inverse dynamics with the model's effects as one C99 file (inverse_dynamics.c).
    #[arg(long)]
    pub c: bool,
    /// The same as one Rust file without std (inverse_dynamics.rs).
    #[arg(long)]
    pub rust: bool,
    /// The bodies as a URDF without geometry, which names no mesh (bodies.urdf).
    #[arg(long)]
    pub urdf: bool,
    /// MuJoCo's form (identified.xml).
    #[arg(long)]
    pub mjcf: bool,
    /// Armature, damping, friction loss and limits of each joint (actuators.csv).
    #[arg(long)]
    pub table: bool,
    /// The joints as actuators of mjlab (mjlab_actuators.py).
    #[arg(long)]
    pub mjlab: bool,
    /// The joints as actuators of Isaac Lab (isaaclab_actuators.py).
    #[arg(long)]
    pub isaaclab: bool,
    /// The joints as servos of BAM, Better Actuator Models (bam.json).
    #[arg(long)]
    pub bam: bool,
    /// Folder for the files; it is made if it is absent.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Print nothing but errors.
    #[arg(long)]
    pub quiet: bool,
}

/// What the command has done.
#[derive(Debug)]
pub struct ExportOutcome {
    /// The files, and what each cannot express, as text for a terminal.
    pub summary: String,
    /// Names of the files.
    pub files: Vec<String>,
}

/// Writes a model's possible bodies and its effects in the forms that were asked for; in all if none was.
///
/// Nothing is written before everything has been made.
///
/// # Errors
/// The model is wrong, or the files cannot be written: [`Error::exit_status`] tells the two apart.
pub fn export(arguments: &ExportArguments) -> Result<ExportOutcome, Error> {
    check_folder(&arguments.out)?;
    let names = [
        generated_code::C_FILE,
        generated_code::RUST_FILE,
        URDF_FILE,
        identified_mjcf::FILE,
        actuator_table::FILE,
        training_actuators::MJLAB_FILE,
        training_actuators::ISAAC_LAB_FILE,
        servo_file::FILE,
    ];
    let outputs: Vec<_> = names.iter().map(|name| arguments.out.join(name)).collect();
    check_inputs(std::slice::from_ref(&arguments.model), &outputs)?;
    let place = Lock::acquire(&arguments.out, "phiw export")?;
    let file = ModelFile::read(&arguments.model)?;
    let tree = robot(&file.model, &arguments.model, &[])?;
    let catalogue = Catalogue::default();
    // Refuses a model whose parameters are not those of its effects.
    file.own_design(&tree, &catalogue)?;
    let xml = file.model.urdf.as_deref().unwrap_or_default();
    let carried = Carried { tree: &tree, xml, model: &file.model, catalogue: &catalogue };
    let ExportArguments { c, rust, urdf, mjcf, table, mjlab, isaaclab, bam, .. } = *arguments;
    let all = ![c, rust, urdf, mjcf, table, mjlab, isaaclab, bam].contains(&true);
    let mut files = Vec::new();
    let mut lacking = Vec::new();
    let mut put = |name: &str, text: String, left_out: Vec<String>| {
        files.push(ResultFile::new(name, text));
        lacking.push((name.to_owned(), left_out));
    };
    if all || c {
        put(generated_code::C_FILE, generated_code::c(carried)?, generated_code::not_expressed(carried));
    }
    if all || rust {
        put(
            generated_code::RUST_FILE,
            generated_code::rust(carried)?,
            generated_code::not_expressed(carried),
        );
    }
    if all || urdf {
        let text = without_geometry(&identified_urdf(carried)?);
        let text = text.map_err(|source| Error::IdentifiedUrdf(Box::new(source)))?;
        put(URDF_FILE, text, identified_urdf::not_expressed(carried));
    }
    if all || mjcf {
        put(identified_mjcf::FILE, identified_mjcf(carried)?, identified_mjcf::not_expressed(carried));
    }
    if all || table {
        put(actuator_table::FILE, actuator_table(carried)?, actuator_table::not_expressed(carried));
    }
    if all || mjlab {
        let left_out = training_actuators::not_expressed(carried);
        put(training_actuators::MJLAB_FILE, training_actuators::mjlab(carried), left_out);
    }
    if all || isaaclab {
        let left_out = training_actuators::not_expressed(carried);
        put(training_actuators::ISAAC_LAB_FILE, training_actuators::isaac_lab(carried), left_out);
    }
    if all || bam {
        put(servo_file::FILE, servo_file(carried)?, servo_file::not_expressed(carried));
    }
    replace_folder(&Disk, &place, &files)?;
    Ok(ExportOutcome {
        summary: summary(&lacking, arguments),
        files: files.into_iter().map(|file| file.name).collect(),
    })
}

fn summary(lacking: &[(String, Vec<String>)], arguments: &ExportArguments) -> String {
    let mut text = String::new();
    for (file, left_out) in lacking.iter().filter(|(_, left_out)| !left_out.is_empty()) {
        let _ = writeln!(text, "{file} cannot express {}: model.json has all", left_out.join("; "));
    }
    let names: Vec<&str> = lacking.iter().map(|(file, _)| file.as_str()).collect();
    let _ = writeln!(text, "{} in {}", names.join(", "), arguments.out.display());
    text
}
