//! The numbers that decide how a log is read.

use thiserror::Error;

/// How a log is read otherwise.
///
/// `cargo xtask conventions --setting NAME=VALUE,VALUE…` holds each number against right models whose logs
/// are changed: it prints how many changes are told, and what is said of logs that are as the URDF has them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConventionSettings {
    /// Rows for each unknown number.
    pub rows_per_unknown: f64,
    /// What must be left of some torque (RMS, a share of it) for the log to be read otherwise.
    pub least_left: f64,
    /// By how much the sum of the logarithms of what is left of the torques (RMS) must fall for each
    /// difference. A direction of gravity counts for two, units of all torques for as many as joints but one.
    pub least_gain: f64,
    /// A torque is in another unit from this factor on; below it is a gain.
    pub least_scale: f64,
    /// All torques are in another unit from this factor on; below it the URDF may have the masses wrong.
    pub least_common_scale: f64,
    /// How much the URDF's torque must be like the fitted one (cosine) for it to tell all torques' unit.
    pub least_likeness: f64,
    /// From this angle on a base is mounted otherwise; below it is not level, which is an effect.
    pub least_angle_rad: f64,
}

impl Default for ConventionSettings {
    fn default() -> Self {
        ConventionSettings {
            rows_per_unknown: 12.0,
            least_left: 0.05,
            least_gain: 1.0,
            least_scale: 2.0,
            least_common_scale: 5.0,
            least_likeness: 0.7,
            least_angle_rad: 0.35,
        }
    }
}

/// A number that the settings do not have.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("there is no setting {name:?}; there are {}", .known.join(", "))]
pub struct UnknownConventionSetting {
    /// What was asked for.
    pub name: String,
    /// What there is.
    pub known: Vec<&'static str>,
}

impl ConventionSettings {
    /// Gives a number another value, by its name.
    ///
    /// # Errors
    /// There is none of this name.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), UnknownConventionSetting> {
        let mut all = [
            ("rows_per_unknown", &mut self.rows_per_unknown),
            ("least_left", &mut self.least_left),
            ("least_gain", &mut self.least_gain),
            ("least_scale", &mut self.least_scale),
            ("least_common_scale", &mut self.least_common_scale),
            ("least_likeness", &mut self.least_likeness),
            ("least_angle_rad", &mut self.least_angle_rad),
        ];
        if let Some((_, setting)) = all.iter_mut().find(|(own, _)| *own == name) {
            **setting = value;
            return Ok(());
        }
        let known = all.into_iter().map(|(own, _)| own).collect();
        Err(UnknownConventionSetting { name: name.to_owned(), known })
    }
}

#[cfg(test)]
mod tests {
    use super::ConventionSettings;

    #[test]
    fn every_setting_is_set_by_its_name() {
        let unknown = ConventionSettings::default().set("gain", 1.0).unwrap_err();
        for name in &unknown.known {
            let mut changed = ConventionSettings::default();
            changed.set(name, -1.0).unwrap();
            assert!(format!("{changed:?}").contains(&format!(" {name}: -1.0")), "{name}: {changed:?}");
        }
        assert!(unknown.to_string().contains("least_gain"), "{unknown}");
    }
}
