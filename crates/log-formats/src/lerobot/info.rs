//! `meta/info.json`: rate, and what the entries of a feature are called.

use serde_json::Value;

/// What a dataset says of itself.
#[derive(Debug, Default)]
pub(crate) struct Info {
    /// Frames in a second.
    pub fps: Option<f64>,
    /// Frames in all.
    pub frames: Option<u64>,
    features: Value,
}

impl Info {
    /// # Errors
    /// It is no JSON.
    pub fn parse(text: &str) -> Result<Self, String> {
        let value: Value = serde_json::from_str(text).map_err(|error| error.to_string())?;
        Ok(Info {
            fps: value["fps"].as_f64().filter(|fps| *fps > 0.0),
            frames: value["total_frames"].as_u64(),
            features: value["features"].clone(),
        })
    }

    /// The names of a feature's entries, if there are as many.
    pub fn names(&self, feature: &str, width: usize) -> Option<Vec<String>> {
        let names = texts(&self.features[feature]["names"])?;
        (names.len() == width).then_some(names)
    }
}

/// A list of names, or the only such list in a table (`{"motors": […]}`).
fn texts(value: &Value) -> Option<Vec<String>> {
    match value {
        Value::Array(entries) => entries.iter().map(|entry| entry.as_str().map(str::to_owned)).collect(),
        Value::Object(table) if table.len() == 1 => texts(table.values().next()?),
        _ => None,
    }
}

/// What an entry of a feature is in our own logs.
pub(crate) fn signal(feature: &str, name: &str) -> Option<String> {
    let of_feature = match feature {
        "observation.state" => "q",
        "observation.velocity" => "qd",
        "observation.effort" | "observation.torque" => "tau",
        "action" => "qref",
        _ => return None,
    };
    let (joint, of_name) = match name.rsplit_once('.') {
        Some((joint, "pos" | "position")) => (joint, None),
        Some((joint, "vel" | "velocity")) => (joint, Some("qd")),
        Some((joint, "effort" | "torque" | "tau")) => (joint, Some("tau")),
        _ => (name, None),
    };
    match (feature, of_name) {
        (_, None) => Some(format!("{of_feature}.{joint}")),
        ("observation.state", Some(signal)) => Some(format!("{signal}.{joint}")),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_in_either_form() {
        let names = |names: &str| {
            let text = format!("{{\"fps\": 50, \"features\": {{\"action\": {{\"names\": {names}}}}}}}");
            Info::parse(&text).unwrap().names("action", 2)
        };
        let expected = Some(vec!["a".to_owned(), "b".to_owned()]);
        assert_eq!(names("[\"a\", \"b\"]"), expected);
        assert_eq!(names("{\"motors\": [\"a\", \"b\"]}"), expected);
        assert_eq!(names("[\"a\"]"), None);
        assert_eq!(names("null"), None);
    }

    #[test]
    fn entries_are_signals() {
        let check =
            |feature, name, expected: Option<&str>| assert_eq!(signal(feature, name).as_deref(), expected);
        check("observation.state", "elbow.pos", Some("q.elbow"));
        check("observation.state", "elbow", Some("q.elbow"));
        check("observation.state", "elbow.effort", Some("tau.elbow"));
        check("observation.effort", "elbow", Some("tau.elbow"));
        check("action", "elbow.pos", Some("qref.elbow"));
        check("action", "elbow.vel", None);
        check("observation.images.top", "height", None);
    }
}
