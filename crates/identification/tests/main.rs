//! The integration tests of this crate as one program, which is linked once. Each file is listed here.

mod accumulation;
mod bandwidth;
mod conventions;
mod design;
mod fit;
mod held_out_change;
mod log_change;
mod logs_in_memory;
mod model_file;
mod reproduction;
mod synthetic;
mod told;
