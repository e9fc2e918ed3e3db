//! The integration tests of this crate as one program, which is linked once. Each file is listed here.

mod declarations;
mod formulas;
mod mechanisms;
mod sentences;
mod turning;
