#![doc = include_str!("../README.md")]

mod arrays;
mod content_hash;
mod csv;
mod decoded_once;
mod error;
mod guarded;
#[cfg(feature = "hdf5")]
mod hdf5;
#[cfg(feature = "lerobot")]
mod lerobot;
mod messages;
mod number;
mod open;
mod table;
mod text_stream;

pub use arrays::NumberArray;
pub use decoded_once::DecodedOnce;
pub use error::FormatError;
pub use guarded::is_guarded;
pub use open::{OpenOptions, looks_like, open};
pub use table::{Column, MISSING, Step, Table, is_missing};
