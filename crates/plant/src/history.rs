//! What the plant truly did, at every boundary between integration steps.

/// A run's truth, which no sensor sees. Arrays are row-major, `[row × joints]`; a row is a boundary between
/// two steps, and what is constant over a step stands in the row of its beginning.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct History {
    /// Number of joints.
    pub joints: usize,
    /// Time of the first row, since the motion's start \[s\]; negative, as the robot settles first.
    pub start_s: f64,
    /// Integration step \[s\].
    pub step_s: f64,
    /// Angles of the links \[rad, m\].
    pub link_angle: Vec<f64>,
    /// Speeds of the links \[rad/s, m/s\].
    pub link_speed: Vec<f64>,
    /// Angles of the drives: apart from the links' behind a flexible transmission.
    pub drive_angle: Vec<f64>,
    /// Speeds of the drives.
    pub drive_speed: Vec<f64>,
    /// Torque that the controller commanded for the step \[N·m, N\].
    pub command: Vec<f64>,
    /// Torque that they did deliver, noise included.
    pub delivered: Vec<f64>,
    /// Torque that the rigid bodies (and rotors that turn with the joints) got during the step.
    pub joint_torque: Vec<f64>,
    /// Configuration of a floating base, 7 numbers a row; empty on a fixed base.
    pub base: Vec<f64>,
    /// Velocity of a floating base in its own frame, linear then angular, 6 numbers a row; empty on a fixed
    /// base.
    pub base_velocity: Vec<f64>,
    /// Wrench at the base at the beginning of the step, 6 numbers a row (see
    /// [`base_wrench`](phiw_dynamics::DynamicsBackend::base_wrench)).
    pub wrench: Vec<f64>,
    /// The same of each foot (see [`foot_wrench`](phiw_dynamics::SimulationBackend::foot_wrench)), 6 numbers
    /// a foot, one foot after the other in a row; empty if the backend does not measure them.
    pub foot_wrenches: Vec<f64>,
}

impl History {
    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.command.len().checked_div(self.joints).unwrap_or(0)
    }

    /// Time at which the last step ended, since the motion's start \[s\].
    pub fn end_s(&self) -> f64 {
        self.start_s + self.step_s * self.steps() as f64
    }

    /// Angle of a joint's drive at a time: cubic between boundaries.
    pub fn drive_angle_at(&self, joint: usize, t_s: f64) -> f64 {
        let (row, x) = self.place(t_s);
        let at = |values: &[f64], row: usize| values[row * self.joints + joint];
        let (q0, q1) = (at(&self.drive_angle, row), at(&self.drive_angle, row + 1));
        let (v0, v1) = (at(&self.drive_speed, row), at(&self.drive_speed, row + 1));
        let (h00, h10) = ((1.0 + 2.0 * x) * (1.0 - x) * (1.0 - x), x * (1.0 - x) * (1.0 - x));
        let (h01, h11) = (x * x * (3.0 - 2.0 * x), x * x * (x - 1.0));
        h00 * q0 + h01 * q1 + self.step_s * (h10 * v0 + h11 * v1)
    }

    /// Speed of a joint's drive at a time: linear between boundaries.
    pub fn drive_speed_at(&self, joint: usize, t_s: f64) -> f64 {
        let (row, x) = self.place(t_s);
        let [v0, v1] = [row, row + 1].map(|row| self.drive_speed[row * self.joints + joint]);
        v0 + x * (v1 - v0)
    }

    /// Mean of what is constant over steps, from `from_s` to `to_s`; its value at the time where both are the
    /// same. `values` has `width` numbers a row, of which `column` is meant.
    pub fn mean(&self, values: &[f64], width: usize, column: usize, from_s: f64, to_s: f64) -> f64 {
        let place = |t_s: f64| ((t_s - self.start_s) / self.step_s).clamp(0.0, self.steps() as f64);
        let (from, to) = (place(from_s), place(to_s));
        let last = self.steps().saturating_sub(1);
        let value = |row: usize| values[row.min(last) * width + column];
        if to - from < 1e-9 {
            // A hair's breadth on, so that rounding does not fall into the step before.
            return value((from + 1e-6) as usize);
        }
        let mut sum = 0.0;
        for row in from as usize..=(to as usize).min(last) {
            let overlap = (to.min(row as f64 + 1.0) - from.max(row as f64)).max(0.0);
            sum += overlap * value(row);
        }
        sum / (to - from)
    }

    /// The step that holds a time, and how far into it the time is.
    fn place(&self, t_s: f64) -> (usize, f64) {
        let place = ((t_s - self.start_s) / self.step_s).clamp(0.0, self.steps() as f64);
        let row = (place as usize).min(self.steps().saturating_sub(1));
        (row, place - row as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::History;

    #[test]
    fn means_weigh_parts_of_steps() {
        let history = History {
            joints: 1,
            start_s: -1.0,
            step_s: 0.5,
            command: vec![1.0, 2.0, 4.0, 8.0],
            ..History::default()
        };
        let mean = |from: f64, to: f64| history.mean(&history.command, 1, 0, from, to);
        assert_eq!(history.end_s(), 1.0);
        assert_eq!(mean(-1.0, 0.0), 1.5);
        assert!((mean(-0.75, 0.25) - (0.25 * 1.0 + 0.5 * 2.0 + 0.25 * 4.0)).abs() < 1e-12);
        assert_eq!(mean(0.0, 0.0), 4.0);
        // Beyond the ends there is nothing: what is there counts.
        assert_eq!(mean(0.5, 9.0), 8.0);
        assert_eq!(mean(-9.0, -0.5), 1.0);
    }

    #[test]
    fn angles_between_boundaries_follow_a_parabola_exactly() {
        let rows = 5;
        let history = History {
            joints: 1,
            start_s: 0.0,
            step_s: 0.1,
            drive_angle: (0..rows).map(|k| 0.5 * (0.1 * f64::from(k)).powi(2)).collect(),
            drive_speed: (0..rows).map(|k| 0.1 * f64::from(k)).collect(),
            command: vec![0.0; 4],
            ..History::default()
        };
        for t_s in [0.0, 0.03, 0.17, 0.399, 0.4] {
            assert!((history.drive_angle_at(0, t_s) - 0.5 * t_s * t_s).abs() < 1e-12);
            assert!((history.drive_speed_at(0, t_s) - t_s).abs() < 1e-12);
        }
    }
}
