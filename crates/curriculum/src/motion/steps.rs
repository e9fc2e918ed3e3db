//! Whether the positions of a motion go from row to row as its velocities say.
//!
//! A check of [`Motion`], which asks for it when it is read from a log: the two files name each other because
//! they are one type, and stand apart for length.

use crate::CurriculumError;
use crate::motion::Motion;

/// How far the step from one row's position to the next may be from the velocities that are stated beside
/// them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepTolerance {
    /// A jump: how much further a joint may go between two rows than the stated velocities make it go \[rad,
    /// m\]. It is there for rounded positions alone: all embedded motions, retargeted onto
    /// `models/upper_body18.urdf` with either kind of derivatives, need 1e-15, and 5e-5 if the bend of the
    /// velocities' curve is left out (`phiw retarget`, measured in its files).
    pub jump: f64,
    /// How much faster a step may be than the joint's limit, or than the velocities stated beside it where
    /// these exceed the limit: a share of them. At a thousand rows a second even a small jump is that fast.
    pub speed_margin: f64,
}

impl Default for StepTolerance {
    fn default() -> Self {
        StepTolerance { jump: 0.005, speed_margin: 0.5 }
    }
}

impl Motion {
    /// Checks each step from one row's positions to the next: its mean velocity must lie between the two that
    /// are stated there, give or take what the bend of the velocities' curve adds. `joints` are the joints'
    /// names and `speed_limits` their limits \[rad/s, m/s\]; a joint beyond their end has none.
    ///
    /// # Errors
    /// [`CurriculumError::Motion`] with the lines, the joint and the values of the first step that does not.
    pub fn check_steps(
        &self,
        joints: &[String],
        speed_limits: &[f64],
        tolerance: &StepTolerance,
    ) -> Result<(), CurriculumError> {
        for row in 0..self.samples() - 1 {
            for (joint, name) in joints.iter().enumerate() {
                let [from, to] = [row, row + 1].map(|row| self.sample(row)[0][joint]);
                let speed = (to - from) / self.period_s();
                let [low, high] = self.stated_speeds(row, joint);
                let limit = speed_limits.get(joint).copied().unwrap_or(f64::INFINITY);
                let fastest = limit.max(low.abs()).max(high.abs());
                let jumps = (speed - high).max(low - speed) * self.period_s() > tolerance.jump;
                if jumps || speed.abs() > (1.0 + tolerance.speed_margin) * fastest {
                    return Err(CurriculumError::Motion {
                        name: self.name.clone(),
                        // The header is the first line.
                        problem: format!(
                            "q.{name} goes from {from:.4} to {to:.4} between lines {} and {} (t = {:.3} s), which is {speed:.3} rad/s or m/s, \
                             but qd.{name} states {low:.3} to {high:.3} there: the robot would jump; mend the positions or leave the motion out",
                            row + 2,
                            row + 3,
                            row as f64 * self.period_s(),
                        ),
                    });
                }
            }
        }
        Ok(())
    }

    /// The slowest and the fastest mean velocity that a joint may have between this row and the next \[rad/s,
    /// m/s\]. The mean of a smooth curve leaves its ends by a twelfth of its second difference; the noise of
    /// this difference takes it to an eighth.
    fn stated_speeds(&self, row: usize, joint: usize) -> [f64; 2] {
        let stated = |row: usize| self.sample(row)[1][joint];
        let second = |row: usize| (stated(row - 1) - 2.0 * stated(row) + stated(row + 1)).abs();
        let inner = 1..self.samples() - 1;
        let bend = [row, row + 1].into_iter().filter(|row| inner.contains(row)).map(second);
        let bend = bend.fold(0.0, f64::max) / 8.0;
        let (here, next) = (stated(row), stated(row + 1));
        [here.min(next) - bend, here.max(next) + bend]
    }
}
