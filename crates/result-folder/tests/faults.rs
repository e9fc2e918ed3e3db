//! Whatever operation fails, and wherever the program is killed: all old or all new, and the next run clears
//! up.

use phiw_result_folder::{
    Disk, FileSystem, Lock, ResultError, ResultFile, StreamedFile, check_inputs, replace_file, replace_files,
    replace_folder, replace_vouched,
};
use std::cell::Cell;
use std::fs;
use std::io;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Fails one operation, or that one and all after it, as if the program were killed there.
struct Faulty {
    left: Cell<usize>,
    killed: bool,
    no_exchange: bool,
}

impl FileSystem for Faulty {
    fn before(&self, operation: &'static str, _: &Path) -> io::Result<()> {
        if self.no_exchange && operation == "exchange" {
            return Err(io::ErrorKind::Unsupported.into());
        }
        match self.left.get() {
            0 if self.killed => Err(io::Error::other("killed")),
            0 => Ok(()),
            1 => {
                self.left.set(0);
                Err(io::ErrorKind::StorageFull.into())
            }
            left => {
                self.left.set(left - 1);
                Ok(())
            }
        }
    }
}

const NAMES: [&str; 3] = ["a.json", "b.json", "c.csv"];

fn files(content: &str) -> Vec<ResultFile> {
    NAMES.iter().map(|name| ResultFile::new(*name, content)).collect()
}

/// What a reader finds under each name.
fn seen(folder: &Path) -> Vec<Option<String>> {
    NAMES.iter().map(|name| fs::read_to_string(folder.join(name)).ok()).collect()
}

fn all(content: Option<&str>) -> Vec<Option<String>> {
    vec![content.map(str::to_owned); NAMES.len()]
}

