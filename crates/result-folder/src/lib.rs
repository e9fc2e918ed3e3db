#![doc = include_str!("../README.md")]

mod error;
mod exchange;
mod file_system;
mod generation;
mod inputs;
mod lock;
mod streamed;

pub use error::ResultError;
pub use exchange::replace_folder;
pub use file_system::{Disk, FileSystem};
pub use generation::{remove_partial_files, replace_file, replace_files, replace_vouched};
pub use inputs::check_inputs;
pub use lock::Lock;
pub use streamed::StreamedFile;

/// A result file: its name in the folder, and its content.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ResultFile {
    /// Its name, without a folder.
    pub name: String,
    /// Its content.
    pub content: Vec<u8>,
}

impl ResultFile {
    /// A file of that name and content.
    pub fn new(name: impl Into<String>, content: impl Into<Vec<u8>>) -> Self {
        ResultFile { name: name.into(), content: content.into() }
    }
}
