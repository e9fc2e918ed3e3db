//! Whether what a belief leaves of the logs is noise that nobody could have foreseen.

use phiw_curriculum::CurriculumError;
use phiw_estimation::{MotionLog, Robot, RobotModel, torques_along};

/// When a residual is white. Each threshold is in standard deviations of what white noise gives, in any of
/// all torques: higher asks for fewer traces and misses small effects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WhitenessSettings {
    /// How far back a residual is compared with itself \[s\]. Default: 0.2, since friction, springs and their
    /// like change slower.
    pub reach_s: f64,
    /// Largest sum of the autocorrelations. Default: 4 (`chance_is_told_from_what_goes_on`, 200 seeds without
    /// a false alarm).
    pub sum: f64,
    /// Largest sum of their squares above what chance gives. Default: 6 (the same test).
    pub squares: f64,
}

impl Default for WhitenessSettings {
    fn default() -> Self {
        WhitenessSettings { reach_s: 0.2, sum: 4.0, squares: 6.0 }
    }
}

/// The torques whose residual under a belief is not white. Noise of the actuators that is new in every period
/// leaves nothing else under a right model, since the rows balance the command exactly; what the model lacks
/// depends on the motion, and goes on as the motion does. Costs a thousandth of a trace. Where the noise of a
/// real robot has a colour, all torques are named, and the trace decides.
///
/// # Errors
/// The belief or a log is not of this robot.
pub(crate) fn coloured(
    robot: &Robot,
    model: &RobotModel,
    logs: &[MotionLog],
    settings: &WhitenessSettings,
) -> Result<Vec<usize>, CurriculumError> {
    let joints = robot.tree().joint_count();
    let mut correlations: Vec<Correlations> = (0..joints).map(|_| Correlations::default()).collect();
    for log in logs {
        let lags = ((settings.reach_s / log.period_s).round() as usize).max(1);
        let residual = residual(robot, model, log)?;
        for (joint, correlations) in correlations.iter_mut().enumerate() {
            let own: Vec<f64> = residual.iter().skip(joint).step_by(joints).copied().collect();
            correlations.add(&own, lags);
        }
    }
    Ok((0..joints).filter(|&joint| !correlations[joint].are_chance(settings)).collect())
}

/// What a belief leaves of the torques of a log: measured minus modelled over each period, `[period × joint]`
/// \[N·m, N\].
///
/// # Errors
/// The belief or the log is not of this robot.
pub(crate) fn residual(
    robot: &Robot,
    model: &RobotModel,
    log: &MotionLog,
) -> Result<Vec<f64>, CurriculumError> {
    let mut block = log.over_periods();
    let torques = torques_along(&robot.design_of(model)?, &model.parameters(robot)?, &mut block, 1)?;
    Ok(block.tau.iter().zip(&torques).map(|(measured, modelled)| measured - modelled).collect())
}

/// Sums of products of a residual with itself at a distance: `[0]` with itself, then one row later, ….
#[derive(Default)]
struct Correlations {
    products: Vec<f64>,
    rows: usize,
}

impl Correlations {
    fn add(&mut self, residual: &[f64], lags: usize) {
        self.products.resize(self.products.len().max(lags + 1), 0.0);
        self.rows += residual.len();
        for (lag, sum) in self.products.iter_mut().enumerate().take(lags + 1) {
            let later = residual.get(lag..).unwrap_or_default();
            *sum += residual.iter().zip(later).map(|(one, other)| one * other).sum::<f64>();
        }
    }

    /// Under white noise each autocorrelation is normal with the variance 1/rows.
    fn are_chance(&self, settings: &WhitenessSettings) -> bool {
        let [whole, products @ ..] = self.products.as_slice() else { return true };
        if *whole == 0.0 {
            return true;
        }
        let (rows, lags) = (self.rows as f64, products.len() as f64);
        let sum: f64 = products.iter().map(|product| product / whole).sum();
        let squares: f64 = products.iter().map(|product| (product / whole).powi(2)).sum();
        let sum = sum * (rows / lags).sqrt();
        let squares = (rows * squares - lags) / (2.0 * lags).sqrt();
        sum.abs() <= settings.sum && squares <= settings.squares
    }
}

#[cfg(test)]
mod tests {
    use super::{Correlations, WhitenessSettings};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Noise of size 1, and a part of it that goes on: friction of a slow motion, or a ripple of 6 Hz.
    fn residual(seed: u64, square: f64, ripple: f64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let value = |row: usize| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            let t_s = 0.01 * row as f64;
            noise + square * (2.0 * t_s).sin().signum() + ripple * (38.0 * t_s).sin()
        };
        (0..2000).map(value).collect()
    }

    #[test]
    fn chance_is_told_from_what_goes_on() {
        for seed in 0..200 {
            for (square, ripple, white) in [(0.0, 0.0, true), (0.3, 0.0, false), (0.0, 0.5, false)] {
                let mut correlations = Correlations::default();
                residual(seed, square, ripple).chunks(700).for_each(|log| correlations.add(log, 20));
                let settings = WhitenessSettings::default();
                assert_eq!(correlations.are_chance(&settings), white, "seed {seed}: {square} {ripple}");
            }
        }
    }
}