/// Entries of a folder, hidden ones too.
fn entries(folder: &Path) -> Vec<String> {
    let entries = folder.read_dir().unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

type Write = dyn Fn(&dyn FileSystem, &Path, &[ResultFile]) -> Result<(), ResultError>;

fn into_folder(system: &dyn FileSystem, folder: &Path, files: &[ResultFile]) -> Result<(), ResultError> {
    replace_folder(system, &Lock::acquire(folder, "test")?, files)
}

/// Lets every operation fail in turn, as a failure and as a kill.
fn check(prepare: &dyn Fn(&Path), old: Option<&str>, no_exchange: bool, write: &Write) {
    for killed in [false, true] {
        let mut commits = 0;
        for operation in 1.. {
            let place = TempDir::new().unwrap();
            let folder = place.path().join("out");
            prepare(&folder);
            assert_eq!(seen(&folder), all(old));
            let system = Faulty { left: Cell::new(operation), killed, no_exchange };
            let outcome = write(&system, &folder, &files("new"));
            let now = seen(&folder);
            assert!(now == all(old) || now == all(Some("new")), "operation {operation}: {now:?}");
            assert!(outcome.is_err() || now == all(Some("new")), "operation {operation}: called done");
            commits += usize::from(now == all(Some("new")));
            if system.left.get() > 0 {
                assert!(operation > 5 && commits > 0, "the faults were never reached");
                break;
            }
            write(&Disk, &folder, &files("newer")).unwrap();
            assert_eq!(seen(&folder), all(Some("newer")));
            let left: Vec<String> =
                entries(place.path()).into_iter().filter(|name| name.contains("phiw-")).collect();
            assert!(left.is_empty(), "operation {operation}: {left:?}");
            let store = folder.join(".out.phiw");
            assert!(!store.is_dir() || entries(&store).len() == 2, "{:?}", entries(&store));
        }
    }
}

fn nothing(_: &Path) {}

fn plain(folder: &Path) {
    fs::create_dir_all(folder).unwrap();
    NAMES.iter().for_each(|name| fs::write(folder.join(name), "old").unwrap());
}

fn with_others(folder: &Path) {
    plain(folder);
    fs::write(folder.join("mine.txt"), "mine").unwrap();
}

fn with_a_folder(folder: &Path) {
    with_others(folder);
    fs::create_dir(folder.join("mine")).unwrap();
}

#[test]
fn a_new_folder_is_whole_or_absent() {
    check(&nothing, None, false, &into_folder);
}

#[test]
fn an_old_folder_is_whole_old_or_whole_new() {
    check(&plain, Some("old"), false, &into_folder);
    check(&with_others, Some("old"), false, &into_folder);
}

#[test]
fn a_folder_with_folders_of_the_users_is_whole_old_or_whole_new() {
    check(&with_a_folder, Some("old"), false, &into_folder);
}

#[test]
fn without_an_exchange_it_is_the_same() {
    check(&plain, Some("old"), true, &into_folder);
}

#[test]
fn files_in_a_folder_of_the_users_are_whole_old_or_whole_new() {
    check(&plain, Some("old"), false, &|system, folder, files| replace_files(system, folder, "out", files));
}

#[test]
fn files_of_the_users_stay() {
    for prepare in [with_others as fn(&Path), with_a_folder] {
        let place = TempDir::new().unwrap();
        let folder = place.path().join("out");
        prepare(&folder);
        into_folder(&Disk, &folder, &files("new")).unwrap();
        assert_eq!(fs::read_to_string(folder.join("mine.txt")).unwrap(), "mine");
        assert_eq!(folder.join("mine").is_dir(), prepare as usize == with_a_folder as fn(&Path) as usize);
    }
}

/// The link was followed, and the file that it led to overwritten.
#[cfg(unix)]
#[test]
fn a_planted_link_is_not_followed() {
    let place = TempDir::new().unwrap();
    let (victim, folder) = (place.path().join("victim"), place.path().join("out"));
    fs::write(&victim, "victim").unwrap();
    fs::create_dir(&folder).unwrap();
    std::os::unix::fs::symlink(&victim, folder.join("a.json")).unwrap();
    into_folder(&Disk, &folder, &files("new")).unwrap();
    assert_eq!(seen(&folder), all(Some("new")));
    assert_eq!(fs::read_to_string(&victim).unwrap(), "victim");
}

/// Two runs shared the names of their temporary files.
#[test]
fn a_second_run_into_the_same_place_is_refused_with_the_name_of_the_first() {
    let place = TempDir::new().unwrap();
    for target in [place.path().to_owned(), place.path().join("new/newer")] {
        let first = Lock::acquire(&target, "phiw identify").unwrap();
        let error = Lock::acquire(&target, "phiw explain").unwrap_err().to_string();
        let pid = format!("pid {}", std::process::id());
        assert!(error.contains("phiw identify") && error.contains(&pid), "{error}");
        drop(first);
        drop(Lock::acquire(&target, "phiw explain").unwrap());
    }
    assert!(entries(place.path()).is_empty(), "{:?}", entries(place.path()));
}

/// The second run followed the visible link into the generation of the first.
#[test]
fn files_that_are_links_to_their_generation_are_replaced_again() {
    let place = TempDir::new().unwrap();
    for content in ["one", "two", "three"] {
        let lock = Lock::acquire(&place.path().join("a.json"), "test").unwrap();
        replace_files(&Disk, lock.target().parent().unwrap(), "a.json", &files(content)).unwrap();
        assert_eq!(seen(place.path()), all(Some(content)));
    }
}

#[test]
fn an_input_is_never_an_output() {
    let place = TempDir::new().unwrap();
    let path = |name: &str| -> PathBuf { place.path().join(name) };
    fs::write(path("input"), "").unwrap();
    fs::hard_link(path("input"), path("same")).unwrap();
    assert!(check_inputs(&[path("input")], &[path("other"), path("input")]).is_err());
    assert!(check_inputs(&[path("input")], &[path("same")]).is_err());
    assert!(check_inputs(&[path("input")], &[path("other")]).is_ok());
}

#[test]
fn one_file_is_whole_old_or_whole_new() {
    for killed in [false, true] {
        for operation in 1..6 {
            let place = TempDir::new().unwrap();
            let path = place.path().join("file");
            fs::write(&path, "old").unwrap();
            let system = Faulty { left: Cell::new(operation), killed, no_exchange: false };
            let outcome = replace_file(&system, &path, b"new");
            let now = fs::read_to_string(&path).unwrap();
            assert_eq!(now, if outcome.is_ok() { "new" } else { "old" });
        }
    }
}

/// A run that was killed left its partial file for ever.
#[test]
fn what_vouches_for_a_file_belongs_to_it_and_killed_runs_leave_nothing() {
    for (killed, operation) in [false, true].into_iter().flat_map(|killed| (1..20).map(move |n| (killed, n)))
    {
        let folder = TempDir::new().unwrap();
        let (log, facts) = (folder.path().join("a.csv"), folder.path().join("a.json"));
        let write = |system: &dyn FileSystem, content: &str| {
            replace_vouched(system, (&log, content.as_bytes()), (&facts, content.as_bytes()))
        };
        write(&Disk, "old").unwrap();
        let faulty = Faulty { left: Cell::new(operation), killed, no_exchange: false };
        let _ = write(&faulty, "new");
        if let Ok(vouched) = fs::read_to_string(&facts) {
            assert_eq!(vouched, fs::read_to_string(&log).unwrap(), "operation {operation}");
        }
        assert!(log.is_file(), "operation {operation}");
        write(&Disk, "newer").unwrap();
        assert_eq!(entries(folder.path()), ["a.csv", "a.json"], "operation {operation}");
        assert_eq!(fs::read_to_string(&log).unwrap(), "newer");
    }
}

/// Whatever fails, and when the writer gives up: what was there is there, and nothing else.
#[test]
fn a_file_that_is_written_piece_by_piece_is_old_or_new() {
    let write = |system: &dyn FileSystem, path: &Path| -> Result<(), ResultError> {
        let mut file = StreamedFile::create(system, path)?;
        for _ in 0..10_000 {
            file.write_all(b"a line\n").map_err(|source| file.unwritable(source))?;
        }
        file.commit()
    };
    for killed in [false, true] {
        let mut commits = 0;
        for operation in 1.. {
            let place = TempDir::new().unwrap();
            let path = place.path().join("a.csv");
            fs::write(&path, "old").unwrap();
            let system = Faulty { left: Cell::new(operation), killed, no_exchange: false };
            let outcome = write(&system, &path);
            let now = fs::read_to_string(&path).unwrap();
            assert!(now == "old" || now.len() == 70_000, "operation {operation}");
            assert!(outcome.is_err() || now != "old", "operation {operation}: called done");
            commits += usize::from(now != "old");
            write(&Disk, &path).unwrap();
            assert_eq!(entries(place.path()), ["a.csv"], "operation {operation}");
            if system.left.get() > 0 {
                assert!(operation > 4 && commits > 0, "the faults were never reached");
                break;
            }
        }
    }
    let place = TempDir::new().unwrap();
    let given_up = StreamedFile::create(&Disk, &place.path().join("new/b.csv")).unwrap();
    drop(given_up);
    assert!(entries(&place.path().join("new")).is_empty());
}
