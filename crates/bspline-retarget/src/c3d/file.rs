//! A C3D file, read.

use super::header::{self, Header};
use super::parameters::{self, Parameters};
use super::{BLOCK, C3dError, Processor};
use crate::recording::{MarkerRecording, RATES_HZ, RecordingError, metres};
use std::path::Path;

/// The points of a C3D file in its own unit, and its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct C3d {
    /// Labels of the points without blanks; a point without one is called `*7` (its number, from 1).
    pub labels: Vec<String>,
    /// Points of all frames, frame by frame, in the file's unit; a missing point is NaN in all three.
    pub points: Vec<[f64; 3]>,
    /// Frames per second \[Hz\].
    pub rate_hz: f64,
    /// The unit as POINT:UNITS names it; empty if it does not.
    pub units: String,
    /// All parameters.
    pub parameters: Parameters,
    /// Who wrote the numbers.
    pub processor: Processor,
}

/// Reads the content of a C3D file.
///
/// # Errors
/// [`C3dError`]: it is none, is cut off, contradicts itself, or holds no points, no frames or no rate.
pub fn read_c3d(bytes: &[u8]) -> Result<C3d, C3dError> {
    let parameter_block = header::parameter_block(bytes)?;
    let (parameters, processor, _) = parameters::read(bytes, parameter_block)?;
    let header = Header::read(bytes, processor);
    let points = parameters.count("POINT", "USED").unwrap_or(header.points);
    if points == 0 {
        return Err(C3dError::Empty { what: "points" });
    }
    let scale = parameters.number("POINT", "SCALE", 0).unwrap_or(f64::from(header.scale));
    let rate_hz = parameters
        .number("POINT", "RATE", 0)
        .filter(|rate| rate.is_finite() && *rate > 0.0)
        .unwrap_or(f64::from(header.rate_hz));
    if !RATES_HZ.contains(&rate_hz) {
        return Err(C3dError::Rate { rate_hz });
    }
    let reals = scale < 0.0;
    if scale.is_nan() || scale == 0.0 || scale == f64::INFINITY {
        let what = format!("integers with the scale {scale}; set it to the length of one count");
        return Err(C3dError::Parameter { name: "POINT:SCALE", what });
    }
    let number = if reals { 4 } else { 2 };
    let layout = Layout { points, stride: (4 * points + header.analog) * number, reals, scale };
    let start = data_start(bytes, &header, &parameters)?;
    let available = (bytes.len() - start) / layout.stride;
    let frames = frame_count(&header, &parameters, available).map_err(|claimed| C3dError::Truncated {
        what: "the frames",
        from: start,
        to: start.saturating_add(claimed.saturating_mul(layout.stride)),
        length: bytes.len(),
    })?;
    if frames == 0 {
        return Err(C3dError::Empty { what: "frames" });
    }
    let data = &bytes[start..start + frames * layout.stride];
    Ok(C3d {
        labels: labels(&parameters, points),
        points: layout.read(data, processor),
        rate_hz,
        units: parameters.texts("POINT", "UNITS").first().cloned().unwrap_or_default(),
        parameters,
        processor,
    })
}

/// Reads a C3D file as a recording in metres; `units` replaces what the file says of its unit.
///
/// # Errors
/// The file cannot be read, is no sound C3D file, or its unit is not known.
pub fn read_c3d_file(path: &Path, units: Option<&str>) -> Result<MarkerRecording, RecordingError> {
    let bytes =
        std::fs::read(path).map_err(|source| RecordingError::Unreadable { path: path.into(), source })?;
    let wrong = |source| RecordingError::C3d { path: path.into(), source };
    read_c3d(&bytes).map_err(wrong)?.recording(units).map_err(wrong)
}

impl C3d {
    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.points.len() / self.labels.len().max(1)
    }

    /// The points in metres; `units` replaces what the file says.
    ///
    /// # Errors
    /// [`C3dError::Units`].
    pub fn recording(&self, units: Option<&str>) -> Result<MarkerRecording, C3dError> {
        let units = units.unwrap_or(&self.units);
        let metres = metres(units).ok_or_else(|| C3dError::Units { units: units.to_owned() })?;
        let positions_m =
            self.points.iter().map(|point| point.map(|coordinate| coordinate * metres)).collect();
        Ok(MarkerRecording { rate_hz: self.rate_hz, labels: self.labels.clone(), positions_m })
    }
}

