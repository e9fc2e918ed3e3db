#![doc = include_str!("../README.md")]

mod arrays;
mod batch;
mod factor;
mod hold;
mod robot;

use pyo3::prelude::*;

/// What the package `phiw` is written on; its names are those of `phiw`.
#[pymodule]
mod _phiw {
    #[pymodule_export]
    use crate::factor::PyFactor;
    #[pymodule_export]
    use crate::robot::Robot;
}
