#![doc = include_str!("../README.md")]

mod arrays;
mod batch;
mod examples;
mod factor;
mod hold;
mod kernel;
mod robot;
mod session;
mod work;

use pyo3::prelude::*;

/// What the package `phiw` is written on; its names are those of `phiw`.
#[pymodule]
mod _phiw {
    #[pymodule_export]
    use crate::examples::example_urdfs;
    #[pymodule_export]
    use crate::factor::PyFactor;
    #[pymodule_export]
    use crate::robot::Robot;
    #[pymodule_export]
    use crate::session::{check, command, explain, identify, next_motion, predict, retarget, write_results};
    #[pymodule_export]
    use crate::work::{InputError, PhiwError};
}
