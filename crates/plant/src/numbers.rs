//! An effect's numbers, by name and by what they must be.

use crate::PlantError;
use crate::error::check_value;

/// Numbers with their names.
pub(crate) type Named = Vec<(&'static str, f64)>;

/// What an effect is given.
#[derive(Default)]
pub(crate) struct Numbers {
    /// Finite.
    pub(crate) free: Named,
    /// Finite and ≥ 0.
    pub(crate) not_negative: Named,
    /// Finite and > 0.
    pub(crate) positive: Named,
}

impl Numbers {
    /// An error that names the first number that is not what it must be.
    pub(crate) fn check(self, kind: &str) -> Result<(), PlantError> {
        let name = |name: &'static str| move || format!("{name} of {kind}");
        for (what, value) in self.free {
            check_value(name(what), value, "a finite number", |_| true)?;
        }
        for (what, value) in self.not_negative {
            check_value(name(what), value, "≥ 0", |value| value >= 0.0)?;
        }
        for (what, value) in self.positive {
            check_value(name(what), value, "> 0", |value| value > 0.0)?;
        }
        Ok(())
    }
}
