//! One run of the program, and what it did.

use super::case::{Case, Expectation};
use super::ground::{GoodRun, Ground};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::{self, Read};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A run that takes longer is killed and counts as hanging: far longer than any takes beside others on a slow
/// machine.
const PATIENCE: Duration = Duration::from_secs(300);
/// Between two looks at a running program.
const POLL: Duration = Duration::from_millis(1);
/// What a file of an earlier result holds, so that a run that fails must leave it.
const EARLIER: &[u8] = b"an earlier result\n";

/// What a result says, as far as results are compared.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answer {
    /// The held-out error as a share of the torque, or the markers' RMS \[m\].
    pub number: f64,
    /// What was chosen: names of effects, or of a motion.
    pub chosen: Vec<String>,
    /// Lines of warnings.
    pub warnings: usize,
}

/// What came of a run, compared with what had to.
#[derive(Clone, Debug, PartialEq)]
pub enum Judgement {
    /// As it had to be.
    Held,
    /// A result that is wrong, or that should have been refused, with exit status 0.
    Wrong(String),
    /// A crash, a hang, a torn result, a bad message, too much time or memory.
    Broken(String),
}

/// One run of the program, and what it did.
#[derive(Clone, Debug)]
pub struct Trial {
    /// Exit status; none after a signal.
    pub status: Option<i32>,
    /// Wall time.
    pub time: Duration,
    /// Peak resident memory \[bytes\], as last seen.
    pub peak_bytes: u64,
    /// What it printed to standard output.
    pub stdout: String,
    /// What it printed to standard error.
    pub stderr: String,
    /// Its result, where there is one.
    pub answer: Option<Answer>,
    results: BTreeMap<String, Vec<u8>>,
    left_over: Vec<String>,
    hung: bool,
}

impl Trial {
    /// Writes the files into a folder of its own, runs `phiw` with `words` there, and collects what it left.
    /// `shell` is the script that starts it, [`Case::PLAIN`] but for limits and redirections.
    ///
    /// # Errors
    /// The folder can't be made, or the program can't be started.
    pub fn run(
        phiw: &Path,
        files: impl IntoIterator<Item = (String, Vec<u8>)>,
        words: &[String],
        shell: &str,
    ) -> io::Result<Self> {
        let folder = tempfile::tempdir()?;
        let mut inputs = Vec::new();
        for (name, content) in files {
            let path = folder.path().join(&name);
            if let Some(parent) = path.parent() {
                std::fs::create_dir_all(parent)?;
            }
            std::fs::write(path, content)?;
            inputs.push(name);
        }
        let mut command = Command::new("sh");
        command.arg("-c").arg(shell).arg("sh").arg(phiw).args(words).current_dir(folder.path());
        let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?;
        let read = |pipe: Option<Box<dyn Read + Send>>| {
            std::thread::spawn(move || {
                let mut bytes = Vec::new();
                if let Some(pipe) = pipe {
                    // Beyond this a message is broken anyhow; the pipe closes then.
                    let _ = pipe.take(4 << 20).read_to_end(&mut bytes);
                }
                bytes
            })
        };
        let stdout = read(child.stdout.take().map(|pipe| Box::new(pipe) as Box<dyn Read + Send>));
        let stderr = read(child.stderr.take().map(|pipe| Box::new(pipe) as Box<dyn Read + Send>));
        let (start, mut peak_bytes, mut hung) = (Instant::now(), 0, false);
        let status = loop {
            peak_bytes = peak_bytes.max(peak_of(child.id()));
            if let Some(status) = child.try_wait()? {
                break status;
            }
            if start.elapsed() > PATIENCE {
                hung = true;
                child.kill()?;
                break child.wait()?;
            }
            std::thread::sleep(POLL);
        };
        let time = start.elapsed();
        let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
        let [stdout, stderr] = [stdout, stderr].map(|reader| text(reader.join().unwrap_or_default()));
        let (results, left_over) = collect(&folder.path().canonicalize()?, &inputs)?;
        let mut trial = Trial {
            status: status.code(),
            time,
            peak_bytes,
            stdout,
            stderr,
            answer: None,
            results,
            left_over,
            hung,
        };
        trial.answer = trial.read_answer();
        Ok(trial)
    }

