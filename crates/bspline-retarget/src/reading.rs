//! Reading a marker recording, whatever file it is in.

use crate::joint_motion::{amass, bvh};
use crate::recording::{MarkerRecording, RecordingError};
use crate::{point_csv, trc};
use phiw_limits::Limits;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Reads a recording as it is. The format is told by the content: C3D, BVH, TRC, the npz of AMASS and SMPL-X;
/// a CSV of named points by its name. `units` replaces what the file says of its unit; a CSV says nothing and
/// is in metres, a BVH says nothing and is in centimetres, AMASS is in metres always.
///
/// [`crate::Retargeter::read`] looks at the numbers, too.
///
/// # Errors
/// [`RecordingError`], which names the file, the place and the mend.
pub fn read_recording(path: &Path, units: Option<&str>) -> Result<MarkerRecording, RecordingError> {
    let unreadable = |source| RecordingError::Unreadable { path: path.to_owned(), source };
    let metadata = path.metadata().map_err(unreadable)?;
    let most = Limits::default().recording_bytes;
    if !metadata.is_file() || metadata.len() > most {
        let what = if metadata.is_file() { "too large for a recording" } else { "no regular file" };
        return Err(unreadable(std::io::Error::other(format!("it is {what}; check the path"))));
    }
    let mut file = File::open(path).map_err(unreadable)?;
    let mut head = Vec::new();
    (&mut file).take(HEAD).read_to_end(&mut head).map_err(unreadable)?;
    let wrong = |what| RecordingError::Content { path: path.to_owned(), what };
    match Format::of(&head) {
        Some(format) => {
            let mut bytes = head;
            file.take(most).read_to_end(&mut bytes).map_err(unreadable)?;
            format.parse(&bytes, units).map_err(wrong)
        }
        None if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv")) => {
            point_csv::read_point_csv(path, units)
        }
        None => crate::c3d::read_c3d_file(path, units),
    }
}

/// Bytes in which a format shows.
const HEAD: u64 = 64;

/// A format that shows in its first bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Bvh,
    Trc,
    Npz,
}

impl Format {
    fn of(head: &[u8]) -> Option<Self> {
        let text = head.strip_prefix(BYTE_ORDER_MARK).unwrap_or(head).trim_ascii_start();
        [(&b"HIERARCHY"[..], Format::Bvh), (b"PathFileType", Format::Trc), (b"PK\x03\x04", Format::Npz)]
            .into_iter()
            .find(|(start, _)| text.starts_with(start))
            .map(|(_, format)| format)
    }

    fn parse(self, bytes: &[u8], units: Option<&str>) -> Result<MarkerRecording, String> {
        let text = || {
            let bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
            std::str::from_utf8(bytes).map_err(|error| {
                format!("byte {} is no text; save the file as UTF-8", error.valid_up_to() + 1)
            })
        };
        match self {
            Format::Bvh => bvh::parse(text()?, units),
            Format::Trc => trc::parse(text()?, units),
            Format::Npz => amass::parse(bytes),
        }
    }
}

/// What some programs begin a text in UTF-8 with.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
