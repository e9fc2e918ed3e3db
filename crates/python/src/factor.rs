//! `phiw.Factor`: rows of [Φ f] reduced to a triangle; triangles merge.

use crate::arrays::{Array, Doubles, Pickled, array};
use phiw_regressor::RegressorError;
use phiw_regressor::factor::Factor;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The triangular factor R of rows of [Φ f]: all that least squares needs of them, in constant memory.
///
/// Factors merge with ``+`` in any order, so that logs are reduced apart, on as many machines as one likes.
///
/// Parameters
/// ----------
/// phi : array, shape (N, k)
///     Rows of Φ.
/// f : array, shape (N,)
///     What Φ·w should be.
#[pyclass(frozen, module = "phiw", name = "Factor")]
pub struct PyFactor {
    factor: Factor,
}

#[pymethods]
impl PyFactor {
    #[new]
    fn new(py: Python<'_>, phi: &Bound<'_, PyAny>, f: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (phi, f) = (Doubles::of(phi, "phi")?, Doubles::of(f, "f")?);
        let &[rows, columns] = phi.shape() else {
            return Err(PyValueError::new_err(format!(
                "phi has the shape {:?}; give it as [N, k]",
                phi.shape()
            )));
        };
        if f.shape() != [rows] {
            return Err(PyValueError::new_err(format!(
                "f has the shape {:?}, but phi has {rows} rows: give one number for each",
                f.shape()
            )));
        }
        let (phi, f) = (phi.as_slice()?, f.as_slice()?);
        let factor = py.detach(|| {
            let mut builder = phiw_regressor::factor::FactorBuilder::new(columns + 1);
            let mut row = vec![0.0; columns + 1];
            for (index, value) in f.iter().enumerate() {
                row[..columns].copy_from_slice(&phi[index * columns..][..columns]);
                row[columns] = *value;
                builder.push_row(&row).map_err(|error| match error {
                    RegressorError::NotFinite { .. } => RegressorError::NotFinite { row: index },
                    other => other,
                })?;
            }
            Ok(builder.factor())
        });
        Ok(PyFactor { factor: factor.map_err(wrong)? })
    }

    /// Number of columns of Φ.
    #[getter]
    fn parameters(&self) -> usize {
        self.factor.parameters()
    }

    /// Number of rows that the factor stands for.
    #[getter]
    fn rows(&self) -> u64 {
        self.factor.rows()
    }

    /// R, upper triangular, shape (k + 1, k + 1); its last column belongs to f.
    #[getter]
    fn r<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let size = self.factor.columns();
        let entry = |row, column| if column < row { 0.0 } else { self.factor.entry(row, column) };
        let entries = (0..size).flat_map(|row| (0..size).map(move |column| entry(row, column)));
        array(py, entries.collect(), &[size, size])
    }

    /// The factor of the rows of both.
    fn __add__(&self, other: &Bound<'_, PyFactor>) -> PyResult<PyFactor> {
        Ok(PyFactor { factor: self.factor.merge(&other.get().factor).map_err(wrong)? })
    }

    /// So that ``sum(factors)`` works, which begins with 0.
    fn __radd__(slf: &Bound<'_, Self>, other: &Bound<'_, PyAny>) -> PyResult<Py<PyFactor>> {
        match other.extract::<u64>() {
            Ok(0) => Ok(slf.clone().unbind()),
            _ => Err(PyValueError::new_err("a factor is merged with a factor")),
        }
    }

    /// The factor of some of the columns, in this order; f stays the last.
    fn select(&self, mut columns: Vec<usize>) -> PyResult<PyFactor> {
        check_columns(&columns, self.factor.parameters())?;
        columns.push(self.factor.parameters());
        Ok(PyFactor { factor: self.factor.select(&columns).map_err(wrong)? })
    }

    /// All rows times a number: one over their standard deviation, for weighted least squares.
    fn scaled(&self, weight: f64) -> PyFactor {
        PyFactor { factor: self.factor.scaled(weight) }
    }

    /// Least squares.
    ///
    /// Returns
    /// -------
    /// parameters : array, shape (k,)
    /// std : array, shape (k,)
    ///     Standard deviations, if the rows' errors are independent and alike.
    /// rmse : float
    ///     Root mean square of Φ·w − f.
    fn solve<'py>(&self, py: Python<'py>) -> PyResult<(Array<'py>, Array<'py>, f64)> {
        let solution = self.factor.solve().map_err(wrong)?;
        let std = self.factor.standard_deviations(solution.residual_std()).map_err(wrong)?;
        let (size, rmse) = (solution.parameters.len(), solution.rmse());
        Ok((array(py, solution.parameters, &[size])?, array(py, std, &[size])?, rmse))
    }

    /// Columns that depend on those before them.
    #[getter]
    fn undetermined_columns(&self) -> Vec<usize> {
        self.factor.undetermined_columns()
    }

    /// cond(Φ): its largest singular value over its smallest.
    #[getter]
    fn condition_number(&self) -> PyResult<f64> {
        self.factor.condition_number().map_err(wrong)
    }

    /// Singular values of Φ, largest first, shape (k,).
    #[getter]
    fn singular_values<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let values = self.factor.singular_values().map_err(wrong)?;
        let size = values.len();
        array(py, values, &[size])
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<PyFactor>().is_ok_and(|other| other.get().factor == self.factor)
    }

    fn __repr__(&self) -> String {
        format!("Factor({} parameters, {} rows)", self.factor.parameters(), self.factor.rows())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Pickled<'py, (usize, u64, Vec<f64>)>> {
        let factor = &slf.get().factor;
        let again = slf.get_type().getattr("_restored")?;
        Ok((again, (factor.columns(), factor.rows(), factor.triangle())))
    }

    #[staticmethod]
    fn _restored(columns: usize, rows: u64, triangle: Vec<f64>) -> PyResult<PyFactor> {
        Ok(PyFactor { factor: Factor::of_triangle(columns, rows, &triangle).map_err(wrong)? })
    }
}

/// No column beyond those of Φ.
fn check_columns(columns: &[usize], count: usize) -> PyResult<()> {
    match columns.iter().find(|column| **column >= count) {
        Some(column) => {
            Err(PyValueError::new_err(format!("there is no column {column}: Φ has {count}, counted from 0")))
        }
        None => Ok(()),
    }
}

fn wrong(error: RegressorError) -> PyErr {
    PyValueError::new_err(error.to_string())
}
