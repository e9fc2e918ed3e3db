//! Input made to exhaust the machine, or broken as if it were: refused with one line, before the work begins.

use crate::synthetic;

use assert_cmd::Command;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Identifies with these files; `None` leaves the good one. Gives exit status and standard error.
fn identify(urdf: Option<&[u8]>, log: Option<&[u8]>) -> (Option<i32>, String) {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("robot.urdf"), urdf.unwrap_or(synthetic::URDF.as_bytes())).unwrap();
    let good = synthetic::csv(&synthetic::recording(1, 15.0));
    fs::write(path("train.csv"), log.unwrap_or(good.as_bytes())).unwrap();
    run(&folder)
}

fn run(folder: &TempDir) -> (Option<i32>, String) {
    let path = |name: &str| folder.path().join(name);
    let mut phiw = Command::cargo_bin("phiw").unwrap();
    phiw.arg("identify").arg("--urdf").arg(path("robot.urdf")).arg("--train").arg(path("train.csv"));
    let output = phiw.arg("--out").arg(path("out")).output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

fn refused((status, message): (Option<i32>, String), expected: &str) {
    assert_eq!(status, Some(2), "{message}");
    assert!(message.contains(expected) && message.lines().count() == 1, "no `{expected}` in: {message}");
}

/// The good URDF with something more inside the robot.
fn urdf_with(more: &str) -> Vec<u8> {
    synthetic::URDF.replace("</robot>", &format!("{more}</robot>")).into_bytes()
}

#[test]
fn a_urdf_nested_deeper_than_the_stack_is_refused() {
    let nested = "<a>".repeat(12_000) + &"</a>".repeat(12_000);
    refused(identify(Some(&urdf_with(&nested)), None), "elements stand inside each other more than 64 deep");
}

#[test]
fn an_element_with_200_000_attributes_is_refused() {
    let attributes: String = (0..200_000).map(|index| format!(" a{index}=\"\"")).collect();
    refused(identify(Some(&urdf_with(&format!("<a{attributes}/>"))), None), "more than 64 attributes");
}

#[test]
fn entities_that_expand_to_gigabytes_are_refused() {
    let head = format!("<!DOCTYPE robot [<!ENTITY e \"{}\">]>", "x".repeat(100_000));
    let text = head + &String::from_utf8(urdf_with(&format!("<a>{}</a>", "&e;".repeat(20_000)))).unwrap();
    refused(identify(Some(text.as_bytes()), None), "its entities expand to more than");
}

#[test]
fn a_urdf_of_many_links_or_joints_is_refused() {
    let links: String = (0..300_000).map(|index| format!("<link name=\"l{index}\"/>")).collect();
    refused(identify(Some(&urdf_with(&links)), None), "more than 200000 elements");
    // Each link's line was sought from the beginning of the file.
    let links: String = (0..150_000).map(|index| format!("<link name=\"l{index}\"/>\n")).collect();
    refused(identify(Some(&urdf_with(&links)), None), "several links have no parent");
    let joints: String = (0..500)
        .map(|index| {
            let parent = if index == 0 { "tool".to_owned() } else { format!("l{}", index - 1) };
            format!(
                "<link name=\"l{index}\"/><joint name=\"j{index}\" type=\"continuous\"><parent link=\"{parent}\"/><child link=\"l{index}\"/></joint>"
            )
        })
        .collect();
    refused(identify(Some(&urdf_with(&joints)), None), "503 joints move");
}

#[test]
fn what_a_fit_does_not_need_does_not_stop_it() {
    let odd = "<link name=\"tool\"><visual><geometry/><origin xyz=\"a b\"/></visual><collision/></link>";
    let urdf = synthetic::URDF.replace("<link name=\"tool\"/>", odd);
    assert_ne!(urdf, synthetic::URDF);
    let (status, message) = identify(Some(urdf.as_bytes()), None);
    assert_eq!(status, Some(0), "{message}");
}

#[test]
fn files_that_are_no_text_are_called_what_they_are() {
    refused(identify(None, Some(b"\xff\xfet\0,\0q\0")), "train.csv: this is no log but UTF-16");
    refused(identify(None, Some(b"\x1f\x8b\x08\0\0\0")), "train.csv: the gzip is damaged or cut short");
    refused(identify(None, Some(b"t,q\0\0\0\0")), "train.csv");
    refused(identify(Some(b"\xff\xfe<\0r\0"), None), "robot.urdf: this is not text but UTF-16");
    refused(identify(Some(b"\x7fELF\xff\xff"), None), "a program");
}

#[test]
fn a_line_longer_than_any_log_has_is_refused() {
    let header = vec![b'a'; 1 << 20];
    refused(identify(None, Some(&header)), "train.csv: can't be read: line 1 has more than");
    let mut log = synthetic::csv(&synthetic::recording(1, 15.0)).into_bytes();
    log.extend(vec![b'1'; 1 << 20]);
    refused(identify(None, Some(&log)), "line 3002 has more than");
    let columns: String = (0..20_000).map(|index| format!("c{index},")).collect();
    refused(identify(None, Some(columns.as_bytes())), "20001 columns");
}

#[test]
fn numbers_in_quotes_are_numbers() {
    let log = synthetic::csv(&synthetic::recording(1, 15.0));
    let quoted = |(index, line): (usize, &str)| match index {
        0 => format!("{line}\n"),
        _ => line.split(',').map(|cell| format!("\"{cell}\"")).collect::<Vec<_>>().join(",") + "\n",
    };
    let (status, message) =
        identify(None, Some(log.lines().enumerate().map(quoted).collect::<String>().as_bytes()));
    assert_eq!(status, Some(0), "{message}");
}

/// Opening it waited for a writer, for ever.
#[cfg(unix)]
#[test]
fn a_pipe_in_the_place_of_a_file_is_refused() {
    let make = |path: &Path| std::process::Command::new("mkfifo").arg(path).status().unwrap();
    for (piped, file) in [("train.csv", "robot.urdf"), ("robot.urdf", "train.csv")] {
        let folder = TempDir::new().unwrap();
        fs::write(folder.path().join(file), synthetic::URDF).unwrap();
        assert!(make(&folder.path().join(piped)).success());
        refused(run(&folder), "no regular file");
    }
}

/// Starting a thread for each core panicked.
#[cfg(target_os = "linux")]
#[test]
fn a_small_address_space_is_no_panic() {
    for (kilobytes, threads) in
        [(1_000_000, ""), (200_000, "1"), (200_000, ""), (80_000, "1"), (80_000, "64")]
    {
        let folder = TempDir::new().unwrap();
        fs::write(folder.path().join("robot.urdf"), synthetic::URDF).unwrap();
        fs::write(folder.path().join("train.csv"), synthetic::csv(&synthetic::recording(1, 15.0))).unwrap();
        let words = "identify --urdf robot.urdf --train train.csv --out out --quiet";
        let script = format!("ulimit -v {kilobytes}; exec {} {words}", env!("CARGO_BIN_EXE_phiw"));
        let mut shell = std::process::Command::new("sh");
        let output =
            shell.args(["-c", &script]).env("RAYON_NUM_THREADS", threads).current_dir(folder.path()).output();
        let output = output.unwrap();
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(message.lines().count() <= 1 && !message.contains("panicked"), "{kilobytes} kB: {message}");
        assert_eq!(output.status.code(), Some(0), "{kilobytes} kB: {message}");
    }
}

/// The standard library's two lines and a signal were all that was said where an allocation failed.
#[cfg(target_os = "linux")]
#[test]
fn memory_that_is_used_up_is_one_message() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("robot.urdf"), synthetic::URDF).unwrap();
    fs::write(folder.path().join("train.csv"), synthetic::csv(&synthetic::recording(1, 15.0))).unwrap();
    let words = "explain --urdf robot.urdf --train train.csv --out out";
    let mut used_up = 0;
    for kilobytes in (30_000..60_000).step_by(3_000) {
        let script = format!("ulimit -v {kilobytes}; exec {} {words}", env!("CARGO_BIN_EXE_phiw"));
        let mut shell = std::process::Command::new("sh");
        shell.args(["-c", &script]).env("RAYON_NUM_THREADS", "1").env("RUST_BACKTRACE", "1");
        let output = shell.current_dir(folder.path()).output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        // Below some size no program is loaded at all.
        if output.status.code() == Some(0) || message.contains("shared libraries") {
            continue;
        }
        used_up += 1;
        assert_eq!(output.status.code(), Some(1), "{kilobytes} kB: {message}");
        assert!(message.lines().count() == 1 && message.contains("not enough memory"), "{message}");
    }
    assert!(used_up > 0, "every size was enough");
}
