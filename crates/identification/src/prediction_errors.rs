//! How far predictions are from what was measured, and how often their band holds it.

use crate::Prediction;

/// Standard deviations to each side of a prediction that 95 % of a normal distribution lie in.
pub const BAND_95: f64 = 1.959_964;

/// Sums over the predictions that count, by torque.
#[derive(Clone, Debug, PartialEq)]
pub struct PredictionErrors {
    torques: Vec<Sums>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Sums {
    count: u64,
    error_squares: f64,
    torque_squares: f64,
    variances: f64,
    within: u64,
}

impl PredictionErrors {
    /// Nothing summed yet, of so many torques.
    pub fn new(torques: usize) -> Self {
        PredictionErrors { torques: vec![Sums::default(); torques] }
    }

    /// Takes a prediction whose standard deviations are `std` \[N·m, N\]; a torque whose joint stands still
    /// does not count.
    pub fn push(&mut self, prediction: &Prediction<'_>, std: &[f64]) {
        for (row, (sums, std)) in self.torques.iter_mut().zip(std).enumerate() {
            if prediction.counts(row) {
                let error = prediction.residual(row);
                sums.count += 1;
                sums.error_squares += error * error;
                sums.torque_squares += prediction.measured[row].powi(2);
                sums.variances += std * std;
                sums.within += u64::from(error.abs() <= BAND_95 * std);
            }
        }
    }

    /// The sums of both, which are of the same torques.
    pub fn merged(mut self, other: &Self) -> Self {
        for (own, other) in self.torques.iter_mut().zip(&other.torques) {
            own.count += other.count;
            own.error_squares += other.error_squares;
            own.torque_squares += other.torque_squares;
            own.variances += other.variances;
            own.within += other.within;
        }
        self
    }

    /// Predictions of a torque that count.
    pub fn count(&self, row: usize) -> u64 {
        self.torques[row].count
    }

    /// RMSE of a torque \[N·m, N\]; not a number where none counts.
    pub fn rmse(&self, row: usize) -> f64 {
        root_mean(self.torques[row].error_squares, self.torques[row].count)
    }

    /// RMS of a measured torque \[N·m, N\].
    pub fn rms_torque(&self, row: usize) -> f64 {
        root_mean(self.torques[row].torque_squares, self.torques[row].count)
    }

    /// RMS of a torque's standard deviation \[N·m, N\].
    pub fn rms_std(&self, row: usize) -> f64 {
        root_mean(self.torques[row].variances, self.torques[row].count)
    }

    /// Share of a torque's measurements that lie inside its 95 % band.
    pub fn within_band(&self, row: usize) -> f64 {
        self.torques[row].within as f64 / self.torques[row].count as f64
    }

    /// RMS of the error over RMS of the torque, all torques pooled.
    pub fn relative(&self) -> f64 {
        let sum = |of: fn(&Sums) -> f64| self.torques.iter().map(of).sum::<f64>();
        (sum(|sums| sums.error_squares) / sum(|sums| sums.torque_squares)).sqrt()
    }

    /// Share of all measurements that lie inside their 95 % bands.
    pub fn within_bands(&self) -> f64 {
        let sum = |of: fn(&Sums) -> u64| self.torques.iter().map(of).sum::<u64>() as f64;
        sum(|sums| sums.within) / sum(|sums| sums.count)
    }
}

fn root_mean(squares: f64, count: u64) -> f64 {
    (squares / count as f64).sqrt()
}
