//! CSV of named points: `t` \[s\] and for each point `<name>.x`, `<name>.y`, `<name>.z` \[m\].

use crate::recording::{MarkerRecording, RecordingError};
use std::path::Path;

/// Largest deviation of a time step from their mean, as a share of it.
const STEP_TOLERANCE: f64 = 0.02;

/// Reads a table of points in metres at a constant rate; an empty or NaN cell is a missing point.
///
/// # Errors
/// The file cannot be read, a column or a cell is wrong, or the times are not equally spaced.
pub fn read_point_csv(path: &Path) -> Result<MarkerRecording, RecordingError> {
    let file = std::fs::File::open(path)
        .map_err(|source| RecordingError::Unreadable { path: path.into(), source })?;
    parse(file).map_err(|what| RecordingError::Csv { path: path.into(), what })
}

fn parse(source: impl std::io::Read) -> Result<MarkerRecording, String> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(source);
    let header = reader.headers().map_err(|error| error.to_string())?.clone();
    let column = |name: &str| header.iter().position(|cell| cell == name);
    let time = column("t").ok_or("line 1 has no column `t`; give the time of each row in seconds")?;
    let mut labels = Vec::new();
    let mut columns = Vec::new();
    for label in header.iter().filter_map(|cell| cell.strip_suffix(".x")) {
        let axis = |axis: &str| {
            let name = format!("{label}.{axis}");
            column(&name)
                .ok_or(format!("line 1 has `{label}.x` but no `{name}`; a point needs .x, .y and .z"))
        };
        columns.push([axis("x")?, axis("y")?, axis("z")?]);
        labels.push(label.to_owned());
    }
    if labels.is_empty() {
        return Err("line 1 names no point; name the columns <point>.x, <point>.y, <point>.z".to_owned());
    }
    let (mut times, mut positions_m) = (Vec::new(), Vec::new());
    for record in reader.records() {
        let record = record.map_err(|error| error.to_string())?;
        let line = record.position().map_or(0, |position| position.line());
        let number = |index: usize| match record.get(index).unwrap_or("") {
            "" => Ok(f64::NAN),
            cell => cell.parse::<f64>().map_err(|_| {
                format!("line {line}, column {}: `{cell}` is not a number", header.get(index).unwrap_or("?"))
            }),
        };
        times.push(number(time)?);
        for &[x, y, z] in &columns {
            let point = [number(x)?, number(y)?, number(z)?];
            let seen = point.iter().all(|coordinate| coordinate.is_finite());
            positions_m.push(if seen { point } else { [f64::NAN; 3] });
        }
    }
    Ok(MarkerRecording { rate_hz: rate_hz(&times)?, labels, positions_m })
}

/// The rate of equally spaced times.
fn rate_hz(times: &[f64]) -> Result<f64, String> {
    let [first, .., last] = times else {
        return Err(format!("{} rows; a motion needs at least 2", times.len()));
    };
    let step = (last - first) / (times.len() - 1) as f64;
    if !(step.is_finite() && step > 0.0) {
        return Err(format!("`t` goes from {first} to {last} s; it must be finite and grow"));
    }
    let even = |row: usize| (times[row] - times[row - 1] - step).abs() <= STEP_TOLERANCE * step;
    // A time that is not a number is not even.
    let uneven = (1..times.len()).find(|&row| !even(row));
    match uneven {
        // The header is line 1.
        Some(row) => Err(format!(
            "line {}: {} s after the row before, the mean is {step} s; resample to a constant rate",
            row + 2,
            times[row] - times[row - 1]
        )),
        None => Ok(1.0 / step),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_read_by_name_and_gaps_stay_gaps() {
        let recording =
            parse("t,b.z,b.y,b.x,note.x ,note.y,note.z\n0,3,2,1,,,\n0.01,3,,1,4,5,6\n".as_bytes()).unwrap();
        assert_eq!(recording.labels, ["b", "note"]);
        assert!((recording.rate_hz - 100.0).abs() < 1e-9);
        assert_eq!(recording.position_m(0, 0), [1.0, 2.0, 3.0]);
        assert!(recording.position_m(0, 1)[0].is_nan() && recording.position_m(1, 0)[0].is_nan());
        assert_eq!(recording.position_m(1, 1), [4.0, 5.0, 6.0]);
    }

    fn check_refused(text: &str, part: &str) {
        let message = parse(text.as_bytes()).unwrap_err();
        assert!(message.contains(part), "{message}");
    }

    #[test]
    fn wrong_tables_are_refused() {
        check_refused("a.x,a.y,a.z\n", "no column `t`");
        check_refused("t,q\n", "names no point");
        check_refused("t,a.x,a.y\n0,1,1\n", "no `a.z`");
        check_refused("t,a.x,a.y,a.z\n0,1,1,1\n", "1 rows");
        check_refused("t,a.x,a.y,a.z\n0,1,1,1\n1,x,1,1\n", "line 3, column a.x: `x`");
        check_refused("t,a.x,a.y,a.z\n0,1,1,1\n1,1,1,1\n3,1,1,1\n", "line 3: 1 s after");
        check_refused("t,a.x,a.y,a.z\n0,1,1,1\n0,1,1,1\n", "must be finite and grow");
        check_refused("t,a.x,a.y,a.z\n0,1,1,1\n1,1,1\n", "");
    }
}
