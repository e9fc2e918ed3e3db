//! What is wrong with a log is named with its place and its mend.

use phiw_telemetry::segments::GapReason;
use phiw_telemetry::{Conditioning, ConditioningOptions, LogError, Recording, TorqueColumns, stream, survey};
use std::ops::ControlFlow;
use std::path::Path;

fn joints() -> Vec<String> {
    vec!["a".into(), "b".into()]
}

/// Surveys and streams a log at 100 Hz with a cut-off of 20 Hz.
fn run(path: &Path) -> Result<(phiw_telemetry::Survey, phiw_telemetry::StreamSummary), LogError> {
    let survey = survey(path, &joints(), TorqueColumns::Required, &mut |_, _| {})?;
    let options = ConditioningOptions { cutoff_hz: Some(20.0), ..Default::default() };
    let conditioning = Conditioning::choose(std::slice::from_ref(&survey), &options)?;
    let summary = stream(&survey, &conditioning, &mut |_, _| {}, &mut |_| ControlFlow::Continue(()))?;
    Ok((survey, summary))
}

fn written(text: &str) -> tempfile::NamedTempFile {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), text).unwrap();
    file
}

const HEADER: &str = "t,q.a,q.b,tau.a,tau.b\n";

/// `count` good rows at 100 Hz, the first at row `from`.
fn rows(from: usize, count: usize) -> String {
    let row = |k: usize| {
        let t = k as f64 / 100.0;
        format!("{t},{},{},{},{}\n", (3.0 * t).sin(), t.cos(), 10.0 * t.cos(), -t)
    };
    (from..from + count).map(row).collect()
}

/// The error's message holds each of the expected parts.
fn check(text: &str, expected: &[&str]) {
    let file = written(text);
    let message = run(file.path()).expect_err(expected[0]).to_string();
    for part in expected {
        assert!(message.contains(part), "`{part}` is not in `{message}`");
    }
    assert!(message.contains(file.path().to_str().unwrap()), "no path in `{message}`");
    assert!(!message.contains('\n'), "{message}");
}

#[test]
fn a_file_that_is_not_there() {
    let folder = tempfile::tempdir().unwrap();
    let message = run(&folder.path().join("none.csv")).unwrap_err().to_string();
    assert!(message.contains("none.csv: no such file"), "{message}");
    let message = run(folder.path()).unwrap_err().to_string();
    assert!(message.contains("this is a folder"), "{message}");
}

#[test]
fn empty_logs() {
    check("", &["the log is empty"]);
    check(HEADER, &["the log is empty"]);
    check(
        &format!("{HEADER},,,,\nnan,1,1,1,1\n"),
        &["no usable row of 2", "1 × empty cell (first in line 2)", "1 × NaN"],
    );
}

#[test]
fn wrong_headers() {
    check("q.a,q.b\n1,2\n", &["line 1", "no column `t`", "add one"]);
    check("time,q.a\n1,2\n", &["no column `t`", "rename `time`"]);
    check("t;q.a;q.b\n1;2;3\n", &["no column `tau.a`", "(nor `tau.b`)"]);
    check("0.0,1.5,2\n0.1,1,2\n", &["first line must be a header"]);
    check("t,q.a,q.B,tau.a,tau.b\n", &["no column `q.b`", "nearest: `q.B`", "hold the joint"]);
    check("t,q.a,q.b,tau.b\n", &["no column `tau.a`", "`tau.b`"]);
    check("t,x,y\n", &["no column `q.a` (nor 3 others)", "add it"]);
    check("t,q.a,q.b,tau.a,tau.b,q.a\n", &["two columns are named `q.a`"]);
}

