#![doc = include_str!("../README.md")]

mod arrays;
mod content_hash;
mod csv;
mod error;
mod messages;
mod number;
mod open;
mod table;
mod text_stream;

pub use error::FormatError;
pub use open::{OpenOptions, looks_like, open};
pub use table::{Column, MISSING, Step, Table, is_missing};
