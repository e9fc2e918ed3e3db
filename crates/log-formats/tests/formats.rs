//! The same log in all formats is the same rows, to the last bit.

use crate::read;

use phiw_log_formats::{OpenOptions, Step, is_missing, open};
use read::{CHECKED, UNCHECKED, file, rows};

#[test]
fn all_formats_give_the_rows_of_the_csv() {
    let expected = rows(&file("csv.csv")).unwrap();
    assert_eq!(expected.len(), 60);
    for name in CHECKED.into_iter().chain(UNCHECKED).chain(["ros2_sqlite"]) {
        assert!(rows(&file(name)).unwrap() == expected, "{name}");
    }
}

#[test]
fn datasets_give_their_episodes_one_after_the_other() {
    let expected = rows(&file("episodes.csv")).unwrap();
    for name in ["lerobot_v2", "lerobot_v3"] {
        assert!(rows(&file(name)).unwrap() == expected, "{name}");
    }
    // One file by itself is an episode without names.
    let episode = file("lerobot_v2/data/chunk-000/episode_000000.parquet");
    let table = open(&episode, &OpenOptions::default()).unwrap();
    assert!(table.columns().iter().any(|column| column.name == "observation.state[3]"));
}

/// A name says nothing.
#[test]
fn the_format_is_seen_in_the_content() {
    let folder = tempfile::tempdir().unwrap();
    let expected = rows(&file("csv.csv")).unwrap();
    for name in ["packed.npz", "packed.csv.gz", "zstd.mcap", "arrays.h5", "ros1_bz2.bag"] {
        let copy = folder.path().join("log.txt");
        std::fs::copy(file(name), &copy).unwrap();
        assert!(rows(&copy).unwrap() == expected, "{name}");
    }
}

#[test]
fn an_empty_cell_is_told_from_one_that_is_no_number() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.csv");
    std::fs::write(&log, "t\tq\n0\t\n1\tNaN\n").unwrap();
    let mut table = open(&log, &OpenOptions::default()).unwrap();
    let mut row = [0.0; 2];
    assert_eq!(table.next(&mut row).unwrap(), Step::Row { place: 2 });
    assert!(is_missing(row[1]));
    assert_eq!(table.next(&mut row).unwrap(), Step::Row { place: 3 });
    assert!(row[1].is_nan() && !is_missing(row[1]));
    assert_eq!(table.next(&mut row).unwrap(), Step::End);
}

#[test]
fn what_is_no_log_is_called_what_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let check = |content: &[u8], part: &str| {
        let path = folder.path().join("log");
        std::fs::write(&path, content).unwrap();
        let Err(error) = open(&path, &OpenOptions::default()) else { panic!("{part} is read") };
        let message = error.to_string();
        assert!(message.contains(part) && message.contains("log") && !message.contains('\n'), "{message}");
    };
    check(b"", "the log is empty");
    check(b"\x7fELF\x02", "a program");
    check(b"PK\x03\x04", "npz is damaged or cut short");
    check(b"SQLite format 3\0", "ends inside its header");
    check(b"\x89MCAP0\r\n", "MCAP is damaged or cut short");
    check(b"#ROSBAG V2.0\n", "ROS bag is damaged or cut short");
    check(b"#ROSBAG V1.2\n", "a ROS bag");
    check(b"PAR1", "Parquet file is damaged");
    check(b"\x89HDF\r\n\x1a\n", "HDF5");
    let Err(error) = open(folder.path(), &OpenOptions::default()) else { panic!("a folder is read") };
    assert!(error.to_string().contains("neither a ROS 2 bag"), "{error}");
}

#[test]
fn a_topic_that_is_not_there_is_named_with_those_that_are() {
    let options = OpenOptions { topic: Some("/joints".to_owned()) };
    let Err(error) = open(&file("zstd.mcap"), &options) else { panic!("it is read") };
    let message = error.to_string();
    assert!(
        message.contains("no topic `/joints`") && message.contains("/joint_states (sensor_msgs"),
        "{message}"
    );
}
