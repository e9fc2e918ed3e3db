//! Thresholds from which on an artefact of a sensor, a drive or a logger is reported.

use crate::alignment::Alignment;

/// From where on something is worth saying. What the real logs of the tests show lies below each of these
/// unless it is truly there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CheckSettings {
    /// A lag over its standard error, from which on it is one, however little of the velocity's power it
    /// costs: a slow joint's velocity is as late as that of a quick one, and steps of a coarse encoder hide
    /// it. The error is that of white noise, and others are told worse. `cargo xtask undeclared --suite
    /// wide_right --situation differenced_velocity` (and `late_velocity`) holds it against late velocities.
    pub lag_significance: f64,
    /// The shortest lag that is one \[s\]: simulators write velocities that are late by half of their step,
    /// which is no error of a torque; 1 ms is one of 2 % at 3 Hz.
    pub least_lag: f64,
    /// Share of the rows whose velocity is the position's difference to the row before, from which on it is
    /// that: half a row late, and nothing that the positions do not say.
    pub differenced: f64,
    /// Distance of a velocity's scale from 1; gear ratios and radii are known better than this.
    pub scale_error: f64,
    /// Share of a velocity's power that may be unexplained for its scale to be judged.
    pub scale_unexplained: f64,
    /// Share of time in which a velocity or a torque is exactly 0; zero crossings alone are below it.
    pub zero_share: f64,
    /// Root mean square of motion while a velocity is 0, as a share of that of all.
    pub motion_at_zero: f64,
    /// Smallest torque besides 0 in steps of the torque: 1 without a dead band, and 2 where one step is never
    /// met.
    pub steps_across_zero: f64,
    /// The same as a share of the torque's root mean square: values that come in no steps lie as near to 0 as
    /// there are rows.
    pub dead_band: f64,
    /// Steps of a torque over its root mean square: at 0.1 they add noise of 3 %.
    pub torque_step: f64,
    /// Steps of a position over its travel: at 1/500 a turn has 9 bits.
    pub position_step: f64,
    /// Length of a stretch of one value in mean lengths of such stretches: more than torque in steps brings
    /// about.
    pub still_runs: f64,
    /// Share of the rows near the top that are at exactly the top.
    pub flat_share: f64,
    /// Rows at exactly the top.
    pub flat_rows: u64,
    /// How often a torque of one sign must come near 0 to be taken for a magnitude; gravity alone may keep
    /// one sign, but does not bounce.
    pub touches: u64,
    /// Jitter of the stamps as a share of the period.
    pub jitter: f64,
    /// Slowest sampling \[Hz\]: five samples for a motion of 4 Hz.
    pub slowest_hz: f64,
    /// Travel in standard deviations of the position's noise below which a joint stands still.
    pub travel_to_noise: f64,
    /// Travel below which a joint stands still \[rad, m\].
    pub least_travel: f64,
}

impl Default for CheckSettings {
    fn default() -> Self {
        CheckSettings {
            lag_significance: 8.0,
            least_lag: 8e-4,
            differenced: 0.95,
            scale_error: 0.05,
            scale_unexplained: 0.05,
            zero_share: 0.02,
            motion_at_zero: 0.03,
            steps_across_zero: 3.0,
            dead_band: 0.01,
            torque_step: 0.1,
            position_step: 0.002,
            still_runs: 20.0,
            flat_share: 0.5,
            flat_rows: 20,
            touches: 3,
            jitter: 0.3,
            slowest_hz: 20.0,
            travel_to_noise: 20.0,
            least_travel: 1e-3,
        }
    }
}

impl CheckSettings {
    /// Whether a velocity is not the positions' derivative.
    pub fn contradicts(&self, alignment: &Alignment) -> bool {
        self.is_late(alignment) || self.is_scaled(alignment) || self.has_dead_band(alignment)
    }

    pub(crate) fn is_late(&self, alignment: &Alignment) -> bool {
        let computed = alignment.differenced > self.differenced;
        let certain = alignment.lag_significance() > self.lag_significance;
        (certain || computed) && alignment.lag.abs() > self.least_lag
    }

    pub(crate) fn is_scaled(&self, alignment: &Alignment) -> bool {
        let judged = alignment.unexplained_at_lag < self.scale_unexplained;
        judged && (alignment.scale - 1.0).abs() > self.scale_error
    }

    pub(crate) fn has_dead_band(&self, alignment: &Alignment) -> bool {
        alignment.zero_share > self.zero_share && alignment.motion_at_zero > self.motion_at_zero
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On a slow joint a lag costs little; its velocity was used, and a delay was named that was none. The
    /// same where the steps of a coarse encoder are more than what the lag costs.
    #[test]
    fn a_lag_counts_by_its_error_and_not_by_what_it_costs() {
        let alignment = |unexplained: f64, unexplained_at_lag: f64| Alignment {
            lag: 0.03,
            stretches: 2000.0,
            scale: 1.0,
            unexplained,
            unexplained_at_lag,
            zero_share: 0.0,
            motion_at_zero: 0.0,
            resolution: 0.01,
            differenced: 0.0,
        };
        let settings = CheckSettings::default();
        assert!(settings.is_late(&alignment(0.02, 0.001)));
        assert!(settings.is_late(&alignment(0.001, 0.00001)));
        assert!(settings.is_late(&alignment(0.0088, 0.0083)));
        assert!(!settings.is_late(&alignment(0.0085, 0.0083)));
        assert!(!settings.is_late(&Alignment { lag: 5e-4, ..alignment(0.02, 0.001) }));
    }
}
