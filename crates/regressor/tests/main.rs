//! The integration tests of this crate as one program, which is linked once. Each file is listed here.

mod factor;
mod joint_torque;
mod least_squares;
