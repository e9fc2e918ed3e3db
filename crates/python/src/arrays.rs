//! Numbers between numpy and the kernels.

use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A contiguous array of doubles; one that is contiguous doubles already is taken as it is.
pub struct Doubles<'py> {
    array: PyReadonlyArrayDyn<'py, f64>,
}

impl<'py> Doubles<'py> {
    /// Whatever numpy takes for numbers.
    pub fn of(values: &Bound<'py, PyAny>, what: &str) -> PyResult<Self> {
        let py = values.py();
        let options = PyDict::new(py);
        options.set_item("dtype", "float64")?;
        let array = py.import("numpy")?.getattr("ascontiguousarray")?.call((values,), Some(&options));
        let array = array
            .map_err(|error| PyValueError::new_err(format!("{what} is no array of numbers: {error}")))?;
        Ok(Doubles { array: array.cast_into::<PyArrayDyn<f64>>()?.readonly() })
    }

    /// The numbers, row by row.
    pub fn as_slice(&self) -> PyResult<&[f64]> {
        Ok(self.array.as_slice()?)
    }

    /// The array's shape.
    pub fn shape(&self) -> &[usize] {
        self.array.shape()
    }
}

/// An array that is given to Python.
pub type Array<'py> = Bound<'py, PyArrayDyn<f64>>;

/// What pickle takes: what makes a value again, and what of.
pub type Pickled<'py, T> = (Bound<'py, PyAny>, T);

/// States of a robot: one, or a batch.
pub struct States<'py> {
    numbers: Doubles<'py>,
    /// Numbers of one state.
    pub width: usize,
    /// Number of states; `None` for one that is no batch.
    pub count: Option<usize>,
}

impl<'py> States<'py> {
    /// An array of shape (width) or (N, width).
    pub fn of(values: &Bound<'py, PyAny>, what: &str, width: usize) -> PyResult<Self> {
        let numbers = Doubles::of(values, what)?;
        let count = match numbers.shape() {
            &[own] if own == width => None,
            &[count, own] if own == width => Some(count),
            shape => {
                return Err(PyValueError::new_err(format!(
                    "{what} has the shape {shape:?}, but this robot needs [{width}] for one state or [N, {width}] for N"
                )));
            }
        };
        Ok(States { numbers, width, count })
    }

    /// The numbers, state by state.
    pub fn as_slice(&self) -> PyResult<&[f64]> {
        self.numbers.as_slice()
    }
}

/// The number of states that all of `arrays` have.
pub fn same_count(arrays: &[(&str, &States<'_>)]) -> PyResult<Option<usize>> {
    let Some((first, states)) = arrays.first() else { return Ok(None) };
    for (name, other) in arrays {
        if other.count != states.count {
            let of = |count: Option<usize>| {
                count.map_or("one state".to_owned(), |count| format!("{count} states"))
            };
            return Err(PyValueError::new_err(format!(
                "{first} holds {}, but {name} holds {}: give as many of each",
                of(states.count),
                of(other.count)
            )));
        }
    }
    Ok(states.count)
}

/// Numbers as an array of this shape; they are moved, not copied.
pub fn array<'py>(py: Python<'py>, numbers: Vec<f64>, shape: &[usize]) -> PyResult<Array<'py>> {
    PyArray1::from_vec(py, numbers).reshape(shape.to_vec())
}