    /// A result file by its name.
    pub fn result_file(&self, name: &str) -> Option<Vec<u8>> {
        self.results.iter().find(|(path, _)| path.ends_with(name)).map(|(_, content)| content.clone())
    }

    /// What it did, in a line.
    pub fn story(&self) -> String {
        let status = self.status.map_or("a signal".to_owned(), |code| format!("exit status {code}"));
        let first: String = self.stderr.lines().next().unwrap_or("no message").chars().take(240).collect();
        format!("{status} after {:.1} s: {}", self.time.as_secs_f64(), first.escape_debug())
    }

    /// What it did against what it had to do.
    pub fn judge(&self, case: &Case, good: &GoodRun) -> Judgement {
        match self.disorder(case) {
            Some(what) => Judgement::Broken(format!("{what}; {}", self.story())),
            None => match self.misled(case, good) {
                Some(what) => Judgement::Wrong(format!("{what}; {}", self.story())),
                None => Judgement::Held,
            },
        }
    }

    /// What is out of order whatever the input: crashes, torn results, bad messages.
    fn disorder(&self, case: &Case) -> Option<String> {
        if self.hung {
            return Some(format!("no end after {} s", PATIENCE.as_secs()));
        }
        let both = || [&self.stdout, &self.stderr];
        if both().iter().any(|text| text.contains("panicked at") || text.contains("RUST_BACKTRACE")) {
            return Some("a panic".to_owned());
        }
        if both().iter().any(|text| text.chars().any(|c| c.is_control() && c != '\n' && c != '\t')) {
            return Some("control characters on the terminal".to_owned());
        }
        if !self.left_over.is_empty() {
            return Some(format!("left over: {}", self.left_over.join(", ")));
        }
        let allowed: &[i32] = if case.expectation == Expectation::Starved { &[0, 1, 2] } else { &[0, 2] };
        let Some(status) = self.status.filter(|status| allowed.contains(status)) else {
            return Some("an exit status that says nothing of the input".to_owned());
        };
        if status == 0 {
            return self.torn();
        }
        // clap's own message has a usage line and a tip.
        let usage = self.stderr.contains("try '--help'") || self.stderr.contains("Usage:");
        if !usage && !case.shell.contains('>') && self.stderr.lines().count() != 1 {
            return Some(format!("{} lines in the place of one message", self.stderr.lines().count()));
        }
        let lengthy = self.stderr.chars().count() > 1200;
        if lengthy && !usage {
            return Some(format!("a message of {} characters", self.stderr.chars().count()));
        }
        // `retarget` does what can be done, and says with 1 that something could not.
        if !self.results.is_empty() && status == 2 {
            let names: Vec<&str> = self.results.keys().map(String::as_str).collect();
            return Some(format!("refused, but has written {}", names.join(", ")));
        }
        if status == 2 && self.peak_bytes > 500_000_000 {
            return Some(format!("{} MB until it was refused", self.peak_bytes / 1_000_000));
        }
        None
    }

    /// A result that is no whole set of files.
    fn torn(&self) -> Option<String> {
        let json = self.results.iter().filter(|(name, _)| name.ends_with(".json"));
        for (name, content) in json {
            if let Err(error) = serde_json::from_slice::<Value>(content) {
                return Some(format!("{name} is no JSON: {error}"));
            }
        }
        (self.results.is_empty() && !self.stdout.contains("Usage"))
            .then(|| "exit status 0 without a result".to_owned())
    }

    /// A result that is not what the input gives.
    fn misled(&self, case: &Case, good: &GoodRun) -> Option<String> {
        if self.status == Some(0) && self.results.is_empty() {
            return None;
        }
        let Some(answer) = self.answer.as_ref().filter(|_| self.status == Some(0)) else {
            return match case.expectation {
                Expectation::Same => Some("the good result was refused".to_owned()),
                _ if self.status == Some(0) => Some("a result that says no number".to_owned()),
                _ => None,
            };
        };
        let bound = Ground::TOLERANCE * (good.answer.number + 0.01);
        let off = (answer.number - good.answer.number).abs();
        // A NaN is not the same.
        let same = off <= bound && answer.chosen == good.answer.chosen;
        let said = answer.warnings > good.answer.warnings;
        let story = || {
            format!(
                "{} {:?} in the place of {} {:?}",
                answer.number, answer.chosen, good.answer.number, good.answer.chosen
            )
        };
        match case.expectation {
            Expectation::Same if !same => Some(story()),
            Expectation::SameOrSaid if !same && !said => Some(format!("{} without a word", story())),
            Expectation::Refused => {
                Some(format!("a result ({}) of an input that must be refused", answer.number))
            }
            _ => None,
        }
    }

