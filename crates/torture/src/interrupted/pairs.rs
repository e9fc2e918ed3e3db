//! Two runs into one folder at the same time.

use super::subject::{State, Subject, SubjectError};

/// What became of pairs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PairScore {
    /// Pairs that were started.
    pub tried: usize,
    /// Pairs of which one was refused, with the name of the other.
    pub refused: usize,
    /// Pairs of which both gave a result, one after the other.
    pub both: usize,
    /// Pairs with another end of a run, or with results of which some are of one and some of the other.
    pub bad: usize,
}

/// Starts `count` pairs.
///
/// # Errors
/// A program can't be started.
pub fn pair(subject: &Subject, count: usize) -> Result<PairScore, SubjectError> {
    let mut score = PairScore { tried: count, ..PairScore::default() };
    for _ in 0..count {
        let runs = [subject.start(0)?, subject.start(1)?];
        let pids = runs.each_ref().map(std::process::Child::id);
        let (mut done, mut refused, mut orderly) = (Vec::new(), 0, true);
        for (which, run) in runs.into_iter().enumerate() {
            let output = run.wait_with_output()?;
            let message = String::from_utf8_lossy(&output.stderr).into_owned();
            let other = format!("(pid {}, `phiw {}`", pids[1 - which], subject.name);
            match output.status.code() {
                Some(0) => done.push(which),
                Some(2) if message.contains(&other) => refused += 1,
                _ => orderly = false,
            }
        }
        let whole = matches!(subject.state()?, State::Whole(which) if done.contains(&which));
        match (orderly && whole, refused) {
            (true, 0) => score.both += 1,
            (true, 1) => score.refused += 1,
            _ => score.bad += 1,
        }
    }
    Ok(score)
}
