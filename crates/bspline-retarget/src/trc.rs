//! TRC, the table of marker positions of OpenSim (and of Motion Analysis, who made it): tabs, five lines of
//! header, one line for each frame. OpenSim's y is up.

use crate::joint_motion::z_up;
use crate::recording::{MarkerRecording, RATES_HZ, metres};

/// Lines before the first frame.
const HEADER: usize = 5;

/// The markers' positions; lengths in `units`, or else in what the file says. An empty or NaN cell is a
/// missing marker.
///
/// # Errors
/// What is wrong, where, and the mend.
pub(crate) fn parse(text: &str, units: Option<&str>) -> Result<MarkerRecording, String> {
    let lines: Vec<&str> = text.lines().collect();
    let [_, names, values, markers, _axes, frames @ ..] = lines.as_slice() else {
        return Err(format!("{} lines; the header alone has {HEADER}: the file is cut short", lines.len()));
    };
    let entry = |name: &str| {
        let place = names.split('\t').position(|other| other.trim() == name);
        place
            .and_then(|place| values.split('\t').nth(place))
            .map(str::trim)
            .ok_or_else(|| format!("lines 2 and 3 have no `{name}`"))
    };
    let rate = entry("DataRate")?;
    let rate_hz = rate.parse().ok().filter(|rate| RATES_HZ.contains(rate));
    let rate_hz: f64 =
        rate_hz.ok_or_else(|| format!("line 3: DataRate is `{rate}`, no camera's (1 Hz to 100 kHz)"))?;
    let unit = units.map_or_else(|| entry("Units"), Ok)?;
    let unit_m =
        metres(unit).ok_or_else(|| format!("line 3: unit `{unit}`: known are m, dm, cm, mm, in and ft"))?;
    let labels: Vec<String> = markers
        .split('\t')
        .skip(2)
        .map(str::trim)
        .filter(|name| !name.is_empty())
        .map(str::to_owned)
        .collect();
    if labels.is_empty() {
        return Err("line 4 names no marker; they stand behind Frame# and Time".to_owned());
    }
    if let Some(twice) = (1..labels.len()).find(|&place| labels[..place].contains(&labels[place])) {
        return Err(format!("line 4: a second marker `{}`; give each its own name", labels[twice]));
    }
    let mut positions_m = Vec::new();
    let numbered = frames.iter().enumerate().map(|(index, line)| (index + HEADER + 1, line));
    for (line, frame) in numbered.filter(|(_, line)| !line.trim().is_empty()) {
        // Cells that are empty at the end may be left out, but frame and time may not.
        let cells: Vec<&str> = frame.split('\t').map(str::trim).collect();
        if cells.len() < 2
            || cells.len() > 2 + 3 * labels.len()
                && cells[2 + 3 * labels.len()..].iter().any(|cell| !cell.is_empty())
        {
            return Err(format!(
                "line {line}: {} cells for {} markers; three for each are expected",
                cells.len(),
                labels.len()
            ));
        }
        let number = |place: usize| match cells.get(place).copied().unwrap_or("") {
            "" => Ok(f64::NAN),
            cell => cell.parse::<f64>().map_err(|_| format!("line {line}: `{cell}` is not a number")),
        };
        number(1)?;
        for marker in 0..labels.len() {
            let first = 2 + 3 * marker;
            let point = [number(first)?, number(first + 1)?, number(first + 2)?];
            let seen = point.iter().all(|coordinate| coordinate.is_finite());
            positions_m.push(if seen { z_up(point.map(|x| x * unit_m)) } else { [f64::NAN; 3] });
        }
    }
    let frames = positions_m.len() / labels.len();
    let told = entry("NumFrames")?;
    if told.parse() != Ok(frames) {
        return Err(format!("line 3 says {told} frames, but {frames} follow; the file is cut short"));
    }
    if frames < 2 {
        return Err(format!("{frames} frames; a motion needs at least 2"));
    }
    Ok(MarkerRecording { rate_hz, labels, positions_m })
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "PathFileType\t4\t(X/Y/Z)\twalk.trc
DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames
60.00\t60.00\t2\t2\tmm\t60.00\t1\t2
Frame#\tTime\tLSHO\t\t\tRSHO\t\t
\t\tX1\tY1\tZ1\tX2\tY2\tZ2

1\t0.000\t100\t1400\t-200\t100\t1400\t200
2\t0.017\t110\t1410\t-210\t\t\t
";

    #[test]
    fn markers_are_read_with_y_up_and_gaps_stay_gaps() {
        let recording = parse(FILE, None).unwrap();
        assert_eq!(recording.labels, ["LSHO", "RSHO"]);
        assert_eq!((recording.rate_hz, recording.frames()), (60.0, 2));
        let left = recording.position_m(0, 0);
        assert!(left.iter().zip([-0.2, 0.1, 1.4]).all(|(a, b)| (a - b).abs() < 1e-12), "{left:?}");
        assert!(recording.position_m(1, 1)[0].is_nan());
        assert_eq!(parse(FILE, Some("cm")).unwrap().position_m(0, 0)[2], 14.0);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        let check = |from: &str, to: &str, said: &str| {
            let error = parse(&FILE.replacen(from, to, 1), None).unwrap_err();
            assert!(error.contains(said) && !error.contains('\n'), "{error}");
        };
        check("60.00", "0", "line 3: DataRate is `0`");
        check("\tmm\t", "\tell\t", "line 3: unit `ell`");
        check("Units", "Unit", "no `Units`");
        check("RSHO", "LSHO", "line 4: a second marker `LSHO`");
        check("1410", "14.1.0", "line 8: `14.1.0` is not a number");
        check("60.00\t2\t", "60.00\t3\t", "line 3 says 3 frames, but 2 follow");
        check("100\t1400\t200", "100\t1400\t200\t7", "line 7: 9 cells for 2 markers");
    }

    #[test]
    fn a_file_without_its_last_lines_is_refused() {
        let lines: Vec<&str> = FILE.lines().collect();
        for count in 0..lines.len() {
            assert!(parse(&lines[..count].join("\n"), None).is_err(), "{count} lines are read");
        }
    }
}