#[test]
fn wrong_rows() {
    let good = rows(0, 50);
    check(
        &format!("{HEADER}{good}0.5,1,abc,1,1\n{}", rows(51, 9)),
        &["line 52", "column `q.b`", "`abc` is not a number"],
    );
    check(&format!("{HEADER}{good}zero,1,1,1,1\n"), &["line 52", "column `t`", "`zero`"]);
    check(&format!("{HEADER}{good}0.5,1,1\n{}", rows(51, 9)), &["line 52", "3 cells", "header has 5"]);
    check(&format!("{HEADER}{good}0.5,1,1,1,1,1\n{}", rows(51, 9)), &["line 52", "6 cells"]);
    check(
        &format!("{HEADER}{good}0.2,1,1,1,1\n{}", rows(51, 9)),
        &["line 52", "time runs backwards", "0.49 s to 0.2 s"],
    );
    // A row that is a gap still counts for the order of time.
    check(&format!("{HEADER}{good}0.2,,1,1,1\n{}", rows(51, 9)), &["line 52", "time runs backwards"]);
    check(&format!("{HEADER}{}", rows(0, 9)), &["long enough", "has 9 samples", "20.000 Hz"]);
}

#[test]
fn cutoffs_that_do_not_fit() {
    let file = written(&format!("{HEADER}{}", rows(0, 200)));
    let survey = survey(file.path(), &joints(), TorqueColumns::Required, &mut |_, _| {}).unwrap();
    check_cutoffs(&survey, &[0.0, -1.0, 36.0, f64::NAN]);
}

/// The length of the low-pass overflowed.
#[test]
fn a_cutoff_of_next_to_nothing_asked_for_a_filter_of_no_length() {
    let file = written(&format!("{HEADER}{}", rows(0, 200)));
    let survey = survey(file.path(), &joints(), TorqueColumns::Required, &mut |_, _| {}).unwrap();
    check_cutoffs(&survey, &[1e-320, 1e-12, 9e-4]);
}

/// All of these are refused, with the range that fits.
fn check_cutoffs(survey: &phiw_telemetry::Survey, cutoffs: &[f64]) {
    for &cutoff in cutoffs {
        let options = ConditioningOptions { cutoff_hz: Some(cutoff), ..Default::default() };
        let message = Conditioning::choose(std::slice::from_ref(survey), &options).unwrap_err().to_string();
        assert!(
            message.contains("sample rate of 100.0 Hz") && message.contains("above 0.001 and up to 35.0 Hz"),
            "{message}"
        );
    }
}

#[test]
fn recordings_of_unequal_arrays() {
    let recording = Recording { joints: joints(), t: vec![0.0; 3], q: vec![0.0; 5], ..Default::default() };
    let message = recording.survey().unwrap_err().to_string();
    assert!(message.contains("`q` has 5 values, but 3 rows of 2 joints need 6"), "{message}");
}

/// A log with something in its middle is read with these gaps: reason, count, first line.
fn check_gaps(text: &str, segments: usize, expected: &[(GapReason, u64, u64)]) {
    let file = written(text);
    let (survey, summary) = run(file.path()).unwrap();
    let gaps: Vec<_> = survey.gaps.iter().map(|gap| (gap.reason, gap.count, gap.first_line)).collect();
    assert_eq!(gaps, expected, "{text}");
    assert_eq!((survey.segments.len(), summary.segments), (segments, segments), "{text}");
    let skipped: u64 = expected.iter().filter(|gap| gap.0 != GapReason::TimeJump).map(|gap| gap.1).sum();
    assert_eq!(survey.rows, survey.used_rows + skipped);
}

