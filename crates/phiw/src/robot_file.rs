//! Robots as files: URDF as it is, MJCF as the URDF of the same robot.

use crate::Error;
use crate::input::read_text;
use phiw_limits::Limits;
use phiw_mjcf::{is_mjcf, read_mjcf_with};
use std::path::Path;

/// The text of a robot.
#[derive(Clone, Debug)]
pub struct RobotText {
    /// Its URDF.
    pub urdf: String,
    /// What of an MJCF file the URDF cannot express, in words.
    pub left_out: Vec<String>,
}

/// The URDF of a robot whose file has this text: the text itself, or what an MJCF file says as a URDF, with
/// what it lacks in the comment at its head. Files that it includes are read from the folder of `path`.
///
/// # Errors
/// It is MJCF that is not read.
pub fn as_urdf(text: String, path: &Path) -> Result<RobotText, Error> {
    if !is_mjcf(&text) {
        return Ok(RobotText { urdf: text, left_out: Vec::new() });
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut load = |name: &str| {
        read_text(&folder.join(name), Limits::default().urdf_bytes).map_err(|error| error.to_string())
    };
    let reading = read_mjcf_with(&text, &mut load)
        .map_err(|source| Error::Mjcf { path: path.to_owned(), source: Box::new(source) })?;
    let mut head = vec!["The robot of an MJCF file.".to_owned()];
    head.extend(reading.left_out.iter().map(|line| format!("- left out: {line}")));
    Ok(RobotText { urdf: phiw_mjcf::comment(&head) + &reading.urdf, left_out: reading.left_out })
}

/// A warning of what was left out, if anything was.
pub fn warning(left_out: &[String]) -> Option<String> {
    (!left_out.is_empty()).then(|| {
        format!("the robot was read from MJCF without what a URDF cannot express: {}", left_out.join("; "))
    })
}