fn data_start(bytes: &[u8], header: &Header, parameters: &Parameters) -> Result<usize, C3dError> {
    let block = match header.data_block {
        0 => parameters.count("POINT", "DATA_START").unwrap_or(0),
        block => block,
    };
    let start = block.saturating_sub(1) * BLOCK;
    if start < BLOCK {
        let what = format!("the data are said to start at block {block}, inside the header; export again");
        return Err(C3dError::Parameter { name: "POINT:DATA_START", what });
    }
    if start > bytes.len() {
        return Err(C3dError::Truncated { what: "the frames", from: start, to: start, length: bytes.len() });
    }
    Ok(start)
}

/// The first count of frames that the file is long enough for; `Err` is the first of all if none is.
fn frame_count(header: &Header, parameters: &Parameters, available: usize) -> Result<usize, usize> {
    let field = |name| parameters.long_count("TRIAL", name);
    let trial = field("ACTUAL_START_FIELD")
        .zip(field("ACTUAL_END_FIELD"))
        .and_then(|(first, last)| (last + 1).checked_sub(first))
        .filter(|&frames| frames > 0);
    let saturated = header.last_frame == 65535;
    // Frames are numbered from 1; some writers leave both numbers at 0.
    let numbered = match (header.first_frame, header.last_frame) {
        (_, 0) => 0,
        (first, last) => (last + 1).saturating_sub(first),
    };
    let counts = [
        trial,
        parameters.long_count("POINT", "LONG_FRAMES").filter(|&frames| frames > 0),
        parameters.count("POINT", "FRAMES").filter(|&frames| frames > 0 && frames < 65535),
        (!saturated).then_some(numbered),
        // The file does not say how many frames there are beyond 65535: all that its length holds are read.
        saturated.then_some(available),
    ];
    let mut claimed = counts.into_iter().flatten();
    let first = claimed.next().unwrap_or(0);
    match std::iter::once(first).chain(claimed).find(|&frames| frames <= available) {
        Some(frames) => Ok(frames),
        None => Err(first),
    }
}

/// POINT:LABELS, LABELS2, … in a row, one for each point.
fn labels(parameters: &Parameters, points: usize) -> Vec<String> {
    let mut labels: Vec<String> = parameters.texts("POINT", "LABELS").to_vec();
    for number in 2.. {
        let more = parameters.texts("POINT", &format!("LABELS{number}"));
        if more.is_empty() || labels.len() >= points {
            break;
        }
        labels.extend_from_slice(more);
    }
    labels.resize(points, String::new());
    for (index, label) in labels.iter_mut().enumerate() {
        if label.is_empty() {
            *label = format!("*{}", index + 1);
        }
    }
    labels
}

/// How a frame lies in the file.
struct Layout {
    points: usize,
    /// Bytes from frame to frame.
    stride: usize,
    reals: bool,
    scale: f64,
}

impl Layout {
    fn read(&self, data: &[u8], processor: Processor) -> Vec<[f64; 3]> {
        let frames = data.chunks_exact(self.stride);
        let mut points = Vec::with_capacity(frames.len() * self.points);
        for frame in frames {
            if self.reals {
                let numbers = frame.as_chunks::<16>().0.iter().take(self.points);
                points.extend(numbers.map(|point| {
                    let [x, y, z, residual] = [0, 4, 8, 12].map(|at| {
                        f64::from(processor.read_f32([
                            point[at],
                            point[at + 1],
                            point[at + 2],
                            point[at + 3],
                        ]))
                    });
                    measured([x, y, z], residual >= 0.0)
                }));
            } else {
                let numbers = frame.as_chunks::<8>().0.iter().take(self.points);
                points.extend(numbers.map(|point| {
                    let [x, y, z, residual] =
                        [0, 2, 4, 6].map(|at| processor.read_i16([point[at], point[at + 1]]));
                    measured([x, y, z].map(|count| f64::from(count) * self.scale), residual >= 0)
                }));
            }
        }
        points
    }
}

/// A point whose residual is negative was not seen, nor was one that is not a number.
fn measured(point: [f64; 3], seen: bool) -> [f64; 3] {
    if seen && point.iter().all(|coordinate| coordinate.is_finite()) { point } else { [f64::NAN; 3] }
}
