//! Joints that are held, as people name them.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Joints that are held and where \[rad, m\]: from a dict, or a list of `"joint"`, `"joint=0.5"` and pairs.
pub fn hold(hold: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<(String, f64)>> {
    let Some(hold) = hold.filter(|hold| !hold.is_none()) else { return Ok(Vec::new()) };
    if let Ok(dict) = hold.cast::<PyDict>() {
        return dict.iter().map(|(joint, value)| Ok((joint.extract()?, value.extract()?))).collect();
    }
    if let Ok(text) = hold.extract::<String>() {
        return text.split(',').map(held_joint).collect();
    }
    let one = |item: Bound<'_, PyAny>| match item.extract::<String>() {
        Ok(text) => held_joint(&text),
        Err(_) => item.extract::<(String, f64)>(),
    };
    hold.try_iter()?.map(|item| one(item?)).collect()
}

fn held_joint(text: &str) -> PyResult<(String, f64)> {
    phiw::arguments::held_joint(text.trim())
        .map_err(|error| PyValueError::new_err(format!("hold {text}: {error}")))
}
