//! Numbers that may be infinite, such as cond(Φ) of a motion that leaves something undetermined: JSON has
//! `null` for them.

use serde::{Deserialize, Deserializer};

/// A number; infinity for `null`.
pub fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::INFINITY))
}

/// The same of several.
pub fn numbers<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    let all: Vec<Option<f64>> = Vec::deserialize(deserializer)?;
    Ok(all.into_iter().map(|number| number.unwrap_or(f64::INFINITY)).collect())
}

#[cfg(test)]
mod tests {
    use serde::{Deserialize, Serialize};

    #[derive(Debug, Deserialize, PartialEq, Serialize)]
    struct Conditions {
        #[serde(deserialize_with = "super::number")]
        one: f64,
        #[serde(deserialize_with = "super::numbers")]
        all: Vec<f64>,
    }

    /// Runs on a robot with a motion that leaves something undetermined were written, and could not be read.
    #[test]
    fn what_is_written_of_an_infinite_number_is_read_again() {
        let written = Conditions { one: f64::INFINITY, all: vec![3.0, f64::INFINITY] };
        let text = serde_json::to_string(&written).unwrap();
        assert_eq!(serde_json::from_str::<Conditions>(&text).unwrap(), written, "{text}");
    }
}
