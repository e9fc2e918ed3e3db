//! A command in a folder of its own, with two inputs that give different results.

use crate::hostile::{Ground, GroundError};
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use tempfile::TempDir;

/// Where the files of a plan live, beside the links to them.
const GENERATIONS: &str = ".plan.csv.phiw";

/// Result files by their path.
pub(super) type Results = BTreeMap<PathBuf, Vec<u8>>;

/// What is in a result folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    /// What one of the two runs gives, all of it.
    Whole(usize),
    /// Nothing that is claimed to be a result: the next run has to make it.
    Undone,
    /// Files of both, or of neither.
    Mixed,
}

/// What `results` are, beside those of the two runs. `claims` says whether a file that is there claims a
/// result.
fn state_of(results: &Results, references: &[Results; 2], claims: impl Fn(&Path, &[u8]) -> bool) -> State {
    match references.iter().position(|reference| reference == results) {
        Some(which) => State::Whole(which),
        None if results.iter().any(|(path, content)| claims(path, content)) => State::Mixed,
        None => State::Undone,
    }
}

/// A command in a folder of its own, with two inputs that give different results.
pub struct Subject {
    /// The command.
    pub name: &'static str,
    folder: TempDir,
    program: PathBuf,
    environment: Vec<(OsString, OsString)>,
    words: [Vec<String>; 2],
    references: [Results; 2],
}

/// A subject can't be made.
#[derive(Debug, thiserror::Error)]
pub enum SubjectError {
    /// The good inputs can't be made.
    #[error(transparent)]
    Ground(#[from] GroundError),
    /// A file or program.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A run that nobody disturbs fails.
    #[error("`{0}` fails on good inputs")]
    Fails(String),
    /// Its two runs can't be told apart.
    #[error("the two runs of `{0}` give the same result")]
    Same(&'static str),
}

/// The commands that write results: four of `phiw`, and the experiments of `xtask` with their run files.
///
/// # Errors
/// [`SubjectError`].
pub fn subjects(phiw: &Path, xtask: &Path, seed: u64) -> Result<Vec<Subject>, SubjectError> {
    let ground = Ground::new(phiw, seed)?;
    let of_phiw = |name: &'static str, key: &str, other: &dyn Fn(&str) -> String| {
        let words = ground.run(key).words.clone();
        let second = words.iter().map(|word| other(word)).collect();
        Subject::new(name, &ground, phiw.to_owned(), Vec::new(), [words, second])
    };
    let other_log = |word: &str| match word {
        "train.csv" => "validate.csv".to_owned(),
        "validate.csv" => "train.csv".to_owned(),
        word => word.to_owned(),
    };
    let mut subjects = vec![
        of_phiw("identify", "identify", &other_log)?,
        of_phiw("explain", "explain", &other_log)?,
        of_phiw("next", "next", &other_log)?,
    ];
    let words = ground.run("retarget").words.clone();
    let mut second = words.clone();
    second.extend(["--interval".to_owned(), "0.25".to_owned()]);
    subjects.push(Subject::new("retarget", &ground, phiw.to_owned(), Vec::new(), [words, second])?);
    let paper = |seed: &str| {
        let words = "paper --backend analytic --seeds 1 --per-task 2 --arm curriculum --footing fixed --iterations 2 --out FOLDER/out --first-seed";
        words.split(' ').chain([seed]).map(str::to_owned).collect::<Vec<_>>()
    };
    let manifest = std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default();
    let environment = vec![("CARGO_MANIFEST_DIR".into(), manifest)];
    subjects.push(Subject::new("paper", &ground, xtask.to_owned(), environment, [paper("0"), paper("0")])?);
    Ok(subjects)
}

impl Subject {
    fn new(
        name: &'static str,
        ground: &Ground,
        program: PathBuf,
        environment: Vec<(OsString, OsString)>,
        words: [Vec<String>; 2],
    ) -> Result<Self, SubjectError> {
        let folder = tempfile::tempdir()?;
        let place = folder.path().display().to_string();
        let words = words.map(|words| words.into_iter().map(|word| word.replace("FOLDER", &place)).collect());
        for (file, content) in ground.files() {
            let path = folder.path().join(file);
            if let Some(parent) = path.parent() {
                std::fs::create_dir_all(parent)?;
            }
            std::fs::write(path, content)?;
        }
        let empty = [Results::new(), Results::new()];
        let mut subject = Subject { name, folder, program, environment, words, references: empty };
        for which in [0, 1] {
            if !subject.start(which)?.wait()?.success() {
                return Err(SubjectError::Fails(subject.words[which].join(" ")));
            }
            subject.references[which] = subject.results()?;
        }
        if subject.words[0] != subject.words[1] && subject.references[0] == subject.references[1] {
            return Err(SubjectError::Same(name));
        }
        Ok(subject)
    }

    /// Whether both runs are one that goes on where it was interrupted.
    pub(super) fn resumes(&self) -> bool {
        self.words[0] == self.words[1]
    }

    /// Starts one of the two runs; standard error is kept.
    pub(super) fn start(&self, which: usize) -> io::Result<Child> {
        let mut command = Command::new(&self.program);
        command
            .args(&self.words[which])
            .current_dir(self.folder.path())
            .envs(self.environment.iter().cloned());
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn()
    }

