#![doc = include_str!("../README.md")]

pub mod json;
pub mod number;
pub mod page;
pub mod plot;
pub mod statistics;

pub use json::ReportJson;
pub use page::IdentificationPage;
