//! The integration tests of this crate as one program, which is linked once. Each file is listed here.

mod mujoco;
mod reading;