    /// The number that a result is compared by: a held-out error, or the markers' RMS.
    fn read_answer(&self) -> Option<Answer> {
        let warnings = self.stderr.lines().count();
        let json = |end: &str| {
            let (_, content) = self.results.iter().find(|(name, _)| name.ends_with(end))?;
            serde_json::from_slice::<Value>(content).ok()
        };
        if let Some(report) = json("out/report.json") {
            let effects = report["effects"].as_array()?;
            let chosen =
                effects.iter().map(|effect| format!("{} {}", effect["kind"], effect["joints"])).collect();
            return Some(Answer {
                number: report["after"]["validate"]["relative"].as_f64()?,
                chosen,
                warnings,
            });
        }
        if let Some(plan) = json("plan.json") {
            let chosen = vec![plan["next"]["motion"].to_string()];
            return Some(Answer { number: 0.0, chosen, warnings });
        }
        if self.result_file("predicted.csv").is_some() || json("simulation.json").is_some() {
            return Some(Answer { number: 0.0, chosen: Vec::new(), warnings });
        }
        let facts = json(".json")?;
        Some(Answer { number: facts["marker_rms_m"].as_f64()?, chosen: Vec::new(), warnings })
    }
}

/// The most resident memory that a child process has had \[bytes\], 0 where that cannot be read.
///
/// `spawn` returns when the child is about to leave the memory that it shares with us (`vfork`), and what is
/// read before it has left is our own peak. Its program is ours for as long.
fn peak_of(process: u32) -> u64 {
    let program = |process: &str| std::fs::read_link(format!("/proc/{process}/exe"));
    // The program is read first: a child never comes back.
    let left = matches!((program(&process.to_string()), program("self")), (Ok(its), Ok(ours)) if its != ours);
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).filter(|_| left);
    line.and_then(|line| line.trim().trim_end_matches(" kB").trim().parse::<u64>().ok()).unwrap_or(0) * 1024
}

type ResultFiles = BTreeMap<String, Vec<u8>>;

/// Result files by path; and what no run may leave: temporary files, locks.
fn collect(folder: &Path, inputs: &[String]) -> io::Result<(ResultFiles, Vec<String>)> {
    let (mut results, mut left_over) = (BTreeMap::new(), Vec::new());
    let mut linked = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        linked.extend(entry?.path().canonicalize());
    }
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(next)? {
            let path = entry?.path();
            let name = path.strip_prefix(folder).unwrap_or(&path).to_string_lossy().into_owned();
            let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
            // What a file of the results is a link into is no leftover.
            let kept = hidden && linked.iter().any(|target| target.starts_with(&path));
            if kept {
                continue;
            }
            if path.is_dir() && !hidden {
                folders.push(path);
            } else if path.is_dir() || (hidden && !path.is_symlink()) {
                left_over.push(name);
            } else if path.is_file() && !inputs.contains(&name) {
                let content = std::fs::read(&path)?;
                if content != EARLIER {
                    results.insert(name, content);
                }
            }
        }
    }
    Ok((results, left_over))
}

#[cfg(test)]
mod tests {
    use super::peak_of;
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};

    #[test]
    fn a_child_that_still_has_our_memory_is_not_charged_with_it() {
        assert_eq!(peak_of(std::process::id()), 0, "our own memory was taken for a child's");
        let mut shell = Command::new("sh");
        let script = ["-c", "echo started; read end"];
        let mut child = shell.args(script).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
        let peak = peak_of(child.id());
        drop(child.stdin.take());
        child.wait().unwrap();
        assert!(peak > 0 || !cfg!(target_os = "linux"), "the memory of a child that runs was not read");
    }
}
