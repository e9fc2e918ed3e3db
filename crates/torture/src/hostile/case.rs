//! What is tried, and what has to come of it.
//!
//! A case is made on a good run of the ground, and the ground runs its good cases as trials that judge a
//! case: case, ground and trial name each other.

use super::Ground;
use rand_chacha::ChaCha8Rng;

/// What has to come of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expectation {
    /// The result of the good input, within [`Ground::TOLERANCE`]: what was spoiled does not matter.
    Same,
    /// Exit status 2 and one line; no result.
    Refused,
    /// Refused, or the result of the good input, or a result with a warning that the good input does not
    /// have. Never another result in silence.
    SameOrSaid,
    /// Any orderly end, since whether the input is wrong depends on the seed: exit status 0, or 2 with one
    /// line. No crash, no torn result.
    Orderly,
    /// The same, or exit status 1 with one line: the machine gave less than the work needs.
    Starved,
}

/// One run of the command.
#[derive(Clone, Debug)]
pub struct Case {
    /// Files to write, by their path within the run's folder. They replace the good ones of the same name.
    pub files: Vec<(String, Vec<u8>)>,
    /// The command line after `phiw`. Paths are relative to the run's folder; results go to `out`.
    pub words: Vec<String>,
    /// What has to come of it.
    pub expectation: Expectation,
    /// The script that starts the command, `"$@"` in it: a limit before, a redirection behind.
    pub shell: String,
    /// Which good run it is compared with: its key in the ground.
    pub good: &'static str,
    /// What is wrong with the input, for the list of failures.
    pub story: String,
}

impl Case {
    /// The script that starts the command as it is.
    pub const PLAIN: &str = "exec \"$@\"";

    /// A case on the good run `good`, with `files` in the place of the good ones.
    pub fn new(ground: &Ground, good: &'static str, expectation: Expectation, story: String) -> Self {
        let words = ground.run(good).words.clone();
        Case { files: Vec::new(), words, expectation, shell: Case::PLAIN.to_owned(), good, story }
    }

    /// The same with that file.
    pub fn file(mut self, name: &str, content: impl Into<Vec<u8>>) -> Self {
        self.files.push((name.to_owned(), content.into()));
        self
    }
}

/// A class of inputs that are wrong in the same way.
#[derive(Clone)]
pub struct Class {
    /// What is wrong, in a few words.
    pub name: &'static str,
    /// Whether a failure is a wrong result with exit status 0, the worst kind.
    pub wrong_result: bool,
    /// How many are tried where the whole table is asked for.
    pub count: usize,
    /// Makes one.
    pub make: fn(&Ground, &mut ChaCha8Rng) -> Case,
}

impl Class {
    /// A class whose failures are crashes, torn results or bad messages.
    pub fn new(name: &'static str, count: usize, make: fn(&Ground, &mut ChaCha8Rng) -> Case) -> Self {
        Class { name, wrong_result: false, count, make }
    }

    /// A class of inputs that must not lead to a wrong result.
    pub fn wrong(name: &'static str, count: usize, make: fn(&Ground, &mut ChaCha8Rng) -> Case) -> Self {
        Class { wrong_result: true, ..Class::new(name, count, make) }
    }
}
