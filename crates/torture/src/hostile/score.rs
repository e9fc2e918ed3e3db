//! All cases, and a table of what came of them.

use super::case::Class;
use super::ground::Ground;
use super::trial::{Judgement, Trial};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::time::Duration;

/// What came of a class.
#[derive(Clone, Debug)]
pub struct ClassScore {
    /// The class.
    pub name: &'static str,
    /// Whether its failures are wrong results.
    pub wrong_result: bool,
    /// How many were run.
    pub tried: usize,
    /// How many of them gave a result.
    pub results: usize,
    /// How many were refused, with exit status 2.
    pub refused: usize,
    /// The longest time until an input was refused \[s\].
    pub slowest_refusal: Duration,
    /// The most memory until an input was refused \[bytes\].
    pub largest_refusal_bytes: u64,
    /// What failed.
    pub failures: Vec<Failure>,
}

/// A case that did not end as it had to.
#[derive(Clone, Debug)]
pub struct Failure {
    /// Its number within the class: the seed makes it again.
    pub number: usize,
    /// What was wrong with the input.
    pub story: String,
    /// What came of it.
    pub judgement: Judgement,
}

/// Runs `share` of each class's cases, several at once; a case depends on `seed`, its class and its number
/// alone. `progress` is called after each class.
///
/// # Errors
/// A program can't be started, or a folder not be made.
pub fn run(
    ground: &Ground,
    classes: &[Class],
    share: f64,
    seed: u64,
    progress: &(dyn Fn(&ClassScore) + Sync),
) -> std::io::Result<Vec<ClassScore>> {
    let score_of = |class: &Class| {
        let count = ((class.count as f64 * share).ceil() as usize).max(1);
        let trials = (0..count).into_par_iter().map(|number| one(ground, class, seed, number));
        let trials = trials.collect::<std::io::Result<Vec<_>>>()?;
        let refused = || trials.iter().filter(|(trial, _)| trial.status == Some(2)).map(|(trial, _)| trial);
        let score = ClassScore {
            name: class.name,
            wrong_result: class.wrong_result,
            tried: count,
            results: trials.iter().filter(|(trial, _)| trial.status == Some(0)).count(),
            refused: refused().count(),
            slowest_refusal: refused().map(|trial| trial.time).max().unwrap_or_default(),
            largest_refusal_bytes: refused().map(|trial| trial.peak_bytes).max().unwrap_or_default(),
            failures: trials.iter().filter_map(|(_, failure)| failure.clone()).collect(),
        };
        progress(&score);
        Ok(score)
    };
    classes.iter().map(score_of).collect()
}

fn one(
    ground: &Ground,
    class: &Class,
    seed: u64,
    number: usize,
) -> std::io::Result<(Trial, Option<Failure>)> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    // Each class has a stream of its own: classes that are added change no other.
    let name = class.name.bytes().fold(0_u64, |sum, byte| sum.wrapping_mul(31).wrapping_add(byte.into()));
    random.set_stream(name.wrapping_add((number as u64) << 40));
    let case = (class.make)(ground, &mut random);
    let run = ground.run(case.good);
    let spoiled = |name: &String| case.files.iter().any(|(spoiled, _)| spoiled == name);
    let good =
        run.files.iter().filter(|name| !spoiled(name)).map(|name| (name.clone(), ground.file(name).to_vec()));
    let trial = Trial::run(ground.phiw(), good.chain(case.files.iter().cloned()), &case.words, &case.shell)?;
    let judgement = trial.judge(&case, run);
    let failure =
        (judgement != Judgement::Held).then(|| Failure { number, story: case.story.clone(), judgement });
    Ok((trial, failure))
}
