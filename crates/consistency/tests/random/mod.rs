//! Random bodies and random data.

use phiw_consistency::{PARAMETERS_PER_BODY, Problem};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub struct Random(ChaCha8Rng);

impl Random {
    pub fn new(seed: u64) -> Self {
        Random(ChaCha8Rng::seed_from_u64(seed))
    }

    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.0.random_range(low..high)
    }

    /// A body of eight points: possible by definition.
    pub fn body(&mut self, mass: f64, size: f64) -> [f64; PARAMETERS_PER_BODY] {
        let mut body = [0.0; PARAMETERS_PER_BODY];
        for _ in 0..8 {
            let m = mass / 8.0 * self.uniform(0.3, 1.7);
            let [x, y, z] = [0; 3].map(|_: i32| self.uniform(-size, size));
            let own = [
                m,
                m * x,
                m * y,
                m * z,
                m * (y * y + z * z),
                -m * x * y,
                m * (x * x + z * z),
                -m * x * z,
                -m * y * z,
                m * (x * x + y * y),
            ];
            body.iter_mut().zip(own).for_each(|(sum, value)| *sum += value);
        }
        body
    }

    pub fn matrix(&mut self, rows: usize, columns: usize) -> Vec<f64> {
        (0..rows * columns).map(|_| self.uniform(-1.0, 1.0)).collect()
    }
}

/// A matrix times a vector.
pub fn product(matrix: &[f64], x: &[f64]) -> Vec<f64> {
    matrix.chunks_exact(x.len().max(1)).map(|row| row.iter().zip(x).map(|(a, b)| a * b).sum()).collect()
}

/// Priors, and true parameters that differ from them, friction last.
pub fn robot(
    random: &mut Random,
    bodies: usize,
    extras: usize,
) -> (Vec<[f64; PARAMETERS_PER_BODY]>, Vec<f64>) {
    let mut priors = Vec::new();
    let mut truth = Vec::new();
    for _ in 0..bodies {
        let mass = random.uniform(0.5, 20.0);
        let size = random.uniform(0.05, 0.4);
        priors.push(random.body(mass, size));
        truth.extend(random.body(mass, size));
    }
    truth.extend((0..extras).map(|_| random.uniform(0.1, 3.0)));
    (priors, truth)
}

/// Data of these rows' count that a model with `truth` gives, with noise of one.
pub fn data(random: &mut Random, truth: &[f64], rows: usize, scale: f64) -> (Vec<f64>, Vec<f64>) {
    let matrix: Vec<f64> = random.matrix(rows, truth.len()).iter().map(|value| scale * value).collect();
    let target = product(&matrix, truth).iter().map(|value| value + random.uniform(-1.7, 1.7)).collect();
    (matrix, target)
}

/// A problem whose extras are not negative.
pub fn problem(priors: &[[f64; PARAMETERS_PER_BODY]], extras: usize, data: &(Vec<f64>, Vec<f64>)) -> Problem {
    let problem = Problem::new(priors, extras).unwrap().with_data(&data.0, &data.1).unwrap();
    (0..extras).fold(problem, |problem, extra| problem.with_bounds(extra, 0.0, f64::INFINITY).unwrap())
}
