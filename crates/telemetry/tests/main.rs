//! The integration tests of this crate as one program, which is linked once. Each file is listed here.

mod blocks;
mod clocks;
mod cutoffs;
mod differentiation;
mod documented_maps;
mod findings;
mod log_maps;
mod mended_rows;
mod written_surveys;
mod wrong_input;