#[test]
fn gaps_are_counted_and_split() {
    use GapReason::*;
    let (before, after) = (rows(0, 60), rows(62, 60));
    let check_middle = |middle: &str, expected: &[(GapReason, u64, u64)]| {
        check_gaps(&format!("{HEADER}{before}{middle}{after}"), 2, expected);
    };
    check_middle("0.6,1,,1,1\n", &[(EmptyCell, 1, 62)]);
    check_middle(",1,1,1,1\n", &[(EmptyCell, 1, 62)]);
    check_middle("0.6,1,NaN,1,1\n0.61,inf,1,1,1\n", &[(NotFinite, 2, 62)]);
    check_middle("0.6,1,1e279,1,1\n0.61, ,1,1,1\n", &[(Huge, 1, 62), (EmptyCell, 1, 63)]);
    check_middle("0.59,1,1,1,1\n", &[(DuplicateStamp, 1, 62)]);
    check_middle("", &[(TimeJump, 1, 62)]);
    // Blank lines and blanks are nothing.
    let blanks = rows(60, 1).replace(',', " , ");
    check_gaps(&format!("{HEADER}{before}\n {blanks}{}", rows(61, 50)), 1, &[]);
    // A reading far off, on a motion that goes on.
    check_gaps(&format!("{HEADER}{before}0.6,1,9,1,1\n{}", rows(61, 50)), 2, &[(Spike, 1, 62)]);
    // A last row that is cut, or may be.
    check_gaps(&format!("{HEADER}{before}0.6,1,1\n"), 1, &[(TruncatedLastRow, 1, 62)]);
    check_gaps(&format!("{HEADER}{before}0.6,1,1"), 1, &[(TruncatedLastRow, 1, 62)]);
    check_gaps(&format!("{HEADER}{before}0.6,1,1,1,1"), 1, &[(TruncatedLastRow, 1, 62)]);
    // Windows' line ends, a byte order mark, quoted names.
    let windows = format!("\u{feff}\"t\",\"q.a\",q.b,tau.a,tau.b\r\n{}", before.replace('\n', "\r\n"));
    check_gaps(&windows, 1, &[]);
}

#[test]
fn short_segments_are_counted() {
    let text = format!("{HEADER}{}{}{}{}", rows(0, 60), rows(70, 10), rows(90, 3), rows(100, 60));
    let (survey, summary) = run(written(&text).path()).unwrap();
    assert_eq!((survey.segments.len(), survey.short_segments), (3, 1));
    assert_eq!((summary.segments, summary.short_segments, summary.rows_in_short_segments), (2, 2, 13));
}

#[test]
fn unknown_columns_are_listed() {
    let text =
        format!("note,{HEADER}{}", rows(0, 60).lines().map(|row| format!("x,{row}\n")).collect::<String>());
    let (survey, _) = run(written(&text).path()).unwrap();
    assert_eq!(survey.ignored_columns, ["note"]);
}

#[test]
fn equal_files_have_equal_hashes() {
    let survey = |text: &str| run(written(text).path()).unwrap().0.content_hash;
    let text = format!("{HEADER}{}", rows(0, 60));
    assert_eq!(survey(&text), survey(&text));
    assert_ne!(survey(&text), survey(&format!("{HEADER}{}", rows(0, 61))));
}

/// It was said to be in milliseconds.
#[test]
fn a_time_that_stands_still_is_called_so() {
    let text =
        rows(0, 60).lines().map(|row| format!("5,{}\n", row.split_once(',').unwrap().1)).collect::<String>();
    let message = run(written(&format!("{HEADER}{text}")).path()).unwrap_err().to_string();
    assert!(message.contains("column `t`: it is 5 in all 60 rows"), "{message}");
}

/// Half of the rows were of one file, half of another, and nobody knew.
#[test]
fn a_log_that_changes_between_the_passes_is_refused() {
    for now in [rows(0, 100), rows(0, 120).replace("0.5,", "0.500001,")] {
        let file = written(&format!("{HEADER}{}", rows(0, 120)));
        let survey = survey(file.path(), &joints(), TorqueColumns::Required, &mut |_, _| {}).unwrap();
        let options = ConditioningOptions::default();
        let conditioning = Conditioning::choose(std::slice::from_ref(&survey), &options).unwrap();
        let again = || stream(&survey, &conditioning, &mut |_, _| {}, &mut |_| ControlFlow::Continue(()));
        again().unwrap();
        std::fs::write(file.path(), format!("{HEADER}{now}")).unwrap();
        let message = again().unwrap_err().to_string();
        assert!(message.contains("the file changed while it was read"), "{message}");
    }
}
