//! Files that are cut or damaged are refused, or read right; they never end the program.

use crate::read;

use read::{CHECKED, UNCHECKED, file, rows};
use std::path::{Path, PathBuf};

/// The files of the folder, one by one; those of datasets with the folder that is then read.
fn files() -> Vec<(String, PathBuf)> {
    let alone = CHECKED.into_iter().chain(UNCHECKED).map(|name| (name.to_owned(), PathBuf::new()));
    let parts = [
        ("lerobot_v2", "meta/info.json"),
        ("lerobot_v2", "data/chunk-000/episode_000001.parquet"),
        ("lerobot_v3", "data/chunk-000/file-000.parquet"),
    ];
    alone.chain(parts.map(|(folder, part)| (folder.to_owned(), PathBuf::from(part)))).collect()
}

fn copy(from: &Path, to: &Path) {
    if from.is_file() {
        std::fs::copy(from, to).unwrap();
        return;
    }
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        copy(&path, &to.join(path.file_name().unwrap()));
    }
}

/// Reads each file after `damage`s to its bytes; `judge` sees the file's name, whether the rows are right,
/// and what they are.
fn damaged(
    damages: impl Fn(usize) -> Vec<usize>,
    damage: impl Fn(&mut Vec<u8>, usize),
    judge: impl Fn(&str, usize, bool),
) {
    for (name, part) in files() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("log");
        copy(&file(&name), &log);
        let right = rows(&log).unwrap();
        let place = if part.as_os_str().is_empty() { log.clone() } else { log.join(&part) };
        let whole = std::fs::read(&place).unwrap();
        for at in damages(whole.len()) {
            let mut bytes = whole.clone();
            damage(&mut bytes, at);
            std::fs::write(&place, bytes).unwrap();
            match rows(&log) {
                Ok(rows) => judge(&name, at, rows == right),
                Err(error) => {
                    let message = error.to_string();
                    assert!(message.contains("log") && !message.contains('\n'), "{name} at {at}: {message}");
                }
            }
        }
    }
}

#[test]
fn a_file_that_is_cut_is_refused_or_right() {
    let places = |length: usize| (0..80).map(|k| k * length / 80).chain(length - 20..length).collect();
    damaged(
        places,
        |bytes, at| bytes.truncate(at),
        |name, at, right| {
            // A text that ends anywhere is a text; its last row is left out.
            assert!(right || name == "semicolons.csv", "{name} cut at {at} is read, and wrong");
        },
    );
}

#[test]
fn a_flipped_bit_is_found_where_there_is_a_check_sum() {
    let places = |length: usize| (0..150).map(|k| k * length / 150).collect();
    damaged(
        places,
        |bytes, at| bytes[at] ^= 1 << (at % 8),
        |name, at, right| {
            assert!(
                right || !CHECKED.contains(&name),
                "{name} with a flipped bit in byte {at} is read, and wrong"
            );
        },
    );
}

#[test]
fn bytes_of_rubbish_end_nothing() {
    let places = |length: usize| (0..80).map(|k| k * length / 80).collect();
    let rubbish = |bytes: &mut Vec<u8>, at: usize| {
        let end = (at + 8).min(bytes.len());
        bytes[at..end].fill(0xff);
    };
    damaged(places, rubbish, |name, at, right| {
        assert!(right || !CHECKED.contains(&name), "{name} with rubbish at byte {at} is read, and wrong");
    });
}
