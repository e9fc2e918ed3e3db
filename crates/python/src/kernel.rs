//! A kernel between numpy's arrays: inputs as they are, results into new memory or into what is given.

use crate::arrays::{Array, States, array};
use crate::batch::{Lane, over_states};
use numpy::{PyArrayMethods, PyUntypedArrayMethods};
use phiw_dynamics::DimensionError;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Runs a kernel over states without Python's lock; its results have `shape` for each state, and go into
/// `out` if that is given.
pub fn over_arrays<'py, S: Send, const K: usize>(
    py: Python<'py>,
    states: [States<'py>; K],
    (shape, out): (&[usize], Option<Array<'py>>),
    scratch: impl Fn() -> S + Send + Sync,
    kernel: impl Fn(&mut S, [&[Lane]; K], &mut [f64]) -> Result<(), DimensionError> + Send + Sync,
) -> PyResult<Array<'py>> {
    let count = states[0].count;
    let mut inputs: [(&[f64], usize); K] = [(&[], 0); K];
    for (input, states) in inputs.iter_mut().zip(&states) {
        *input = (states.as_slice()?, states.width);
    }
    let width = shape.iter().product();
    let shape: Vec<usize> = count.into_iter().chain(shape.iter().copied()).collect();
    let Some(out) = out else {
        let mut outputs = vec![0.0; count.unwrap_or(1) * width];
        py.detach(|| over_states(inputs, width, &mut outputs, scratch, kernel)).map_err(wrong_size)?;
        return array(py, outputs, &shape);
    };
    if out.shape() != shape {
        let message = format!("out has the shape {:?}, but the result has {shape:?}", out.shape());
        return Err(PyValueError::new_err(message));
    }
    let unusable = |why: String| PyValueError::new_err(format!("out cannot be written to: {why}"));
    // A slice of numbers in Fortran's order would be had, too.
    if !out.is_c_contiguous() {
        return Err(unusable("it is not contiguous in C's order".to_owned()));
    }
    let mut written = out.try_readwrite().map_err(|error| unusable(error.to_string()))?;
    let outputs = written.as_slice_mut().map_err(|error| unusable(error.to_string()))?;
    py.detach(|| over_states(inputs, width, outputs, scratch, kernel)).map_err(wrong_size)?;
    drop(written);
    Ok(out)
}

/// An array that does not fit the robot.
pub fn wrong_size(error: DimensionError) -> PyErr {
    PyValueError::new_err(error.to_string())
}
