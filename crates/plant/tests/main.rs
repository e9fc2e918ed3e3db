//! The integration tests of this crate as one program, which is linked once. Each file is listed here.

mod effects;
mod models;
mod plant;
mod plants;
mod standing;
mod zero_moment_point;
