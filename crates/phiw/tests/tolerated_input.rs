//! Input that is odd but can be worked with: exit status 0, and everyone is told, on standard error, in the
//! page and in `report.json`.

use crate::synthetic;

use assert_cmd::Command;
use phiw_report::ReportJson;

/// Identifies from the logs given and looks for `warnings` in all three places; gives back the number of rows
/// used.
fn check(train: &str, validate: &str, warnings: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("robot.urdf"), synthetic::URDF).unwrap();
    std::fs::write(path("train.csv"), train).unwrap();
    std::fs::write(path("validate.csv"), validate).unwrap();
    let output = Command::cargo_bin("phiw")
        .unwrap()
        .arg("identify")
        .args([path("--urdf").file_name().unwrap(), path("robot.urdf").as_os_str()])
        .args([
            "--declare".as_ref(),
            "rigid_body,viscous_friction".as_ref(),
            "--train".as_ref(),
            path("train.csv").as_os_str(),
        ])
        .args([
            "--validate".as_ref(),
            path("validate.csv").as_os_str(),
            "--out".as_ref(),
            path("out").as_os_str(),
        ])
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    let report = ReportJson::from_json(&std::fs::read_to_string(path("out/report.json")).unwrap()).unwrap();
    let page = std::fs::read_to_string(path("out/report.html")).unwrap();
    assert_eq!(report.warnings, report.phiw.unwrap().warnings);
    let told = report.warnings;
    assert_eq!(told.len(), warnings.len(), "{told:?}");
    for warning in warnings {
        assert!(stderr.contains(warning), "no `{warning}` in {stderr}");
        assert!(told.iter().any(|line| line.contains(warning)), "no `{warning}` in {told:?}");
        assert!(page.contains(warning), "no `{warning}` in the page");
    }
    let error = report.after.validate.relative.unwrap();
    assert!(error < 0.06, "the rest of the log was as good as ever, but the error is {error}");
}

#[test]
fn a_log_without_oddities_gets_no_warning() {
    check(&log(1), &log(2), &[]);
}

#[test]
fn rows_that_cannot_be_used_are_skipped_counted_and_reported() {
    let train = with_cell(&with_cell(&with_cell(&log(1), 702, "nan"), 703, "inf"), 1504, "1e279");
    let truncated = &train[..train.len() - 12];
    check(
        truncated,
        &with_cell(&log(2), 901, ""),
        &[
            "train.csv: 2 rows skipped (NaN or infinity), first at line 702",
            "train.csv: 1 row skipped (value beyond 1e100), first at line 1504",
            "train.csv: 1 row skipped (truncated last row), first at line 3001",
            "validate.csv: 1 row skipped (empty cell), first at line 901",
        ],
    );
}

#[test]
fn jumps_in_time_split_the_log() {
    let lines: Vec<String> = log(1).lines().map(str::to_owned).collect();
    let train: String = lines
        .iter()
        .enumerate()
        .filter(|(row, _)| !(1000..1050).contains(row))
        .map(|(_, line)| format!("{line}\n"))
        .collect();
    check(&train, &log(2), &["train.csv: time jumps at line 1001; the log is split there"]);
}

#[test]
fn training_on_the_validation_log_is_told() {
    check(&log(1), &log(1), &["train.csv and"]);
}

#[test]
fn unknown_columns_are_told() {
    let extra = |(row, line): (usize, &str)| {
        format!("{line},{}\n", if row == 0 { "battery voltage" } else { "24.1" })
    };
    let train: String = log(1).lines().enumerate().map(extra).collect();
    check(&train, &log(2), &["train.csv: unknown column is ignored: `battery voltage`"]);
}

fn log(seed: u64) -> String {
    synthetic::csv(&synthetic::recording(seed, 15.0))
}

/// The log with the position of the second joint on one line (counted from 1) replaced.
fn with_cell(log: &str, line: usize, text: &str) -> String {
    let change = |(index, row): (usize, &str)| {
        let mut cells: Vec<&str> = row.split(',').collect();
        if index + 1 == line {
            cells[2] = text;
        }
        cells.join(",") + "\n"
    };
    log.lines().enumerate().map(change).collect()
}
