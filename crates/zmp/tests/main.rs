//! The integration tests of this crate as one program, which is linked once. Each file is listed here.

mod balance;
mod robots;
mod rows;
mod support_polygon;
