//! The integration tests of this crate as one program, which is linked once. Each file is listed here.

mod conformance;
mod dynamics;
mod models;
mod setup;
mod standing;
mod steps;
