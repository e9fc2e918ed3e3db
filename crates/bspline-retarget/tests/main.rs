//! The integration tests of this crate as one program, which is linked once. Each file is listed here.

mod artefacts;
mod bspline;
mod c3d;
mod joint_motion;
mod retarget;
