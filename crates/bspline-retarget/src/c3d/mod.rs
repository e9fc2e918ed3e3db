//! C3D files of any make: Intel, DEC and SGI numbers, integers and reals.
//!
//! Layout after the C3D manual: a header of 512 bytes, a section of named parameters, then for each frame the
//! points (four numbers each) and the analog channels. A reader should trust none of the counts, of which a
//! file holds several; this one takes the first that the length of the file bears out.

mod error;
mod file;
mod header;
mod numbers;
mod parameters;
mod write;

pub use error::C3dError;
pub use file::{C3d, read_c3d, read_c3d_file};
pub use numbers::Processor;
pub use parameters::{Parameter, ParameterValue, Parameters};
pub use write::{C3dFormat, Storage, write_c3d};

/// The unit of everything in a C3D file \[bytes\].
const BLOCK: usize = 512;
