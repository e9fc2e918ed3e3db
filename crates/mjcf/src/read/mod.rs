//! Robots from MJCF files, as URDF.
//!
//! Bodies, joints and their inertias are rewritten as a URDF, which the rest of the program reads, keeps
//! beside the model and writes results into. What a URDF has no place for is named, not lost in silence:
//! armature, springs, tendons, gravity of its own.

mod bodies;
mod defaults;
mod element;
mod error;
mod geometry;
mod include;
mod inertial;
mod meshes;
mod orientation;
mod relations;
mod robot;
mod urdf;

pub use error::MjcfReadError;
pub use include::Loader;

use bodies::Reader;

/// A robot of an MJCF file.
#[derive(Clone, Debug, PartialEq)]
pub struct MjcfReading {
    /// The same robot as a URDF: bodies and joints in the file's order and with its names, inertias, limits,
    /// damping, friction loss.
    pub urdf: String,
    /// Armature of the joints that have one, by name \[kg·m², kg\].
    pub armature: Vec<(String, f64)>,
    /// What of the robot's dynamics a URDF cannot express, in words: armature, springs, tendons, closed
    /// loops, gravity; and bodies whose inertia is unknown since only a mesh has it.
    pub left_out: Vec<String>,
}

/// Whether a text is MJCF: its first element is `<mujoco>` (that of a URDF is `<robot>`).
pub fn is_mjcf(text: &str) -> bool {
    let mut rest = text.trim_start_matches('\u{feff}').trim_start();
    loop {
        let end = match rest {
            _ if rest.starts_with("<!--") => "-->",
            _ if rest.starts_with("<?") => "?>",
            _ => break,
        };
        let Some(found) = rest.find(end) else { return false };
        rest = rest[found + end.len()..].trim_start();
    }
    let after = rest.strip_prefix("<mujoco");
    after.is_some_and(|after| after.starts_with(|c: char| c.is_whitespace() || c == '>' || c == '/'))
}

/// Reads the text of an MJCF file as MuJoCo compiles it: classes of defaults, angles, frames, inertias of
/// geometry where a body has no inertial.
///
/// Hinges, slides and one free joint are read. Bodies without a joint are fixed, several joints of one body
/// become several, with massless links between them. Joints that follow another by an equality of first order
/// do so in the URDF. Geometry becomes `<visual>`; assets are never looked for.
///
/// # Errors
/// The text is no MJCF or asks for too much ([`phiw_limits::Limits`]); it includes other files, has ball
/// joints, or makes bodies by rules (`replicate`, `attach`, `composite`, `flexcomp`); a number is none.
pub fn read_mjcf(text: &str) -> Result<MjcfReading, MjcfReadError> {
    let document = include::parse(text)?;
    let robot = Reader::new(document.root_element())?.read()?;
    Ok(urdf::reading(robot))
}

/// The same of a file that may include others, which `load` gives by the names that the file has for them
/// (paths from the folder of the first file, as MuJoCo takes them).
///
/// # Errors
/// As [`read_mjcf`]; and an included file cannot be had, is no MJCF, or is included twice.
pub fn read_mjcf_with(text: &str, load: &mut Loader<'_>) -> Result<MjcfReading, MjcfReadError> {
    match include::with_includes(text, load)? {
        None => read_mjcf(text),
        Some(whole) => {
            read_mjcf(&whole).map_err(|source| MjcfReadError::WithIncludes { source: Box::new(source) })
        }
    }
}
