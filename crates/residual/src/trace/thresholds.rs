//! The numbers that decide what has a name, what does harm, and when a residual is looked at as structure.

use thiserror::Error;

/// The numbers that decide what has a name, what does harm, and when a residual is looked at as structure.
///
/// Shares are of squares unless they say RMS. Each can be held against right models and missing effects by
/// `cargo xtask undeclared --suite wide_right,wide_effects --seeds dev --threshold NAME=VALUE,VALUE…`, which
/// prints for every value what is named falsely, what is called sufficient, and how many effects are named.
///
/// What a probe must foretell (`probe/`), how much error parameters may make (`remaining.rs`), when an effect
/// is a rival (`order.rs`), when a drive's limit is one (`limits.rs`) and what a parameter costs that nothing
/// tells (`selection/criterion.rs`) stand as constants where they are used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// Probability of naming anything on a right model, for all candidates of a run together; that at which
    /// one refinement is in the model, if it were not there; and that at which an end is taken from another
    /// start, if the two were as good.
    pub false_name_probability: f64,
    /// Probability that a residual of noise, of any torque, seems to follow any signal. At that of a name, a
    /// spring that is smaller than coloured noise is not seen.
    pub false_structure_probability: f64,
    /// Share of a torque's residual, where training motion is foretold from its other parts, that an effect
    /// on it must take away to have a name.
    pub least_share: f64,
    /// The same for an effect whose torque follows the same signal of the same joint as a simpler one of the
    /// model.
    pub least_share_of_kin: f64,
    /// Share of what is already explained of the same torque (of what the other effects took; for a form of
    /// something simpler, of the simpler's squares) that an effect must take, times what is left beyond noise
    /// without it over what is left with it: one that leaves noise only may be small. How exactly a sign
    /// turns is no effect of its own.
    pub least_of_others: f64,
    /// RMS of what an effect takes over the RMS of its torque, at least, to have a name. Half of it is as
    /// good as nothing ([`Self::negligible_share`]), also for a member of a family that has a name.
    pub least_size: f64,
    /// Share of a torque (RMS) that is seen by itself: what an effect is, beyond what others of its signal
    /// that were found could do, where the other parameters have taken up most of it, to have a name; what
    /// is left of a right model by filters and encoders at most; and what an effect must take not to be
    /// asked whether other constants of the other effects could do its work.
    pub least_visible: f64,
    /// Factor between two errors (RMS) up to which they are the same: between a residual and the noise floor,
    /// between one and what a held model left when it was identified, and between the errors on motion held
    /// out with and without an effect, in the mean of the torques or all together.
    pub same_error: f64,
    /// Correlation of a residual's samples 2.5 s apart from which on it wanders, whatever it follows: noise
    /// of up to 1 s of correlation has less than a tenth.
    pub wander: f64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Thresholds {
            false_name_probability: 0.01,
            false_structure_probability: 0.05,
            least_share: 0.2,
            least_share_of_kin: 0.75,
            least_of_others: 0.02,
            least_size: 0.01,
            least_visible: 0.03,
            same_error: 1.05,
            wander: 0.3,
        }
    }
}

/// A number that the thresholds do not have.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("there is no threshold {name:?}; there are {}", .known.join(", "))]
pub struct UnknownThreshold {
    /// What was asked for.
    pub name: String,
    /// What there is.
    pub known: Vec<&'static str>,
}

impl Thresholds {
    /// Gives a threshold another value, by its name.
    ///
    /// # Errors
    /// There is none of this name.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), UnknownThreshold> {
        let mut all = self.by_name();
        if let Some((_, threshold)) = all.iter_mut().find(|(own, _)| *own == name) {
            **threshold = value;
            return Ok(());
        }
        let known = all.into_iter().map(|(own, _)| own).collect();
        Err(UnknownThreshold { name: name.to_owned(), known })
    }

    /// A residual, or an effect, below this share of its torque (RMS) is as good as none: nothing is sought
    /// in such a residual, and it does no harm to be larger than it was. What is left of an effect of
    /// `least_size` where the other parameters have taken up a part of it is above.
    pub fn negligible_share(&self) -> f64 {
        0.5 * self.least_size
    }

    fn by_name(&mut self) -> [(&'static str, &mut f64); 9] {
        [
            ("false_name_probability", &mut self.false_name_probability),
            ("false_structure_probability", &mut self.false_structure_probability),
            ("least_share", &mut self.least_share),
            ("least_share_of_kin", &mut self.least_share_of_kin),
            ("least_of_others", &mut self.least_of_others),
            ("least_size", &mut self.least_size),
            ("least_visible", &mut self.least_visible),
            ("same_error", &mut self.same_error),
            ("wander", &mut self.wander),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::Thresholds;

    #[test]
    fn every_threshold_is_set_by_its_name() {
        let names: Vec<&str> = Thresholds::default().by_name().map(|(name, _)| name).to_vec();
        for name in names {
            let mut changed = Thresholds::default();
            changed.set(name, -1.0).unwrap();
            assert_eq!(format!("{changed:?}").matches("-1.0").count(), 1, "{name}");
            assert!(format!("{changed:?}").contains(&format!(" {name}: -1.0")), "{name}: {changed:?}");
        }
    }

    #[test]
    fn an_unknown_threshold_is_refused_with_those_that_exist() {
        let message = Thresholds::default().set("least", 1.0).unwrap_err().to_string();
        assert!(message.contains("\"least\"") && message.contains("least_share_of_kin"), "{message}");
    }
}
