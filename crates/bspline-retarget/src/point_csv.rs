//! CSV of named points: `t` \[s\] and for each point `<name>.x`, `<name>.y`, `<name>.z`, in metres if nothing
//! else is said.

use crate::recording::{MarkerRecording, RATES_HZ, RecordingError, metres};
use std::path::Path;

/// Largest deviation of a time step from their mean, as a share of it.
const STEP_TOLERANCE: f64 = 0.02;

/// Reads a table of points at a constant rate, in `units` or else in metres; an empty or NaN cell is a
/// missing point.
///
/// # Errors
/// The file cannot be read, a column or a cell is wrong, the times are not equally spaced or no camera's, or
/// the unit is not known.
pub fn read_point_csv(path: &Path, units: Option<&str>) -> Result<MarkerRecording, RecordingError> {
    let file = std::fs::File::open(path)
        .map_err(|source| RecordingError::Unreadable { path: path.into(), source })?;
    parse(file, units).map_err(|what| RecordingError::Csv { path: path.into(), what })
}

fn parse(source: impl std::io::Read, units: Option<&str>) -> Result<MarkerRecording, String> {
    let unit = units.unwrap_or("m");
    let unit_m = metres(unit).ok_or_else(|| format!("unit `{unit}`: known are m, dm, cm, mm, in and ft"))?;
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
            positions_m.push(if seen { point.map(|x| x * unit_m) } else { [f64::NAN; 3] });
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
    // A NaN in the times fails this comparison, too.
    let uneven = (1..times.len()).find(|&row| !even(row));
    match uneven {
        // The header is line 1.
        Some(row) => Err(format!(
            "line {}: {} s after the row before, the mean is {step} s; resample to a constant rate",
            row + 2,
            times[row] - times[row - 1]
        )),
        None if RATES_HZ.contains(&(1.0 / step)) => Ok(1.0 / step),
        None => Err(format!(
            "`t` goes in steps of {step} s, a rate of {} Hz, no camera's (1 Hz to 100 kHz); give `t` in seconds",
            1.0 / step
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_read_by_name_and_gaps_stay_gaps() {
        let recording =
            parse("t,b.z,b.y,b.x,note.x ,note.y,note.z\n0,3,2,1,,,\n0.01,3,,1,4,5,6\n".as_bytes(), None)
                .unwrap();
        assert_eq!(recording.labels, ["b", "note"]);
        assert!((recording.rate_hz - 100.0).abs() < 1e-9);
        assert_eq!(recording.position_m(0, 0), [1.0, 2.0, 3.0]);
        assert!(recording.position_m(0, 1)[0].is_nan() && recording.position_m(1, 0)[0].is_nan());
        assert_eq!(recording.position_m(1, 1), [4.0, 5.0, 6.0]);
    }

    fn check_refused(text: &str, part: &str) {
        let message = parse(text.as_bytes(), None).unwrap_err();
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

    /// A table in millimetres was refused with the advice to say so in the map, which changed nothing.
    #[test]
    fn units_of_the_map_were_not_those_of_a_table() {
        let read = |units| parse("t,a.x,a.y,a.z\n0,1000,2000,-500\n0.01,,,\n".as_bytes(), units);
        assert_eq!(read(None).unwrap().position_m(0, 0), [1000.0, 2000.0, -500.0]);
        assert_eq!(read(Some("mm")).unwrap().position_m(0, 0), [1.0, 2.0, -0.5]);
        assert!(read(Some("mm")).unwrap().position_m(1, 0)[0].is_nan());
        let error = read(Some("furlong")).unwrap_err();
        assert!(error.contains("`furlong`") && error.contains("mm"), "{error}");
    }

    /// Times in milliseconds made a motion a thousand times as long, and as many times the control points.
    #[test]
    fn tables_had_any_rate() {
        check_refused("t,a.x,a.y,a.z\n0,1,1,1\n10,1,1,1\n20,1,1,1\n", "0.1 Hz, no camera's");
        check_refused("t,a.x,a.y,a.z\n0,1,1,1\n1e-9,1,1,1\n", "give `t` in seconds");
        check_refused("t,a.x,a.y,a.z\n0,1,1,1\n1e300,1,1,1\n", "no camera's");
    }
}
