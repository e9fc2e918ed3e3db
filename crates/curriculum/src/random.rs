//! Random numbers of a run, from its seed.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What a stream of random numbers is for. Each iteration has its own, so that nothing has to be remembered.
#[derive(Clone, Copy)]
pub(crate) enum Purpose {
    Selection = 1,
    Experiment = 2,
}

/// The stream of an iteration for a purpose.
pub(crate) fn random(seed: u64, iteration: usize, purpose: Purpose) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(16 * (iteration as u64 + 1) + purpose as u64);
    rng
}
