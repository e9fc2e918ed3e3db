//! Reading a marker recording, whatever file it is in.

use crate::recording::{MarkerRecording, RecordingError};
use phiw_limits::Limits;
use std::path::Path;

/// Reads a recording as it is: C3D, or CSV of named points if the name ends so. `units` replaces what the
/// file says of its unit; a CSV says nothing and is in metres.
///
/// [`crate::Retargeter::read`] looks at the numbers, too.
///
/// # Errors
/// [`RecordingError`], which names the file, the place and the mend.
pub fn read_recording(path: &Path, units: Option<&str>) -> Result<MarkerRecording, RecordingError> {
    let metadata =
        path.metadata().map_err(|source| RecordingError::Unreadable { path: path.to_owned(), source })?;
    let most = Limits::default().recording_bytes;
    if !metadata.is_file() || metadata.len() > most {
        let what = if metadata.is_file() { "too large for a recording" } else { "no regular file" };
        let source = std::io::Error::other(format!("it is {what}; check the path"));
        return Err(RecordingError::Unreadable { path: path.to_owned(), source });
    }
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv")) {
        crate::point_csv::read_point_csv(path, units)
    } else {
        crate::c3d::read_c3d_file(path, units)
    }
}