    /// What is in the results.
    pub(super) fn state(&self) -> io::Result<State> {
        let claims = |path: &Path, content: &[u8]| match self.name {
            // A motion without its facts is a whole motion, of which nobody says how it came about.
            "retarget" => path.ends_with("recording.json"),
            // Run files grow from iteration to iteration, and are whole at any moment; motions are made
            // before them.
            "paper" => {
                path.extension().is_some_and(|extension| extension == "json")
                    && serde_json::from_slice::<serde_json::Value>(content).is_err()
            }
            _ => true,
        };
        Ok(state_of(&self.results()?, &self.references, claims))
    }

    /// Which result files are of which run, in words.
    pub(super) fn story(&self) -> io::Result<String> {
        let results = self.results()?;
        let of_file = |(path, content): (&PathBuf, &Vec<u8>)| {
            let of = |which: usize| self.references[which].get(path) == Some(content);
            let whose = match (of(0), of(1)) {
                (true, true) => "of both",
                (true, false) => "of the first",
                (false, true) => "of the second",
                (false, false) => "of neither",
            };
            format!("{} {whose}", path.display())
        };
        Ok(results.iter().map(of_file).collect::<Vec<_>>().join(", "))
    }

    /// Temporary names that are there: those of a commit that is under way, or of one that was killed. Locks
    /// are none.
    pub(super) fn temporary_names(&self) -> BTreeSet<PathBuf> {
        let root = self.folder.path();
        let entries =
            |folder: PathBuf| folder.read_dir().into_iter().flatten().flatten().map(|entry| entry.path());
        let runs = entries(root.join("out/runs")).collect::<Vec<_>>();
        let folders = [root.to_owned(), root.join("out")].into_iter().chain(runs);
        let name = |path: &PathBuf| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let is_temporary = |path: &PathBuf| {
            let name = name(path);
            name.starts_with('.') && !name.ends_with("lock") && name != GENERATIONS
        };
        let mut names: BTreeSet<PathBuf> = folders.flat_map(entries).filter(is_temporary).collect();
        names.extend(entries(root.join(GENERATIONS)));
        names
    }

    /// Takes all results away.
    pub(super) fn clear(&self) -> io::Result<()> {
        match self.name {
            // The motions take long, and are written by `retarget`, which is a subject of its own.
            "paper" => {
                for name in ["runs", "report.html"] {
                    let path = self.folder.path().join("out").join(name);
                    if path.is_dir() {
                        std::fs::remove_dir_all(path)?
                    } else if path.exists() {
                        std::fs::remove_file(path)?
                    }
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Names that no run may leave behind.
    pub(super) fn leftovers(&self) -> io::Result<Vec<PathBuf>> {
        let mut left = Vec::new();
        let mut folders = vec![self.folder.path().to_owned()];
        while let Some(folder) = folders.pop() {
            for entry in folder.read_dir()? {
                let path = entry?.path();
                let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                if name == GENERATIONS {
                    // The files of a plan live here: one generation, and the link to it.
                    let extra = path.read_dir()?.count().saturating_sub(2);
                    left.extend((0..extra).map(|_| path.clone()));
                } else if name.starts_with('.') {
                    left.push(path);
                } else if path.is_dir() {
                    folders.push(path);
                }
            }
        }
        Ok(left)
    }

    /// All visible files that are results, by their path.
    fn results(&self) -> io::Result<Results> {
        let root = self.folder.path();
        let mut results = Results::new();
        for name in ["plan.csv", "plan.json"] {
            if let Ok(content) = std::fs::read(root.join(name)) {
                results.insert(name.into(), content);
            }
        }
        let mut folders = vec![root.join("out")];
        while let Some(folder) = folders.pop() {
            for entry in folder.read_dir().into_iter().flatten() {
                let path = entry?.path();
                let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
                if path.is_dir() && !hidden {
                    folders.push(path);
                } else if !hidden {
                    let name = path.strip_prefix(root).unwrap_or(&path).to_owned();
                    results.insert(name, without_time(std::fs::read(&path)?));
                }
            }
        }
        Ok(results)
    }
}

/// A page without the moment at which it was made.
fn without_time(content: Vec<u8>) -> Vec<u8> {
    let Ok(text) = std::str::from_utf8(&content) else { return content };
    match (text.find("<time"), text.find("</time>")) {
        (Some(start), Some(end)) if start < end => format!("{}{}", &text[..start], &text[end..]).into_bytes(),
        _ => content,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn results(files: &[(&str, &str)]) -> Results {
        files.iter().map(|(name, content)| (PathBuf::from(name), content.as_bytes().to_vec())).collect()
    }

    #[test]
    fn whole_undone_and_mixed_results_are_told_apart() {
        let references = [results(&[("a", "1"), ("b", "1")]), results(&[("a", "2"), ("b", "2")])];
        let claims = |path: &Path, _: &[u8]| path.ends_with("b");
        let cases: [(&[(&str, &str)], State); 7] = [
            (&[("a", "1"), ("b", "1")], State::Whole(0)),
            (&[("a", "2"), ("b", "2")], State::Whole(1)),
            (&[], State::Undone),
            (&[("a", "2")], State::Undone),
            (&[("a", "2"), ("b", "1")], State::Mixed),
            (&[("b", "1")], State::Mixed),
            (&[("a", "1"), ("b", "1"), ("c", "1")], State::Mixed),
        ];
        for (files, expected) in cases {
            assert_eq!(state_of(&results(files), &references, claims), expected, "{files:?}");
        }
    }

    #[test]
    fn the_moment_of_a_page_does_not_count() {
        let page = |time: &str, body: &str| format!("<p><time>{time}</time>{body}</p>").into_bytes();
        assert_eq!(without_time(page("10:01", "x")), without_time(page("10:02", "x")));
        assert_ne!(without_time(page("10:01", "x")), without_time(page("10:01", "y")));
    }
}
