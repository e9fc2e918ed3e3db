//! The integration tests of this crate as one program, which is linked once. Each file is listed here.

mod arm;
mod estimation;
mod growth;
mod parts;
mod run;
mod score_test;
mod selection;
mod simulated;
mod standing;
mod unknown_noise;
