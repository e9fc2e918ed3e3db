//! Runs that are killed at any moment, half of them while they commit.

use super::subject::{State, Subject, SubjectError};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::time::{Duration, Instant};

/// What kills left.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct KillScore {
    /// Runs that were started.
    pub tried: usize,
    /// Runs that were killed before they ended.
    pub killed: usize,
    /// Of the killed: while a commit was under way.
    pub committing: usize,
    /// Results that were whole, as before.
    pub old: usize,
    /// Results that were whole, of the killed run.
    pub new: usize,
    /// No result, or one that is not claimed to be one; the run after made it.
    pub undone: usize,
    /// Results that were neither.
    pub mixed: usize,
    /// The first of them: which file is of which run.
    pub first_mixed: Option<String>,
    /// Temporary files that were left after a run that nobody disturbed.
    pub leftovers: usize,
}

impl KillScore {
    fn mix(&mut self, subject: &Subject) -> Result<(), SubjectError> {
        self.mixed += 1;
        let story = subject.story()?;
        self.first_mixed.get_or_insert(story);
        Ok(())
    }
}

/// Between two looks at a run.
const POLL: Duration = Duration::from_micros(50);

/// Kills `count` runs, every other one while it commits.
///
/// # Errors
/// A program can't be started, or an undisturbed run fails.
pub fn kill(subject: &Subject, count: usize, seed: u64) -> Result<KillScore, SubjectError> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut score = KillScore { tried: count, ..KillScore::default() };
    finish(subject, 1)?;
    subject.clear()?;
    let start = Instant::now();
    let there = subject.temporary_names();
    let mut run = subject.start(0)?;
    while run.try_wait()?.is_none() && subject.temporary_names().is_subset(&there) {}
    let committing = Instant::now();
    run.wait()?;
    let (duration, commit) = (start.elapsed(), committing.elapsed());
    for number in 0..count {
        if subject.resumes() {
            subject.clear()?;
        }
        let before = subject.state()?;
        let which = usize::from(before == State::Whole(0) && !subject.resumes());
        // A killed run's names may still be there.
        let there = subject.temporary_names();
        let mut run = subject.start(which)?;
        let at = Instant::now() + duration.mul_f64(random.random_range(0.0..1.05));
        let aimed = number % 2 == 1;
        if aimed {
            // Without a pause: a commit takes less than a millisecond.
            while run.try_wait()?.is_none() && subject.temporary_names().is_subset(&there) {}
            let until = Instant::now() + commit.mul_f64(random.random_range(0.0..1.0));
            while Instant::now() < until {}
        } else {
            while run.try_wait()?.is_none() && Instant::now() < at {
                std::thread::sleep(POLL);
            }
        }
        if run.try_wait()?.is_none() {
            score.killed += 1;
            score.committing += usize::from(aimed);
        }
        run.kill()?;
        run.wait()?;
        match subject.state()? {
            State::Whole(now) if now == which => score.new += 1,
            state @ State::Whole(_) if state == before => score.old += 1,
            State::Undone => {
                // What is left of it must not stand in the way.
                finish(subject, which)?;
                match subject.state()? {
                    State::Whole(now) if now == which => score.undone += 1,
                    _ => score.mix(subject)?,
                }
            }
            _ => {
                score.mix(subject)?;
                finish(subject, which)?;
            }
        }
    }
    finish(subject, 0)?;
    score.leftovers = subject.leftovers()?.len();
    Ok(score)
}

fn finish(subject: &Subject, which: usize) -> Result<(), SubjectError> {
    let output = subject.start(which)?.wait_with_output()?;
    if output.status.success() {
        Ok(())
    } else {
        Err(SubjectError::Fails(format!("{}: {}", subject.name, String::from_utf8_lossy(&output.stderr))))
    }
}
