//! The integration tests of this crate as one program, which is linked once. Each file is listed here.

mod analytic_backend;
mod arbitrary;
mod closed_forms;
mod derivatives;
mod dynamics;
mod kinematics;
mod robots;
mod scalars;
mod urdf_diagnostics;
mod urdf_options;
mod urdf_writing;
