#![doc = include_str!("../README.md")]

mod selection;
pub mod trace;
