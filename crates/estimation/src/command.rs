//! What the controller commanded, as far as a log tells: its torques without the errors of their sensors.

use crate::MotionLog;
use crate::motion_log::Asked;
use phiw_dynamics::dense::Cholesky;

/// Coefficients of a controller: its model's torque, position and velocity gains.
const TERMS: usize = 3;
/// Share of the torque limit from which on a command may have been clipped.
const NEAR_LIMIT: f64 = 0.9;
/// RMS of what a controller leaves of a torque, over the torque's, below which it is rounding.
const EXACT: f64 = 1e-7;

impl MotionLog {
    /// The commands, `[row × joint]`: those that were written down, or what the reference tells of them, or
    /// else the log's own torques.
    ///
    /// From a reference: of all torques that a controller of the form (13) could have given, a
    /// share of its model's torque and a PD on the reference, those nearest to the log's. What the log's
    /// torques have beside is not of the controller. `limits` are those of the torques \[N·m, N\], at
    /// which commands are clipped.
    ///
    /// The three coefficients of each joint are fitted to the log, since gains are seldom known.
    pub fn commands(&self, limits: &[f64]) -> Vec<f64> {
        if self.command.len() == self.tau.len() {
            return self.command.clone();
        }
        let mut command = self.tau.clone();
        let Some(asked) = self.asked.as_ref().filter(|asked| asked.fits(self)) else { return command };
        for (joint, &limit) in limits.iter().enumerate().take(self.joints) {
            let limit = if limit > 0.0 { limit } else { f64::INFINITY };
            self.fit_controller(asked, joint, limit, &mut command);
        }
        command
    }

    fn fit_controller(&self, asked: &Asked, joint: usize, limit: f64, command: &mut [f64]) {
        let terms = |row: usize| {
            let at = row * self.joints + joint;
            [asked.torque[at], asked.q[at] - self.q[at], asked.qd[at] - self.qd[at]]
        };
        let (mut gram, mut right) = ([[0.0; TERMS]; TERMS], [0.0; TERMS]);
        for row in 0..self.rows() {
            let tau = self.tau[row * self.joints + joint];
            if tau.abs() > NEAR_LIMIT * limit {
                continue;
            }
            let terms = terms(row);
            for (a, left) in terms.iter().enumerate() {
                right[a] += left * tau;
                terms.iter().enumerate().for_each(|(b, other)| gram[a][b] += left * other);
            }
        }
        let scale: [f64; TERMS] = std::array::from_fn(|term| gram[term][term].sqrt());
        if scale.contains(&0.0) {
            return;
        }
        let entry = |a: usize, b: usize| {
            gram[a][b] / (scale[a] * scale[b]) + if a == b { f64::EPSILON.sqrt() * 1e-4 } else { 0.0 }
        };
        let Some(factor) = Cholesky::of(TERMS, entry) else { return };
        let mut gains: [f64; TERMS] = std::array::from_fn(|term| right[term] / scale[term]);
        factor.solve_lower(&mut gains);
        factor.solve_upper(&mut gains);
        let (mut left, mut all) = (0.0, 0.0);
        let own: Vec<f64> = (0..self.rows())
            .map(|row| {
                let parts = terms(row).into_iter().zip(gains).zip(scale);
                let torque = parts.map(|((term, gain), scale)| gain * term / scale).sum::<f64>();
                let torque = torque.clamp(-limit, limit);
                let tau = self.tau[row * self.joints + joint];
                left += (tau - torque).powi(2);
                all += tau * tau;
                torque
            })
            .collect();
        if left > EXACT * EXACT * all {
            own.into_iter().enumerate().for_each(|(row, torque)| command[row * self.joints + joint] = torque);
        }
    }
}

impl Asked {
    fn fits(&self, log: &MotionLog) -> bool {
        [&self.q, &self.qd, &self.torque].iter().all(|signal| signal.len() == log.q.len())
    }
}
