//! Random draws that are the same on every machine for the same seed.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// What a stream of random numbers is for. Each use has its own, so that a case without its secret keeps its
/// motion and noise.
#[derive(Clone, Copy)]
pub enum Stream {
    /// Friction, rotors, sampling.
    Plant,
    /// Trajectories.
    Motion,
    /// Which joints, which form, which size.
    Secret,
    /// Noise of the sensors.
    Sensors,
    /// What is particular about a situation.
    Situation,
}

/// A seeded generator with the draws that cases need.
pub struct CaseRng(ChaCha8Rng);

impl CaseRng {
    /// The numbers of one use, one case and one attempt at it.
    pub fn new(seed: u64, attempt: u64, stream: Stream) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(attempt * 16 + stream as u64);
        CaseRng(generator)
    }

    /// Uniform between two bounds.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// Uniform in the logarithm.
    pub fn log_uniform(&mut self, low: f64, high: f64) -> f64 {
        self.uniform(low.ln(), high.ln()).exp()
    }

    /// Standard normal.
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// An index below `count`.
    pub fn index(&mut self, count: usize) -> usize {
        self.0.random_range(0..count)
    }

    /// One of the choices.
    pub fn pick<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.index(choices.len())]
    }

    /// True with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.0.random::<f64>() < probability
    }

    /// −1 or 1.
    pub fn sign(&mut self) -> f64 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }
}
